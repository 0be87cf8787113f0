// Times of impact of rigid and scaling bodies beside certain bounds (MotionOracle.h) and exact moments
// (StraightOracle.h).
//
// TESSERA_HUNT=N: so many times as many trials. TESSERA_SEED=n: of each kind that one alone.
#include <gtest/gtest.h>

#include <cstdlib>
#include <functional>
#include <sstream>

#include "tests/truth/ImpactTrials.h"
#include "tests/truth/MotionOracle.h"

namespace tessera {
namespace {

using truth::FirstContact;
using truth::MovingBodies;
using truth::Trial;

Impact answer(const Trial& trial) {
    QueryWork work;
    const TriangleTree a(trial.a.mesh(), {.volume = trial.volume}), b(trial.b.mesh(), {.volume = trial.volume});
    return timeOfImpact(a, trial.motionA, b, trial.motionB, work, {.tolerance = trial.tolerance});
}

MovingBodies movingBodies(const Trial& trial) {
    return {trial.a.mesh(), trial.motionA, trial.b.mesh(), trial.motionB};
}

/// What is wrong with an answer; nothing where nothing is. `meets`: they meet then, or have before.
std::string wrong(const Trial& trial, const MovingBodies& bodies, std::optional<double> meets, const Impact& found) {
    std::ostringstream out;
    out.precision(17);
    const double rounding = 1e-13 * trial.extent();
    if (!found.complete) out << "incomplete; ";
    if (meets && !found.hit) out << "no hit, but they meet at " << *meets << "; ";
    if (!found.hit) return out.str();
    if (meets && found.t > *meets) out << "late: at " << found.t << ", they meet at " << *meets << "; ";
    const double near = std::max(trial.tolerance, rounding);
    if (bodies.apart(found.t, near * (1 + 1e-9))) out << "at " << found.t << " all is farther than the tolerance; ";
    if (bodies.apart(found.t, found.distance + rounding))
        out << "farther than " << found.distance << " at " << found.t << "; ";
    if (found.distance > bodies.distanceAtMost(found.t) + rounding)
        out << "nearer than " << found.distance << " at " << found.t << "; ";
    if (std::abs(found.normal.norm() - 1) > 1e-9) out << "a normal of length " << found.normal.norm() << "; ";
    return out.str();
}

void forSeeds(std::uint64_t first, std::uint64_t count, const std::function<void(std::uint64_t)>& trial) {
    if (const char* seed = std::getenv("TESSERA_SEED")) return trial(std::strtoull(seed, nullptr, 10));
    const char* hunt = std::getenv("TESSERA_HUNT");
    count *= hunt ? std::max(1, std::atoi(hunt)) : 1;
    for (std::uint64_t i = 0; i < count; ++i) trial(first + i);
}

/// How sure the truth was.
struct Tally {
    int trials = 0, meet = 0, free = 0, sharp = 0, hits = 0;
    void add(const FirstContact& truth, bool hit) {
        ++trials;
        meet += truth.meetsAt.has_value();
        free += truth.free;
        sharp += truth.meetsAt && *truth.meetsAt - truth.freeUpTo < 1e-9;
        hits += hit;
    }
    void print() const {
        std::printf("%d trials: %d meet (%d known to 1e-9), %d do not, %d left open; %d hits\n", trials, meet, sharp,
                    free, trials - meet - free, hits);
    }
};

std::string nameOfMoves(const testing::TestParamInfo<truth::Moves>& of) {
    constexpr const char* kNames[] = {"Screw", "Both", "Scale", "Stretch", "Orbit", "Arc", "Far"};
    return kNames[static_cast<std::size_t>(of.param)];
}

class FreeStarts : public testing::TestWithParam<truth::Moves> {};

TEST_P(FreeStarts, AreNeverLateAndNoFalseHits) {
    Tally tally;
    forSeeds(1, 60, [&](std::uint64_t seed) {
        const Trial trial = truth::freeTrial(GetParam(), seed);
        const MovingBodies bodies = movingBodies(trial);
        const FirstContact truth = bodies.firstContact();
        const Impact found = answer(trial);
        EXPECT_EQ(wrong(trial, bodies, truth.meetsAt, found), "") << trial.what << ", TESSERA_SEED=" << seed;
        tally.add(truth, found.hit);
    });
    tally.print();
    if (std::getenv("TESSERA_SEED")) return;
    // The oracle has something to say, both ways.
    EXPECT_GT(5 * tally.meet, tally.trials);
    EXPECT_GT(10 * tally.free, tally.trials);
    EXPECT_GE(20 * (tally.meet + tally.free), 19 * tally.trials);
    EXPECT_GE(10 * tally.sharp, 8 * tally.meet);
}

INSTANTIATE_TEST_SUITE_P(Moves, FreeStarts,
                         testing::Values(truth::Moves::kScrew, truth::Moves::kBoth, truth::Moves::kScale,
                                         truth::Moves::kStretch, truth::Moves::kOrbit, truth::Moves::kArc,
                                         truth::Moves::kFar),
                         nameOfMoves);

/// Whatever follows: resting, sliding, parting, turning about the contact.
TEST(TouchingStarts, AreHitsAtZero) {
    forSeeds(1, 3000, [&](std::uint64_t seed) {
        const Trial trial = truth::touchingTrial(seed);
        const Impact found = answer(trial);
        EXPECT_TRUE(found.hit && found.t == 0)
            << trial.what << ": " << found.hit << " at " << found.t << ", TESSERA_SEED=" << seed;
        EXPECT_LE(found.distance, 1e-13 * trial.extent()) << "TESSERA_SEED=" << seed;
    });
}

TEST(NearStarts, AreNeverLateAndNoFalseHits) {
    Tally tally;
    forSeeds(1, 150, [&](std::uint64_t seed) {
        const Trial trial = truth::nearTrial(seed);
        const MovingBodies bodies = movingBodies(trial);
        const FirstContact truth = bodies.firstContact();
        const Impact found = answer(trial);
        EXPECT_EQ(wrong(trial, bodies, truth.meetsAt, found), "") << trial.what << ", TESSERA_SEED=" << seed;
        tally.add(truth, found.hit);
    });
    tally.print();
    if (std::getenv("TESSERA_SEED")) return;
    EXPECT_GT(2 * tally.meet, tally.trials);
    EXPECT_GT(20 * tally.free, tally.trials);
}

/// Grazing, edge along edge, corner on corner, contact at the very end: exact moments.
TEST(StraightWays, AreHitsNoLaterThanTheExactMoment) {
    int hits = 0, within = 0, atStart = 0, atEnd = 0;
    forSeeds(1, 600, [&](std::uint64_t seed) {
        const Trial trial = truth::latticeTrial(seed);
        const std::optional<truth::Rational> exact =
            truth::firstStraightContact(trial.a.mesh(), trial.motionA, trial.b.mesh(), trial.motionB);
        const Impact found = answer(trial);
        const bool late = exact && (!found.hit || truth::Rational(found.t) > *exact);
        EXPECT_FALSE(late) << "they meet at " << *exact << ", found: " << found.hit << " at " << found.t
                           << ", TESSERA_SEED=" << seed;
        EXPECT_EQ(wrong(trial, movingBodies(trial), {}, found), "") << "TESSERA_SEED=" << seed;
        hits += exact.has_value();
        atStart += exact && *exact == 0;
        atEnd += exact && *exact == 1;
        within += exact && *exact > 0 && *exact < 1;
    });
    std::printf("%d meet: %d at the start, %d on the way, %d at the very end\n", hits, atStart, within, atEnd);
    if (std::getenv("TESSERA_SEED")) return;
    EXPECT_GT(within, 100);
    EXPECT_GT(atStart, 20);
    EXPECT_GT(atEnd, 3);
}

/// An oracle that would say yes to anything is none.
TEST(MotionOracle, SaysNoToAnswersThatAreWrong) {
    int hits = 0;
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        const Trial trial = truth::freeTrial(truth::Moves::kBoth, seed);
        const MovingBodies bodies = movingBodies(trial);
        const FirstContact truth = bodies.firstContact();
        const Impact right = answer(trial);
        if (!right.hit || right.t == 0 || !truth.meetsAt) continue;
        ++hits;
        ASSERT_EQ(wrong(trial, bodies, truth.meetsAt, right), "") << seed;
        Impact late = right;
        late.t = *truth.meetsAt + 1e-9;
        EXPECT_NE(wrong(trial, bodies, truth.meetsAt, late), "") << seed;
        Impact missed = right;
        missed.hit = false;
        EXPECT_NE(wrong(trial, bodies, truth.meetsAt, missed), "") << seed;
        Impact far = right;
        far.t = 0;
        EXPECT_NE(wrong(trial, bodies, truth.meetsAt, far), "") << seed;
        Impact elsewhere = right;
        elsewhere.distance += 1e-9;
        EXPECT_NE(wrong(trial, bodies, truth.meetsAt, elsewhere), "") << seed;
    }
    EXPECT_GT(hits, 5);
}

/// Interval against rational arithmetic, where both have an answer: ways without turns.
TEST(MotionOracle, BracketsTheExactMoment) {
    int sharp = 0;
    for (std::uint64_t seed = 1; seed <= 150; ++seed) {
        const Trial trial = truth::latticeTrial(seed);
        const std::optional<truth::Rational> exact =
            truth::firstStraightContact(trial.a.mesh(), trial.motionA, trial.b.mesh(), trial.motionB);
        const FirstContact truth = movingBodies(trial).firstContact();
        EXPECT_FALSE(truth.free && exact) << seed;
        if (truth.meetsAt) {
            ASSERT_TRUE(exact) << seed;
            EXPECT_LE(*exact, truth::Rational(*truth.meetsAt)) << seed;
        }
        if (!exact) continue;
        EXPECT_GE(*exact, truth::Rational(truth.freeUpTo)) << seed;
        sharp += truth.meetsAt && *truth.meetsAt - truth.freeUpTo < 1e-9;
    }
    EXPECT_GT(sharp, 15);
}

}  // namespace
}  // namespace tessera
