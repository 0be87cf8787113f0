/// Whatever is done to free bodies, in all pairs of states.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tests/unit/bodies/Bin.h"

namespace tessera::test {
namespace {

constexpr std::size_t kEditsOfARun = 1000;

std::size_t runs(std::size_t usual) {
    const char* const given = std::getenv("TESSERA_RUNS");
    return given ? std::strtoull(given, nullptr, 10) : usual;
}

/// Whether numbers there tell a body's parts apart: beyond, rounding decides who touches.
bool isNear(const Contact& contact) {
    return contact.point.cwiseAbs().maxCoeff() < 1e9;
}

/// Pairs that touch, all or where they stand: not at what stopped them on their way there.
std::set<std::string> touching(const StepResult& result, bool whereTheyStand) {
    std::set<std::string> out;
    for (const Contact& contact : result.contacts)
        if (isNear(contact) && (contact.time == 1 || !whereTheyStand))
            out.insert(fmt::format("{} {}", contact.objectA.value, contact.objectB.value));
    return out;
}

/// Returns all of `those` that is not in `others`.
std::string without(const std::set<std::string>& those, const std::set<std::string>& others) {
    std::vector<std::string> left;
    std::ranges::set_difference(those, others, std::back_inserter(left));
    return fmt::format("{}", fmt::join(left, ", "));
}

/// Contacts where all stands are those that a pipeline finds which sees the scene for the first time.
void expectContactsOfANewPipeline(Bin& bin) {
    const StepResult now = bin.simulation().step(true, {}).collision;
    CollisionPipeline pipeline(bin.limits());
    pipeline.sceneChanged(bin.scene(), nullptr);
    const StepResult fresh = pipeline.step(bin.scene(), {}, {}, 0);
    EXPECT_EQ(now.counters.contactsLeftOut + fresh.counters.contactsLeftOut, 0u);
    EXPECT_EQ(without(touching(fresh, true), touching(now, false)), "") << "touch in a pipeline that is new to them";
    EXPECT_EQ(without(touching(now, true), touching(fresh, true)), "") << "do not touch in a new pipeline";
}

/// Runs of 1000 random edits. Some seeds have a twin of two threads, some a twin that looks at all bodies anew in every
/// frame: both are one scene, to the bit. In the end a pipeline that sees the scene for the first time finds the same
/// contacts. The long form has TESSERA_RUNS=300.
TEST(Bin, LivesThroughRandomEditsInAllPairsOfStates) {
    std::size_t edits = 0, refused = 0, asleep = 0, frames = 0;
    Bin::Meetings meetings;
    forSeeds(runs(2), [&](Random& random) {
        const std::uint64_t seed = random();
        Bin bin(seed);
        std::optional<Bin> twin;
        const std::size_t kind = below(random, 3);
        if (kind == 1) twin.emplace(seed, BinOptions{.threads = 2});
        if (kind == 2) twin.emplace(seed, BinOptions{.lookAtAll = true});
        for (int frame = 0; bin.edits() < kEditsOfARun; ++frame) {
            SCOPED_TRACE("frame " + std::to_string(frame));
            const FrameResult mine = bin.next();
            bin.expectSound();
            if (twin) {
                const FrameResult other = twin->next();
                EXPECT_EQ(bin.scene().stateHash(), twin->scene().stateHash());
                EXPECT_EQ(mine.collision.counters.asleep, other.collision.counters.asleep);
            }
            if (testing::Test::HasFailure()) return;
            asleep += mine.collision.counters.asleep > 5;
            ++frames;
        }
        expectContactsOfANewPipeline(bin);
        edits += bin.edits();
        refused += bin.refused();
        for (const auto& [pair, count] : bin.meetings()) meetings[pair] += count;
    });
    testing::Test::RecordProperty("edits", static_cast<int>(edits));
    testing::Test::RecordProperty("frames", static_cast<int>(frames));
    testing::Test::RecordProperty("refused", static_cast<int>(refused));
    testing::Test::RecordProperty("asleep", static_cast<int>(asleep));
    testing::Test::RecordProperty("pairs", static_cast<int>(meetings.size()));
    if (std::getenv("TESSERA_SEED") || testing::Test::HasFailure()) return;
    EXPECT_LT(3 * refused, edits) << "edits must be made for this to say anything: " << refused << " of " << edits;
    EXPECT_GT(20 * asleep, frames) << "frames in which bodies sleep";
    EXPECT_GE(meetings.size() + 4, kBodyStates * (kBodyStates + 1) / 2) << "pairs of states";
}

/// In this run motions are stopped at their very end, far from where their bodies stay.
TEST(Bin, WhatStoppedAMotionAtItsEndIsNoContactWhereThingsStand) {
    Random random(191);
    Bin bin(random());
    while (bin.edits() < kEditsOfARun && !testing::Test::HasFailure()) (void)bin.next();
    expectContactsOfANewPipeline(bin);
}

}  // namespace
}  // namespace tessera::test
