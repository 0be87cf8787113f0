/// Lists of changes as JSON: each field of each type, there and back.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "common/codec/ChangeCodec.h"
#include "common/json/ChangeJson.h"
#include "common/scene/FieldTable.h"
#include "tests/support/words/Words.h"

namespace tessera {
namespace {

ChangeList listOf(const ByteSlice& encoded) {
    const Expected<ChangeList> list = decodeChangeList(encoded, BlobStore(), AbsentBlobs::kKeepAbsent);
    EXPECT_TRUE(list) << list.error().message;
    return list ? *list : ChangeList{};
}
ByteSlice readList(const Json& json, std::span<const ByteSlice> binaries, std::vector<Blob>& arrays,
                   std::optional<ApiError>& fault) {
    JsonPlace place;
    ByteSlice bytes = changesIn(place, json, binaries, {}, arrays);
    fault = place.fault();
    return bytes;
}

/// Whatever a fresh object of any type holds can be said, and comes back the same.
TEST(ChangeJson, EachFieldOfEachTypeThereAndBack) {
    ChangeListBuilder builder;
    std::uint64_t id = kFirstPlaceholder;
    for (const TypeInfo& type : allTypes()) {
        builder.create(ObjectId(id), type.type);
        for (const FieldEntry& field : type.fields)
            builder.set(ObjectId(id), type.type, field.id, field.load(type.freshObject()));
        ++id;
    }
    builder.place(ObjectId(kFirstPlaceholder), kRootNode, 3);
    builder.detach(ObjectId(7));
    builder.destroy(ObjectId(9));
    const ChangeList list = builder.take();
    std::vector<Blob> arrays;
    std::optional<ApiError> fault;
    const ByteSlice back = readList(*parseJson(jsonText(changesJson(list))), {}, arrays, fault);
    ASSERT_FALSE(fault) << fault->message;
    EXPECT_EQ(listOf(back), list);
}

TEST(ChangeJson, RowsOfNumbersComeAsBinaries) {
    const TypeInfo& type = *findType("Transform");
    const FieldEntry& field = *findField(type, "translation");
    const std::vector<std::uint64_t> ids{17, 18};
    const std::vector<double> values{1, 2, 3, 4, 5, 6};
    const auto bytesOf = [](const auto& numbers) {
        const auto* from = reinterpret_cast<const std::byte*>(numbers.data());
        return ByteSlice(Bytes(from, from + numbers.size() * sizeof(numbers[0])));
    };
    const std::vector<ByteSlice> binaries{bytesOf(ids), bytesOf(values)};
    ASSERT_EQ(field.kind, FieldKind::kDouble);
    const Json json =
        *parseJson(R"({"set":[{"type":"Transform","field":"translation","ids":{"binary":0},"values":{"binary":1}}]})");
    std::vector<Blob> arrays;
    std::optional<ApiError> fault;
    const ByteSlice bytes = readList(json, binaries, arrays, fault);
    ASSERT_FALSE(fault) << fault->message;
    const ChangeList list = listOf(bytes);
    ASSERT_EQ(list.columns.size(), 1u);
    EXPECT_EQ(std::get<std::vector<double>>(list.columns[0].values), values);
    EXPECT_EQ(list.columns[0].ids, (std::vector{ObjectId(17), ObjectId(18)}));

    const std::vector<ByteSlice> tooShort{binaries[0], bytesOf(std::vector<double>{1, 2, 3, 4, 5})};
    readList(json, tooShort, arrays, fault);
    ASSERT_TRUE(fault);
    EXPECT_WORDS(fault->message);
}

TEST(ChangeJson, ArraysComeAsBinariesAndGoBefore) {
    const std::vector<ByteSlice> binaries{ByteSlice(Bytes(24, std::byte{1}))};
    const Json json = *parseJson(R"({"set":[{"type":"Geometry","field":"positions","ids":[5],"values":[{"binary":0}]}],
        "parts":[{"object":5,"type":"Geometry","field":"normals","offset":8,"bytes":{"binary":0}}]})");
    std::vector<Blob> arrays;
    std::optional<ApiError> fault;
    const ByteSlice bytes = readList(json, binaries, arrays, fault);
    ASSERT_FALSE(fault) << fault->message;
    ASSERT_FALSE(arrays.empty());
    EXPECT_EQ(arrays[0].id(), blobIdOf(binaries[0]));
    const ChangeList list = listOf(bytes);
    ASSERT_EQ(list.ranges.size(), 1u);
    EXPECT_EQ(list.ranges[0].offset, 8u);
}

}  // namespace
}  // namespace tessera
