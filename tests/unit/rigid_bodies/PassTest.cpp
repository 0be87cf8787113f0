/// Nothing passes a thin plate: any shape, any speed, whoever stands, moves or is free.
///
/// Judged by the committed poses and the way between them alone. In the plate's own frame the corners and the middles
/// of the faces of what was shot are followed from pose to pose, in pieces so short that arcs are straight; each time
/// one changes its side of the plate's middle, it has done so beside the plate, or has got through.
///
/// TESSERA_HUNT=10000: so many shots of each kind. TESSERA_SEED=n: that one alone.
#include <cstdlib>
#include <string>

#include "common/math/Compose.h"
#include "tests/unit/rigid_bodies/World.h"

namespace tessera::rigidbodytest {
namespace {

constexpr double kThick = 0.02;
/// What is on the rim may slide around it, as deep in it as contact allows (1 % of 0.65).
constexpr double kRim = 0.4 * kThick;

int hunt(int otherwise) {
    const char* text = std::getenv("TESSERA_HUNT");
    return text == nullptr ? otherwise : std::atoi(text);
}

template <typename Shot>
void shots(int count, const Shot& shot) {
    const char* only = std::getenv("TESSERA_SEED");
    int passed = 0;
    std::string seeds;
    const int first = only != nullptr ? std::atoi(only) : 1, last = only != nullptr ? first : hunt(count);
    for (int seed = first; seed <= last; ++seed) {
        std::mt19937_64 random(static_cast<std::uint64_t>(seed));
        if (!shot(random)) continue;
        ++passed;
        if (passed <= 20) seeds += " " + std::to_string(seed);
    }
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    EXPECT_EQ(passed, 0) << "of " << last - first + 1 << "; seeds" << seeds
                         << "; again: TESSERA_SEED=n unit_rigid_bodies --gtest_filter=" << test->test_suite_name()
                         << "." << test->name();
}

double uniform(std::mt19937_64& random, double low, double high) {
    return low + (high - low) * (static_cast<double>(random() >> 11) * 0x1p-53);
}
Vec3d inCube(std::mt19937_64& random) {
    const double x = uniform(random, -1, 1), y = uniform(random, -1, 1);
    return {x, y, uniform(random, -1, 1)};
}
Quatd anyTurn(std::mt19937_64& random) {
    Vec3d a = inCube(random);
    return Quatd(uniform(random, -1, 1), a.x(), a.y(), a.z()).normalized();
}

/// Corners and middles of faces.
std::vector<Vec3d> marksOf(const Shape& shape) {
    const TriangleMesh& mesh = shape.tree->mesh();
    std::vector<Vec3d> out;
    for (std::uint32_t f = 0; f < mesh.faceCount(); ++f) {
        const Triangle t = mesh.triangle(f);
        out.insert(out.end(), {t[0], t[1], t[2], (t[0] + t[1] + t[2]) / 3});
    }
    return out;
}

/// A pose between two: the body's middle goes straight, and it turns about one axis.
Affine3d between(const Affine3d& from, const Affine3d& to, const Vec3d& middle, double t) {
    const Quatd a(Mat3d(from.rotation())), b(Mat3d(to.rotation()));
    const Vec3d at = (1 - t) * (from * middle) + t * (to * middle);
    const Mat3d turned = a.slerp(t, b).toRotationMatrix();
    Affine3d out = Affine3d::Identity();
    out.linear() = turned;
    out.translation() = at - turned * middle;
    return out;
}

/// Does a mark get from one side of the plate to the other through it? The plate's middle is y = 0 of its frame.
bool through(const std::vector<Vec3d>& marks, const Affine3d& from, const Affine3d& to, const Affine3d& plateFrom,
             const Affine3d& plateTo, const Vec3d& half) {
    constexpr int kPieces = 32;
    std::vector<Vec3d> before;
    for (int piece = 0; piece <= kPieces; ++piece) {
        const double t = piece / double{kPieces};
        const Affine3d plate_T_body =
            between(plateFrom, plateTo, Vec3d::Zero(), t).inverse() * between(from, to, Vec3d::Zero(), t);
        for (std::size_t i = 0; i < marks.size(); ++i) {
            const Vec3d now = plate_T_body * marks[i];
            if (piece == 0) {
                before.push_back(now);
                continue;
            }
            const Vec3d was = std::exchange(before[i], now);
            if ((was.y() > 0) == (now.y() > 0)) continue;
            const Vec3d at = was + (now - was) * (was.y() / (was.y() - now.y()));
            if (std::abs(at.x()) < half.x() - kRim && std::abs(at.z()) < half.z() - kRim) return true;
        }
    }
    return false;
}

std::vector<Shape> bullets() {
    std::vector<Shape> out;
    out.push_back(hullShape(boxPoints({0.2, 0.12, 0.16})));
    out.push_back(hullShape(spherePoints(0.1, 24)));
    out.push_back(hullShape({{0, 0.15, 0}, {0.1, -0.05, 0.06}, {-0.1, -0.05, 0.06}, {0, -0.05, -0.12}}));
    out.push_back(hullShape(boxPoints({0.5, 0.02, 0.4})));
    out.push_back(hullShape(boxPoints({0.6, 0.05, 0.05})));
    return out;
}

std::vector<Shape> meshBullets() {
    std::vector<Shape> out;
    for (const Vec3d& size : {Vec3d(0.2, 0.12, 0.16), Vec3d(0.5, 0.02, 0.4), Vec3d(0.6, 0.05, 0.05)})
        out.push_back(boxMesh(size));
    return out;
}

struct Plate {
    bool mesh = false;
    bool anyVolume = false;  ///< its tree's are of another kind
    double mass = 0;
    bool moves = false;
};

/// One body, shot from outside at a place within the plate.
bool passes(std::mt19937_64& random, const std::vector<Shape>& shapes, const Plate& kind) {
    const Vec3d size(2, kThick, 2);
    static const Shape hullPlate = hullShape(boxPoints(size)), meshPlate = boxMesh(size);
    static const std::array others{boxMesh(size, VolumeKind::kSphere), boxMesh(size, VolumeKind::kAabb),
                                   boxMesh(size, VolumeKind::kDop14), boxMesh(size, VolumeKind::kDop26)};
    World w;
    w.gravity.setZero();
    const Quatd tilt = anyTurn(random);
    const Vec3d place = inCube(random);
    const Shape& of = kind.anyVolume ? others[random() % others.size()] : kind.mesh ? meshPlate : hullPlate;
    const std::uint32_t plate = w.add(of, place, kind.mass, tilt);
    const Shape& shape = shapes[random() % shapes.size()];
    const Vec3d aim(uniform(random, -0.8, 0.8), 0, uniform(random, -0.8, 0.8));
    const double side = random() % 2 == 0 ? 1 : -1;
    const Vec3d from = aim + Vec3d(uniform(random, -1, 1), side * uniform(random, 0.45, 1.5), uniform(random, -1, 1));
    const double speed = std::pow(10.0, uniform(random, 0.7, 2.7));
    const std::uint32_t body = w.add(shape, Vec3d(place + tilt * from), uniform(random, 0.1, 20), anyTurn(random));
    w.bodies[body].velocity = tilt * (speed * (aim - from).normalized());
    w.bodies[body].spin = 30 * inCube(random);
    w.bodies[body].restitution = uniform(random, 0, 1);
    if (kind.moves) {
        w.bodies[plate].velocity = tilt * Vec3d(0, side * uniform(random, 0, 30), 0);
        w.bodies[plate].anchor = place;
        w.bodies[plate].spin = 0.5 * inCube(random);
    }
    const std::vector<Vec3d> marks = marksOf(shape);
    for (int frame = 0; frame < 8; ++frame) {
        const Affine3d before = w.pose(body), plateBefore = w.pose(plate);
        w.step();
        if (through(marks, before, w.pose(body), plateBefore, w.pose(plate), 0.5 * size)) return true;
    }
    return false;
}

TEST(Pass, HullsAndAFixedHull) {
    const std::vector<Shape> shapes = bullets();
    shots(300, [&](auto& random) { return passes(random, shapes, {}); });
}
TEST(Pass, HullsAndAFixedMesh) {
    const std::vector<Shape> shapes = bullets();
    shots(300, [&](auto& random) { return passes(random, shapes, {.mesh = true}); });
}
TEST(Pass, MeshesAndAFixedHull) {
    const std::vector<Shape> shapes = meshBullets();
    shots(200, [&](auto& random) { return passes(random, shapes, {}); });
}
TEST(Pass, MeshesAndAFixedMesh) {
    const std::vector<Shape> shapes = meshBullets();
    shots(200, [&](auto& random) { return passes(random, shapes, {.mesh = true}); });
}
TEST(Pass, MeshesAndAFixedMeshWithOtherVolumes) {
    const std::vector<Shape> shapes = meshBullets();
    shots(200, [&](auto& random) { return passes(random, shapes, {.mesh = true, .anyVolume = true}); });
}
TEST(Pass, HullsAndAFreeHull) {
    const std::vector<Shape> shapes = bullets();
    shots(300, [&](auto& random) { return passes(random, shapes, {.mass = std::pow(10.0, uniform(random, -1, 2))}); });
}
TEST(Pass, HullsAndAFreeMesh) {
    const std::vector<Shape> shapes = bullets();
    shots(200, [&](auto& random) {
        return passes(random, shapes, {.mesh = true, .mass = std::pow(10.0, uniform(random, -1, 2))});
    });
}
TEST(Pass, MeshesAndAFreeMesh) {
    const std::vector<Shape> shapes = meshBullets();
    shots(200, [&](auto& random) {
        return passes(random, shapes, {.mesh = true, .mass = std::pow(10.0, uniform(random, -1, 2))});
    });
}
TEST(Pass, HullsAndAMovingHull) {
    const std::vector<Shape> shapes = bullets();
    shots(200, [&](auto& random) { return passes(random, shapes, {.moves = true}); });
}
TEST(Pass, HullsAndAMovingMesh) {
    const std::vector<Shape> shapes = bullets();
    shots(200, [&](auto& random) { return passes(random, shapes, {.mesh = true, .moves = true}); });
}

/// Two plates that fly at each other, both fast, each turned a little.
TEST(Pass, TwoFastPlates) {
    const Vec3d size(1, kThick, 1), small(0.5, kThick, 0.4);
    const Shape a = hullShape(boxPoints(size)), b = hullShape(boxPoints(small));
    const std::vector<Vec3d> marks = marksOf(b);
    shots(300, [&](auto& random) {
        World w;
        w.gravity.setZero();
        const double height = uniform(random, 0.4, 3), speed = std::pow(10.0, uniform(random, 0.7, 2.7));
        const Quatd tilt = Quatd(1, 0.2 * uniform(random, -1, 1), 0, 0.2 * uniform(random, -1, 1)).normalized();
        const std::uint32_t plate = w.add(a, Vec3d(0, 0, 0), uniform(random, 0.1, 5));
        const std::uint32_t body = w.add(b, Vec3d(0.1 * uniform(random, -1, 1), height, 0.1 * uniform(random, -1, 1)),
                                         uniform(random, 0.1, 5), tilt);
        w.bodies[plate].velocity = Vec3d(0, speed * uniform(random, 0, 1), 0);
        w.bodies[body].velocity = Vec3d(0, -speed, 0);
        for (int frame = 0; frame < 8; ++frame) {
            const Affine3d before = w.pose(body), plateBefore = w.pose(plate);
            w.step();
            if (through(marks, before, w.pose(body), plateBefore, w.pose(plate), 0.5 * size)) return true;
        }
        return false;
    });
}

/// Floor and a thin wall are one mesh. A body lies on the floor and is shot along it.
bool getsThroughTheWall(std::mt19937_64& random, const std::vector<Shape>& shapes) {
    static const Shape hall = [] {
        std::vector<Vec3d> points;
        std::vector<std::uint32_t> indices;
        const auto add = [&](const Vec3d& size, const Vec3d& at) {
            const Shape box = boxMesh(size);
            const TriangleMesh& mesh = box.tree->mesh();
            for (std::uint32_t f = 0; f < mesh.faceCount(); ++f)
                for (const Vec3d& corner : mesh.triangle(f)) {
                    indices.push_back(static_cast<std::uint32_t>(points.size()));
                    points.push_back(corner + at);
                }
        };
        add({12, 0.2, 12}, {0, -0.1, 0});
        add({kThick, 3, 12}, {0, 1.5, 0});
        return meshShape(points, indices);
    }();
    World w;
    w.add(hall, Vec3d(0, 0, 0), 0);
    const Shape& shape = shapes[random() % shapes.size()];
    const Quatd turned(Eigen::AngleAxisd(uniform(random, -3, 3), Vec3d::UnitY()));
    Affine3d pose =
        composeTransform(Vec3d(uniform(random, -3, -0.8), 0, uniform(random, -2, 2)), turned, Vec3d::Ones());
    const double down = shape.tree->mesh().bounds().transformed(pose).lower.y();
    pose.translation().y() -= down + uniform(random, 0, 2e-4);
    const std::uint32_t body = w.add(shape, pose, 1);
    w.bodies[body].friction = uniform(random, 0, 0.3);
    w.bodies[body].velocity = Vec3d(std::pow(10.0, uniform(random, 0.7, 2.7)), 0, uniform(random, -3, 3));
    w.bodies[body].spin = Vec3d(0, 5 * uniform(random, -1, 1), 0);
    const std::vector<Vec3d> marks = marksOf(shape);
    Affine3d wall = Affine3d::Identity();  // its y across
    wall.linear().col(0) = -Vec3d::UnitY();
    wall.linear().col(1) = Vec3d::UnitX();
    wall.translation() = Vec3d(0, 1.5, 0);
    for (int frame = 0; frame < 20; ++frame) {
        const Affine3d before = w.pose(body);
        w.step();
        if (through(marks, before, w.pose(body), wall, wall, {1.5, 0, 6})) return true;
    }
    return false;
}

TEST(Pass, HullsThatLieOnTheFloorOfTheWall) {
    const std::vector<Shape> shapes = bullets();
    shots(200, [&](auto& random) { return getsThroughTheWall(random, shapes); });
}
TEST(Pass, MeshesThatLieOnTheFloorOfTheWall) {
    const std::vector<Shape> shapes = meshBullets();
    shots(100, [&](auto& random) { return getsThroughTheWall(random, shapes); });
}

}  // namespace
}  // namespace tessera::rigidbodytest
