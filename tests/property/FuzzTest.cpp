// No sequence of bytes crashes decode or apply.
#include <gtest/gtest.h>

#include <cstring>

#include "common/codec/ChangeCodec.h"
#include "common/codec/FrameCodec.h"
#include "tests/property/SceneModel.h"

namespace tessera {
namespace {

/// Whatever came of the bytes: an applied list leaves a scene that its own snapshot describes.
void decodeAndApply(ByteSpan bytes, Aspect& aspect, std::size_t& decodedLists, std::size_t& appliedLists) {
    const auto list = decodeChangeList(bytes, blobStore(), AbsentBlobs::kKeepAbsent);
    if (!list) return;
    ++decodedLists;
    const StateHash before = aspect.stateHash();
    const auto undo = aspect.applyWithInverse(*list);
    if (!undo) {
        ASSERT_EQ(aspect.stateHash(), before);
        return;
    }
    ++appliedLists;
    Aspect copy;
    const Expected<void> done = copy.apply(snapshot(aspect));
    ASSERT_TRUE(done) << done.error().message;
    ASSERT_EQ(copy.stateHash(), aspect.stateHash());
    ASSERT_TRUE(aspect.apply(*undo));
    ASSERT_EQ(aspect.stateHash(), before);
}

void damage(Bytes& bytes, Random& random) {
    for (std::size_t n = 1 + below(random, 4); n > 0 && !bytes.empty(); --n) {
        const std::size_t at = below(random, bytes.size());
        switch (below(random, 6)) {
            case 0:
                bytes[at] ^= static_cast<std::byte>(1u << below(random, 8));
                break;
            case 1:
                bytes[at] = static_cast<std::byte>(random());
                break;
            case 2: {  // a number somewhere becomes an extreme one
                const std::uint64_t extremes[] = {0, 1, 0x7fffffff, 0xffffffff, 1ull << 63, ~0ull};
                const std::uint64_t extreme = extremes[below(random, 6)];
                std::memcpy(bytes.data() + at, &extreme, std::min<std::size_t>(8, bytes.size() - at));
                break;
            }
            case 3:
                bytes.resize(at);
                break;
            case 4: {  // one stretch over another
                const std::size_t length = std::min<std::size_t>(8 * (1 + below(random, 3)), bytes.size() - at);
                std::memmove(bytes.data() + at, bytes.data() + below(random, bytes.size() - length + 1), length);
                break;
            }
            default:
                bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(at), 1 + below(random, 8),
                             static_cast<std::byte>(random()));
        }
    }
}

TEST(Fuzz, DamagedListsAreRefusedOrApplied) {
    std::size_t decoded = 0, applied = 0;
    forSeeds(40, [&](Random& random) {
        SceneModel model;
        Aspect aspect;
        for (int i = 0; i < 25; ++i) {
            const ChangeList list = model.nextList(random);
            const Bytes good = encodeChangeList(list);
            for (int attempt = 0; attempt < 25; ++attempt) {
                Bytes bytes = good;
                damage(bytes, random);
                decodeAndApply(bytes, aspect, decoded, applied);
                if (testing::Test::HasFailure()) return;
            }
            ASSERT_TRUE(aspect.apply(list));
        }
    });
    if (std::getenv("TESSERA_SEED")) return;
    EXPECT_GT(decoded, 1000u) << "the damage never reaches apply";
    EXPECT_GT(applied, 100u) << "the damage is always refused: it tests nothing behind the checks";
}

TEST(Fuzz, RandomBytesAreRefused) {
    forSeeds(2000, [](Random& random) {
        Bytes bytes(below(random, 300));
        for (std::byte& b : bytes) b = static_cast<std::byte>(oneIn(random, 2) ? 0 : random());
        EXPECT_FALSE(decodeChangeList(bytes, blobStore()));
        (void)decodeFrame(bytes);
        (void)decodeStats(bytes);
    });
}

TEST(Fuzz, DamagedFramesAndStatisticsAreRefusedOrWhole) {
    FramePayload payload;
    payload.view.users = {User(), User()};
    const Bytes frame = encodeFrame(payload);
    const Bytes stats = encodeStats({{{"front-0-0", 1, 2, 3, 4, 5}, {"front-0-1", 1, 2, 3, 4, 5}}, 6, 7, 8});
    forSeeds(3000, [&](Random& random) {
        Bytes bytes = frame;
        damage(bytes, random);
        if (const auto decoded = decodeFrame(bytes)) {
            EXPECT_TRUE(decoded->view.position.allFinite());
            EXPECT_GT(decoded->view.worldUnitsPerMetre, 0);
        }
        bytes = stats;
        damage(bytes, random);
        const auto host = decodeStats(bytes);
        if (!host) return;
        EXPECT_GE(host->workMs, 0);
        for (const TileStats& tile : host->tiles) EXPECT_GE(tile.cullMs, 0);
    });
}

}  // namespace
}  // namespace tessera
