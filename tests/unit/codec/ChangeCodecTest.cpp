#include "common/codec/ChangeCodec.h"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "common/codec/Parts.h"
#include "common/scene/FieldTable.h"
#include "proto/change.pb.h"
#include "tests/support/words/Words.h"
#include "tests/unit/codec/Samples.h"

namespace tessera {
namespace {

using namespace test;

TEST(ChangeCodec, DecodesWhatItEncoded) {
    BlobStore store;
    const Blob blob = store.add(blobOf(1));
    const ChangeList list = richList(blob);
    const auto decoded = decodeChangeList(encodeChangeList(list), store);
    ASSERT_TRUE(decoded) << decoded.error().message;
    EXPECT_EQ(*decoded, list);
}

TEST(ChangeCodec, DecodesTheEmptyList) {
    const auto decoded = decodeChangeList(encodeChangeList({}), BlobStore());
    ASSERT_TRUE(decoded);
    EXPECT_TRUE(decoded->empty());
}

TEST(ChangeCodec, SharesTheBytesOfABlobThatIsHere) {
    BlobStore store;
    const Blob blob = store.add(blobOf(1));
    const auto decoded = decodeChangeList(encodeChangeList(richList(blob)), store);
    for (const FieldColumn& column : decoded->columns)
        if (const auto* blobs = std::get_if<std::vector<Blob>>(&column.values)) {
            EXPECT_EQ(blobs->at(0).bytes().data(), blob.bytes().data());
            EXPECT_TRUE(blobs->at(1).empty());
        }
}

TEST(ChangeCodec, RefusesOrKeepsAnAbsentBlobAsItIsTold) {
    const Blob blob = blobOf(2);
    const Bytes bytes = encodeChangeList(richList(blob));
    const auto refused = decodeChangeList(bytes, BlobStore());
    ASSERT_FALSE(refused);
    EXPECT_WORDS(refused.error().message);

    const auto kept = decodeChangeList(bytes, BlobStore(), AbsentBlobs::kKeepAbsent);
    ASSERT_TRUE(kept);
    EXPECT_EQ(*kept, richList(blob));
    for (const FieldColumn& column : kept->columns)
        if (const auto* blobs = std::get_if<std::vector<Blob>>(&column.values)) {
            EXPECT_FALSE(blobs->at(0).resident());
            EXPECT_EQ(blobs->at(0).sizeBytes(), 12u);
        }
}

TEST(ChangeCodec, RefusesABlobWhoseSizeIsNotTheKnownOne) {
    BlobStore store;
    const Blob blob = store.add(blobOf(3));
    const auto decoded = decodeChangeList(encodeChangeList(richList(Blob::absent(blob.id(), 99))), store);
    ASSERT_FALSE(decoded);
    EXPECT_WORDS(decoded.error().message);
}

TEST(ChangeCodec, RefusesEveryTruncation) {
    BlobStore store;
    const Bytes bytes = encodeChangeList(richList(store.add(blobOf(1))));
    for (std::size_t size = 0; size < bytes.size(); ++size)
        EXPECT_FALSE(decodeChangeList(ByteSpan(bytes).first(size), store)) << size;
    Bytes longer = bytes;
    longer.push_back(std::byte{0});
    EXPECT_FALSE(decodeChangeList(longer, store));
}

TEST(ChangeCodec, HoldsItsLimits) {
    BlobStore store;
    const ChangeList list = richList(store.add(blobOf(1)));
    const Bytes bytes = encodeChangeList(list);
    const auto codeUnder = [&](const ChangeLimits& limits) {
        const auto decoded = decodeChangeList(bytes, store, AbsentBlobs::kRefuse, limits);
        return decoded ? ErrorCode::kFailed : decoded.error().code;
    };
    EXPECT_EQ(codeUnder({.maxBytes = bytes.size() - 1}), ErrorCode::kLimit);
    EXPECT_EQ(codeUnder({.maxChanges = list.changeCount() - 1}), ErrorCode::kLimit);
    EXPECT_EQ(codeUnder({.maxColumns = list.columns.size() - 1}), ErrorCode::kLimit);
    EXPECT_EQ(codeUnder({.maxTextBytes = 8}), ErrorCode::kLimit);
    EXPECT_TRUE(decodeChangeList(bytes, store, AbsentBlobs::kRefuse,
                                 {.maxBytes = bytes.size(),
                                  .maxChanges = list.changeCount(),
                                  .maxColumns = list.columns.size(),
                                  .maxTextBytes = 9}));
}

// ---- heads and parts that our encoder never makes ------------------------------------------------------------------

struct Forgery {
    proto::change::ListHead head;
    std::vector<Bytes> parts = std::vector<Bytes>(8);

    Forgery& column(std::uint32_t type, std::uint32_t field, int kind, std::uint32_t width, std::size_t idBytes,
                    std::size_t valueBytes) {
        proto::change::Column& c = *head.add_columns();
        c.set_type(type);
        c.set_field(field);
        c.set_kind(static_cast<proto::change::Column::Kind>(kind));
        c.set_width(width);
        parts.emplace_back(idBytes);
        parts.emplace_back(valueBytes);
        return *this;
    }
    [[nodiscard]] std::string error() const {
        std::vector<ByteSpan> spans(parts.begin(), parts.end());
        const auto decoded = decodeChangeList(joinParts(head, spans), BlobStore());
        return decoded ? "" : decoded.error().message;
    }
};

TEST(ChangeCodec, ExplainsWhatIsWrongWithAForgedList) {
    EXPECT_EQ(Forgery().error(), "");
    EXPECT_EQ(Forgery().column(3, 1, 1, 3, 16, 48).error(), "");
    EXPECT_EQ(Forgery().column(3, 1, 1, 3, 16, 40).error(), "change list: 40 bytes for 6 scalars");
    EXPECT_EQ(Forgery().column(3, 1, 1, 3, 15, 48).error(), "change list: the ids of a column are cut off");
    EXPECT_EQ(Forgery().column(3, 1, 1, 5, 16, 80).error(), "change list: a column of width 5");
    EXPECT_EQ(Forgery().column(3, 1, 1, 0, 16, 0).error(), "change list: a column of width 0");
    EXPECT_EQ(Forgery().column(3, 1, 2, 2, 16, 32).error(), "change list: a column of width 2");
    EXPECT_EQ(Forgery().column(3, 1, 9, 1, 8, 8).error(), "change list: field kind 9 is unknown");
    EXPECT_EQ(Forgery().column(65536, 1, 2, 1, 8, 8).error(), "change list: a type or field number is past 65535");
    EXPECT_EQ(Forgery().column(1, 1, 4, 1, 8, 3).error(), "change list: texts are cut off");
    EXPECT_EQ(Forgery().column(1, 1, 4, 1, 8, 5).error(), "change list: bytes are left over behind the texts");
    EXPECT_EQ(Forgery().column(4, 1, 5, 1, 8, 23).error(), "change list: blob names are cut off");

    EXPECT_EQ(Forgery().column(3, 1, 6, 1, 8, 2).error(), "change list: 2 bytes for 1 scalars");
    EXPECT_EQ(Forgery().column(3, 1, 7, 1, 8, 3).error(), "change list: lists of references are cut off");
    EXPECT_EQ(Forgery().column(3, 1, 7, 1, 8, 12).error(), "change list: bytes are left over behind the references");
    EXPECT_EQ(Forgery().column(3, 1, 8, 1, 8, 127).error(), "change list: 127 bytes for 1 scalars");
    Forgery endless = Forgery().column(3, 1, 7, 1, 8, 12);
    std::memset(endless.parts.back().data(), 0xff, 4);
    EXPECT_EQ(endless.error(), "change list: lists of references are cut off");
    Forgery ranges;
    ranges.parts[6].resize(56);
    EXPECT_EQ(ranges.error(), "change list: a range has no bytes");
    ranges.parts[6][16] = std::byte{4};
    ranges.parts[7].resize(3);
    EXPECT_EQ(ranges.error(), "change list: the bytes of a range are cut off");
    ranges.parts[7].resize(5);
    EXPECT_EQ(ranges.error(), "change list: bytes are left over behind the ranges");
    ranges.parts[7].resize(4);
    EXPECT_EQ(ranges.error(), "");
    ranges.parts[6].resize(55);
    EXPECT_EQ(ranges.error(), "change list: ranges are cut off");

    Forgery sized = Forgery().column(4, 1, 5, 1, 8, 24);
    sized.parts.back()[16] = std::byte{1};
    EXPECT_EQ(sized.error(), "change list: a blob without a name has a size");
    Forgery longText = Forgery().column(1, 1, 4, 1, 8, 4);
    std::memset(longText.parts.back().data(), 0xff, 4);
    EXPECT_EQ(longText.error(), "change list: a text of 4294967295 bytes, more than the limit of 4096");
    Forgery creations;
    creations.parts[0].resize(16);
    creations.parts[1].resize(2);
    EXPECT_EQ(creations.error(), "change list: ids and types of creations differ in number");
    Forgery placements;
    placements.parts[2].resize(8);
    placements.parts[3].resize(8);
    EXPECT_EQ(placements.error(), "change list: nodes, parents and indices of placements differ in number");
    Forgery missing = Forgery().column(3, 1, 1, 3, 16, 48);
    missing.head.clear_columns();
    EXPECT_EQ(missing.error(), "change list: 0 columns are named, 1 are there");
    Forgery odd;
    odd.parts.emplace_back();
    EXPECT_EQ(odd.error(), "change list: 9 parts");
}

TEST(ChangeCodec, RefusesFieldsOfANewerSchema) {
    proto::change::ListHead head;
    std::string bytes = head.SerializeAsString() + std::string("\xA0\x06\x01", 3);  // field 100, varint 1
    ASSERT_TRUE(head.ParseFromString(bytes));
    std::vector<Bytes> empty(8);
    const auto decoded =
        decodeChangeList(joinParts(head, std::vector<ByteSpan>(empty.begin(), empty.end())), BlobStore());
    ASSERT_FALSE(decoded);
    EXPECT_WORDS(decoded.error().message);
}

TEST(ChangeCodec, RefusesAHeadOfCountlessEmptyColumnsBeforeItBecomesObjects) {
    // 10 MiB of two-byte sub-messages would become hundreds of MiB of objects.
    const std::size_t count = 5u << 20;
    Bytes bytes(8 + 8 * 8);
    const std::uint32_t headBytes = 2 * count, parts = 8;
    std::memcpy(bytes.data(), &headBytes, 4);
    std::memcpy(bytes.data() + 4, &parts, 4);
    for (std::size_t i = 0; i < count; ++i) {
        bytes.push_back(std::byte{0x0A});
        bytes.push_back(std::byte{0x00});
    }
    const auto decoded = decodeChangeList(bytes, BlobStore());
    ASSERT_FALSE(decoded);
    EXPECT_EQ(decoded.error().code, ErrorCode::kLimit);
}

}  // namespace
}  // namespace tessera
