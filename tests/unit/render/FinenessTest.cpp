/// How fine surfaces of control points are drawn, by screen: never off by more pixels than they ask for, the same
/// whoever looked where before.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <random>

#include "client/render/scene/SceneItems.h"
#include "client/render/scene/ScreenFineness.h"
#include "common/drawable/NurbsArrays.h"
#include "common/freeform/nurbs/NurbsShapes.h"
#include "tests/unit/drawable/ControlCube.h"
#include "tests/unit/render/TestScene.h"

namespace tessera {
namespace {

class FinenessScene : public TestScene {
public:
    template <typename Core>
    ObjectId core(const Core& value) {
        const ObjectId id{nextId++};
        edit.create(id, typeOf<Core>());
        for (const FieldEntry& field : findType(typeOf<Core>())->fields)
            edit.set(id, typeOf<Core>(), field.id, field.read(&value));
        return id;
    }
};

SubdivisionSurface cube(std::uint32_t n, std::int64_t level, double screenError = 0.5) {
    SubdivisionSurface surface = test::controlGrid(n);
    surface.level = level;
    surface.screenError = screenError;
    return surface;
}
NurbsSurfaceCore ball(double tolerance, double screenError = 0.5) {
    NurbsSurfaceCore core = coreOfSurface(*sphereSurface(1, {}));
    core.tolerance = tolerance;
    core.screenError = screenError;
    return core;
}

/// Of the finest part.
unsigned mostSteps(const Fineness& fineness) {
    const auto levels = fineness.levels.as<std::uint8_t>();
    return levels.empty() ? fineness.steps : unsigned{*std::max_element(levels.begin(), levels.end())};
}

struct ChosenMesh {
    Fineness fineness;
    BlobId positions;
    std::uint64_t triangles = 0;
    bool operator==(const ChosenMesh&) const = default;
};
std::map<ObjectId, ChosenMesh> chosenBy(const RenderScene& scene, const ScreenCamera& camera) {
    std::map<ObjectId, ChosenMesh> chosen;
    const RenderScene::Impl& all = scene.seenFrom(camera);
    for (const SceneItem& item : all.items)
        if (item.node) chosen[item.node] = {item.fineness, item.mesh->arrays().positions.id(), item.mesh->triangles};
    return chosen;
}

/// With an eye anywhere, that looks anywhere.
TestCamera cameraAt(const Vec3d& place, const Quatd& turn, int widthPx = 320) {
    TestCamera camera(widthPx, widthPx * 5 / 8, 2, 2);
    camera.view.orientation = turn;
    camera.view.position = place - turn * Vec3d(0, 0, 2);
    return camera;
}

Vec3d nearestOn(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    const auto onEdge = [&p](const Vec3d& from, const Vec3d& to) {
        const Vec3d along = to - from;
        const double length2 = along.squaredNorm();
        return Vec3d(from + (length2 > 0 ? std::clamp((p - from).dot(along) / length2, 0.0, 1.0) : 0.0) * along);
    };
    const Vec3d normal = (b - a).cross(c - a);
    const bool inside = normal.norm() > 0 && (b - a).cross(p - a).dot(normal) >= 0 &&
                        (c - b).cross(p - b).dot(normal) >= 0 && (a - c).cross(p - c).dot(normal) >= 0;
    if (inside) return p - (p - a).dot(normal) / normal.squaredNorm() * normal;
    Vec3d best = onEdge(a, b);
    for (const Vec3d& q : {onEdge(b, c), onEdge(c, a)})
        if ((q - p).norm() < (best - p).norm()) best = q;
    return best;
}

/// In pixels of the screen; nothing where it is not seen.
std::optional<Eigen::Vector2d> pixelOf(const ScreenCamera& camera, const Vec3d& world, bool seenAlone) {
    const Vec3d eye = camera.eye_T_world * world;
    const Vec4d clip = camera.clip_T_eye * Vec4d(eye.x(), eye.y(), eye.z(), 1);
    if (clip.w() < 0.05) return std::nullopt;
    const Eigen::Vector2d ndc(clip.x() / clip.w(), clip.y() / clip.w());
    if (seenAlone && ndc.cwiseAbs().maxCoeff() > 1) return std::nullopt;
    return Eigen::Vector2d(0.5 * ndc.x() * camera.pixels.width, 0.5 * ndc.y() * camera.pixels.height);
}

TEST(ScreenFineness, NothingIsFartherOffItsSurfaceThanThePixelsItAsksFor) {
    const char* one = std::getenv("TESSERA_SEED");
    const std::uint64_t first = one ? std::strtoull(one, nullptr, 10) : 1, last = one ? first : 6;
    std::size_t finer = 0, wouldBeOff = 0, judged = 0;
    for (std::uint64_t seed = first; seed <= last; ++seed) {
        SCOPED_TRACE(::testing::Message()
                     << "TESSERA_SEED=" << seed << " build/bin/unit_render --gtest_filter=ScreenFineness.*");
        std::mt19937_64 random(seed);
        const auto uniform = [&random](double from, double to) {
            return std::uniform_real_distribution<double>(from, to)(random);
        };
        const auto anyTurn = [&] {
            return Quatd(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(0.1, 1)).normalized();
        };
        FinenessScene scene;
        std::map<ObjectId, ObjectId> cores;
        for (int i = 0; i < 5; ++i) {
            const double wanted = std::exp2(uniform(-2, 2));
            SubdivisionSurface skin =
                cube(1 + static_cast<std::uint32_t>(random() % 2), static_cast<std::int64_t>(random() % 3), wanted);
            std::vector<float> points(skin.points.as<float>().begin(), skin.points.as<float>().end());
            for (float& x : points) x += static_cast<float>(uniform(-0.5, 0.5));
            skin.points = Blob::of(std::span<const float>(points));
            const ObjectId core =
                random() % 3 == 0 ? scene.core(ball(std::exp2(uniform(-6, -3)), wanted)) : scene.core(skin);
            const Vec3d scale = Vec3d(uniform(0.3, 1), uniform(-1, 1), uniform(0.3, 1) * (random() % 3 == 0 ? 20 : 1));
            cores[scene.put(core, 3 * Vec3d(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)), anyTurn(), scale)] = core;
        }
        scene.apply();
        RenderScene render;
        render.update(scene.aspect, nullptr);
        const Vec3d from = anyTurn() * Vec3d(0, 0, std::exp2(uniform(0.5, 5)));
        const ScreenCamera camera =
            cameraAt(from, Quatd::FromTwoVectors(Vec3d::UnitZ(), from), 160 << random() % 4).camera();
        const RenderScene::Impl& all = render.seenFrom(camera);
        std::uint64_t triangles = 0;
        for (const SceneItem& item : all.items) triangles += item.node ? item.mesh->triangles : 0;
        for (const SceneItem& item : all.items) {
            if (!item.node) continue;
            const Drawable drawable = drawableOf(scene.aspect, cores.at(item.node));
            finer += mostSteps(item.fineness) > 0;
            // What is as fine as may be is off by what it is off; what has many triangles takes long to look through.
            if (item.mesh->triangles > 15'000) continue;
            if (mostSteps(item.fineness) == drawable.finest() || 4 * item.mesh->triangles > kMostTrianglesByScreen ||
                triangles + 3 * item.mesh->triangles > kMostTrianglesOfScreen)
                continue;
            const MeshArrays drawn = drawable.at(item.fineness).arrays(), base = drawable.arrays(),
                             truth = drawable.at(std::min(mostSteps(item.fineness) + 2, drawable.finest())).arrays();
            EXPECT_EQ(drawn.positions.id(), item.mesh->arrays().positions.id());
            const Affine3d world_T_item = item.world_T_item;
            const auto points = truth.positions.as<float>();
            if (points.empty()) continue;  // more triangles than may be
            const auto offOf = [&](const MeshArrays& mesh, const Vec3d& p) {
                const auto corners = mesh.positions.as<float>();
                const auto at = [&](std::uint32_t v) {
                    return Vec3d(corners[3 * v], corners[3 * v + 1], corners[3 * v + 2]);
                };
                Vec3d best = Vec3d::Constant(1e9);
                const auto indices = mesh.indices.as<std::uint32_t>();
                for (std::size_t t = 0; t < indices.size(); t += 3) {
                    const Vec3d q = nearestOn(p, at(indices[t]), at(indices[t + 1]), at(indices[t + 2]));
                    if ((q - p).norm() < (best - p).norm()) best = q;
                }
                const auto truthPx = pixelOf(camera, world_T_item * p, true),
                           drawnPx = pixelOf(camera, world_T_item * best, false);
                return truthPx && drawnPx ? (*truthPx - *drawnPx).norm() : 0.0;
            };
            bool off = false;
            for (int i = 0; i < 40; ++i) {
                const std::size_t v = 3 * (random() % (points.size() / 3));
                const Vec3d p(points[v], points[v + 1], points[v + 2]);
                EXPECT_LE(offOf(drawn, p), drawable.screenError() + 0.01) << "fineness " << mostSteps(item.fineness);
                off = off || offOf(base, p) > drawable.screenError();
                ++judged;
            }
            wouldBeOff += off;
        }
    }
    if (!one) {
        EXPECT_GT(judged, 200u);
        EXPECT_GT(finer, 5u);
        EXPECT_GT(wouldBeOff, 1u) << "steps that nobody needed prove nothing";
    }
}

TEST(ScreenFineness, IsTheSameWhateverWasSeenAndDoneBefore) {
    const char* one = std::getenv("TESSERA_SEED");
    const std::uint64_t first = one ? std::strtoull(one, nullptr, 10) : 1, last = one ? first : 4;
    std::size_t finer = 0;
    for (std::uint64_t seed = first; seed <= last; ++seed) {
        SCOPED_TRACE(::testing::Message()
                     << "TESSERA_SEED=" << seed << " build/bin/unit_render --gtest_filter=ScreenFineness.*");
        std::mt19937_64 random(seed);
        const auto uniform = [&random](double from, double to) {
            return std::uniform_real_distribution<double>(from, to)(random);
        };
        FinenessScene scene;
        const ObjectId soft = scene.core(cube(2, 1)), round = scene.core(ball(0.1)), glass = scene.core([&] {
            SubdivisionSurface surface = cube(1, 2);
            surface.material = scene.material(0.4F);
            return surface;
        }());
        std::vector<ObjectId> transforms;
        const auto put = [&](ObjectId core) {
            transforms.push_back(scene.transform({uniform(-6, 6), uniform(-3, 3), uniform(-9, 0)}));
            scene.node(core, scene.node(transforms.back()));
        };
        for (const ObjectId core : {soft, soft, round, glass, soft, round}) put(core);
        scene.apply();
        RenderScene followed;
        followed.update(scene.aspect, nullptr);
        for (int step = 0; step < 12; ++step) {
            switch (random() % 6) {
                case 0:
                    scene.place(transforms[random() % transforms.size()],
                                {uniform(-6, 6), uniform(-3, 3), uniform(-9, 0)}, Quatd::Identity(),
                                Vec3d::Constant(uniform(0.2, 2)));
                    break;
                case 1:
                    put(random() % 2 ? soft : glass);
                    break;
                case 2:
                    scene.edit.set(soft, typeOf<SubdivisionSurface>(), fieldId<&SubdivisionSurface::level>,
                                   toValue(static_cast<std::int64_t>(random() % 4)));
                    break;
                case 3:
                    scene.edit.set(glass, typeOf<SubdivisionSurface>(), fieldId<&SubdivisionSurface::screenError>,
                                   toValue(random() % 3 == 0 ? 0.0 : uniform(0.1, 2)));
                    break;
                case 4:
                    scene.edit.set(round, typeOf<NurbsSurfaceCore>(), fieldId<&NurbsSurfaceCore::tolerance>,
                                   toValue(uniform(0.05, 0.3)));
                    break;
                default: {
                    const std::array<float, 3> moved{static_cast<float>(uniform(-2, 2)), 0, 1};
                    scene.edit.setRange(soft, typeOf<SubdivisionSurface>(), fieldId<&SubdivisionSurface::points>,
                                        12 * (random() % 26), Blob::of(std::span<const float>(moved)));
                }
            }
            const ChangeList list = scene.apply();
            followed.update(scene.aspect, &list);
            const ScreenCamera camera =
                cameraAt({uniform(-2, 2), uniform(-1, 1), uniform(-3, 4)}, Quatd::Identity(), 160 << random() % 4)
                    .camera();
            const auto now = chosenBy(followed, camera);
            RenderScene fresh;
            fresh.update(scene.aspect, nullptr);
            ASSERT_EQ(now, chosenBy(fresh, camera)) << "step " << step;
            for (const auto& [node, chosen] : now) {
                const Drawable drawable = drawableOf(scene.aspect, *scene.aspect.get<Node>(node));
                ASSERT_EQ(chosen.positions, drawable.at(chosen.fineness).arrays().positions.id());
                finer += mostSteps(chosen.fineness) > 0;
            }
            EXPECT_EQ(followed.impl().transparentTriangles + followed.impl().finerTransparentTriangles,
                      fresh.impl().transparentTriangles + fresh.impl().finerTransparentTriangles);
        }
    }
    if (!one) {
        EXPECT_GT(finer, 40u);
    }
}

TEST(ScreenFineness, ThereIsAnEndToTriangles) {
    FinenessScene scene;
    const ObjectId skin = scene.core(cube(2, 0, 1e-5)), coarse = scene.core(cube(2, 0, 0));
    for (int i = 0; i < 30; ++i) scene.put(skin, {0.4 * (i % 6) - 1, 0.4 * static_cast<double>(i / 6) - 1, -4});
    const ObjectId around = scene.put(skin, Vec3d::Zero(), Quatd::Identity(), Vec3d::Constant(3)),
                   still = scene.put(coarse, {0, 0, -3}), behind = scene.put(skin, {0, 0, 9});
    scene.apply();
    RenderScene render;
    render.update(scene.aspect, nullptr);
    const auto chosen = chosenBy(render, TestCamera(1920, 1200).camera());
    std::uint64_t sum = 0;
    for (const auto& [node, of] : chosen) {
        EXPECT_LE(of.triangles, kMostTrianglesByScreen);
        if (node != behind && node != still) sum += of.triangles;
    }
    EXPECT_LE(sum, kMostTrianglesOfScreen);
    EXPECT_GT(sum, kMostTrianglesOfScreen / 4) << "it is used";
    EXPECT_EQ(chosen.at(still).fineness, Fineness()) << "its author wants no other";
    EXPECT_EQ(chosen.at(behind).fineness, Fineness()) << "this screen does not show it";
    EXPECT_GT(mostSteps(chosen.at(around).fineness), 3u) << "the eye is within it";
}

/// Control faces in a row away from the eye, bent as much everywhere.
SubdivisionSurface longSheet(std::uint32_t length, double screenError) {
    SubdivisionSurface surface;
    std::vector<float> points;
    std::vector<std::uint32_t> sizes(4 * length, 4), vertices;
    for (std::uint32_t j = 0; j <= length; ++j)
        for (std::uint32_t i = 0; i < 5; ++i)
            points.insert(points.end(),
                          {static_cast<float>(i) - 2, (i + j) % 2 ? 0.2F : -0.2F, -static_cast<float>(j)});
    for (std::uint32_t j = 0; j < length; ++j)
        for (std::uint32_t i = 0; i < 4; ++i)
            vertices.insert(vertices.end(), {5 * j + i, 5 * j + i + 1, 5 * j + i + 6, 5 * j + i + 5});
    surface.points = Blob::of(std::span<const float>(points));
    surface.faceSizes = Blob::of(std::span<const std::uint32_t>(sizes));
    surface.faceVertices = Blob::of(std::span<const std::uint32_t>(vertices));
    surface.level = 0;
    surface.screenError = screenError;
    return surface;
}

TEST(ScreenFineness, ASurfaceIsFineWhereItIsNearAlone) {
    FinenessScene scene;
    const ObjectId sheet = scene.put(scene.core(longSheet(100, 0.5)), {0, -1.2, 0});
    scene.apply();
    RenderScene render;
    render.update(scene.aspect, nullptr);
    const auto chosen = chosenBy(render, TestCamera(960, 600).camera()).at(sheet);
    const auto levels = chosen.fineness.levels.as<std::uint8_t>();
    ASSERT_EQ(levels.size(), 400u);
    const auto mostIn = [&](std::size_t first, std::size_t count) {
        return *std::max_element(levels.begin() + static_cast<std::ptrdiff_t>(first),
                                 levels.begin() + static_cast<std::ptrdiff_t>(first + count));
    };
    EXPECT_GE(mostIn(0, 40), mostIn(340, 60) + 2);
    // As often as the distance doubles a level every second time, at least.
    for (std::size_t row = 10; row < 80; row += 10) EXPECT_GE(mostIn(4 * row, 40), mostIn(4 * row + 40, 40)) << row;
    EXPECT_LT(chosen.triangles, (800ull << (2 * mostIn(0, 400))) / 4);
}

TEST(ScreenFineness, AnEyeThatMovesALittleMostlySeesTheSame) {
    FinenessScene scene;
    const ObjectId sheet = scene.put(scene.core(longSheet(250, 0.5)), {0, -1.2, 0});
    scene.apply();
    RenderScene render;
    render.update(scene.aspect, nullptr);
    constexpr int kFrames = 200;
    int changes = 0;
    Fineness before;
    for (int frame = 0; frame < kFrames; ++frame) {
        // Somebody who leans forward, by two millimetres from one frame to the next.
        const auto chosen =
            chosenBy(render,
                     cameraAt({0.1 * std::sin(0.02 * frame), 0.1, 1 - 0.002 * frame}, Quatd::Identity(), 960).camera())
                .at(sheet);
        changes += chosen.fineness != before;
        before = chosen.fineness;
    }
    RecordProperty("changes", changes);
    EXPECT_GT(changes, 1) << "it does look";
    EXPECT_LT(changes, kFrames / 4);
}

TEST(ScreenFineness, SurfacesThatShareEdgesStepTogether) {
    FinenessScene scene;
    const ObjectId near = scene.core(ball(0.05)), far = scene.core([] {
        NurbsSurfaceCore core = coreOfSurface(*sphereSurface(1, {}));
        std::vector<double> points(core.points.as<double>().begin(), core.points.as<double>().end());
        for (std::size_t i = 2; i < points.size(); i += 3) points[i] -= 600;
        core.points = Blob::of(std::span<const double>(points));
        core.tolerance = 0.05;
        return core;
    }());
    const ObjectId frame = scene.node(scene.transform({0, 0, -3}));
    const ObjectId a = scene.node(near, frame), b = scene.node(far, frame);
    const ObjectId alone = scene.put(far, {1, 0, -3});
    scene.apply();
    RenderScene render;
    render.update(scene.aspect, nullptr);
    const auto chosen = chosenBy(render, TestCamera(1600, 1000).camera());
    EXPECT_GT(chosen.at(a).fineness, Fineness());
    EXPECT_EQ(chosen.at(b).fineness, chosen.at(a).fineness)
        << "one frame and one tolerance: a crack between them would show";
    EXPECT_EQ(chosen.at(alone).fineness, Fineness());
}

TEST(ScreenFineness, IsOfTheScreenAndNotOfTheTile) {
    FinenessScene scene;
    for (int i = 0; i < 6; ++i) scene.put(scene.core(cube(1, 1)), {0.7 * i - 2, 0.3 * i - 1, -2.5 - i});
    scene.apply();
    TestCamera camera(640, 400, 2, 2);
    std::map<ObjectId, Fineness> known;
    const auto finenessOf = [](const RenderScene& of, ObjectId node) {
        const auto& items = of.impl().items;
        return std::ranges::find(items, node, &SceneItem::node)->fineness;
    };
    for (const CullerKind kind : {CullerKind::kNone, CullerKind::kFrustum, CullerKind::kMasked})
        for (const auto& [column, row] : {std::pair{1, 1}, {0, 1}, {1, 0}, {0, 0}}) {
            RenderScene own;
            own.update(scene.aspect, nullptr);
            for (const DrawItem& item :
                 RenderAction(kind).run(own, camera.camera(), camera.tile(column, row), nullptr).opaque) {
                const Fineness fineness = finenessOf(own, item.node);
                EXPECT_EQ(known.try_emplace(item.node, fineness).first->second, fineness);
            }
        }
    EXPECT_EQ(known.size(), 6u);
    EXPECT_TRUE(std::any_of(known.begin(), known.end(), [](const auto& of) { return mostSteps(of.second) > 0; }));
}

TEST(ScreenFineness, LengthsAreStretchedByNoMoreThanIsSaid) {
    std::mt19937_64 random(7);
    for (int i = 0; i < 500; ++i) {
        const Mat3d m = Mat3d::NullaryExpr([&] { return std::uniform_real_distribution<double>(-2, 2)(random); });
        const Vec3d v =
            Vec3d::NullaryExpr([&] { return std::uniform_real_distribution<double>(-1, 1)(random); }).normalized();
        EXPECT_LE((m * v).norm(), rowStretchOf(m) * (1 + 1e-12));
    }
    EXPECT_NEAR(rowStretchOf(3 * Quatd(1, 2, 3, 4).normalized().toRotationMatrix()), 3, 1e-12);
}

}  // namespace
}  // namespace tessera
