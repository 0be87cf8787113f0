/// Every finder finds what brute force finds.
#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <functional>
#include <memory>
#include <numeric>

#include "common/base/Workers.h"
#include "server/collision/mesh/InstructionSet.h"
#include "server/collision/neighbours/DifferenceFinder.h"
#include "tests/unit/neighbours/BoxScenes.h"

namespace tessera {
namespace {

constexpr std::array kMethods{NeighbourMethod::kAllPairs, NeighbourMethod::kSweepAndPrune, NeighbourMethod::kGrid,
                              NeighbourMethod::kTree, NeighbourMethod::kAuto};

/// A new box for each item, by index.
void moveAll(NeighbourFinder& finder, const std::vector<Box>& boxes) {
    std::vector<std::uint32_t> items(boxes.size());
    std::iota(items.begin(), items.end(), 0u);
    finder.move(items, boxes);
}

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
    moveAll(*finder, all);
    finder->move(2, boxBetween(6, 7));
    moveAll(*finder, all);
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
        moveAll(finder, boxes);
    } else if (manner % 2 == 0) {
        for (std::size_t i = 0; i < n; ++i) boxes[i] = moved(i);
        moveAll(finder, boxes);
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
        moveAll(finder, boxes);
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

/// Items come, go, change their groups and bodies, move a little or leap; what is told of the pairs adds up to all of
/// them.
TEST(NeighbourFinder, FollowsWhoComesAndGoes) {
    for (const NeighbourMethod method :
         {NeighbourMethod::kAllPairs, NeighbourMethod::kSweepAndPrune, NeighbourMethod::kTree, NeighbourMethod::kAuto})
        for (unsigned seed = 0; seed < 12; ++seed) {
            SCOPED_TRACE(std::string(name(method)) + ", seed " + std::to_string(seed));
            std::mt19937 random(seed);
            const auto below = [&](std::uint32_t n) { return static_cast<std::uint32_t>(random() % n); };
            const double world = seed % 3 == 0 ? 4 : 30;
            const auto someBox = [&] {
                const auto coordinate = [&] { return world * (static_cast<double>(random()) / 4294967296.0); };
                Box box;
                if (below(20) == 0) return box;
                box.lower = Vec3d(coordinate(), coordinate(), coordinate());
                box.upper = box.lower + Vec3d::Constant(below(30) == 0 ? 5 : 1);
                return box;
            };
            constexpr std::uint32_t kGroups = 4;
            const bool large = method == NeighbourMethod::kAuto && seed == 0;
            std::uint32_t n = large ? 4200 : 20 + below(100);
            InteractionTable table;
            table.active = {true, true, false, false};
            table.interacts.assign(kGroups * kGroups, false);
            const auto interact = [&](std::uint32_t a, std::uint32_t b, bool yes) {
                table.interacts[a * kGroups + b] = table.interacts[b * kGroups + a] = yes;
            };
            interact(0, 1, true);
            interact(0, 2, true);
            interact(1, 1, true);
            interact(1, 3, true);
            std::vector<Box> boxes;
            const auto assign = [&](std::uint32_t item) {
                table.groupOf[item] = below(6) == 0 ? InteractionTable::kNoGroup : below(kGroups);
                table.bodyOf[item] = below(n / 2);
            };
            table.groupOf.resize(n);
            table.bodyOf.resize(n);
            for (std::uint32_t i = 0; i < n; ++i) {
                assign(i);
                boxes.push_back(table.groupOf[i] == InteractionTable::kNoGroup ? Box{} : someBox());
            }
            const auto expected = [&] {
                std::vector<NeighbourPair> out;
                for (std::uint32_t a = 0; a < n; ++a)
                    for (std::uint32_t b = a + 1; b < n && !boxes[a].empty(); ++b)
                        if (!boxes[b].empty() && boxes[a].overlaps(boxes[b]) && table.relevant(a, b))
                            out.push_back({a, b});
                return out;
            };
            const std::unique_ptr<NeighbourFinder> finder = makeNeighbourFinder({.method = method});
            if (method != NeighbourMethod::kAllPairs && method != NeighbourMethod::kSweepAndPrune) {
                if (seed % 2 == 0) finder->expect(n + 40);
            } else {
                for (std::uint32_t& group : table.groupOf) group = group == InteractionTable::kNoGroup ? 3 : group;
            }
            finder->reset(boxes, table);
            std::vector<NeighbourPair> known(finder->pairs().begin(), finder->pairs().end());
            ASSERT_EQ(known, expected());
            std::size_t told = 0;
            for (int frame = 0; frame < (large ? 8 : 80); ++frame) {
                std::vector<std::uint32_t> items;
                if (below(3) != 0)
                    for (std::uint32_t k = below(12) == 0 ? n / 3 : below(8); k > 0; --k) {
                        const std::uint32_t item = below(n + 2);
                        if (item >= n) {
                            n = item + 1;
                            table.groupOf.resize(n, InteractionTable::kNoGroup);
                            table.bodyOf.resize(n, 0);
                            boxes.resize(n);
                        }
                        items.push_back(item);
                    }
                std::sort(items.begin(), items.end());
                items.erase(std::unique(items.begin(), items.end()), items.end());
                if (!items.empty()) {
                    for (const std::uint32_t item : items) assign(item);
                    if (below(5) == 0) {  // groups that are all given may come to be something else to others
                        const std::uint32_t group = below(kGroups);
                        interact(group, below(group < 2 ? kGroups : 2), below(2) == 0);  // passive ones never do
                        for (std::uint32_t i = 0; i < n; ++i)
                            if (table.groupOf[i] == group && !std::binary_search(items.begin(), items.end(), i))
                                items.insert(std::lower_bound(items.begin(), items.end(), i), i);
                    }
                    std::vector<NeighbourPair> theirs;
                    std::erase_if(known, [&](const NeighbourPair& pair) {
                        if (!std::binary_search(items.begin(), items.end(), pair.a) &&
                            !std::binary_search(items.begin(), items.end(), pair.b))
                            return false;
                        theirs.push_back(pair);
                        return true;
                    });
                    finder->regroup(items, theirs, table);
                    for (const std::uint32_t item : items) {
                        boxes[item] = table.groupOf[item] == InteractionTable::kNoGroup ? Box{} : someBox();
                        finder->move(item, boxes[item]);
                    }
                }
                for (std::uint32_t k = below(8) == 0 ? n : below(6); k > 0; --k) {
                    const std::uint32_t item = below(n);
                    if (table.groupOf[item] == InteractionTable::kNoGroup) continue;
                    if (below(2) == 0 || boxes[item].empty()) {
                        boxes[item] = someBox();
                    } else {
                        const Vec3d by = Vec3d::Constant(0.3 - 0.6 * below(2));
                        boxes[item].lower += by;
                        boxes[item].upper += by;
                    }
                    finder->move(item, boxes[item]);
                }
                std::vector<NeighbourPair> begun, ended;
                if (finder->changes(begun, ended)) {
                    ++told;
                    ASSERT_TRUE(std::is_sorted(begun.begin(), begun.end()) &&
                                std::is_sorted(ended.begin(), ended.end()));
                    for (const NeighbourPair& pair : ended) {
                        ASSERT_TRUE(std::binary_search(known.begin(), known.end(), pair));
                        std::erase(known, pair);
                    }
                    for (const NeighbourPair& pair : begun) {
                        ASSERT_FALSE(std::binary_search(known.begin(), known.end(), pair));
                        known.insert(std::lower_bound(known.begin(), known.end(), pair), pair);
                    }
                } else {
                    known.assign(finder->pairs().begin(), finder->pairs().end());
                }
                ASSERT_EQ(known, expected()) << "frame " << frame;
                if (below(10) == 0) {
                    ASSERT_EQ(list(finder->pairs()), known);
                }
            }
            if (method == NeighbourMethod::kTree) {
                EXPECT_GT(told, 40u);
            }
        }
}

/// Whoever says who comes and goes tells of pairs that there are not, twice of others, or names nobody. The pairs are
/// right all the same, and nothing ends.
TEST(NeighbourFinder, FindsAllAgainWhereItWasToldWhatIsNotSo) {
    std::uint64_t first = 1, last = 40;
    if (const char* only = std::getenv("TESSERA_NEIGHBOURS_SEED")) first = last = std::strtoull(only, nullptr, 10);
    for (std::uint64_t seed = first; seed <= last; ++seed) {
        SCOPED_TRACE("TESSERA_NEIGHBOURS_SEED=" + std::to_string(seed) +
                     " bin/unit_neighbours --gtest_filter=NeighbourFinder.FindsAllAgain*");
        Random random(seed);
        // Few among many, so that changes are but noted; and few among few.
        const std::size_t n = seed % 2 == 0 ? 1500 : 40;
        const double world = seed % 2 == 0 ? 12 : 4;
        std::vector<Box> boxes;
        for (std::size_t i = 0; i < n; ++i) boxes.push_back(boxAt(uniform3(random, 0, world), Vec3d::Ones()));
        InteractionTable table = InteractionTable::everybody(n);
        neighbours::DifferenceFinder finder(seed % 3 == 0 ? NeighbourMethod::kAuto : NeighbourMethod::kTree);
        finder.expect(n + n / 8);
        finder.reset(boxes, table);
        ASSERT_EQ(list(finder.pairs()), bruteForce(boxes, table));
        for (int frame = 0; frame < 12; ++frame) {
            SCOPED_TRACE("frame " + std::to_string(frame));
            const auto item = static_cast<std::uint32_t>(random() % n);
            const std::vector<NeighbourPair> all = bruteForce(boxes, table);
            std::vector<NeighbourPair> known;
            for (const NeighbourPair& pair : all)
                if (pair.a == item || pair.b == item) known.push_back(pair);
            const auto other = static_cast<std::uint32_t>(random() % n);
            if (random() % 2 == 0) known.push_back({std::min(item, other), std::max(item, other)});
            if (random() % 3 == 0) known.push_back({other, other});
            if (random() % 3 == 0) known.push_back({item, static_cast<std::uint32_t>(n + random() % 1000)});
            if (random() % 3 == 0 && !known.empty()) known.push_back(known.front());
            boxes[item] = Box{};
            finder.regroup(std::span(&item, 1), known, table);
            boxes[item] = boxAt(uniform3(random, 0, world), Vec3d::Ones());
            finder.move(item, boxes[item]);
            for (int k = 0; k < 5; ++k) {
                const auto mover = static_cast<std::uint32_t>(random() % n);
                boxes[mover] = boxAt(uniform3(random, 0, world), Vec3d::Ones());
                finder.move(mover, boxes[mover]);
            }
            std::vector<NeighbourPair> begun, ended;
            if (random() % 2 == 0) (void)finder.changes(begun, ended);
            ASSERT_EQ(list(finder.pairs()), bruteForce(boxes, table));
        }
    }
}

/// What goes far away takes no place amid others, where it would stretch their leaf.
TEST(DifferenceFinder, MovesFarAwayMakeFewNewOrders) {
    neighbours::DifferenceFinder finder(NeighbourMethod::kAuto);
    std::vector<Box> boxes;
    for (int i = 0; i < 4000; ++i) {
        const Vec3d at(1.3 * (i % 16), 1.3 * (i / 16 % 16), 1.3 * (i / 256));
        boxes.push_back({at, at + Vec3d::Ones()});
    }
    finder.expect(boxes.size() + boxes.size() / 8 + 256);
    finder.reset(boxes, InteractionTable::everybody(boxes.size()));
    (void)finder.pairs();
    for (int i = 0; i < 400; ++i) {
        const Vec3d at(-40 - 2.0 * i, i, 0);
        finder.move(static_cast<std::uint32_t>(11 * i % 4000), {at, at + Vec3d::Ones()});
        std::vector<NeighbourPair> begun, ended;
        if (!finder.changes(begun, ended)) (void)finder.pairs();
    }
    EXPECT_LE(finder.arrangements(), 4U);
}

}  // namespace
}  // namespace tessera
