#include "common/scene/AspectFeed.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <thread>

#include "tests/property/Seeds.h"
#include "tests/unit/Eventually.h"
#include "tests/unit/scene/SceneEdits.h"

namespace tessera {
namespace {

ChangeListPtr moved(Aspect& scene, double x) {
    Edits edits;
    edits.value<Transform>(5, fieldId<&Transform::translation>, toValue(Vec3d(x, 0, 0)));
    auto list = std::make_shared<const ChangeList>(edits.take());
    mustApply(scene, *list);
    return list;
}

TEST(AspectFeed, AReaderIsAsTheWriterWasAfterSomeList) {
    Aspect scene = hall();
    AspectFeed feed;
    const std::unique_ptr<AspectReader> reader = feed.join(scene);
    const StateHash before = scene.stateHash();
    feed.publish(scene, moved(scene, 7));
    EXPECT_EQ(reader->scene().stateHash(), before) << "until it likes";
    EXPECT_TRUE(*reader->catchUp());
    EXPECT_EQ(reader->scene().stateHash(), scene.stateHash());
    EXPECT_EQ(reader->number(), 1u);
    EXPECT_FALSE(*reader->catchUp());
    const std::unique_ptr<AspectReader> later = feed.join(scene);
    EXPECT_EQ(later->scene().stateHash(), scene.stateHash());
}

TEST(AspectFeed, ForAReaderThatSleepsItKeepsWhatItNeedsAndNoMore) {
    Aspect scene = hall();
    AspectFeed feed;
    const std::unique_ptr<AspectReader> reader = feed.join(scene);
    for (int i = 0; i < 10'000; ++i) feed.publish(scene, moved(scene, i));
    EXPECT_LE(feed.waiting(), 2u) << "one place in 10,000 lists is one value";
    EXPECT_TRUE(*reader->catchUp());
    EXPECT_EQ(reader->number(), AspectFeed::kQueued);
    feed.publish(scene, nullptr);
    EXPECT_TRUE(*reader->catchUp());
    EXPECT_EQ(reader->number(), 10'000u);
    EXPECT_EQ(reader->scene().stateHash(), scene.stateHash());
    EXPECT_EQ(feed.waiting(), 0u);
}

TEST(AspectFeed, ReadersComeAndGoAndAListThatWasLeftOutIsNoticed) {
    Aspect scene = hall();
    AspectFeed feed;
    std::unique_ptr<AspectReader> reader = feed.join(scene);
    reader.reset();
    feed.publish(scene, moved(scene, 1));
    EXPECT_EQ(feed.readers(), 0u);
    reader = feed.join(scene);
    (void)moved(scene, 2);
    Edits edits;
    edits.node(9, "new");
    const auto list = std::make_shared<const ChangeList>(edits.take());
    mustApply(scene, *list);
    feed.publish(scene, list);
    const Expected<bool> caught = reader->catchUp();
    ASSERT_FALSE(caught);
    EXPECT_EQ(caught.error().code, ErrorCode::kFailed);
}

// Readers of every pace beside a writer that never waits: each state that anybody sees is one that the writer had, and
// in the end it is the last one.
TEST(AspectFeed, ReadersInThreadsOfTheirOwnSeeStatesThatWere) {
    forSeeds(8, [](Random& random) {
        constexpr int kReaders = 4;
        Aspect scene = hall();
        AspectFeed feed;
        std::vector<std::unique_ptr<AspectReader>> readers;
        for (int i = 0; i < kReaders; ++i) readers.push_back(feed.join(scene));
        std::atomic<std::uint64_t> last{0};  // 0: it goes on
        std::atomic<bool> stop{false};
        std::array<std::atomic<bool>, kReaders> fine{};
        std::vector<std::thread> threads;
        for (int i = 0; i < kReaders; ++i)
            threads.emplace_back([&, i, own = Random(static_cast<std::uint64_t>(i))]() mutable {
                AspectReader& reader = *readers[static_cast<std::size_t>(i)];
                while (!stop) {
                    const std::uint64_t end = last;
                    const Expected<bool> caught = reader.catchUp();
                    if (!caught) return;
                    if (end != 0 && reader.number() == end) {
                        fine[static_cast<std::size_t>(i)] = true;
                        return;
                    }
                    // Reads all of its scene meanwhile.
                    std::size_t sum = 0;
                    for (const ObjectId id : reader.scene().ids()) sum += reader.scene().find(id).is<Node>();
                    if (sum == 0) return;
                    if (i > 0 && !*caught) test::aMoment(own, std::chrono::microseconds(100 << (2 * i)));
                }
            });
        std::uint64_t published = 0, nextId = 100;
        std::vector<std::uint64_t> nodes;
        for (int turn = 0; turn < 3000; ++turn) {
            Edits edits;
            if (nodes.empty() || oneIn(random, 3)) {
                nodes.push_back(nextId);
                edits.node(nextId++, "n", kRootNode.value);
            } else if (oneIn(random, 3)) {
                const std::size_t at = below(random, nodes.size());
                edits.detach(ObjectId(nodes[at]));
                edits.gone(nodes[at]);
                nodes.erase(nodes.begin() + static_cast<std::ptrdiff_t>(at));
            } else {
                edits.value<Node>(nodes[below(random, nodes.size())], fieldId<&Node::name>,
                                  toValue(std::string("n") + std::to_string(turn)));
            }
            const auto list = std::make_shared<const ChangeList>(edits.take());
            mustApply(scene, *list);
            feed.publish(scene, list);
            ++published;
        }
        last = published;
        const auto allDone = [&] {
            return std::ranges::all_of(fine, [](const std::atomic<bool>& one) { return one.load(); });
        };
        EXPECT_TRUE(test::eventually([&] {
            feed.publish(scene, nullptr);
            return allDone();
        }));
        stop = true;
        for (std::thread& thread : threads) thread.join();
        for (const auto& reader : readers) EXPECT_EQ(reader->scene().stateHash(), scene.stateHash());
    });
}

}  // namespace
}  // namespace tessera
