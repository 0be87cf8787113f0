/// A file that is read again: what of it gets into a scene that people have changed since.
#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include "tests/support/words/Words.h"
#include "tests/unit/sim/FileAtWork.h"

namespace tessera::test {
namespace {

TEST(ReloadPlan, WhatHasNotChangedCostsNothing) {
    FileAtWork work(kHall);
    const StateHash before = work.scene().stateHash();
    const ReloadPlan plan = work.becomes(kHall);
    EXPECT_TRUE(plan.parts.empty() && plan.notes.empty());
    EXPECT_EQ(work.scene().stateHash(), before);
}

TEST(ReloadPlan, OneMeshIsOneChange) {
    FileAtWork work(kHall);
    const ObjectId shape = work.core("/hall/crane/shape"), material = work.scene().get<Geometry>(shape)->material;
    std::vector<Said> next = kHall;
    next[0].below[0].box = 3;
    const ReloadPlan plan = work.becomes(next);
    EXPECT_EQ(plan.changed, 1u) << "a cube's positions: normals and indices are the same arrays";
    EXPECT_EQ(work.mostInAPart, 1u);
    EXPECT_EQ(work.core("/hall/crane/shape"), shape);
    EXPECT_EQ(work.scene().get<Geometry>(shape)->material, material);
    EXPECT_EQ(plan.arrays.size(), 1u);
    EXPECT_TRUE(plan.arrays[0].resident());
}

TEST(ReloadPlan, WhatAPersonHasMovedStaysWhereTheyPutIt) {
    FileAtWork work(kHall);
    work.set<&Transform::translation>(work.core("/hall/crane"), Vec3d(7, 7, 7));
    std::vector<Said> next = kHall;
    next[0].below[0].rough = 0.25f;
    ReloadPlan plan = work.becomes(next);
    EXPECT_EQ(plan.changed, 1u);
    EXPECT_EQ(plan.kept, 0u) << "the file has not touched it";
    EXPECT_TRUE(plan.notes.empty()) << allNotes(plan);
    next[0].below[0].at = {1, 1, 1};
    next[0].below[1].at = {2, 2, 2};
    plan = work.becomes(next);
    EXPECT_EQ(work.scene().get<Transform>(work.core("/hall/crane"))->translation, Vec3d(7, 7, 7));
    EXPECT_EQ(work.scene().get<Transform>(work.core("/hall/crate"))->translation, Vec3d(2, 2, 2));
    EXPECT_EQ(plan.kept, 1u);
    EXPECT_EQ(allNotes(plan),
              "the Transform of /hall/crane: translation stays as it is here; the file has changed it too\n");
    next[0].below[0].at = {7, 7, 7};
    plan = work.becomes(next);
    EXPECT_TRUE(plan.notes.empty()) << "both say the same now: " << allNotes(plan);
    next[0].below[0].at = {8, 8, 8};
    plan = work.becomes(next);
    EXPECT_EQ(work.scene().get<Transform>(work.core("/hall/crane"))->translation, Vec3d(8, 8, 8))
        << "and the file leads again";
}

TEST(ReloadPlan, HalfOfAMeshIsNone) {
    FileAtWork work(kHall);
    const ObjectId shape = work.core("/hall/crane/shape");
    const MeshArrays other = makeBox(Vec3d(1, 2, 3)).toArrays();
    work.set<&Geometry::positions>(shape, other.positions);
    std::vector<Said> next = kHall;
    next[0].below[0].box = 3;
    next[0].below[0].rough = std::nullopt;  // the Geometry's material
    const ReloadPlan plan = work.becomes(next);
    EXPECT_EQ(work.scene().get<Geometry>(shape)->positions, other.positions);
    EXPECT_TRUE(work.scene().get<Geometry>(shape)->material) << "all of it stays";
    EXPECT_EQ(plan.kept, 2u) << allNotes(plan);
}

TEST(ReloadPlan, SiblingsComeAndGoAndAreKnownByTheirNames) {
    FileAtWork work(kHall);
    const ObjectId crane = work.node("/hall/crane"), lamp = work.node("/hall/lamp"), crate = work.node("/hall/crate");
    work.add("mine", "/hall");
    std::vector<Said> next = kHall;
    next[0].below.insert(next[0].below.begin(), {.name = "door", .box = 1});
    next[0].below.insert(next[0].below.begin() + 3, {.name = "rope"});
    ReloadPlan plan = work.becomes(next);
    EXPECT_EQ(work.below("/hall"), (Names{"door", "crane", "crate", "rope", "lamp", "mine"}));
    EXPECT_EQ(work.node("/hall/crane"), crane);
    EXPECT_EQ(work.node("/hall/lamp"), lamp);
    EXPECT_EQ(plan.objects, 6u) << "two nodes with Transforms, a shape with its node";
    next[0].below.erase(next[0].below.begin() + 1);  // the crane
    plan = work.becomes(next);
    EXPECT_EQ(work.below("/hall"), (Names{"door", "crate", "rope", "lamp", "mine"}));
    EXPECT_EQ(plan.removed, 5u) << "with its Transform, its shape, that one's node, and the Material";
    std::swap(next[0].below[0], next[0].below[1]);
    plan = work.becomes(next);
    EXPECT_EQ(work.below("/hall"), (Names{"crate", "door", "rope", "lamp", "mine"}));
    EXPECT_EQ(work.node("/hall/crate"), crate);
    EXPECT_EQ(plan.objects + plan.removed + plan.changed, 0u);
}

TEST(ReloadPlan, OfEqualNamesWhatSaysTheSameIsTheSame) {
    std::vector<Said> tops = {{.name = "row"}};
    for (int i = 0; i < 5; ++i) tops[0].below.push_back({.name = "seat", .at = {double(i), 0, 0}});
    FileAtWork work(tops);
    const ObjectId second = work.node("/row/seat[1]"), last = work.node("/row/seat[4]");
    work.set<&Transform::scale>(work.core("/row/seat[1]"), Vec3d(2, 2, 2));
    tops[0].below.erase(tops[0].below.begin());
    ReloadPlan plan = work.becomes(tops);
    EXPECT_EQ(work.node("/row/seat[0]"), second);
    EXPECT_EQ(work.scene().get<Transform>(work.core("/row/seat[0]"))->scale, Vec3d(2, 2, 2));
    EXPECT_EQ(plan.removed, 2u);
    EXPECT_EQ(plan.changed, 0u);
    tops[0].below[3].at = {9, 9, 9};
    plan = work.becomes(tops);
    EXPECT_EQ(work.node("/row/seat[3]"), last) << "the others say the same, so it is this one";
    EXPECT_EQ(plan.changed, 1u);
}

TEST(ReloadPlan, WhatPeopleRemovedStaysRemoved) {
    FileAtWork work(kHall);
    work.remove("/hall/crane");
    std::vector<Said> next = kHall;
    next[0].below[0].at = {5, 5, 5};
    next[0].below[0].below = {{.name = "hook"}};
    const ReloadPlan plan = work.becomes(next);
    EXPECT_EQ(work.below("/hall"), (Names{"crate", "lamp"}));
    EXPECT_WORDS(allNotes(plan));
    EXPECT_EQ(plan.objects, 0u);
}

/// An undo brings it as it was before the file changed.
TEST(ReloadPlan, WhatIsRemovedAndBroughtBackIsAsTheFileHasItAfterAReload) {
    for (const bool twice : {false, true}) {
        FileAtWork work(kHall);
        const ObjectId crane = work.node("/hall/crane");
        ChangeList back = work.removeForNow("/hall/crane");
        std::vector<Said> next = kHall;
        next[0].below[0].at = {5, 5, 5};
        next[0].below[0].box = 3;
        next[0].below[0].rough = 0.25f;
        next[0].below[0].below = {{.name = "hook", .at = {1, 2, 3}, .box = 1, .below = {{.name = "eye"}}}};
        (void)work.becomes(next);
        if (twice) {
            next[0].below[0].at = {6, 6, 6};
            next[0].below[1].at = {2, 2, 2};
            const ReloadPlan plan = work.becomes(next);
            EXPECT_EQ(plan.changed, 1u);
            EXPECT_EQ(plan.kept, 0u);
        }
        work.bringBack(std::move(back));
        ASSERT_EQ(work.node("/hall/crane"), crane);
        EXPECT_EQ(work.scene().get<Transform>(work.core("/hall/crane"))->translation, Vec3d(1, 0, 0)) << "as it went";
        const ReloadPlan plan = work.becomes(next);
        EXPECT_EQ(plan.kept, 0u) << allNotes(plan);
        FileAtWork fresh(next);
        EXPECT_EQ(work.node("/hall/crane"), crane);
        EXPECT_EQ(work.below("/hall"), fresh.below("/hall"));
        EXPECT_EQ(work.below("/hall/crane"), fresh.below("/hall/crane"));
        EXPECT_TRUE(work.node("/hall/crane/hook/eye"));
        EXPECT_EQ(work.scene().objectCount(), fresh.scene().objectCount());
        EXPECT_EQ(work.scene().get<Transform>(work.core("/hall/crane"))->translation, next[0].below[0].at);
        EXPECT_EQ(work.scene().get<Transform>(work.core("/hall/crane/hook"))->translation, Vec3d(1, 2, 3));
        const Geometry& shape = *work.scene().get<Geometry>(work.core("/hall/crane/shape"));
        EXPECT_EQ(shape.positions, makeBox(Vec3d::Constant(3)).toArrays().positions);
        EXPECT_EQ(work.scene().get<Material>(shape.material)->roughness, 0.25f);
        const ReloadPlan more = work.becomes(next);
        EXPECT_TRUE(more.parts.empty() && more.notes.empty()) << allNotes(more);
    }
}

TEST(ReloadPlan, WhatIsRemovedAndBroughtBackGoesWithAReloadOfAFileThatHasItNoMore) {
    FileAtWork work(kHall);
    ChangeList back = work.removeForNow("/hall/crane");
    std::vector<Said> next = kHall;
    next[0].below.erase(next[0].below.begin());
    (void)work.becomes(next);
    (void)work.becomes(next);
    work.bringBack(std::move(back));
    const ReloadPlan plan = work.becomes(next);
    EXPECT_EQ(work.below("/hall"), (Names{"crate", "lamp"})) << allNotes(plan);
    EXPECT_EQ(work.scene().objectCount(), FileAtWork(next).scene().objectCount());
}

/// Its core and its material are others in the file by then.
TEST(ReloadPlan, WhatIsBroughtBackLeavesNothingBehindOfWhatItWas) {
    FileAtWork work(kHall);
    ChangeList back = work.removeForNow("/hall/crane/shape");
    std::vector<Said> next = kHall;
    next[0].below[0].rough.reset();
    (void)work.becomes(next);
    work.bringBack(std::move(back));
    (void)work.becomes(next);
    EXPECT_FALSE(work.scene().get<Geometry>(work.core("/hall/crane/shape"))->material);
    EXPECT_EQ(work.scene().objectCount(), FileAtWork(next).scene().objectCount());
}

/// What is gone from file and scene waits, in case that it comes back; but not without end.
TEST(ReloadPlan, WhatWaitsToComeBackIsBounded) {
    const auto hallOf = [](int round) {
        std::vector<Said> tops = {{.name = "hall"}};
        for (int i = 0; i < 500; ++i)
            tops[0].below.push_back({.name = "part" + std::to_string(round) + "_" + std::to_string(i)});
        return tops;
    };
    FileAtWork work(hallOf(0));
    std::vector<std::size_t> bytes;
    for (int round = 1; round <= 12; ++round) {
        for (int i = 0; i < 500; ++i) work.remove("/hall/part" + std::to_string(round - 1) + "_" + std::to_string(i));
        (void)work.becomes(hallOf(round));
        bytes.push_back(work.held().bytes);
    }
    EXPECT_EQ(work.below("/hall").size(), 500u);
    EXPECT_LT(bytes.back(), bytes[3] + bytes[3] / 10);
}

TEST(ReloadPlan, WhatPeoplePutBelowANodeKeepsIt) {
    FileAtWork work(kHall);
    work.add("mine", "/hall/crane/shape");
    work.set<&Transform::translation>(work.core("/hall/crate"), Vec3d(7, 7, 7));
    std::vector<Said> next = kHall;
    next[0].below.erase(next[0].below.begin(), next[0].below.begin() + 2);
    const ReloadPlan plan = work.becomes(next);
    EXPECT_EQ(work.below("/hall"), (Names{"crane", "lamp"}));
    EXPECT_TRUE(work.node("/hall/crane/shape/mine"));
    EXPECT_WORDS(allNotes(plan));
}

TEST(ReloadPlan, WhatComesBackInTheFileSaysWhatItSaidBefore) {
    FileAtWork work(kHall);
    std::vector<Said> next = kHall;
    next[0].below.erase(next[0].below.begin());
    next[0].below[0].at = {4, 4, 4};
    (void)work.becomes(next);
    (void)work.becomes(kHall);
    FileAtWork fresh(kHall);
    EXPECT_EQ(work.below("/hall"), fresh.below("/hall"));
    EXPECT_EQ(work.scene().objectCount(), fresh.scene().objectCount());
    EXPECT_EQ(work.scene().get<Transform>(work.core("/hall/crate"))->translation, Vec3d(2, 0, 0));
}

TEST(ReloadPlan, WhatTheFileHandsToAnotherGoesWhereThatOneWasRemoved) {
    const std::vector<Said> before = {{.name = "a", .box = 1, .rough = 0.5f}, {.name = "b", .box = 2}};
    FileAtWork work(before);
    const ObjectId material = work.scene().get<Geometry>(work.core("/a/shape"))->material;
    work.remove("/b");
    (void)work.becomes({{.name = "a", .box = 1}, {.name = "b", .box = 2, .rough = 0.5f}});
    EXPECT_FALSE(work.scene().get<Geometry>(work.core("/a/shape"))->material);
    EXPECT_FALSE(work.scene().find(material)) << "nobody uses it any more";
}

TEST(ReloadPlan, WhatIsChangedWhileItIsPlannedStays) {
    FileAtWork work(kHall);
    std::vector<Said> next = kHall;
    next[0].below[0].at = {5, 5, 5};
    next[0].below[1].at = {6, 6, 6};
    const ReloadPlan plan =
        work.becomes(next, {}, [&] { work.set<&Transform::translation>(work.core("/hall/crane"), Vec3d(7, 7, 7)); });
    EXPECT_EQ(work.scene().get<Transform>(work.core("/hall/crane"))->translation, Vec3d(7, 7, 7));
    EXPECT_EQ(work.scene().get<Transform>(work.core("/hall/crate"))->translation, Vec3d(6, 6, 6));
    EXPECT_EQ(plan.kept, 1u);
    EXPECT_EQ(plan.changed, 1u);
    EXPECT_WORDS(allNotes(plan));
}

/// What the figures in server/sim/reload/README.md are measured by: --gtest_output=xml has them.
TEST(ReloadCost, OneMeshOfManyNodesIsOneChangeInAList) {
    for (const int nodes : {1'000, 100'000}) {
        std::vector<Said> tops = {{.name = "plant"}};
        for (int i = 0; i < nodes / 102; ++i) {
            Said hall{.name = "hall" + std::to_string(i), .at = {double(i), 0, 0}, .box = 1, .rough = 0.5f};
            for (int k = 0; k < 100; ++k)
                hall.below.push_back({.name = "part" + std::to_string(k), .at = {0, double(k), 0}});
            tops[0].below.push_back(std::move(hall));
        }
        FileAtWork work(tops);
        tops[0].below[3].box = 2;
        ChangeList list = fileOf(tops);
        const auto read = std::chrono::steady_clock::now();
        HeldFile next = *HeldFile::of(list);
        const auto former = std::make_shared<const HeldFile>(work.held());
        const FileChange change(former, std::move(list), std::move(next));
        const auto compared = std::chrono::steady_clock::now();
        Expected<ReloadPlan> plan = planReload(work.scene(), change, kRootNode);
        const auto planned = std::chrono::steady_clock::now();
        ASSERT_TRUE(plan);
        ASSERT_EQ(plan->parts.size(), 1u);
        leaveOutWhatChanged(work.scene(), plan->parts[0], *plan);
        const auto looked = std::chrono::steady_clock::now();
        EXPECT_EQ(plan->parts[0].list.changeCount(), 1u);
        const auto note = [&](const char* what, auto from, auto to) {
            RecordProperty(std::to_string(nodes) + " nodes, " + what + ", us",
                           static_cast<int>(std::chrono::duration<double, std::micro>(to - from).count()));
        };
        note("compare beside frames", read, compared);
        note("plan beside frames", compared, planned);
        note("last look in the frame", planned, looked);
        RecordProperty(std::to_string(nodes) + " nodes, KiB held", static_cast<int>(former->bytes >> 10));
        EXPECT_LT(former->bytes, static_cast<std::size_t>(nodes) * 512);
    }
}

}  // namespace
}  // namespace tessera::test
