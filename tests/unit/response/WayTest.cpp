#include "server/collision/response/Way.h"

#include <gtest/gtest.h>

#include "server/collision/response/Chain.h"
#include "tests/unit/response/TrialScene.h"

namespace tessera {
namespace {

Way randomWay(Dice& dice) {
    const auto value = [&] { return Pose{dice.vector(-2, 2), dice.rotation(), dice.vector(0.5, 1.5)}; };
    Way way{value(), value()};
    if (dice.chance(0.4)) way.end.rotation = way.start.rotation;
    if (dice.chance(0.4)) way.end.scale = way.start.scale;
    return way;
}

/// A body below `depth` transforms, the `moving` ones of which get a way.
struct Below : TrialScene {
    Dice dice;
    std::vector<ObjectId> transforms;
    std::vector<Way> ways;

    Below(unsigned seed, int depth, int moving) : dice(seed) {
        const ObjectId top = node(kRootNode);
        ObjectId parent = top;
        for (int i = 0; i < depth; ++i) {
            const Way way = randomWay(dice);
            transforms.push_back(transform(way.start.translation, way.start.rotation, way.start.scale));
            parent = node(parent, transforms.back());
            if (i < moving) ways.push_back(way);
        }
        node(parent, geometry(boxSoup(Vec3d(0.4, 0.8, 1.2))));
        watch(top);
    }
    [[nodiscard]] const Way* wayOf(ObjectId id) const {
        for (std::size_t i = 0; i < ways.size(); ++i)
            if (transforms[i] == id) return &ways[i];
        return nullptr;
    }
    [[nodiscard]] std::vector<Vec3d> corners(const Affine3d& world) const {
        std::vector<Vec3d> out;
        const TriangleMesh& mesh = handler.parts()[0].shape->mesh();
        for (std::uint32_t f = 0; f < mesh.faceCount(); ++f)
            for (unsigned k = 0; k < 3; ++k) out.push_back(world * mesh.corner(f, k));
        return out;
    }
};

TEST(Way, EndsAreExactAndBetweenIsBetween) {
    Way way;
    way.start = {Vec3d(1, 2, 3), Quatd(0.3, 0.2, 0.1, 0.7), Vec3d(1, 2, 3)};
    way.end = {Vec3d(3, 2, 1), Quatd(-0.3, 0.5, 0.1, 0.2), Vec3d(2, 2, 2)};
    EXPECT_EQ(way.at(0).rotation.coeffs(), way.start.rotation.coeffs()) << "not even normalised";
    EXPECT_EQ(way.at(1).translation, way.end.translation);
    EXPECT_EQ(way.at(0.5).translation, Vec3d(2, 2, 2));
    EXPECT_EQ(way.at(0.5).scale, Vec3d(1.5, 2, 2.5));
    const Quatd half = way.at(0.5).rotation;
    EXPECT_NEAR(half.angularDistance(way.start.rotation.normalized()),
                half.angularDistance(way.end.rotation.normalized()), 1e-12);
}

TEST(Way, NoPointLeavesItsChordByMoreThanTheBound) {
    double tightest = 0;
    for (unsigned seed = 0; seed < 60; ++seed) {
        Below scene(seed, 3, 1);
        const WayBound bound = boundWay(scene.handler, 0, [&](ObjectId id) { return scene.wayOf(id); });
        ASSERT_EQ(bound.bends, 1);
        const PartOnTheWay part(scene.handler, 0, scene.transforms[0]);
        const auto at = [&](double f) { return scene.corners(part.world(localOf(scene.ways[0].at(f)))); };
        for (const double from : {0.0, 0.2, 0.7})
            for (const double to : {0.3, 0.75, 1.0}) {
                if (to <= from) continue;
                const auto first = at(from), last = at(to);
                const double h = to - from;
                for (int k = 1; k < 16; ++k) {
                    const auto now = at(from + h * k / 16);
                    for (std::size_t i = 0; i < now.size(); ++i) {
                        const double off = (now[i] - (first[i] + (last[i] - first[i]) * k / 16)).norm();
                        EXPECT_LE(off, bound.curvature * h * h / 8 + 1e-12) << seed;
                        EXPECT_LE((now[i] - first[i]).norm(), bound.length * h * k / 16 + 1e-12) << seed;
                        if (bound.curvature > 0) tightest = std::max(tightest, off / (bound.curvature * h * h / 8));
                    }
                }
            }
    }
    EXPECT_GT(tightest, 0.3) << "a bound that says nothing";
}

TEST(Way, TheBoxHoldsThePartWhereverEachTransformIsOrSlides) {
    for (unsigned seed = 0; seed < 60; ++seed) {
        const int moving = 1 + static_cast<int>(seed % 5);
        Below scene(seed, 5, moving);
        const WayLookup wayOf = [&](ObjectId id) { return scene.wayOf(id); };
        const Box box = boxOnAllWays(scene.handler, 0, wayOf), wider = boxOnAllWays(scene.handler, 0, wayOf, true);
        const WayBound bound = boundWay(scene.handler, 0, wayOf);
        const auto start = scene.corners(scene.handler.parts()[0].world);
        EXPECT_EQ(bound.bends, moving);
        for (int trial = 0; trial < 200; ++trial) {
            const bool slides = trial % 2;
            Affine3d world = Affine3d::Identity();
            for (int i = 0; i < 5; ++i) {
                Pose pose = scene.at(scene.transforms[static_cast<std::size_t>(i)]);
                if (i < moving) {
                    const Way& way = scene.ways[static_cast<std::size_t>(i)];
                    const double f = scene.dice.uniform(0, 1);
                    pose = way.at(f);
                    // What is left of the translation may go anywhere.
                    if (slides)
                        pose.translation +=
                            (1 - f) * (way.end.translation - way.start.translation).norm() * scene.dice.direction();
                }
                world = world * localOf(pose);
            }
            const auto now = scene.corners(world);
            for (std::size_t k = 0; k < now.size(); ++k) {
                EXPECT_TRUE((slides ? wider : box).contains(now[k])) << seed;
                EXPECT_TRUE(slides || (now[k] - start[k]).norm() <= bound.length) << seed;
            }
        }
    }
}

TEST(Way, AStraightMoveHasNoBend) {
    Below scene(3, 3, 1);
    scene.ways[0].end = scene.ways[0].start;
    scene.ways[0].end.translation += Vec3d(3, 0, 0);
    const WayBound bound = boundWay(scene.handler, 0, [&](ObjectId id) { return scene.wayOf(id); });
    EXPECT_NEAR(bound.length, 3, 1e-9);
    EXPECT_NEAR(bound.drift, 3, 1e-9);
    EXPECT_EQ(bound.curvature, 0);
    EXPECT_EQ(bound.bow, 0);
}

/// What is folded into one motion is the chain, at every moment; and what can be folded is.
TEST(Chain, FoldsWhatIsOneMotion) {
    int folded = 0, refused = 0;
    for (unsigned seed = 0; seed < 400; ++seed) {
        Dice dice(seed);
        Chain chain;
        int turns = 0;
        bool belowTurn = false, even = true, foldable = true, movesBelowTurn = false;
        for (int i = 0; i < 5; ++i) {
            Way way = randomWay(dice);
            const bool evenly = dice.chance(0.7);
            if (evenly)
                for (Pose* pose : {&way.start, &way.end})
                    pose->scale = Vec3d::Constant(dice.chance(0.3) ? -pose->scale.x() : pose->scale.x());
            const double kind = dice.uniform(0, 1);
            if (kind < 0.4) {
                chain.append(localOf(way.start));
                even = even && evenly;
            } else if (kind < 0.7) {
                way.end.rotation = way.start.rotation, way.end.scale = way.start.scale;
                chain.append(way);
                foldable = foldable && !belowTurn;
                movesBelowTurn = movesBelowTurn || belowTurn;
                even = even && evenly;
            } else {
                if (way.start.rotation.coeffs() == way.end.rotation.coeffs())
                    way.end.rotation = dice.rotation(1) * way.start.rotation;
                foldable = foldable && !belowTurn && even;
                chain.append(way);
                belowTurn = true;
                ++turns;
            }
        }
        const std::optional<BodyMotion> motion = chain.asOneMotion(Mat3d::Identity());
        ASSERT_EQ(motion.has_value(), foldable) << "seed " << seed;
        EXPECT_EQ(chain.straight(), turns == 0) << "seed " << seed;
        // Seen from where its first turn is, uneven scales above that are no hindrance.
        const std::optional<BodyMotion> fromTurn = chain.asOneMotion(chain.frameOfTurn().inverse());
        Affine3d frame = Affine3d::Identity();
        frame.linear() = chain.frameOfTurn().inverse();
        ++(motion ? folded : refused);
        for (int s = 0; s <= 16; ++s) {
            const double t = s / 16.0;
            const Affine3d truth = chain.at(t);
            if (motion) {
                ASSERT_LE((motion->placeAt(t).matrix() - truth.matrix()).norm(), 1e-11) << "seed " << seed;
            }
            if (fromTurn) {
                ASSERT_LE((fromTurn->placeAt(t).matrix() - (frame * truth).matrix()).norm(), 1e-10) << "seed " << seed;
            }
        }
        if (turns == 1 && !movesBelowTurn) {
            EXPECT_TRUE(fromTurn) << "seed " << seed;
        }
    }
    EXPECT_GT(folded, 80);
    EXPECT_GT(refused, 80);
}

}  // namespace
}  // namespace tessera
