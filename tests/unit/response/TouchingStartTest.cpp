// Motions of what touches something from the start, beside an oracle that looks at every pair of faces all along the
// way.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/unit/response/FaceOracle.h"
#include "tests/unit/response/Halls.h"
#include "tests/unit/response/TrialScene.h"

namespace tessera {
namespace {

struct TouchingScene : TrialScene {
    std::vector<ObjectId> movers, others;
    ObjectId transform_;  ///< what moves
    double thickness = 1e300, size = 0;
    Quatd turn;
    Vec3d origin;
    Chance& chance;
    bool rough;         ///< not exactly on a plane
    bool room = false;  ///< with walls of 3 all around, 8 by 8

    explicit TouchingScene(Chance& c, bool slide = false) : chance(c) {
        slides = slide;
        // Everything lies somewhere, turned somehow.
        turn = chance.oneIn(2) ? Quatd::Identity() : chance.turn(3);
        origin = chance.oneIn(2) ? Vec3d::Zero().eval() : Vec3d(chance.of(1, 1e4) * chance.vector());
        rough = chance.oneIn(3);
        const ObjectId fixed = node(kRootNode);
        const auto stand = [&](const bodies::Body& shape, const Vec3d& where) {
            others.push_back(body(fixed, shape, origin + turn * where, turn).shape);
        };
        if (rough) {
            stand(terrain(chance), Vec3d::Zero());
        } else if (chance.oneIn(4)) {
            // Slabs side by side, each a part, and a wall.
            for (int i = -2; i < 2; ++i)
                for (int j = -2; j < 2; ++j) stand(bodies::box(Vec3d(2, 0.5, 2)), Vec3d(2 * i + 1, -0.25, 2 * j + 1));
            stand(bodies::box(Vec3d(0.1, 2, 8)), Vec3d(chance.in(1, 3), 1, 0));
        } else {
            stand(hall(chance), Vec3d::Zero());
            room = true;
        }
        transform_ = transform(Vec3d::Zero());
        const ObjectId carrier = node(kRootNode, transform_);
        const std::size_t parts = chance.oneIn(3) ? 1 + chance.below(3) : 1;
        for (std::size_t i = 0; i < parts; ++i) {
            Vec3d extent(chance.of(0.1, 1.5), chance.of(0.1, 1.5), chance.of(0.1, 1.5));
            if (chance.oneIn(2)) extent[static_cast<int>(chance.below(3))] = chance.of(1e-3, 2e-2);
            const bool ball = chance.oneIn(5);
            const bodies::Body shape = ball ? bodies::sphere(0.3, 6, 8) : bodies::box(extent);
            const double bottom = ball ? 0.3 : 0.5 * extent.y();
            movers.push_back(body(carrier, shape, Vec3d(0.7 * static_cast<double>(i), bottom, 0)).shape);
            if (!ball) thickness = std::min(thickness, extent.minCoeff());
            size = std::max(size, extent.norm());
        }
        watch(carrier);
    }
    [[nodiscard]] Pose pose(const Vec3d& where, const Quatd& own) const {
        return {origin + turn * where, turn * own, Vec3d::Ones()};
    }
    /// No corner of what moves is farther out of the room than this, sideways or down.
    [[nodiscard]] double out() const {
        double most = -1e300;
        for (const ObjectId id : movers) {
            const Affine3d world = worldTransform(aspect, id);
            const TriangleMesh mesh = meshOf(id);
            for (const Vec3d& p : mesh.positions()) {
                const Vec3d own = turn.conjugate() * (world * p - origin);
                most = std::max({most, std::abs(own.x()) - 4, std::abs(own.z()) - 4, -own.y()});
            }
        }
        return most;
    }
    [[nodiscard]] double tolerance() const {
        double most = 0;
        for (const Part& part : handler.parts())
            if (std::ranges::find(movers, part.node) != movers.end())
                most = std::max(most, stopTolerance * part.worldBox.size().norm());
        return 1.6 * most;  // boxes of what turns are larger
    }
    [[nodiscard]] double rounding() const { return 1e-9 * size + 1e-14 * origin.norm(); }
    [[nodiscard]] bool touchesAny() const {
        for (const ObjectId a : movers)
            for (const ObjectId b : others)
                if (touching(a, b)) return true;
        return false;
    }
    /// On the floor, in a place where it is free but for that.
    bool setDown() {
        for (int tries = 0; tries < 20; ++tries) {
            const Vec3d where(chance.in(-3, 3), 0, chance.in(-3, 3));
            const Quatd own = chance.oneIn(3) ? Quatd::Identity() : chance.upright(4);
            put(transform_, pose(where + Vec3d(0, rough ? 1 : 1e-3, 0), own));
            if (touchesAny()) continue;
            if (!rough) {
                put(transform_, pose(where, own));
                return true;
            }
            double free = 1, met = -0.5;
            for (int i = 0; i < 50; ++i) {
                const double middle = 0.5 * (free + met);
                put(transform_, pose(where + Vec3d(0, middle, 0), own));
                (touchesAny() ? met : free) = middle;
            }
            put(transform_, pose(where + Vec3d(0, met, 0), own));
            return true;
        }
        return false;
    }
    Pose wish() {
        const Pose from = at(transform_);
        Vec3d way(chance.in(-1, 1), 0, chance.in(-1, 1));
        if (chance.oneIn(4)) way = Vec3d(chance.oneIn(2) ? 1 : -1, 0, 0);
        if (chance.oneIn(4)) way.y() = chance.in(-1, 1) * chance.of(1e-6, 1);
        const double length = size * chance.of(0.01, chance.oneIn(4) ? 100 : 8);
        Pose to = from;
        to.translation += turn * (length * way.normalized());
        if (chance.oneIn(3)) to.rotation = from.rotation * chance.upright(2);
        if (chance.oneIn(8)) to.rotation = from.rotation * chance.turn(1);
        if (chance.oneIn(8)) to.scale *= chance.in(0.8, 1.25);
        return to;
    }
};

/// A floor that rises towards x > 0 by a slope, and a box that stands before it.
struct BoxBeforeSlope : TrialScene {
    Thing box, floor;
    BoxBeforeSlope(double slope, bool slide) {
        slides = slide;
        bodies::Body ground;
        addSheet(ground, Vec3d(-5, 0, -5), Vec3d(10, 0, 0), Vec3d(0, 0, 10), 10, 10,
                 [&](int i, int) { return std::max(0, i - 5) * slope; });
        box = body(kRootNode, bodies::box(Vec3d::Ones()), Vec3d(-2, 0.5, 0.3));
        floor = body(kRootNode, ground, Vec3d::Zero());
        watch(box.node);
    }
};

TEST(TouchingStart, AStopEndsAtASlopeUpwardsAndASlideGoesUp) {
    for (const double slope : {0.3, 0.01, 1e-3}) {
        BoxBeforeSlope stop(slope, false), slide(slope, true);
        EXPECT_TRUE(stop.goTo(stop.box.transform, Vec3d(2, 0.5, 0.3)).stopped) << slope;
        EXPECT_NEAR(stop.placeOf(stop.box.transform).x(), -0.5, 0.2 + 2e-4) << slope;
        EXPECT_EQ(stop.placeOf(stop.box.transform).y(), 0.5);
        slide.goTo(slide.box.transform, Vec3d(2, 0.5, 0.3));
        EXPECT_GT(slide.placeOf(slide.box.transform).x(), 1.5) << slope;
        EXPECT_NEAR(slide.placeOf(slide.box.transform).y(),
                    0.5 + slope * (slide.placeOf(slide.box.transform).x() + 0.5), 1e-3 + 0.2 * slope);
    }
}

TEST(TouchingStart, OverAnEdgeThatGoesDownAndAlongNoLengthIsTooLong) {
    for (const double slope : {0.0, -1e-6, -0.01, -0.5}) {
        BoxBeforeSlope scene(slope, false);
        EXPECT_FALSE(scene.goTo(scene.box.transform, Vec3d(4, 0.5, 0.3)).stopped) << slope;
        EXPECT_FALSE(scene.goTo(scene.box.transform, Vec3d(1e4, 0.5, 300)).stopped) << slope;
    }
}

TEST(TouchingStart, AStepHigherThanTheToleranceStopsALowerOneNeedNot) {
    for (const double high : {1e-5, 1e-3, 0.1}) {
        TrialScene scene;
        const auto box = scene.body(kRootNode, bodies::box(Vec3d::Ones()), Vec3d(-2, 0.5, 0));
        bodies::Body ground;
        addSheet(ground, Vec3d(-5, 0, -5), Vec3d(5, 0, 0), Vec3d(0, 0, 10), 3, 3, [](int, int) { return 0; });
        addSheet(ground, Vec3d(0, high, -5), Vec3d(5, 0, 0), Vec3d(0, 0, 10), 3, 3, [](int, int) { return 0; });
        scene.body(kRootNode, ground, Vec3d::Zero());
        scene.watch(box.node);
        EXPECT_EQ(scene.goTo(box.transform, Vec3d(2, 0.5, 0)).stopped, high > 2e-4) << high;
        if (high > 2e-4) {
            EXPECT_NEAR(scene.placeOf(box.transform).x(), -0.5, 2e-4);
        }
    }
}

TEST(TouchingStart, PressedForAThousandFramesNothingSinks) {
    for (const bool slide : {false, true})
        for (const double far : {0.0, 1e4}) {
            TrialScene scene;
            scene.slides = slide;
            const Quatd turn(Eigen::AngleAxisd(1, Vec3d(1, 2, 3).normalized()));
            const Vec3d origin(far, -far, far);
            const auto box = scene.body(kRootNode, bodies::box(Vec3d::Ones()), origin + turn * Vec3d(0, 0.5, 0), turn);
            bodies::Body ground;
            addSheet(ground, Vec3d(-5, 0, -5), Vec3d(10, 0, 0), Vec3d(0, 0, 10), 7, 7, [](int, int) { return 0; });
            scene.body(kRootNode, ground, origin, turn);
            scene.watch(box.node);
            for (int i = 0; i < 1000; ++i) {
                const Vec3d aside(0.1 * std::cos(i), i % 3 ? -0.1 : -1e-5, 0.1 * std::sin(i));
                Pose wanted = scene.at(box.transform);
                wanted.translation += turn * aside;
                if (i % 4 == 0) wanted.rotation = wanted.rotation * Quatd(Eigen::AngleAxisd(0.1, Vec3d::UnitY()));
                scene.go(box.transform, wanted);
            }
            const Vec3d own = turn.conjugate() * (scene.placeOf(box.transform) - origin);
            EXPECT_NEAR(own.y(), 0.5, 2e-6) << slide << ' ' << far;
        }
}

struct Tally {
    int wishes = 0, stopped = 0, undecided = 0, far = 0, unfounded = 0;
};

TEST(TouchingStart, NoFacesEverMeetThatWereApartUnlessTheyLieFlush) {
    Tally tally;
    forSeeds(seeds(60), [&](Random& random) {
        Chance chance(random);
        TouchingScene scene(chance);
        if (!scene.setDown()) return;
        const FaceOracle oracle(scene.aspect, scene.movers, scene.others);
        const double tolerance = scene.tolerance(), rounding = scene.rounding();
        for (int k = 0; k < 4; ++k) {
            const Pose from = scene.at(scene.transform_), wanted = scene.wish();
            const FaceOracle::Meetings start = oracle.meetings();
            const Resolution result = scene.go(scene.transform_, wanted);
            const Pose accepted = scene.at(scene.transform_);
            ++tally.wishes;
            tally.stopped += result.stopped;
            tally.undecided += result.undecided > 0;
            const Way way{from, accepted};
            const double length = (accepted.translation - from.translation).norm() +
                                  2 * scene.size * from.rotation.angularDistance(accepted.rotation) +
                                  2 * scene.size * (accepted.scale - from.scale).norm();
            tally.far += length > scene.size;
            const int samples = static_cast<int>(std::clamp(3 * length / scene.thickness, 20.0, 600.0));
            for (int s = 1; s <= samples; ++s) {
                const double fraction = s == samples ? 1 : s % 2 ? chance.in(0, 1) : static_cast<double>(s) / samples;
                scene.put(scene.transform_, way.at(fraction));
                const auto wrong = FaceOracle::wrong(start, oracle.meetings(), tolerance, rounding);
                ASSERT_FALSE(wrong) << *wrong << ", wish " << k << ", at " << fraction << " of the accepted way of "
                                    << length << ", tolerance " << tolerance;
            }
            scene.put(scene.transform_, accepted);
            // Where it was stopped there is a reason: a little further something is there that was not, or is deeper.
            if (result.stopped && result.undecided == 0) {
                const Way whole{from, wanted};
                const double all = (wanted.translation - from.translation).norm() +
                                   scene.size * from.rotation.angularDistance(wanted.rotation) +
                                   scene.size * (wanted.scale - from.scale).norm();
                const double reached = (wanted.translation - from.translation).norm() > 0
                                           ? (accepted.translation - from.translation).norm() /
                                                 (wanted.translation - from.translation).norm()
                                           : 0;
                bool reason = false;
                for (int s = 1; s <= 8 && !reason; ++s) {
                    scene.put(scene.transform_, whole.at(reached + 0.5 * s * tolerance / all));
                    for (const auto& [faces, depth] : oracle.meetings()) {
                        const auto was = start.find(faces);
                        reason = reason || was == start.end() || depth > was->second + 1e-13;
                    }
                }
                scene.put(scene.transform_, accepted);
                tally.unfounded += !reason;
            }
        }
    });
    std::printf("%d wishes, %d stopped, %d undecided, %d went farther than their size, %d stopped without a reason\n",
                tally.wishes, tally.stopped, tally.undecided, tally.far, tally.unfounded);
    EXPECT_LE(50 * tally.unfounded, tally.stopped);
    EXPECT_LE(50 * tally.undecided, tally.wishes);
}

/// A slide may go on along what it meets; where it ends nothing is met that was not, and nobody has left the room.
TEST(TouchingStart, SlidesEndWhereNothingNewIsMetAndNobodyLeavesTheRoom) {
    int wishes = 0, stopped = 0, further = 0;
    forSeeds(seeds(60), [&](Random& random) {
        Chance chance(random);
        TouchingScene scene(chance, true);
        if (!scene.setDown()) return;
        const FaceOracle oracle(scene.aspect, scene.movers, scene.others);
        const double tolerance = scene.tolerance(), rounding = scene.rounding();
        bool inside = scene.room && scene.out() < rounding;
        for (int k = 0; k < 8; ++k) {
            const Pose from = scene.at(scene.transform_);
            const FaceOracle::Meetings start = oracle.meetings();
            const Pose wanted = scene.wish();
            const bool low = (scene.turn.conjugate() * (wanted.translation - from.translation)).y() < 0.3;
            const Resolution result = scene.go(scene.transform_, wanted);
            const auto wrong = FaceOracle::wrong(start, oracle.meetings(), tolerance, rounding);
            ASSERT_FALSE(wrong) << *wrong << ", wish " << k;
            inside = inside && low;
            ASSERT_TRUE(!inside || scene.out() < tolerance + rounding) << scene.out() << ", wish " << k;
            ++wishes;
            stopped += result.stopped;
            further += result.stopped && (result.accepted.translation - from.translation).norm() > 0.1 * scene.size;
        }
    });
    std::printf("%d wishes, %d stopped, %d of them went somewhere\n", wishes, stopped, further);
}

}  // namespace
}  // namespace tessera
