/// Every finder finds what brute force finds.
#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <memory>

#include "common/base/Workers.h"
#include "server/collision/mesh/InstructionSet.h"
#include "server/collision/neighbours/DifferenceFinder.h"
#include "tests/unit/neighbours/BoxScenes.h"

namespace tessera {
namespace {

constexpr std::array kMethods{NeighbourMethod::kAllPairs, NeighbourMethod::kSweepAndPrune, NeighbourMethod::kGrid,
                              NeighbourMethod::kTree, NeighbourMethod::kAuto};

class EveryFinder : public testing::TestWithParam<NeighbourMethod> {
protected:
    std::unique_ptr<NeighbourFinder> finder = makeNeighbourFinder({.method = GetParam()});

    std::vector<NeighbourPair> pairs() { return list(finder->pairs()); }
    void start(const std::vector<Box>& boxes) { finder->reset(boxes, InteractionTable::everybody(boxes.size())); }
};

INSTANTIATE_TEST_SUITE_P(Neighbours, EveryFinder, testing::ValuesIn(kMethods), [](const auto& param) {
    std::string word(name(param.param));
    std::replace(word.begin(), word.end(), ' ', '_');
    return word;
});

TEST_P(EveryFinder, FindsNothingAmongNothing) {
    start({});
    EXPECT_EQ(pairs(), std::vector<NeighbourPair>{});
    start({boxBetween(0, 1)});
    EXPECT_EQ(pairs(), std::vector<NeighbourPair>{});
}

TEST_P(EveryFinder, TakesTouchingBoxesForNeighboursAndEmptyOnesForNobodys) {
    start({boxAt({0, 0, 0}, {1, 1, 1}), boxAt({1, 0, 0}, {1, 1, 1}), boxAt({1, 1.1, 0}, {1, 1, 1}), Box{}});
    EXPECT_EQ(pairs(), (std::vector<NeighbourPair>{{0, 1}}));
    finder->move(2, boxAt({1, 1, 0}, {1, 1, 1}));
    EXPECT_EQ(pairs(), (std::vector<NeighbourPair>{{0, 1}, {0, 2}, {1, 2}}));
    finder->move(0, Box{});
    EXPECT_EQ(pairs(), (std::vector<NeighbourPair>{{1, 2}}));
}

TEST_P(EveryFinder, KeepsItsPairsWhenABoxVanishesAndReturns) {
    start({boxBetween(0, 2), boxBetween(1, 3), boxBetween(2.5, 4)});
    EXPECT_EQ(pairs(), (std::vector<NeighbourPair>{{0, 1}, {1, 2}}));
    finder->move(1, Box{});
    EXPECT_EQ(pairs(), std::vector<NeighbourPair>{});
    finder->move(1, boxBetween(1, 3));
    EXPECT_EQ(pairs(), (std::vector<NeighbourPair>{{0, 1}, {1, 2}}));
}

TEST_P(EveryFinder, SeesAGapOfOneUnitInTheLastPlaceOfADouble) {
    const double x = 1e5 + 0.1;
    start({boxBetween(0, x), boxBetween(std::nextafter(x, 1e9), 2e5), boxBetween(x, 3e5)});
    EXPECT_EQ(pairs(), (std::vector<NeighbourPair>{{0, 2}, {1, 2}}));
    finder->move(1, boxBetween(x, 2e5));
    EXPECT_EQ(pairs(), (std::vector<NeighbourPair>{{0, 1}, {0, 2}, {1, 2}}));
    finder->move(1, boxBetween(std::nextafter(x, 1e9), 2e5));
    EXPECT_EQ(pairs(), (std::vector<NeighbourPair>{{0, 2}, {1, 2}}));
}

TEST_P(EveryFinder, LetsAnInfiniteBoxMeetAllThatLieInItsRange) {
    const double infinity = std::numeric_limits<double>::infinity();
    Box floor;
    floor.lower = {-infinity, -infinity, -infinity};
    floor.upper = {infinity, 0, infinity};
    start(
        {boxAt({0, 0, 0}, {1, 1, 1}), floor, boxAt({1e300, 1e-300, 0}, {1, 1, 1}), boxAt({-1e300, -9, 0}, {1, 1, 1})});
    EXPECT_EQ(pairs(), (std::vector<NeighbourPair>{{0, 1}, {1, 3}}));
}

TEST_P(EveryFinder, TakesABoxWithANanInItForEmpty) {
    Box box = boxBetween(0, 1);
    box.upper.y() = std::numeric_limits<double>::quiet_NaN();
    start({boxBetween(0, 1), box, boxBetween(0.5, 2)});
    EXPECT_EQ(pairs(), (std::vector<NeighbourPair>{{0, 2}}));
    finder->move(1, boxBetween(2, 3));
    finder->move(0, box);
    EXPECT_EQ(pairs(), (std::vector<NeighbourPair>{{1, 2}}));
}

TEST_P(EveryFinder, TakesTheLastOfTwoMoves) {
    start({boxBetween(0, 1), boxBetween(5, 6), boxBetween(9, 10)});
    EXPECT_EQ(pairs(), std::vector<NeighbourPair>{});
    const std::vector<std::uint32_t> items{1, 2, 1};
    const std::vector<Box> to{boxBetween(0.5, 2), boxBetween(3, 4), boxBetween(3.5, 5)};
    finder->move(items, to);
    EXPECT_EQ(pairs(), (std::vector<NeighbourPair>{{1, 2}}));
    const std::vector<Box> all{boxBetween(0, 1), boxBetween(5, 6), boxBetween(0, 1)};
    finder->moveAll(all);
    finder->move(2, boxBetween(6, 7));
    finder->moveAll(all);
    finder->move(1, boxBetween(1, 2));
    EXPECT_EQ(pairs(), (std::vector<NeighbourPair>{{0, 1}, {0, 2}, {1, 2}}));
    EXPECT_EQ(pairs(), (std::vector<NeighbourPair>{{0, 1}, {0, 2}, {1, 2}})) << "asked again";
}

/// How a scene goes on in a frame.
void step(Random& random, const Kind& kind, std::vector<Box>& boxes, NeighbourFinder& finder) {
    const std::size_t n = boxes.size();
    const std::uint64_t manner = random() % 8;
    const double speed = manner < 3 ? 0.05 : 0.5;
    const auto moved = [&](std::size_t i) {
        if (random() % 500 == 0) return kind.make(random, i, n);  // a leap, perhaps to nowhere
        Box box = boxes[i];
        const Vec3d shift = uniform3(random, -speed, speed);
        box.lower += shift;
        box.upper += shift;
        if (random() % 8 == 0) box.upper += uniform3(random, 0, 0.01);
        return box;
    };
    if (manner == 7) {
        for (std::size_t i = 0; i < n; ++i) boxes[i] = kind.make(random, i, n);  // all leap
        finder.moveAll(boxes);
    } else if (manner % 2 == 0) {
        for (std::size_t i = 0; i < n; ++i) boxes[i] = moved(i);
        finder.moveAll(boxes);
    } else {
        const std::size_t share = manner == 1 ? 100 : 8;  // 99 % static; most static
        for (std::size_t k = 0; k < n / share + 1; ++k) {
            const auto i = static_cast<std::uint32_t>(random() % n);
            boxes[i] = moved(i);
            finder.move(i, boxes[i]);
        }
    }
}

/// Several finders on one scene: that of all methods, on these workers.
struct Contender {
    std::string name;
    std::unique_ptr<NeighbourFinder> finder;
};

std::vector<Contender> everyMethod(Workers* workers) {
    std::vector<Contender> contenders;
    for (const NeighbourMethod method : kMethods)
        contenders.push_back({std::string(name(method)), makeNeighbourFinder({.method = method, .workers = workers})});
    // The kernels that this processor would not choose.
    for (const InstructionSet set : {InstructionSet::kSse41, InstructionSet::kAvx2})
        for (const NeighbourMethod method : {NeighbourMethod::kGrid, NeighbourMethod::kTree})
            if (set < instructionSet())
                contenders.push_back(
                    {std::string(name(method)) + ", " + std::string(name(set)),
                     std::make_unique<neighbours::DifferenceFinder>(method, workers, neighbours::slotKernels(set))});
    return contenders;
}

using Reference = std::function<std::vector<NeighbourPair>(const std::vector<Box>&, const InteractionTable&)>;

void runScene(std::vector<Contender> contenders, const Kind& kind, std::size_t n, std::uint64_t seed, int frames,
              const Reference& reference) {
    SCOPED_TRACE(kind.name + ", n = " + std::to_string(n) + ", seed = " + std::to_string(seed));
    Random random(seed);
    const InteractionTable table = interests(random, n, seed % 2 == 0);
    std::vector<Box> boxes;
    for (std::size_t i = 0; i < n; ++i) boxes.push_back(kind.make(random, i, n));
    for (Contender& contender : contenders) contender.finder->reset(boxes, table);
    for (int frame = 0; frame <= frames; ++frame) {
        if (frame > 0) {
            const std::vector<Box> before = boxes;
            const Random seedOfFrame = random;
            for (Contender& contender : contenders) {
                boxes = before;
                random = seedOfFrame;
                step(random, kind, boxes, *contender.finder);
                if (random() % 4 == 0)
                    step(random, kind, boxes, *contender.finder);  // two lists before the pairs are asked for
            }
        }
        const std::vector<NeighbourPair> expected = reference(boxes, table);
        for (Contender& contender : contenders)
            ASSERT_EQ(list(contender.finder->pairs()), expected) << contender.name << ", frame " << frame;
    }
}

TEST(NeighbourFinder, FindsWhatBruteForceFindsWhateverMovesAndHow) {
    for (const Kind& kind : kinds())
        for (const std::size_t n : {1u, 2u, 17u, 130u, 700u})
            for (std::uint64_t seed = 0; seed < 4; ++seed) {
                runScene(everyMethod(nullptr), kind, n, seed, n < 200 ? 60 : 16, bruteForce);
                if (HasFatalFailure()) return;
            }
}

TEST(NeighbourFinder, FindsWhatBruteForceFindsAmongThousands) {
    for (const Kind& kind : kinds()) {
        runScene(everyMethod(nullptr), kind, 3000, 6, 5, bruteForce);
        if (HasFatalFailure()) return;
    }
}

TEST(NeighbourFinder, FindsTheSameWithOneTwoAndThreeThreads) {
    // Large enough for several tasks each; that one thread is right is the claim of others.
    Workers two(2), three(3);
    for (const Kind& kind : kinds()) {
        if (kind.name == "points in one place") continue;  // millions of pairs and nothing else
        for (const NeighbourMethod method : {NeighbourMethod::kGrid, NeighbourMethod::kTree, NeighbourMethod::kAuto}) {
            std::vector<Contender> contenders;
            contenders.push_back({"one", makeNeighbourFinder({.method = method})});
            contenders.push_back({"two", makeNeighbourFinder({.method = method, .workers = &two})});
            contenders.push_back({"three", makeNeighbourFinder({.method = method, .workers = &three})});
            NeighbourFinder& one = *contenders.front().finder;
            runScene(std::move(contenders), kind, 20000, 8, 4,
                     [&](const auto&, const auto&) { return list(one.pairs()); });
            if (HasFatalFailure()) return;
        }
    }
}

TEST(AutoFinder, TakesAGridForBoxesThatComeAndATreeOnceTheyMoveOn) {
    Random random(5);
    std::vector<Box> boxes;
    for (std::size_t i = 0; i < 6000; ++i) boxes.push_back(kinds()[0].make(random, i, 6000));
    neighbours::DifferenceFinder finder(NeighbourMethod::kAuto);
    finder.reset(boxes, InteractionTable::everybody(boxes.size()));
    EXPECT_EQ(list(finder.pairs()), bruteForce(boxes, InteractionTable::everybody(boxes.size())));
    EXPECT_EQ(finder.method(), NeighbourMethod::kGrid);
    for (int frame = 0; frame < 4; ++frame) {
        for (Box& box : boxes) box = boxAt(box.lower + uniform3(random, -0.02, 0.02), box.size());
        finder.moveAll(boxes);
        ASSERT_EQ(list(finder.pairs()), bruteForce(boxes, InteractionTable::everybody(boxes.size())));
    }
    EXPECT_EQ(finder.method(), NeighbourMethod::kTree);
}

TEST(AutoFinder, TakesATreeForClustersFromTheStart) {
    Random random(5);
    std::vector<Box> boxes;
    for (std::size_t i = 0; i < 6000; ++i) {
        const double far = static_cast<double>(i % 5) * 1e4;
        boxes.push_back(boxAt(Vec3d::Constant(far) + uniform3(random, 0, 10), uniform3(random, 0, 0.3)));
    }
    neighbours::DifferenceFinder finder(NeighbourMethod::kAuto);
    finder.reset(boxes, InteractionTable::everybody(boxes.size()));
    EXPECT_EQ(list(finder.pairs()), bruteForce(boxes, InteractionTable::everybody(boxes.size())));
    EXPECT_EQ(finder.method(), NeighbourMethod::kTree);
}

TEST(NeighbourFinder, StartsAfreshWithOthers) {
    for (const NeighbourMethod method : kMethods) {
        const auto finder = makeNeighbourFinder({.method = method});
        Random random(3);
        for (const std::size_t n : {300u, 20u, 0u, 900u}) {
            const Kind kind = kinds()[n % 7];
            std::vector<Box> boxes;
            for (std::size_t i = 0; i < n; ++i) boxes.push_back(kind.make(random, i, n));
            finder->reset(boxes, InteractionTable::everybody(n));
            if (n > 0) finder->move(0, boxes[0] = kind.make(random, 0, n));
            ASSERT_EQ(list(finder->pairs()), bruteForce(boxes, InteractionTable::everybody(n))) << name(method) << n;
        }
    }
}

}  // namespace
}  // namespace tessera
