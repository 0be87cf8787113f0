// Who is led at a smooth surface stops where the surface is, not at the triangles that are drawn of it: beside closed
// forms, and beside exact trees of fine tessellations.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>
#include <string>

#include "common/freeform/subdivision/LimitTessellation.h"
#include "server/collision/query/DistanceQuery.h"
#include "server/collision/query/TimeOfImpact.h"
#include "tests/unit/drawable/ControlCube.h"
#include "tests/unit/nurbs/Plane.h"
#include "tests/unit/pipeline/SmoothScene.h"
#include "tests/unit/query/Bodies.h"

namespace tessera {
namespace {

struct StopSeeds {
    explicit StopSeeds(std::uint64_t count) {
        const char* one = std::getenv("TESSERA_SEED");
        first = one ? std::strtoull(one, nullptr, 10) : 0;
        end = one ? first + 1 : count;
    }
    [[nodiscard]] bool all() const { return end - first > 1; }
    std::uint64_t first = 0, end = 0;
};
std::string repeatStop(std::uint64_t seed) {
    return "TESSERA_SEED=" + std::to_string(seed) + " build/bin/unit_pipeline --gtest_filter=FreeformStop.*";
}
double among(std::mt19937_64& random, double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(random);
}
Vec3d anywhere(std::mt19937_64& random, double reach) {
    return {among(random, -reach, reach), among(random, -reach, reach), among(random, -reach, reach)};
}

/// As CollisionLimits has it, of a box of size 1.
const double kBoxStop = 1e-4 * std::sqrt(3.0);

/// The gap of a box and a ball is convex along a straight way: golden sections find its least, halvings where it first
/// is `gap`. 1: nowhere.
double firstAt(const Vec3d& from, const Vec3d& to, double radius, double gap) {
    const auto at = [&](double t) { return boxFromBall(from + t * (to - from), radius) - gap; };
    double low = 0, high = 1;
    for (int i = 0; i < 200; ++i) {
        const double third = (high - low) / 3;
        (at(low + third) < at(high - third) ? high : low) =
            at(low + third) < at(high - third) ? high - third : low + third;
    }
    if (at(low) > 0) return 1;
    double apart = 0, near = low;
    for (int i = 0; i < 100; ++i) {
        const double middle = 0.5 * (apart + near);
        (at(middle) > 0 ? apart : near) = middle;
    }
    return apart;
}

TEST(FreeformStop, MotionsStopAtTheSurfaceNotAtItsTrianglesHoweverOftenAndFastTheyArePushed) {
    std::size_t stops = 0, passes = 0, tellings = 0;
    const StopSeeds seeds(12);
    for (std::uint64_t seed = seeds.first; seed < seeds.end; ++seed) {
        SCOPED_TRACE(repeatStop(seed));
        std::mt19937_64 random(seed);
        NurbsSurfaceCore ball = ballCore(1);
        ball.tolerance = seed % 2 ? 0.2 : 0.05;  // few triangles: they lie far within
        SmoothScene scene(ball,
                          smoothObject(seed % 3 == 0   ? CollisionObject::kDeforming
                                       : seed % 3 == 1 ? CollisionObject::kRigid
                                                       : CollisionObject::kStatic),
                          Interest::kStop);
        scene.commit(scene.boxTo(Vec3d(0, 3, 0)));
        for (int push = 0; push < 30; ++push) {
            const Vec3d from = scene.at(scene.box.transform).translation;
            // From afar; again at what it stopped at; almost along it; so fast that it would be through in the frame.
            Vec3d to = anywhere(random, 3);
            if (push % 4 == 1) to = Vec3d::Zero();
            if (push % 4 == 2) to = from + 0.3 * from.unitOrthogonal() - 1e-5 * from;
            if (push % 4 == 3) to = -1000 * from;
            const StepResult found = scene.frame({scene.boxTo(to)});
            const Vec3d reached = scene.at(scene.box.transform).translation;
            ASSERT_GT(boxFromBall(reached, 1), 0);
            ASSERT_TRUE(found.notLookedAt.empty());
            const double length = (to - from).norm(), t = (reached - from).dot(to - from) / (length * length);
            const double met = firstAt(from, to, 1, 0), near = firstAt(from, to, 1, 0.0101 * kBoxStop);
            ASSERT_LE(t, met + 1e-9);
            if (near == 1) {
                ++passes;
                ASSERT_EQ(reached, to);
                continue;
            }
            ASSERT_GE(t, std::max(0.0, near - 0.501 * kBoxStop / length) - 1e-9);
            if (met == 1) continue;
            ++stops;
            ASSERT_EQ(found.stopped, std::vector<ObjectId>{scene.box.transform});
            // What stopped it is told by the surface's own parameters; where they also are as near as contacts are
            // told, that is told of the same faces.
            if (t < 1e-9) continue;  // it was there already
            ASSERT_FALSE(found.contacts.empty()) << push << " t " << t << " met " << met << " near " << near << " gap "
                                                 << boxFromBall(reached, 1) / kBoxStop << " of " << length;
            const std::vector<Contact>& contacts = found.contacts.all();
            const auto told = std::ranges::find_if(contacts, [](const Contact& c) { return c.time < 1; });
            const Contact& contact = told == contacts.end() ? contacts.front() : *told;
            ASSERT_EQ(contact.patchB, 0U);
            ASSERT_EQ(contact.interest, scene.law);
            ASSERT_LE((evaluate(sphereSurface(1).value(), contact.patchUvB.x(), contact.patchUvB.y()).at.point -
                       contact.point)
                          .norm(),
                      told == contacts.end() ? 1e-4 * std::sqrt(12.0) : 0.02 * kBoxStop);
            if (told == contacts.end()) continue;
            ++tellings;
            ASSERT_LE(contact.time, met + 1e-9);
            ASSERT_GE(contact.time, near - 1e-9);
        }
    }
    if (seeds.all()) {
        EXPECT_GT(stops, 100U);
        EXPECT_GT(tellings, 10U);
        EXPECT_GT(passes, 20U);
    }
}

TEST(FreeformStop, ATrimmedSheetIsNotPassedButThroughItsHole) {
    std::size_t stops = 0, passes = 0;
    const StopSeeds seeds(40);
    const double hole = 1.2, size = 10;
    const std::vector<TrimLoop> loops{{LoopRole::kHole, {circle({0, 0}, hole)}}};
    for (std::uint64_t seed = seeds.first; seed < seeds.end; ++seed) {
        SCOPED_TRACE(repeatStop(seed));
        std::mt19937_64 random(seed);
        SmoothScene scene(coreOfSurface(planeSurface({{-size, size}, {-size, size}}, loops).value()),
                          smoothObject(seed % 2 ? CollisionObject::kRigid : CollisionObject::kDeforming),
                          Interest::kStop);
        for (int push = 0; push < 6; ++push) {
            const Vec3d side(among(random, -2, 2), among(random, -2, 2), 0);
            const double fast = std::pow(10, among(random, 0, 4));
            scene.commit(scene.boxTo(side + Vec3d(0, 0, fast)));
            scene.frame();
            (void)scene.frame({scene.boxTo(side - Vec3d(0, 0, fast))});
            const double z = scene.at(scene.box.transform).translation.z();
            const double farthest = (side.cwiseAbs().head<2>() + Vec2d(0.5, 0.5)).norm();
            if (farthest < hole - kBoxStop) {
                ++passes;
                ASSERT_EQ(z, -fast);
            } else if (farthest > hole + kBoxStop) {
                ++stops;
                ASSERT_GT(z, 0.5);
                ASSERT_LE(z, 0.5 + 0.52 * kBoxStop + 1e-9 * fast);
            }
        }
    }
    if (seeds.all()) {
        EXPECT_GT(stops, 100U);
        EXPECT_GT(passes, 5U);
    }
}

/// So fine that what it is off the surface is a twentieth of what the test looks for.
struct FineSurface {
    TriangleMesh mesh;
    double off = 0;  ///< the surface is about so far from it, at most
};
FineSurface fineOf(const SubdivisionSurface& fields) {
    const auto gridOf = [&](int level) {
        ControlMesh control;
        const auto points = fields.points.as<float>();
        for (std::size_t i = 0; i < points.size(); i += 3)
            control.positions.emplace_back(points[i], points[i + 1], points[i + 2]);
        const auto sizes = fields.faceSizes.as<std::uint32_t>(), vertices = fields.faceVertices.as<std::uint32_t>();
        control.faceSizes.assign(sizes.begin(), sizes.end());
        control.faceVertices.assign(vertices.begin(), vertices.end());
        const std::shared_ptr<const LimitTessellation> tessellation = LimitTessellation::build(control, level).value();
        std::vector<float> positions(3 * tessellation->vertexCount()), normals(positions.size());
        tessellation->evaluate(points, positions, normals);
        return TriangleMesh::make(std::span<const float>(positions), tessellation->indices()).value();
    };
    FineSurface out{gridOf(4), 0};
    // The vertices of a level more lie on the surface, those in the middles of edges where the chords are farthest off
    // it.
    const TriangleMesh finer = gridOf(5);
    const TriangleTree tree(out.mesh, {});
    for (std::size_t i = 0; i < finer.vertexCount(); i += 7) {
        const Vec3d p = finer.positions()[i];
        const std::array<double, 9> corners{p.x(), p.y(), p.z(), p.x(), p.y(), p.z(), p.x(), p.y(), p.z()};
        const TriangleTree point(
            TriangleMesh::make(std::span<const double>(corners), std::array<std::uint32_t, 3>{0, 1, 2}).value(), {});
        QueryWork work;
        out.off = std::max(out.off, 2 * distanceBetween(tree, point, Affine3d::Identity(), work, {}).distance);
    }
    return out;
}

TEST(FreeformStop, OfASurfaceThatDeformsNobodyIsEverLedIntoIt) {
    std::size_t stops = 0;
    const StopSeeds seeds(6);
    for (std::uint64_t seed = seeds.first; seed < seeds.end; ++seed) {
        SCOPED_TRACE(repeatStop(seed));
        std::mt19937_64 random(seed);
        SubdivisionSurface fields = test::controlGrid(1 + static_cast<std::uint32_t>(seed % 2));
        fields.level = 1;
        SmoothScene scene(fields, smoothObject(CollisionObject::kDeforming),
                          seed % 3 == 0 ? Interest::kSlide : Interest::kStop);
        for (int step = 0; step < 6; ++step) {
            const std::size_t points = scene.aspect.get<SubdivisionSurface>(scene.surface)->points.sizeBytes() / 12;
            const std::vector<float> moved{static_cast<float>(among(random, -1.5, 1.5)),
                                           static_cast<float>(among(random, -1.5, 1.5)),
                                           static_cast<float>(among(random, -1.5, 1.5))};
            scene.move(3 * (random() % points), moved);
            const FineSurface fine = fineOf(*scene.aspect.get<SubdivisionSurface>(scene.surface));
            const TriangleTree tree(fine.mesh, {});
            const auto boxOf = [&](double grown) {
                return TriangleTree(bodies::meshOf(shapes::box(Vec3d::Constant(1 + 2 * grown))), {});
            };
            const auto gapAt = [&](const Vec3d& where) {
                QueryWork work;
                return distanceBetween(tree, boxOf(0), Affine3d(Eigen::Translation3d(where)), work, {}).distance;
            };
            Vec3d from = scene.at(scene.box.transform).translation;
            // Where it grew into the box, the box is put elsewhere.
            if (gapAt(from) <= 4 * fine.off + kBoxStop) {
                scene.commit(scene.boxTo(from = Vec3d(0, 4, 0)));
            }
            const Vec3d to = step % 2 ? anywhere(random, 3) : Vec3d(-50 * from);
            const StepResult found = scene.frame({scene.boxTo(to)});
            const Vec3d reached = scene.at(scene.box.transform).translation;
            const bool slides = seed % 3 == 0;
            // On the straight way to where it stopped a box that is a little smaller meets nothing.
            if (!slides) {
                BodyMotion rest, way;
                way.start.translation = from;
                way.end.translation = reached;
                QueryWork work;
                ASSERT_FALSE(timeOfImpact(tree, rest, boxOf(-2 * fine.off), way, work, {.tolerance = 1e-9}).hit)
                    << fine.off;
            }
            ASSERT_GE(gapAt(reached), 0);
            {
                QueryWork work;
                ASSERT_GT(distanceBetween(tree, boxOf(-2 * fine.off), Affine3d(Eigen::Translation3d(reached)), work, {})
                              .distance,
                          0);
            }
            if (found.stopped.empty() || slides) continue;
            ++stops;
            // It went as far as it could: to within half the stop tolerance of way, straight at it or grazing.
            ASSERT_LE(gapAt(reached), 0.52 * kBoxStop + 2 * fine.off);
        }
    }
    if (seeds.all()) {
        EXPECT_GT(stops, 6U);
    }
}

}  // namespace
}  // namespace tessera
