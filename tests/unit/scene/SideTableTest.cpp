#include "common/scene/SideTable.h"

#include <map>

#include "tests/property/Seeds.h"
#include "tests/unit/scene/SceneEdits.h"

namespace tessera {
namespace {

TEST(SideTable, DataComesChangesAndGoesWithItsObject) {
    Aspect scene = hall();
    std::vector<std::string> told;
    const auto name = [](const char* what, ObjectId id) { return std::string(what) + " " + std::to_string(id.value); };
    SideTable<std::string> names(
        {.created = [&](ObjectId, const Object& object) -> std::optional<std::string> {
             const Node* node = object.as<Node>();
             return node ? std::optional(node->name) : std::nullopt;
         },
         .changed = [&](ObjectId id,
                        std::string& data) { told.push_back(name("changed", id)), data = scene.get<Node>(id)->name; },
         .destroyed = [&](ObjectId id, std::string data) { told.push_back(name("destroyed", id) + " " + data); },
         .effects = Effect::kName});
    names.lookAnew(scene);
    EXPECT_EQ(names.size(), 4u);
    EXPECT_EQ(*names.find(ObjectId(3)), "crane");
    EXPECT_EQ(names.find(ObjectId(5)), nullptr) << "no node";
    Edits edits;
    edits.node(9, "new")
        .value<Node>(3, fieldId<&Node::name>, toValue(std::string("lift")))
        .value<Node>(4, fieldId<&Node::levels>, FieldValue(std::int64_t{1}));
    edits.detach(ObjectId(4));
    ChangeList list = edits.take();
    mustApply(scene, list);
    names.follow(scene, list);
    EXPECT_EQ(told, (std::vector<std::string>{"changed 3"}))
        << "hook's name is as it was, and who comes is told of once";
    EXPECT_EQ(*names.find(ObjectId(9)), "new");
    EXPECT_EQ(*names.find(ObjectId(3)), "lift");
    Edits gone;
    gone.gone(4);
    list = gone.take();
    mustApply(scene, list);
    names.follow(scene, list);
    EXPECT_EQ(told.back(), "destroyed 4 hook");
    EXPECT_EQ(names.find(ObjectId(4)), nullptr);
    EXPECT_EQ(*names.detach(ObjectId(3)), "lift");
    EXPECT_EQ(names.detach(ObjectId(3)), std::nullopt);
    names.attach(ObjectId(5), "by hand") += "!";
    EXPECT_EQ(*names.find(ObjectId(5)), "by hand!");
}

TEST(SideTable, OverRandomHistoriesIsAsTheScene) {
    forSeeds(50, [](Random& random) {
        Aspect scene;
        std::map<ObjectId, std::string> alive;
        std::size_t created = 0, destroyed = 0;
        SideTable<std::string> table(
            {.created =
                 [&](ObjectId, const Object& object) {
                     return ++created, std::optional(object.as<Node>() ? object.as<Node>()->name : "core");
                 },
             .changed =
                 [&](ObjectId id, std::string& data) {
                     if (const Node* node = scene.get<Node>(id)) data = node->name;
                 },
             .destroyed = [&](ObjectId, std::string) { ++destroyed; }});
        table.lookAnew(scene);
        std::uint64_t next = 10;
        for (int turn = 0; turn < 200; ++turn) {
            Edits edits;
            for (std::size_t i = below(random, 4); i > 0; --i) {
                if (alive.empty() || oneIn(random, 2)) {
                    alive[ObjectId(next)] = "made";
                    edits.node(next++, "made");
                } else {
                    auto some = std::next(alive.begin(), static_cast<std::ptrdiff_t>(below(random, alive.size())));
                    if (oneIn(random, 3)) {
                        edits.detach(some->first);
                        edits.destroy(some->first);
                        alive.erase(some);
                    } else {
                        some->second = std::to_string(turn);
                        edits.value<Node>(some->first.value, fieldId<&Node::name>, toValue(some->second));
                    }
                }
            }
            const ChangeList list = edits.take();
            if (!scene.apply(list)) FAIL();
            table.follow(scene, list);
            ASSERT_EQ(table.size(), alive.size() + 1);
            ASSERT_EQ(created - destroyed, alive.size() + 1);
            for (const auto& [id, name] : alive) ASSERT_EQ(*table.find(id), name);
        }
    });
}

}  // namespace
}  // namespace tessera
