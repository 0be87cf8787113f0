// Shadows of lights that shine to all sides, beside rays (common/rays).
#include <random>

#include "common/rays/RayTree.h"
#include "tests/golden/Stage.h"
#include "tests/unit/draw/RendererStage.h"

namespace tessera {
namespace {

constexpr int kLampPx = 192;

/// Things and walls around a light, as a scene and as one mesh for rays.
struct Room {
    std::vector<float> positions;
    std::vector<std::uint32_t> indices;
    std::vector<std::pair<MeshData, Affine3d>> things;

    void add(const MeshData& mesh, const Affine3d& place) {
        const auto first = static_cast<std::uint32_t>(positions.size() / 3);
        for (std::size_t i = 0; i < mesh.positions.size(); i += 3) {
            const Vec3d at = place * Vec3d(mesh.positions[i], mesh.positions[i + 1], mesh.positions[i + 2]);
            for (const double x : {at.x(), at.y(), at.z()}) positions.push_back(static_cast<float>(x));
        }
        for (const std::uint32_t index : mesh.indices) indices.push_back(first + index);
        things.emplace_back(mesh, place);
    }
    [[nodiscard]] Vec3d normalOf(std::uint32_t face) const {
        std::array<Vec3d, 3> at;
        for (std::size_t i = 0; i < 3; ++i)
            for (int axis = 0; axis < 3; ++axis)
                at[i][axis] =
                    positions[3 * std::size_t{indices[3 * std::size_t{face} + i]} + static_cast<std::size_t>(axis)];
        return (at[1] - at[0]).cross(at[2] - at[0]);
    }
};

class PointShadow : public RendererTest {
protected:
    static constexpr double kHalf = 3;  ///< of the room's side

    static Room room(std::mt19937& random) {
        const auto between = [&](double low, double high) {
            return std::uniform_real_distribution<double>(low, high)(random);
        };
        Room made;
        for (int axis = 0; axis < 3; ++axis)
            for (const double sign : {-1.0, 1.0}) {
                Vec3d size = Vec3d::Constant(2 * kHalf + 0.4);
                size[axis] = 0.2;
                made.add(makeBox(size), Affine3d(Eigen::Translation3d((kHalf + 0.1) * sign * Vec3d::Unit(axis))));
            }
        for (int i = 0; i < 10; ++i) {
            const Vec3d at(between(-2.3, 2.3), between(-2.3, 2.3), between(-2.3, 2.3));
            const Quatd turn(Eigen::AngleAxisd(between(0, 6), Vec3d(between(-1, 1), 1, 0.3).normalized()));
            const Affine3d place = Eigen::Translation3d(at) * turn;
            made.add(i % 3 == 0   ? makeSphere(between(0.2, 0.5), 48)
                     : i % 3 == 1 ? makeTorus(between(0.3, 0.6), 0.12, 40, 20)
                                  : makeBox(Vec3d(between(0.2, 0.9), between(0.2, 0.9), 0.3)),
                     place);
        }
        return made;
    }
};

TEST_F(PointShadow, IsWhereARayToTheLightMeetsSomething) {
    std::mt19937 random(11);
    const auto between = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    // All over a ball, its middle first; on its rim most.
    std::vector<Vec3d> around{Vec3d::Zero()};
    while (around.size() < 200) {
        const Vec3d side(between(-1, 1), between(-1, 1), between(-1, 1));
        if (const double far = side.norm(); far < 1 && far > 0) around.push_back(side / (around.size() % 4 ? far : 1));
    }
    int lit = 0, dark = 0, wrong = 0;
    std::array<int, 6> sides{};
    for (int round = 0; round < 8; ++round) {
        const Room made = room(random);
        const RayTree tree = RayTree::build(made.positions, made.indices).value();
        Vec3d light;
        do light = {between(-2, 2), between(-2, 2), between(-2, 2)};
        while (tree.nearest({.origin = light, .direction = Vec3d::UnitX()})->t < 0.1);
        const auto shown = [&](bool shadows, const ScreenCamera& camera) {
            TestScene scene;
            scene.setEnvironment(Vec3f::Zero(), Vec3f::Zero(), Vec3f::Zero());
            Material matt;
            matt.baseColor = Vec4f(0.7f, 0.7f, 0.7f, 1);
            matt.roughness = 1;
            const ObjectId material = scene.add(matt);
            for (const auto& [mesh, place] : made.things)
                scene.place(scene.add(mesh, material), place.translation(), Quatd(place.linear()));
            scene.addPointLight(light, Vec3f::Ones(), 12, round % 2 ? 0.0f : 12.0f, Vec3f(0, 0, 1), shadows);
            return draw(scene.take(), camera);
        };
        for (int look = 0; look < 3; ++look) {
            View view;
            view.orientation =
                Quatd(Eigen::AngleAxisd(between(0, 6), Vec3d(between(-1, 1), 1, between(-1, 1)).normalized()));
            const Vec3d eye(between(-1, 1), between(-1, 1), between(-1, 1));
            view.position = eye - view.orientation * Vec3d(0, 0, 1.2);
            const ScreenCamera camera = cameraOf(kLampPx, kLampPx, {0, 0, 1.2}, 3.2, view);
            const Picture with = shown(true, camera), without = shown(false, camera);
            const Affine3d world_T_eye = camera.eye_T_world.inverse();
            for (int i = 0; i < 1500; ++i) {
                const int x = static_cast<int>(random() % kLampPx), y = static_cast<int>(random() % kLampPx);
                const Vec3d towards((2 * (x + 0.5) / kLampPx - 1) / camera.clip_T_eye(0, 0),
                                    (1 - 2 * (y + 0.5) / kLampPx) / camera.clip_T_eye(1, 1), -1);
                const Ray sight{.origin = world_T_eye.translation(), .direction = world_T_eye.linear() * towards};
                const auto hit = tree.nearest(sight);
                ASSERT_TRUE(hit);
                // An eye inside of a thing does not see it.
                if (made.normalOf(hit->face).dot(sight.direction) > 0) continue;
                const Vec3d point = sight.origin + hit->t * sight.direction;
                // What the unshaded light barely reaches tells nothing.
                if (pixel(without, x, y).g < 12) continue;
                // A map's pixel there, and as far as a surface looks around in the map: before it, and in its plane.
                // Where rays to all of that agree there is no doubt.
                const Vec3d away = point - light, normal = made.normalOf(hit->face).normalized();
                const double margin = 6 * 2 / 1024.0 * 1.04 * away.norm();
                std::size_t met = 0, rays = 0;
                for (std::size_t k = 0; k < around.size() && (met == 0 || met == rays); ++k, ++rays) {
                    const Vec3d flat = around[k] - normal.dot(around[k]) * normal;
                    const Vec3d beside = k % 2 ? Vec3d(flat + 0.05 * normal) : around[k] - 1.5 * away.normalized();
                    met += tree.any({.origin = light, .direction = away + margin * beside}, 1);
                }
                if (met != 0 && met != rays) continue;
                int axis = 0;
                away.cwiseAbs().maxCoeff(&axis);
                ++sides[static_cast<std::size_t>(2 * axis + (away[axis] < 0))];
                met == 0 ? ++lit : ++dark;
                const bool right = met == 0 ? pixel(with, x, y).g == pixel(without, x, y).g : pixel(with, x, y).g == 0;
                wrong += !right;
                if (!right && wrong < 10)
                    ADD_FAILURE() << "round " << round << ", look " << look << ", pixel " << x << ' ' << y << ": "
                                  << pixel(with, x, y) << " for " << (met == 0 ? pixel(without, x, y) : Rgb{});
            }
        }
    }
    EXPECT_EQ(wrong, 0);
    EXPECT_GT(lit, 5000);
    EXPECT_GT(dark, 1000);
    for (const int count : sides) EXPECT_GT(count, 100);
}

/// In an empty room nothing stands in the light's way: away from its edges it looks as without shadows, to the byte.
TEST_F(PointShadow, OfNothingIsNone) {
    std::mt19937 random(12);
    const auto between = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    int seen = 0, darker = 0;
    for (int round = 0; round < 6; ++round) {
        const Vec3d half(between(1, 6), between(1, 3), between(1, 6));
        const Vec3d light = Vec3d(between(-0.95, 0.95), between(-0.95, 0.95), between(-0.95, 0.95)).cwiseProduct(half);
        const auto shown = [&](bool shadows, const ScreenCamera& camera) {
            TestScene scene;
            scene.setEnvironment(Vec3f::Zero(), Vec3f::Zero(), Vec3f::Zero());
            Material matt;
            matt.roughness = 1;
            const ObjectId material = scene.add(matt);
            for (int axis = 0; axis < 3; ++axis)
                for (const double sign : {-1.0, 1.0}) {
                    Vec3d size = 2 * half + Vec3d::Constant(0.4);
                    size[axis] = 0.2;
                    scene.place(scene.add(makeBox(size), material), (half[axis] + 0.1) * sign * Vec3d::Unit(axis));
                }
            scene.addPointLight(light, Vec3f::Ones(), 12, 0, Vec3f(0, 0, 1), shadows);
            return draw(scene.take(), camera);
        };
        for (int look = 0; look < 3; ++look) {
            View view;
            view.orientation =
                Quatd(Eigen::AngleAxisd(between(0, 6), Vec3d(between(-1, 1), 1, between(-1, 1)).normalized()));
            view.position = -(view.orientation * Vec3d(0, 0, 1.2));
            const ScreenCamera camera = cameraOf(kLampPx, kLampPx, {0, 0, 1.2}, 3.2, view);
            const Picture with = shown(true, camera), without = shown(false, camera);
            const Affine3d world_T_eye = camera.eye_T_world.inverse();
            for (int y = 0; y < kLampPx; ++y)
                for (int x = 0; x < kLampPx; ++x) {
                    const Vec3d eye = world_T_eye.translation();
                    const Vec3d towards =
                        world_T_eye.linear() * Vec3d((2 * (x + 0.5) / kLampPx - 1) / camera.clip_T_eye(0, 0),
                                                     (1 - 2 * (y + 0.5) / kLampPx) / camera.clip_T_eye(1, 1), -1);
                    double t = HUGE_VAL;
                    for (int axis = 0; axis < 3; ++axis)
                        t = std::min(t, (std::copysign(half[axis], towards[axis]) - eye[axis]) / towards[axis]);
                    const Vec3d point = eye + t * towards;
                    // As far as a surface looks around in a map: 6 pixels.
                    const double margin = 6 * 2 / 1024.0 * 1.04 * (point - light).norm();
                    if (((half - point.cwiseAbs()).array() < margin).count() > 1) continue;
                    ++seen;
                    darker += pixel(with, x, y).g != pixel(without, x, y).g;
                }
        }
    }
    EXPECT_GT(seen, 300000);
    EXPECT_EQ(darker, 0);
}

TEST_F(PointShadow, OfTheFirstFourThatAskTheOthersAreCounted) {
    TestScene scene;
    scene.place(scene.add(makeSheet(8, 8)), {0, 0, -4});
    for (int i = 0; i < 7; ++i) scene.addPointLight({0.1 * i, 1, -2}, Vec3f::Ones(), 1, 0, Vec3f(0, 0, 1), true);
    (void)draw(scene.take(), cameraOf(kLampPx, kLampPx));
    EXPECT_EQ(renderer_->lastCounts().shadowsLeftOut, 3u);
}

}  // namespace
}  // namespace tessera
