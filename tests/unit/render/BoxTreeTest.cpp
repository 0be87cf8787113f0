#include "client/render/scene/BoxTree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

namespace tessera {
namespace {

Box boxAt(const Vec3d& lower, double size) {
    Box box;
    box.extend(lower);
    box.extend(Vec3d(lower + Vec3d::Constant(size)));
    return box;
}

struct Shape {
    std::uint32_t depth = 0, nodes = 0;
    double cost = 0;  ///< summed half surfaces
};

/// Every item with a box in one leaf, every box the very union of what is below; counts and shape.
Shape check(const BoxTree& tree, const std::vector<Box>& boxes) {
    Shape shape;
    std::vector<int> seen(boxes.size(), 0);
    const std::function<Box(std::uint32_t, std::uint32_t)> visit = [&](std::uint32_t index, std::uint32_t depth) {
        const BoxTree::Node& node = tree.node(index);
        shape.depth = std::max(shape.depth, depth);
        ++shape.nodes;
        const Vec3d s = node.box.size();
        shape.cost += s.x() * s.y() + s.y() * s.z() + s.z() * s.x();
        Box box;
        std::uint32_t count = 0;
        if (node.leaf) {
            EXPECT_GE(node.count, 1u);
            EXPECT_LE(node.count, BoxTree::kItemsPerLeaf);
            for (const std::uint32_t item : node.items()) {
                ++seen[item];
                box.extend(boxes[item]);
            }
            count = node.count;
        } else {
            for (const std::uint32_t child : {node.below[0], node.below[1]}) {
                box.extend(visit(child, depth + 1));
                count += tree.node(child).count;
            }
        }
        EXPECT_EQ(node.count, count);
        EXPECT_EQ(node.box.lower, box.lower);
        EXPECT_EQ(node.box.upper, box.upper);
        return box;
    };
    if (!tree.empty()) visit(BoxTree::kRoot, 0);
    for (std::size_t i = 0; i < boxes.size(); ++i) EXPECT_EQ(seen[i], boxes[i].empty() ? 0 : 1) << "item " << i;
    return shape;
}

/// As deep as halves of at most four fifths make it, and the small subtrees that may be as lopsided as they like.
std::uint32_t deepest(std::size_t items) {
    return static_cast<std::uint32_t>(std::log(std::max(1.0, static_cast<double>(items) / 16)) / std::log(1.25)) + 18;
}

TEST(BoxTree, HoldsEveryItemOnceThroughAnyHistory) {
    for (unsigned seed = 0; seed < 200; ++seed) {
        SCOPED_TRACE(seed);
        std::mt19937 random(seed);
        const auto uniform = [&](double from, double to) {
            return std::uniform_real_distribution<double>(from, to)(random);
        };
        const auto anyBox = [&] {
            return boxAt(Vec3d(uniform(-10, 10), uniform(-10, 10), uniform(-10, 10)), uniform(0, 2));
        };
        std::vector<Box> boxes(random() % 300);
        for (Box& box : boxes)
            if (random() % 3 > 0) box = anyBox();
        BoxTree tree;
        tree.build(boxes);
        for (int step = 0; step < 25; ++step) {
            std::vector<std::uint32_t> changed;
            const std::size_t edits = random() % 8 == 0 ? 200 : random() % 6;
            for (std::size_t i = 0; i < edits; ++i) {
                const std::size_t item = random() % (boxes.size() + 1);
                if (item == boxes.size()) boxes.emplace_back();
                switch (random() % 4) {
                    case 0:
                        boxes[item] = Box();
                        break;
                    case 1:
                        boxes[item] = anyBox();
                        break;
                    case 2:
                        boxes[item] = boxAt(Vec3d::Zero(), 1);
                        break;  // many in one place
                    default:
                        if (!boxes[item].empty()) boxes[item] = boxAt(boxes[item].lower + Vec3d(0.1, 0, 0), 0.5);
                }
                changed.push_back(static_cast<std::uint32_t>(item));
            }
            tree.follow(boxes, changed);
            check(tree, boxes);
            if (testing::Test::HasFailure()) return;
        }
    }
}

TEST(BoxTree, StaysShallowWhateverTheOrderInWhichItemsComeAndGo) {
    for (const int order : {0, 1, 2}) {
        SCOPED_TRACE(order);
        std::vector<Box> boxes;
        BoxTree tree;
        for (int i = 0; i < 6000; ++i) {
            // Along a line; ever farther out; all in one place.
            const double x = order == 0 ? i : order == 1 ? std::exp2(i / 64.0) : 0;
            boxes.push_back(boxAt({x, 0, 0}, 1));
            const std::uint32_t item = static_cast<std::uint32_t>(i);
            tree.follow(boxes, std::span(&item, 1));
        }
        EXPECT_LE(check(tree, boxes).depth, deepest(6000));
        // All that is left lies at one end.
        for (std::uint32_t i = 0; i < 5500; ++i) {
            boxes[i] = Box();
            tree.follow(boxes, std::span(&i, 1));
        }
        const Shape shape = check(tree, boxes);
        EXPECT_LE(shape.depth, deepest(500));
        EXPECT_LE(shape.nodes, 500u);
    }
}

TEST(BoxTree, StaysNearlyAsGoodAsOneBuiltAnewWhenItemsWander) {
    std::mt19937 random(3);
    std::normal_distribution<double> step(0, 0.4);
    std::uniform_real_distribution<double> place(-50, 50);
    std::vector<Box> boxes(4000);
    for (Box& box : boxes) box = boxAt({place(random), place(random), place(random)}, 1);
    for (const std::size_t atOnce : {std::size_t{40}, boxes.size()}) {
        BoxTree tree;
        tree.build(boxes);
        for (std::size_t moves = 0; moves < 400 * boxes.size(); moves += atOnce) {
            std::vector<std::uint32_t> changed;
            for (std::size_t i = 0; i < atOnce; ++i) {
                changed.push_back(static_cast<std::uint32_t>((moves + i) % boxes.size()));
                Box& box = boxes[changed.back()];
                const Vec3d by(step(random), step(random), step(random));
                box.lower += by;
                box.upper += by;
            }
            tree.follow(boxes, changed);
        }
        BoxTree anew;
        anew.build(boxes);
        EXPECT_LE(check(tree, boxes).cost, 2 * check(anew, boxes).cost) << atOnce << " at once";
    }
}

// What is loaded comes so, and goes so when that is undone: no frame may rebuild all that is there.
TEST(BoxTree, AFewThatComeOrGoCostNoFrameWhatAllWouldCost) {
    constexpr std::uint32_t kAll = 100'000, kAtOnce = 200;
    for (const int order : {0, 1, 2}) {
        for (const bool sameOrder : {true, false}) {
            SCOPED_TRACE(testing::Message()
                         << "order " << order << (sameOrder ? ", the first goes first" : ", the last goes first"));
            std::mt19937 random(7);
            std::uniform_real_distribution<double> place(0, 50);
            const auto next = [&](std::uint32_t i) {
                // Along a line; anywhere; many in few places.
                if (order == 0) return boxAt({i * 0.5, 0, 0}, 1);
                if (order == 1) return boxAt({place(random), place(random), place(random)}, 0.5);
                return boxAt({i % 10 - 4.5, 0.1 * (i % 60), -1.3}, 0.2 + 0.05 * (i % 16));
            };
            std::vector<Box> boxes;
            BoxTree tree;
            std::uint64_t most = 0;
            const auto follow = [&](std::vector<std::uint32_t> changed) {
                const std::uint64_t before = tree.work();
                tree.follow(boxes, changed);
                most = std::max(most, tree.work() - before);
            };
            for (std::uint32_t i = 0; i < kAll;) {
                std::vector<std::uint32_t> changed;
                for (const std::uint32_t end = i + kAtOnce; i < end; ++i) {
                    boxes.push_back(next(i));
                    changed.push_back(i);
                }
                follow(std::move(changed));
            }
            const Shape shape = check(tree, boxes);
            EXPECT_LE(shape.depth, deepest(kAll));
            BoxTree anew;
            anew.build(boxes);
            EXPECT_LE(shape.cost, 2 * check(anew, boxes).cost);
            for (std::uint32_t gone = 0; gone < kAll - 1000;) {
                std::vector<std::uint32_t> changed;
                for (const std::uint32_t end = gone + kAtOnce; gone < end; ++gone) {
                    const std::uint32_t item = sameOrder ? gone : kAll - 1 - gone;
                    boxes[item] = Box();
                    changed.push_back(item);
                }
                follow(std::move(changed));
            }
            EXPECT_LE(check(tree, boxes).depth, deepest(1000));
            // 300 nodes an item: on their way down and up, and where parts are built anew. All of them are 130,000.
            EXPECT_LE(most, kAtOnce * 300);
        }
    }
}

TEST(BoxTree, OneChangeCostsAsGoodAsTheSameInAHundredTimesAsManyItems) {
    const auto workOfOne = [](std::size_t count) {
        std::mt19937 random(1);
        const double side = std::cbrt(static_cast<double>(count));
        std::uniform_real_distribution<double> place(0, side);
        const auto anyBox = [&] { return boxAt({place(random), place(random), place(random)}, 0.5); };
        std::vector<Box> boxes(count);
        for (Box& box : boxes) box = anyBox();
        BoxTree tree;
        tree.build(boxes);
        const std::uint64_t before = tree.work();
        constexpr int kChanges = 300;
        for (int i = 0; i < kChanges; ++i) {
            const auto item = static_cast<std::uint32_t>(random() % count);
            if (i % 3 == 0) {
                boxes[item] = Box();
            } else if (i % 3 == 1) {
                boxes[item] = anyBox();
            } else {
                boxes.push_back(anyBox());
            }
            const std::uint32_t changed[] = {item, static_cast<std::uint32_t>(boxes.size() - 1)};
            tree.follow(boxes, changed);
        }
        check(tree, boxes);
        return static_cast<double>(tree.work() - before) / kChanges;
    };
    const double small = workOfOne(1'000);
    const double large = workOfOne(100'000);
    EXPECT_LE(large, 3 * small) << small << " nodes of 1,000, " << large << " of 100,000";
    EXPECT_LE(large, 200);
}

}  // namespace
}  // namespace tessera
