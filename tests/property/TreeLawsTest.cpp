// Which placements a scene takes, beside a plain map of parents; and that what it takes can be taken back.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "common/scene/Aspect.h"
#include "tests/property/Seeds.h"

namespace tessera {
namespace {

/// Each node's children in order; 0 holds those without a parent.
struct PlainTree {
    std::map<std::uint64_t, std::vector<std::uint64_t>> children;
    std::map<std::uint64_t, std::uint64_t> parent;

    /// False where the index is past the end.
    bool place(const Placement& p) {
        const std::uint64_t node = p.node.value;
        std::erase(children[parent[node]], node);
        std::vector<std::uint64_t>& siblings = children[p.parent.value];
        if (p.parent && p.index != Placement::kLast && p.index > siblings.size()) return false;
        const bool last = !p.parent || p.index == Placement::kLast;
        siblings.insert(last ? siblings.end() : siblings.begin() + p.index, node);
        parent[node] = p.parent.value;
        return true;
    }
    [[nodiscard]] bool within(const SceneLimits& limits) const {
        for (const auto& [node, above] : parent) {
            std::size_t depth = 1;
            for (std::uint64_t at = above; at != 0; at = parent.at(at))
                if (++depth > parent.size()) return false;  // a circle
            if (depth > limits.maxDepth) return false;
        }
        return std::ranges::all_of(
            children, [&](const auto& entry) { return entry.first == 0 || entry.second.size() <= limits.maxChildren; });
    }
};

constexpr std::uint64_t kNodes = 12;
constexpr SceneLimits kTight{.maxChildren = 4, .maxDepth = 5};

/// A dozen nodes, placed at random: lists that are too deep, too wide or have a circle in between or at their end.
struct Trees {
    PlainTree plain;
    Aspect aspect{kTight};

    Trees() {
        ChangeList start;
        for (std::uint64_t id = 2; id <= kNodes; ++id) start.creations.push_back({ObjectId(id), typeOf<Node>()});
        for (std::uint64_t id = 1; id <= kNodes; ++id) {
            plain.parent[id] = 0;
            plain.children[0].push_back(id);
        }
        EXPECT_TRUE(aspect.apply(start));
    }
    static ChangeList next(Random& random) {
        ChangeList list;
        const std::uint64_t count = 1 + below(random, 12);
        for (std::uint64_t i = 0; i < count; ++i) {
            const std::uint64_t parent = below(random, kNodes + 1);
            list.placements.push_back(
                {ObjectId(2 + below(random, kNodes - 1)), ObjectId(parent),
                 below(random, 3) > 0 ? Placement::kLast : static_cast<std::uint32_t>(below(random, 3))});
        }
        return list;
    }
};

TEST(TreeLaws, AListIsTakenWhenTheTreeThatItLeavesIsWithinTheLimits) {
    std::size_t taken = 0, refused = 0;
    forSeeds(300, [&](Random& random) {
        Trees trees;
        for (int i = 0; i < 60; ++i) {
            const ChangeList list = Trees::next(random);
            PlainTree after = trees.plain;
            const bool expected =
                std::ranges::all_of(list.placements, [&](const Placement& p) { return after.place(p); }) &&
                after.within(kTight);
            const StateHash before = trees.aspect.stateHash();
            const Expected<ChangeList> back = trees.aspect.applyWithInverse(list);
            ASSERT_EQ(back.has_value(), expected) << (back ? "taken" : back.error().message);
            ++(expected ? taken : refused);
            if (!back) {
                ASSERT_EQ(trees.aspect.stateHash(), before);
                continue;
            }
            const StateHash there = trees.aspect.stateHash();
            const Expected<ChangeList> again = trees.aspect.applyWithInverse(*back);
            ASSERT_TRUE(again) << again.error().message;
            ASSERT_EQ(trees.aspect.stateHash(), before);
            const Expected<void> forward = trees.aspect.apply(*again);
            ASSERT_TRUE(forward) << forward.error().message;
            ASSERT_EQ(trees.aspect.stateHash(), there);
            trees.plain = std::move(after);
            for (const auto& [node, parent] : trees.plain.parent)
                ASSERT_EQ(trees.aspect.get<Node>(ObjectId(node))->parent, ObjectId(parent));
        }
    });
    if (std::getenv("TESSERA_SEED")) return;
    // Both happen often enough for this to mean something.
    EXPECT_GT(taken, 1000u);
    EXPECT_GT(refused, 1000u);
}

}  // namespace
}  // namespace tessera
