// What touches from the start and is led by a transform that stands above it twice, above both, or in a frame that is
// stretched: ways that are no single motion.
#include <gtest/gtest.h>

#include <cmath>

#include <Eigen/SVD>

#include "tests/unit/response/FaceOracle.h"
#include "tests/unit/response/Halls.h"
#include "tests/unit/response/TrialScene.h"

namespace tessera {
namespace {

enum class Carried { kTwice, kInTwoFrames, kTwiceAndBoth, kThroughAStretch };

/// Something small stands on the floor of a hall. One transform, the joint, is what moves.
struct CarriedScene : TrialScene {
    Chance& chance;
    Carried kind;
    ObjectId joint, lift[2];
    std::vector<ObjectId> movers, others;
    ObjectId carrier, below;
    double thickness = 1e300, size = 0;

    CarriedScene(Chance& c, Carried k) : chance(c), kind(k) {
        joint = transform(chance.vector(), chance.turn(3));
        const auto under = [&](ObjectId parent, ObjectId core) { return node(parent, core); };
        const auto still = [&](bool uneven) {
            const Vec3d scale = uneven ? Vec3d(chance.of(0.5, 2), chance.of(0.5, 2), chance.of(0.5, 2))
                                       : Vec3d::Constant(chance.of(0.7, 1.4)).eval();
            return transform(0.7 * chance.vector(), chance.turn(3), scale);
        };
        if (kind == Carried::kInTwoFrames) {
            carrier = under(under(kRootNode, still(true)), joint);
            below = under(under(kRootNode, still(true)), joint);
        } else {
            const bool stretched = kind == Carried::kThroughAStretch;
            carrier = under(under(under(kRootNode, joint), still(stretched)), joint);
            below = kind == Carried::kTwiceAndBoth ? under(kRootNode, joint) : node(kRootNode);
        }
        // A hall is put below by two transforms, so that any linear map can be said.
        lift[0] = transform();
        lift[1] = transform();
        others.push_back(
            body(under(under(below, lift[0]), lift[1]), chance.oneIn(3) ? terrain(chance) : hall(chance), Vec3d::Zero())
                .shape);
        Vec3d extent(chance.of(0.1, 1.5), chance.of(0.1, 1.5), chance.of(0.1, 1.5));
        if (chance.oneIn(2)) extent[static_cast<int>(chance.below(3))] = chance.of(1e-3, 2e-2);
        const bool ball = chance.oneIn(5);
        movers.push_back(body(carrier, ball ? bodies::sphere(0.3, 6, 8) : bodies::box(extent),
                              Vec3d(0, ball ? 0.3 : 0.5 * extent.y(), 0))
                             .shape);
        if (!ball) thickness = extent.minCoeff();
        watch(carrier);
        const TriangleMesh mesh = meshOf(movers[0]);
        for (const Vec3d p : mesh.positions()) size = std::max(size, 2 * p.norm());
    }
    /// hall_T_mover as told.
    void putHall(const Affine3d& hall_T_mover) {
        const Affine3d map =
            worldTransform(aspect, below).inverse() * worldTransform(aspect, carrier) * hall_T_mover.inverse();
        Eigen::JacobiSVD<Mat3d> svd(map.linear(), Eigen::ComputeFullU | Eigen::ComputeFullV);
        Mat3d u = svd.matrixU(), v = svd.matrixV();
        Vec3d scale = svd.singularValues();
        if (u.determinant() < 0) {
            u = -u;
            scale = -scale;
        }
        if (v.determinant() < 0) {
            v = -v;
            scale = -scale;
        }
        put(lift[0], {map.translation(), Quatd(u).normalized(), scale});
        put(lift[1], {Vec3d::Zero(), Quatd(v).conjugate().normalized(), Vec3d::Ones()});
    }
    [[nodiscard]] bool setDown() {
        for (int tries = 0; tries < 20; ++tries) {
            const Affine3d at =
                Pose{Vec3d(chance.in(-3, 3), 0, chance.in(-3, 3)), chance.upright(4), Vec3d::Ones()}.matrix();
            const auto lifted = [&](double by) {
                Affine3d out = at;
                out.translation().y() += by;
                putHall(out);
                return touching(movers[0], others[0]);
            };
            if (lifted(1)) continue;
            double free = 1, met = -0.5;
            if (!lifted(met)) continue;
            for (int i = 0; i < 50; ++i) {
                const double middle = 0.5 * (free + met);
                (lifted(middle) ? met : free) = middle;
            }
            return lifted(met);
        }
        return false;
    }
    [[nodiscard]] double tolerance() const {
        const Part& part = handler.parts()[this->part(movers[0])];
        const Part& other = handler.parts()[this->part(others[0])];
        return 2 * stopTolerance * std::min(part.worldBox.size().norm(), other.worldBox.size().norm());
    }
    /// In the world, how far the mover's corners go against the hall's frame up to there.
    [[nodiscard]] Affine3d between() const {
        return worldTransform(aspect, others[0]).inverse() * worldTransform(aspect, movers[0]);
    }
    Pose anywhere() {
        Pose to = at(joint);
        to.translation += chance.of(1e-3, 3) * chance.vector();
        if (!chance.oneIn(4)) to.rotation = to.rotation * chance.turn(chance.of(1e-3, 2));
        if (chance.oneIn(8)) to.scale *= chance.in(0.8, 1.25);
        return to;
    }
    /// Three of four begin upwards, so that something comes of them.
    Pose wish() {
        const Pose from = at(joint);
        const double high = between().translation().y();
        Pose to = anywhere();
        for (int tries = chance.oneIn(4) ? 0 : 20; tries > 0; --tries) {
            put(joint, Way{from, to}.at(0.02));
            const bool up = between().translation().y() > high;
            put(joint, from);
            if (up) break;
            to = anywhere();
        }
        return to;
    }
};

class CarriedStart : public testing::TestWithParam<Carried> {};

TEST_P(CarriedStart, NoFacesEverMeetThatWereApart) {
    int wishes = 0, stopped = 0, undecided = 0, far = 0;
    forSeeds(seeds(60), [&](Random& random) {
        Chance chance(random);
        CarriedScene scene(chance, GetParam());
        if (!scene.setDown()) return;
        const FaceOracle oracle(scene.aspect, scene.movers, scene.others);
        for (int k = 0; k < 4; ++k) {
            const Pose from = scene.at(scene.joint), wanted = scene.wish();
            const FaceOracle::Meetings start = oracle.meetings();
            double tolerance = scene.tolerance();
            const Resolution result = scene.go(scene.joint, wanted);
            const Pose accepted = scene.at(scene.joint);
            ++wishes;
            stopped += result.stopped;
            undecided += result.undecided > 0;
            const Way way{from, accepted};
            double length = 0;
            for (int s = 0; s < 20; ++s) {
                scene.put(scene.joint, way.at(s / 20.0));
                const Affine3d here = scene.between();
                scene.put(scene.joint, way.at((s + 1) / 20.0));
                const Affine3d there = scene.between();
                tolerance = std::max(tolerance, scene.tolerance());
                length += (there.translation() - here.translation()).norm() +
                          (there.linear() - here.linear()).norm() * scene.size;
            }
            far += length > scene.size;
            const int samples = static_cast<int>(std::clamp(3 * length / scene.thickness, 20.0, 600.0));
            for (int s = 1; s <= samples; ++s) {
                const double fraction = s == samples ? 1 : s % 2 ? chance.in(0, 1) : static_cast<double>(s) / samples;
                scene.put(scene.joint, way.at(fraction));
                const auto wrong = FaceOracle::wrong(start, oracle.meetings(), tolerance, 1e-9);
                ASSERT_FALSE(wrong) << *wrong << ", wish " << k << ", at " << fraction << " of the accepted way of "
                                    << length << ", tolerance " << tolerance;
            }
            scene.put(scene.joint, accepted);
        }
    });
    std::printf("%d wishes, %d stopped, %d undecided, %d went farther than their size\n", wishes, stopped, undecided,
                far);
    EXPECT_LE(50 * undecided, wishes);
    EXPECT_GE(10 * far, wishes);
}

INSTANTIATE_TEST_SUITE_P(Kinds, CarriedStart,
                         testing::Values(Carried::kTwice, Carried::kInTwoFrames, Carried::kTwiceAndBoth,
                                         Carried::kThroughAStretch));

}  // namespace
}  // namespace tessera
