/// What the scene tells those who do not follow it: by name, and page by page while it changes.
#include "common/cores/Animation.h"
#include "server/sim/desk/SceneAnswers.h"

#include <gtest/gtest.h>

#include <set>

#include "common/application/SceneExcerpt.h"
#include "common/codec/ChangeCodec.h"
#include "common/scene/FieldTable.h"
#include "server/sim/frame/Simulation.h"
#include "tests/support/words/Words.h"
#include "tests/unit/scene/SceneEdits.h"
#include "tests/unit/sim/RandomTree.h"
#include "tests/unit/sim/SceneForTests.h"

namespace tessera {
namespace {

using test::RandomTree;

std::vector<ObjectId> idsOf(const answer::TreePage& page) {
    std::vector<ObjectId> ids;
    for (const TreeNode& node : page.nodes) ids.push_back(node.node);
    return ids;
}

/// All pages of a scene that stands still.
std::vector<ObjectId> walked(const Aspect& scene, TreeWish wanted, const PageLimits& limits) {
    std::vector<ObjectId> all;
    do {
        const Expected<answer::TreePage> page = treePage(scene, wanted, limits);
        EXPECT_TRUE(page);
        if (!page) return all;
        EXPECT_LE(page->nodes.size(), limits.maxTold);
        for (const ObjectId id : idsOf(*page)) all.push_back(id);
        wanted.after = page->next;
    } while (!wanted.after.empty());
    return all;
}

void addBelow(const Aspect& scene, ObjectId node, std::uint32_t levels, std::vector<ObjectId>& ids) {
    ids.push_back(node);
    if (levels == 0) return;
    for (const ObjectId child : scene.get<Node>(node)->children) addBelow(scene, child, levels - 1, ids);
}
std::vector<ObjectId> inOrder(const Aspect& scene, ObjectId top, std::uint32_t levels = TreeWish::kAllLevels) {
    std::vector<ObjectId> ids;
    addBelow(scene, top, levels, ids);
    return ids;
}

TEST(SceneAnswers, WhatIsFoundHasItsPathUnlessThatWouldTakeTooLong) {
    const Aspect scene = hall();
    const Expected<answer::FoundPage> page = foundPage(scene, {.expression = "/hall/*"});
    ASSERT_TRUE(page);
    ASSERT_EQ(page->nodes.size(), 2u);
    EXPECT_EQ(page->nodes[0].path, "/hall/crane");
    EXPECT_EQ(page->nodes[0].coreType, typeOf<Transform>());
    EXPECT_EQ(page->nodes[1].path, "/hall/hook");
    EXPECT_TRUE(page->next.empty());
    EXPECT_EQ(foundPage(scene, {.expression = "/hall/*"}, {.maxSiblings = 2})->nodes[1].path, "#4")
        << "two siblings, and one above";
    EXPECT_EQ(foundPage(scene, {.expression = "/hall/*", .pageSize = 1})->nodes.size(), 1u);
    EXPECT_EQ(foundPage(scene, {.expression = "/hall["}).error().code, ErrorCode::kUsage);
    EXPECT_EQ(foundPage(scene, {.expression = "*", .node = ObjectId(5)}).error().code, ErrorCode::kNotFound);
}

TEST(SceneAnswers, ObjectsAreToldByPathAndByNumber) {
    const Aspect scene = hall();
    const answer::Objects told =
        describe(scene, {.names = {"/hall/crane", "#7", "/hall/crone", "#99", "#x", ""}, .content = true}).value();
    ASSERT_EQ(told.objects.size(), 6u);
    EXPECT_EQ(told.objects[0], (ObjectInfo{.id = ObjectId(3),
                                           .type = typeOf<Node>(),
                                           .parent = ObjectId(2),
                                           .core = ObjectId(5),
                                           .coreType = typeOf<Transform>(),
                                           .movable = ObjectId(3),
                                           .path = "/hall/crane"}));
    EXPECT_EQ(told.objects[1].type, typeOf<Material>());
    EXPECT_EQ(told.objects[1].path, "#7");
    for (std::size_t i = 2; i < 6; ++i) EXPECT_FALSE(told.objects[i].id) << i;
    EXPECT_EQ(told.objects[2].path, findNode(scene, "/hall/crone").error().message);
    EXPECT_WORDS(told.objects[4].path);

    SceneExcerpt excerpt;
    ASSERT_TRUE(excerpt.add(told.content));
    EXPECT_EQ(excerpt.coreOf(ObjectId(3)).as<Transform>()->translation, Vec3d(1, 2, 3));
    EXPECT_TRUE(excerpt.get<Material>(ObjectId(7)));
    EXPECT_FALSE(excerpt.find(ObjectId(4))) << "nobody asked for it";
    EXPECT_TRUE(describe(scene, {.names = {"/hall"}})->content.empty());
    EXPECT_TRUE(describe(scene, {.names = {"/hall"}, .paths = false})->objects[0].path.empty());
}

TEST(SceneAnswers, PlacesAreThoseInTheWorld) {
    test::ListMaker make;
    const ObjectId turned = make.transform(Vec3d::Zero());
    const double half = std::sqrt(0.5);  // a quarter of a turn about y: x leads to -z
    make.builder.set(turned, typeOf<Transform>(), fieldId<&Transform::rotation>, toValue(Quatd(half, 0, half, 0)));
    make.builder.set(turned, typeOf<Transform>(), fieldId<&Transform::scale>, toValue(Vec3d(2, 1, 1)));
    const ObjectId above = make.node("above", kRootNode, turned);
    (void)make.node("below", above, make.transform(Vec3d(3, 0, 0)));
    Simulation simulation;
    std::vector<ChangeList> lists;
    lists.push_back(make.builder.take());
    ASSERT_TRUE(simulation.load(std::move(lists)));
    const ObjectsWish wish{.names = {"/above/below", "/nowhere", "/above"}, .places = true};
    const answer::Objects told = describe(simulation.scene(), wish).value();
    ASSERT_EQ(told.places.size(), 3u);
    EXPECT_TRUE(told.places[0].xAxis.isApprox(Vec3d(0, 0, -2)));
    EXPECT_TRUE(told.places[0].origin.isApprox(Vec3d(0, 0, -6)));
    EXPECT_EQ(told.places[1], PlaceValue());
    EXPECT_TRUE(told.places[2].zAxis.isApprox(Vec3d(1, 0, 0)));
    EXPECT_TRUE(describe(simulation.scene(), {.names = {"/above"}})->places.empty());
    EXPECT_FALSE(describe(simulation.scene(), wish, {.maxLooks = 2})) << "the way up is looked at, too";
}

TEST(SceneAnswers, WhatWouldBeTooMuchToLookAtIsRefused) {
    test::ListMaker make;
    const ObjectId hall = make.node("hall", kRootNode);
    for (int i = 0; i < 100; ++i) make.node("n" + std::to_string(i), hall);
    Simulation simulation;
    std::vector<ChangeList> lists;
    lists.push_back(make.builder.take());
    ASSERT_TRUE(simulation.load(std::move(lists)));
    const Aspect& scene = simulation.scene();
    const auto looks = [&](const ObjectsWish& wish, std::size_t most) {
        return describe(scene, wish, {.maxLooks = most}).has_value();
    };
    // On the way there, and beside it for its path.
    EXPECT_TRUE(looks({.names = {"/hall/n5"}}, 210));
    EXPECT_FALSE(looks({.names = {"/hall/n5"}}, 200));
    EXPECT_TRUE(looks({.names = {"/hall/n5"}, .paths = false}, 110));
    EXPECT_FALSE(looks({.names = {"/hall/n5"}, .paths = false}, 100));
    EXPECT_TRUE(looks({.names = {"#5"}, .paths = false}, 10)) << "what is named by its number has none";
    // The second time they are looked at once and for all.
    EXPECT_TRUE(looks({.names = std::vector<std::string>(50, "/hall/n5"), .paths = false}, 500));
    // What is not there is told where it should be.
    EXPECT_FALSE(looks({.names = {"/hall/n5/x"}}, 220));
    EXPECT_TRUE(describe(scene, {.names = {"/hall/n5/x"}}, {.maxLooks = 5'000}));
    EXPECT_FALSE(describe(scene, {.names = {"#2"}, .content = true}, {.maxBytes = 8}));
    EXPECT_FALSE(treePage(scene, {}, {.maxObjectBytes = 8}));
    EXPECT_EQ(foundPage(scene, {.expression = "/hall/*"}, {.maxWork = 100})->next.empty(), false);
}

TEST(SceneAnswers, PathsThatAreTooLongAreNumbers) {
    test::ListMaker make;
    ObjectId above = kRootNode;
    for (int i = 0; i < 3; ++i) above = make.node(std::string(2'000, 'x'), above);
    Simulation simulation;
    std::vector<ChangeList> lists;
    lists.push_back(make.builder.take());
    ASSERT_TRUE(simulation.load(std::move(lists)));
    const answer::Objects told = describe(simulation.scene(), {.names = {"#3", "#4"}}).value();
    EXPECT_EQ(told.objects[0].path.size(), 4'002u);
    EXPECT_EQ(told.objects[1].path, "#4");
    EXPECT_TRUE(decodeAnswer(encodeAnswer(ApplicationAnswer(told))));
}

TEST(SceneAnswers, PagesTellEveryNodeOnceWhateverTheirSize) {
    for (int seed = 1; seed <= 20; ++seed) {
        Random random(static_cast<std::uint64_t>(seed));
        RandomTree tree(random);
        for (int i = 0; i < 150; ++i) (void)tree.next();
        const Aspect& scene = tree.scene();
        const std::vector<ObjectId> all = inOrder(scene, kRootNode);
        for (const std::size_t size : {1u, 2u, 3u, 7u, 1000u})
            EXPECT_EQ(walked(scene, {}, {.maxTold = size}), all) << "seed " << seed << ", pages of " << size;
        for (const std::size_t looked : {2u, 5u})
            EXPECT_EQ(walked(scene, {}, {.maxLookedAt = looked}), all) << "seed " << seed;
        for (const std::uint32_t levels : {0u, 1u, 2u})
            EXPECT_EQ(walked(scene, {.levels = levels}, {.maxTold = 2}), inOrder(scene, kRootNode, levels));
        EXPECT_EQ(walked(scene, {}, {.maxBytes = 1}), all) << "one node goes beyond the bytes";
    }
}

TEST(SceneAnswers, WhoLooksForCoresIsToldOfTheirNodesAlone) {
    std::size_t all = 0;
    for (std::uint64_t seed = 1; seed <= 30; ++seed) {
        Random random(seed);
        RandomTree tree(random);
        for (int i = 0; i < 150; ++i) (void)tree.next();
        const Aspect& scene = tree.scene();
        std::vector<ObjectId> moving, held;
        ObjectId core;
        for (const ObjectId id : inOrder(scene, kRootNode)) {
            if (!scene.coreOf<Transform>(*scene.get<Node>(id))) continue;
            moving.push_back(id);
            core = scene.get<Node>(id)->core;
        }
        all += moving.size();
        EXPECT_EQ(walked(scene, {.coreType = typeOf<Transform>()}, {.maxTold = 2, .maxLookedAt = 5}), moving);
        if (moving.empty()) continue;
        for (const ObjectId id : moving)
            if (scene.get<Node>(id)->core == core) held.push_back(id);
        EXPECT_EQ(walked(scene, {.cores = {core}}, {.maxLookedAt = 3}), held);
    }
    EXPECT_GT(all, 15u) << "there was something to find";
}

/// What stays in its place is told, whatever becomes of the rest between two pages, and the pages come to an end.
TEST(SceneAnswers, PagesGoOnWhileTheTreeChanges) {
    std::size_t stoodStill = 0;
    for (int seed = 1; seed <= 60; ++seed) {
        Random random(static_cast<std::uint64_t>(seed));
        RandomTree tree(random);
        for (int i = 0; i < 150; ++i) (void)tree.next();
        std::set<ObjectId> stayed;
        for (const ObjectId id : inOrder(tree.scene(), kRootNode)) stayed.insert(id);
        const auto touched = [&](const ChangeList& list) {
            for (const Placement& placement : list.placements) stayed.erase(placement.node);
        };
        SceneExcerpt excerpt;
        TreeWish wanted;
        std::size_t pages = 0;
        do {
            const Expected<answer::TreePage> page = treePage(tree.scene(), wanted, {.maxTold = 3});
            ASSERT_TRUE(page) << page.error().message;
            ASSERT_TRUE(excerpt.add(*page)) << "seed " << seed;
            wanted.after = page->next;
            // Fewer changes than a page tells: the walk gains on them.
            if (pages++ % 2 == 0)
                if (const ChangeListPtr list = tree.next()) touched(*list);
        } while (!wanted.after.empty() && pages < 10'000);
        ASSERT_TRUE(wanted.after.empty()) << "seed " << seed;
        // Below what has moved nothing has stayed where it was.
        for (const ObjectId id : inOrder(tree.scene(), kRootNode)) {
            bool still = true;
            for (ObjectId at = id; at != kRootNode && still; at = tree.scene().get<Node>(at)->parent)
                still = stayed.contains(at);
            if (still) {
                ++stoodStill;
                EXPECT_TRUE(excerpt.get<Node>(id)) << "seed " << seed << ", node " << id.value;
            }
        }
        std::set<ObjectId> once;
        for (const TreeNode& node : excerpt.nodes()) EXPECT_TRUE(once.insert(node.node).second) << "told twice";
    }
    EXPECT_GT(stoodStill, 200u) << "there was something to lose";
}

TEST(SceneAnswers, WhatMakesNoSenseIsRefusedAndStopsNothing) {
    const Aspect scene = hall();
    EXPECT_EQ(treePage(scene, {.node = ObjectId(99)}).error().code, ErrorCode::kNotFound);
    EXPECT_EQ(treePage(scene, {.node = ObjectId(7)}).error().code, ErrorCode::kNotFound) << "a material has no tree";
    EXPECT_EQ(treePage(scene, {.node = ObjectId(2), .after = {ObjectId(1)}}).error().code, ErrorCode::kBadInput);
    // A way that never was: on from where it ends in the tree.
    for (const std::vector<ObjectId>& way :
         {std::vector{ObjectId(1), ObjectId(4)}, {ObjectId(1), ObjectId(7)}, {ObjectId(1), ObjectId(1)}}) {
        const Expected<answer::TreePage> page = treePage(scene, {.after = way});
        ASSERT_TRUE(page);
        EXPECT_EQ(idsOf(*page), (std::vector{ObjectId(2), ObjectId(3), ObjectId(4)}));
    }
    EXPECT_TRUE(treePage(scene, {.levels = 1, .after = {ObjectId(1), ObjectId(2), ObjectId(3)}})->nodes.empty());
}

/// The work of a page does not grow with the scene: told and looked at are counted, not timed.
TEST(SceneAnswers, APageOfALargeSceneIsAsLargeAsOneOfASmall) {
    Aspect scene;
    Edits edits;
    for (std::uint64_t i = 0; i < 20'000; ++i) edits.node(i + 2, "row");
    mustApply(scene, edits.take());
    const PageLimits limits;
    const Expected<answer::TreePage> first = treePage(scene, {}, limits);
    ASSERT_TRUE(first);
    EXPECT_EQ(first->nodes.size(), limits.maxTold);
    EXPECT_LT(encodeAnswer(*first).size(), limits.maxBytes);
    EXPECT_EQ(treePage(scene, {.after = first->next}, limits)->nodes.front().node, ObjectId(2 + limits.maxTold - 1));
    const Expected<answer::TreePage> nothing = treePage(scene, {.coreType = typeOf<Interest>()}, limits);
    EXPECT_TRUE(nothing->nodes.empty());
    EXPECT_FALSE(nothing->next.empty()) << "it stopped looking, and is not at the end";
}

TEST(SceneAnswers, WhatPlaysIsToldWithItsLengthWhereItsTypeIsAskedFor) {
    Aspect scene;
    Edits edits;
    const auto doubles = [](std::vector<double> numbers) { return Blob::of(std::span<const double>(numbers)); };
    edits.node(2, "take")
        .core<Animation>(3, 2)
        .node(4, "motion")
        .core<Motion>(5, 4)
        .node(8, "empty")
        .core<Animation>(9, 8);
    edits.core<KeyFrames>(6).core<KeyFrames>(7);
    setField<&KeyFrames::times>(edits, ObjectId(6), doubles({0, 2.5}));
    setField<&KeyFrames::times>(edits, ObjectId(7), doubles({1.25}));
    setField<&Animation::channels>(edits, ObjectId(3), RefList{ObjectId(6), ObjectId(7)});
    std::vector<double> keys(22, 0.0);
    keys[11] = 4;
    setField<&Motion::keys>(edits, ObjectId(5), doubles(keys));
    mustApply(scene, edits.take());
    const Expected<answer::TreePage> animations = treePage(scene, {.coreType = typeOf<Animation>()});
    EXPECT_EQ(animations->lengths, (std::vector{PlayLength{ObjectId(3), 2.5}}))
        << "and nothing of the one without keys";
    EXPECT_EQ(treePage(scene, {.coreType = typeOf<Motion>()})->lengths, (std::vector{PlayLength{ObjectId(5), 4.0}}));
    EXPECT_TRUE(treePage(scene, {})->lengths.empty()) << "nobody asked";
    SceneExcerpt excerpt;
    ASSERT_TRUE(excerpt.add(*animations));
    EXPECT_EQ(excerpt.lengthOf(ObjectId(3)), 2.5);
    EXPECT_EQ(excerpt.lengthOf(ObjectId(9)), std::nullopt);
}

TEST(SceneAnswers, AnExcerptRefusesWhatIsNoScene) {
    SceneExcerpt excerpt;
    EXPECT_FALSE(excerpt.add(asBytes("no list at all")));
    ChangeListBuilder odd;
    odd.create(ObjectId(3), ObjectType(60'000));
    EXPECT_FALSE(excerpt.add(encodeChangeList(odd.take())));
    odd.set(ObjectId(4), typeOf<Transform>(), fieldId<&Transform::translation>, toValue(Vec3d(1, 2, 3)));
    EXPECT_FALSE(excerpt.add(encodeChangeList(odd.take()))) << "a field of nothing";
    odd.create(ObjectId(4), typeOf<Material>());
    odd.set(ObjectId(4), typeOf<Transform>(), fieldId<&Transform::translation>, toValue(Vec3d(1, 2, 3)));
    EXPECT_FALSE(excerpt.add(encodeChangeList(odd.take()))) << "a field of another type";
    answer::TreePage page;
    page.nodes.push_back({ObjectId(9), ObjectId(1), 0});
    EXPECT_FALSE(excerpt.add(page)) << "a node without a word about it";
    // Two nodes, each below the other: a tree all the same.
    odd.create(ObjectId(11), typeOf<Node>());
    odd.create(ObjectId(12), typeOf<Node>());
    page = {.nodes = {{ObjectId(11), ObjectId(12), 1}, {ObjectId(12), ObjectId(11), 1}}};
    page.content = encodeChangeList(odd.take());
    ASSERT_TRUE(excerpt.add(page));
    EXPECT_TRUE(excerpt.get<Node>(ObjectId(12))->children.empty());
}

}  // namespace
}  // namespace tessera
