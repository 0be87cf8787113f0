// Copies of parts of random scenes, held beside what an isomorphism of trees has to be.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "common/scene/Clones.h"
#include "tests/property/SceneModel.h"

namespace tessera {
namespace {

/// A random scene of all types, some of it in the tree.
Aspect randomScene(Random& random, SceneModel& model) {
    Aspect aspect;
    for (std::size_t i = 0, lists = 4 + below(random, 12); i < lists; ++i) {
        const Expected<void> applied = aspect.apply(model.nextList(random));
        EXPECT_TRUE(applied) << applied.error().message;
    }
    return aspect;
}

std::set<ObjectId> nodesBelow(const Aspect& aspect, ObjectId top) {
    std::set<ObjectId> nodes = {top};
    // Slow on purpose: whoever has a parent among them, until nobody new has.
    for (bool grows = true; grows;) {
        grows = false;
        for (const ObjectId id : aspect.ids())
            if (const Node* node = aspect.get<Node>(id); node && nodes.contains(node->parent))
                grows = nodes.insert(id).second || grows;
    }
    return nodes;
}

/// What a deep copy makes anew: nodes, cores that they hold, and what is neither and is referred to from there by a
/// field that says of what type.
std::set<ObjectId> copiedBy(const Aspect& aspect, ObjectId top, const CloneOptions& options) {
    std::set<ObjectId> copied = nodesBelow(aspect, top);
    if (!options.deep) return copied;
    const auto isShared = [&](ObjectId id) {
        if (std::ranges::count(options.shareTypes, aspect.find(id).info().type) > 0) return true;
        return std::ranges::any_of(options.shareObjects, [&](ObjectId shared) {
            const Node* node = aspect.get<Node>(shared);
            return (node ? node->core : shared) == id;
        });
    };
    for (const ObjectId id : std::set(copied))
        if (const ObjectId core = aspect.get<Node>(id)->core; core && !isShared(core)) copied.insert(core);
    for (bool grows = true; grows;) {
        grows = false;
        for (const ObjectId id : std::set(copied)) {
            const Object object = aspect.find(id);
            if (object.is<Node>()) continue;
            for (const FieldEntry& field : object.info().fields) {
                if (!field.holdsRefs() || field.anyObject) continue;
                const FieldValue value = field.load(object);
                const RefList refs =
                    field.kind == FieldKind::kRefs ? std::get<RefList>(value) : RefList{std::get<ObjectId>(value)};
                for (const ObjectId to : refs) {
                    const Object target = aspect.find(to);
                    if (target && !target.is<Node>() && !target.info().isCore && !isShared(to))
                        grows = copied.insert(to).second || grows;
                }
            }
        }
    }
    return copied;
}

/// Pairs original and copy by walking both trees and all that they refer to, in step.
struct Pairing {
    const Aspect& aspect;
    const std::set<ObjectId>& copied;
    std::uint64_t firstNew;
    const std::string& newName;
    std::map<ObjectId, ObjectId> copyOf = {};
    std::map<ObjectId, ObjectId> originalOf = {};

    bool pair(ObjectId original, ObjectId copy, bool top = false) {
        if (!copied.contains(original)) {
            EXPECT_EQ(original, copy) << "stays what it was";
            return original == copy;
        }
        if (const auto known = copyOf.find(original); known != copyOf.end()) {
            EXPECT_EQ(known->second, copy) << "two copies of #" << original.value;
            return known->second == copy;
        }
        EXPECT_GE(copy.value, firstNew);
        EXPECT_TRUE(originalOf.try_emplace(copy, original).second) << "one copy of two objects";
        copyOf[original] = copy;
        const Object was = aspect.find(original), is = aspect.find(copy);
        if (!is || was.info().type != is.info().type) {
            ADD_FAILURE() << "#" << original.value << " and #" << copy.value << " are of two types";
            return false;
        }
        if (const Node* node = was.as<Node>()) {
            const Node& other = *is.as<Node>();
            EXPECT_EQ(node->children.size(), other.children.size());
            if (node->children.size() != other.children.size()) return false;
            auto at = other.children.begin();
            for (const ObjectId child : node->children)
                if (!pair(child, *at++)) return false;
        }
        for (const FieldEntry& field : was.info().fields) {
            const FieldValue a = field.load(was), b = field.load(is);
            if (top && field.name == "name" && was.is<Node>() && !newName.empty()) {
                EXPECT_EQ(std::get<std::string>(b), newName);
            } else if (field.kind == FieldKind::kRef) {
                if (!pair(std::get<ObjectId>(a), std::get<ObjectId>(b))) return false;
            } else if (field.kind == FieldKind::kRefs) {
                const auto &from = std::get<RefList>(a), &to = std::get<RefList>(b);
                EXPECT_EQ(from.size(), to.size());
                for (std::size_t i = 0; i < std::min(from.size(), to.size()); ++i)
                    if (!pair(from[i], to[i])) return false;
            } else {
                EXPECT_EQ(a, b) << was.info().name << "." << field.name;
            }
        }
        return !testing::Test::HasFailure();
    }
};

TEST(CloneLaws, ACopyIsTheOriginalAgainAndSharesWhatItIsToldTo) {
    std::size_t deep = 0, shared = 0, inside = 0;
    forSeeds(300, [&](Random& random) {
        SceneModel model;
        Aspect aspect = randomScene(random, model);
        const std::vector<ObjectId> nodes = model.nodes();
        for (int i = 0; i < 6; ++i) {
            const ObjectId top = nodes[below(random, nodes.size())];
            CloneOptions options;
            options.deep = !oneIn(random, 4);
            if (oneIn(random, 2)) options.name = "copy";
            const std::set<ObjectId> original = nodesBelow(aspect, top);
            if (oneIn(random, 2)) options.under = nodes[below(random, nodes.size())];
            if (options.deep)
                for (std::size_t k = below(random, 4); k > 0; --k) {
                    const TypeInfo& type = allTypes()[1 + below(random, allTypes().size() - 1)];
                    if (oneIn(random, 2)) options.shareTypes.push_back(type.type);
                    const std::vector<ObjectId> ids = aspect.ids();
                    if (oneIn(random, 2)) options.shareObjects.push_back(ids[below(random, ids.size())]);
                }
            const StateHash before = aspect.stateHash();
            const std::uint64_t firstNew = aspect.nextFreeId();
            Expected<Clone> clone = cloneList(aspect, top, options);
            if (top == kRootNode || original.contains(options.under)) {
                ASSERT_FALSE(clone);
                EXPECT_EQ(clone.error().code, ErrorCode::kRefused);
                continue;
            }
            ASSERT_TRUE(clone) << clone.error().message;
            const auto given = [&](ObjectId id) {
                return isPlaceholder(id) ? ObjectId(id.value - kFirstPlaceholder + firstNew) : id;
            };
            replaceIds(clone->list, given);
            const Expected<ChangeList> back = aspect.applyWithInverse(clone->list);
            ASSERT_TRUE(back) << back.error().message;

            const ObjectId copy = given(clone->node);
            ASSERT_NE(aspect.get<Node>(copy), nullptr);
            const ObjectId parent = options.under ? options.under : aspect.get<Node>(top)->parent;
            EXPECT_EQ(aspect.get<Node>(copy)->parent, parent);
            if (parent) {
                EXPECT_EQ(aspect.get<Node>(parent)->children.back(), copy);
            }
            const std::set<ObjectId> expected = copiedBy(aspect, top, options);
            EXPECT_EQ(clone->objects, expected.size());
            Pairing pairing{aspect, expected, firstNew, options.name};
            pairing.pair(top, copy, true);
            ASSERT_FALSE(testing::Test::HasFailure());
            EXPECT_EQ(pairing.copyOf.size(), expected.size()) << "all that is made anew is referred to";
            deep += options.deep;
            shared += options.deep && expected.size() < copiedBy(aspect, top, {.deep = true}).size();
            inside += expected.size() > original.size();

            ASSERT_TRUE(aspect.apply(*back)) << "one step of undo";
            EXPECT_EQ(aspect.stateHash(), before);
        }
    });
    if (std::getenv("TESSERA_SEED")) return;
    EXPECT_GT(deep, 300u);
    EXPECT_GT(shared, 20u);
    EXPECT_GT(inside, 100u);
}

TEST(CloneLaws, NoListIsLargerThanItMayBe) {
    forSeeds(60, [&](Random& random) {
        SceneModel model;
        const Aspect aspect = randomScene(random, model);
        for (const ObjectId top : model.nodes()) {
            const Expected<Clone> whole = cloneList(aspect, top, {.deep = true});
            if (!whole) continue;
            const std::size_t changes = whole->list.changeCount();
            EXPECT_TRUE(cloneList(aspect, top, {.deep = true, .maxChanges = changes}));
            const Expected<Clone> refused =
                cloneList(aspect, top, {.deep = true, .maxChanges = below(random, changes)});
            ASSERT_FALSE(refused);
            EXPECT_EQ(refused.error().code, ErrorCode::kLimit);
        }
    });
}

}  // namespace
}  // namespace tessera
