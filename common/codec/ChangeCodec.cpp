#include "common/codec/ChangeCodec.h"

#include <fmt/core.h>
#include <google/protobuf/unknown_field_set.h>

#include <algorithm>
#include <limits>

#include "common/codec/Parts.h"
#include "proto/change.pb.h"

namespace tessera {

namespace {

enum ListPart : std::size_t {
    kCreationIds,
    kCreationTypes,
    kPlacementNodes,
    kPlacementParents,
    kPlacementIndices,
    kDestructions,
    kRanges,      ///< RangeRecord each
    kRangeBytes,  ///< of all ranges, one behind the other
    kFirstColumnPart
};
constexpr std::size_t kPartsPerColumn = 2;
/// A column's entry in the head takes 4 small numbers; unknown fields have no room beside them.
constexpr std::size_t kHeadBytesPerColumn = 24;

/// As it stands on the wire.
struct BlobRecord {
    std::uint64_t low = 0, high = 0, sizeBytes = 0;
};

struct RangeRecord {
    std::uint64_t object = 0, offset = 0, sizeBytes = 0;
    std::uint16_t type = 0, field = 0;
    std::uint32_t unused = 0;
    BlobRecord result;
};
static_assert(sizeof(RangeRecord) == 56);

static_assert(sizeof(ObjectId) == 8 && sizeof(ObjectType) == 2, "ids are written as they lie in memory");

template <typename T>
ByteSpan bytesOf(const std::vector<T>& values) {
    static_assert(std::is_trivially_copyable_v<T>);
    return std::as_bytes(std::span(values));
}

template <typename T>
void append(Bytes& out, const T& value) {
    const ByteSpan bytes = std::as_bytes(std::span(&value, 1));
    out.insert(out.end(), bytes.begin(), bytes.end());
}

// ---- encoding ------------------------------------------------------------------------------------------------------

Bytes packTexts(const std::vector<std::string>& texts) {
    Bytes packed;
    std::size_t total = sizeof(std::uint32_t) * texts.size();
    for (const std::string& text : texts) total += text.size();
    packed.reserve(total);
    for (const std::string& text : texts) append(packed, static_cast<std::uint32_t>(text.size()));
    for (const std::string& text : texts) {
        const ByteSpan bytes = asBytes(text);
        packed.insert(packed.end(), bytes.begin(), bytes.end());
    }
    return packed;
}

BlobRecord recordOf(const Blob& blob) {
    return {blob.id().low, blob.id().high, blob.sizeBytes()};
}

Bytes packBlobs(const std::vector<Blob>& blobs) {
    Bytes packed;
    packed.reserve(sizeof(BlobRecord) * blobs.size());
    for (const Blob& blob : blobs) append(packed, recordOf(blob));
    return packed;
}

Bytes packRefs(const std::vector<RefList>& lists) {
    Bytes packed;
    for (const RefList& refs : lists) append(packed, static_cast<std::uint32_t>(refs.size()));
    for (const RefList& refs : lists) {
        const ByteSpan bytes = bytesOf(refs);
        packed.insert(packed.end(), bytes.begin(), bytes.end());
    }
    return packed;
}

// ---- decoding ------------------------------------------------------------------------------------------------------

tl::unexpected<Error> bad(std::string what) {
    return fail(ErrorCode::kBadInput, "change list: " + std::move(what));
}

/// The caller has bounded the size of the whole, so copying a part takes no more than that.
template <typename T>
std::vector<T> copyAs(ByteSpan bytes) {
    std::vector<T> values(bytes.size() / sizeof(T));
    if (!values.empty()) std::memcpy(values.data(), bytes.data(), values.size() * sizeof(T));
    return values;
}

template <typename T>
bool isWhole(ByteSpan bytes) {
    return bytes.size() % sizeof(T) == 0;
}

template <typename T>
Expected<FieldColumn::Values> decodeScalars(ByteSpan bytes, std::size_t count) {
    if (bytes.size() / sizeof(T) != count || !isWhole<T>(bytes))
        return bad(fmt::format("{} bytes for {} scalars", bytes.size(), count));
    return copyAs<T>(bytes);
}

Expected<FieldColumn::Values> decodeTexts(ByteSpan bytes, std::size_t rows, std::size_t maxTextBytes) {
    if (bytes.size() / sizeof(std::uint32_t) < rows) return bad("texts are cut off");
    const std::vector<std::uint32_t> lengths = copyAs<std::uint32_t>(bytes.first(rows * sizeof(std::uint32_t)));
    bytes = bytes.subspan(rows * sizeof(std::uint32_t));
    std::vector<std::string> texts;
    texts.reserve(rows);
    for (const std::uint32_t length : lengths) {
        if (length > maxTextBytes)
            return fail(ErrorCode::kLimit, fmt::format("change list: a text of {} bytes, more than the limit of {}",
                                                       length, maxTextBytes));
        if (length > bytes.size()) return bad("texts are cut off");
        texts.emplace_back(asText(bytes.first(length)));
        bytes = bytes.subspan(length);
    }
    if (!bytes.empty()) return bad("bytes are left over behind the texts");
    return texts;
}

Expected<FieldColumn::Values> decodeRefs(ByteSpan bytes, std::size_t rows) {
    if (bytes.size() / sizeof(std::uint32_t) < rows) return bad("lists of references are cut off");
    const std::vector<std::uint32_t> counts = copyAs<std::uint32_t>(bytes.first(rows * sizeof(std::uint32_t)));
    bytes = bytes.subspan(rows * sizeof(std::uint32_t));
    std::vector<RefList> lists;
    lists.reserve(rows);
    for (const std::uint32_t count : counts) {
        if (count > bytes.size() / sizeof(ObjectId)) return bad("lists of references are cut off");
        lists.push_back(copyAs<ObjectId>(bytes.first(count * sizeof(ObjectId))));
        bytes = bytes.subspan(count * sizeof(ObjectId));
    }
    if (!bytes.empty()) return bad("bytes are left over behind the references");
    return lists;
}

Expected<std::vector<RangeEdit>> decodeRanges(ByteSpan records, ByteSpan bytes) {
    std::vector<RangeEdit> ranges;
    ranges.reserve(records.size() / sizeof(RangeRecord));
    for (const RangeRecord& record : copyAs<RangeRecord>(records)) {
        if (record.sizeBytes == 0) return bad("a range has no bytes");
        if (record.sizeBytes > bytes.size()) return bad("the bytes of a range are cut off");
        const ByteSpan own = bytes.first(record.sizeBytes);
        bytes = bytes.subspan(record.sizeBytes);
        // Never a handle that is here: whoever applies the list makes the array and compares.
        ranges.push_back({ObjectId(record.object), ObjectType(record.type), FieldId(record.field), record.offset,
                          Blob(Bytes(own.begin(), own.end())),
                          Blob::absent({record.result.low, record.result.high}, record.result.sizeBytes)});
    }
    if (!bytes.empty()) return bad("bytes are left over behind the ranges");
    return ranges;
}

Expected<FieldColumn::Values> decodeBlobs(ByteSpan bytes, std::size_t rows, const BlobStore& store,
                                          AbsentBlobs absent) {
    if (bytes.size() / sizeof(BlobRecord) != rows || !isWhole<BlobRecord>(bytes)) return bad("blob names are cut off");
    std::vector<Blob> blobs;
    blobs.reserve(rows);
    for (const BlobRecord& record : copyAs<BlobRecord>(bytes)) {
        const BlobId id{record.low, record.high};
        if (!id) {
            if (record.sizeBytes != 0) return bad("a blob without a name has a size");
            blobs.emplace_back();
            continue;
        }
        Blob blob = store.find(id);
        if (blob.empty()) {
            if (absent == AbsentBlobs::kRefuse)
                return fail(ErrorCode::kNotFound,
                            fmt::format("change list: blob {} ({} bytes) is not here", toHex(id), record.sizeBytes));
            blob = Blob::absent(id, record.sizeBytes);
        } else if (blob.sizeBytes() != record.sizeBytes) {
            return bad(fmt::format("blob {} has {} bytes, not {}", toHex(id), blob.sizeBytes(), record.sizeBytes));
        }
        blobs.push_back(std::move(blob));
    }
    return blobs;
}

struct Decoding {
    const BlobStore& store;
    AbsentBlobs absent;
    const ChangeLimits& limits;
};

Expected<FieldColumn> decodeColumn(const proto::change::Column& head, ByteSpan ids, ByteSpan values,
                                   const Decoding& how) {
    constexpr std::uint32_t kMaxNumber = std::numeric_limits<std::uint16_t>::max();
    if (head.type() > kMaxNumber || head.field() > kMaxNumber) return bad("a type or field number is past 65535");
    if (!proto::change::Column::Kind_IsValid(head.kind()))
        return bad(fmt::format("field kind {} is unknown", int(head.kind())));
    const auto kind = static_cast<FieldKind>(head.kind());
    const std::uint32_t maxWidth = kind == FieldKind::kFloat || kind == FieldKind::kDouble ? 4 : 1;
    if (head.width() < 1 || head.width() > maxWidth) return bad(fmt::format("a column of width {}", head.width()));

    FieldColumn column;
    column.type = ObjectType(static_cast<std::uint16_t>(head.type()));
    column.field = FieldId(static_cast<std::uint16_t>(head.field()));
    column.width = static_cast<std::uint8_t>(head.width());
    column.ids = copyAs<ObjectId>(ids);
    const std::size_t rows = column.ids.size();
    const std::size_t scalars = rows * column.width;
    Expected<FieldColumn::Values> decoded;
    switch (kind) {
        case FieldKind::kFloat:
            decoded = decodeScalars<float>(values, scalars);
            break;
        case FieldKind::kDouble:
            decoded = decodeScalars<double>(values, scalars);
            break;
        case FieldKind::kInt:
            decoded = decodeScalars<std::int64_t>(values, scalars);
            break;
        case FieldKind::kRef:
            decoded = decodeScalars<ObjectId>(values, scalars);
            break;
        case FieldKind::kText:
            decoded = decodeTexts(values, rows, how.limits.maxTextBytes);
            break;
        case FieldKind::kBlob:
            decoded = decodeBlobs(values, rows, how.store, how.absent);
            break;
        case FieldKind::kBool:
            decoded = decodeScalars<std::uint8_t>(values, scalars);
            break;
        case FieldKind::kRefs:
            decoded = decodeRefs(values, rows);
            break;
        case FieldKind::kMatrix:
            decoded = decodeScalars<Matrix>(values, scalars);
            break;
    }
    if (!decoded) return tl::unexpected(decoded.error());
    column.values = std::move(*decoded);
    return column;
}

/// Sizes of the parts that every list has, and the number of changes in all of them.
Expected<void> checkParts(const SplitParts& split, const ChangeLimits& limits) {
    if (split.parts.size() < kFirstColumnPart || (split.parts.size() - kFirstColumnPart) % kPartsPerColumn != 0)
        return bad(fmt::format("{} parts", split.parts.size()));
    const std::size_t creations = split.parts[kCreationIds].size() / sizeof(ObjectId);
    const std::size_t placements = split.parts[kPlacementNodes].size() / sizeof(ObjectId);
    if (!isWhole<ObjectId>(split.parts[kCreationIds]) ||
        split.parts[kCreationTypes].size() != creations * sizeof(ObjectType))
        return bad("ids and types of creations differ in number");
    if (!isWhole<ObjectId>(split.parts[kPlacementNodes]) ||
        split.parts[kPlacementParents].size() != placements * sizeof(ObjectId) ||
        split.parts[kPlacementIndices].size() != placements * sizeof(std::uint32_t))
        return bad("nodes, parents and indices of placements differ in number");
    if (!isWhole<ObjectId>(split.parts[kDestructions])) return bad("destructions are cut off");
    if (!isWhole<RangeRecord>(split.parts[kRanges])) return bad("ranges are cut off");
    std::size_t changes = creations + placements + split.parts[kDestructions].size() / sizeof(ObjectId) +
                          split.parts[kRanges].size() / sizeof(RangeRecord);
    for (std::size_t part = kFirstColumnPart; part < split.parts.size(); part += kPartsPerColumn) {
        if (!isWhole<ObjectId>(split.parts[part])) return bad("the ids of a column are cut off");
        changes += split.parts[part].size() / sizeof(ObjectId);
    }
    if (changes > limits.maxChanges)
        return fail(ErrorCode::kLimit,
                    fmt::format("change list: {} changes, more than the limit of {}", changes, limits.maxChanges));
    return {};
}

Expected<proto::change::ListHead> parseHead(const SplitParts& split) {
    proto::change::ListHead head;
    if (!head.ParseFromArray(split.head.data(), static_cast<int>(split.head.size()))) return bad("its head is damaged");
    const auto isKnown = [](const google::protobuf::Message& message) {
        return message.GetReflection()->GetUnknownFields(message).empty();
    };
    if (!isKnown(head) || !std::all_of(head.columns().begin(), head.columns().end(), isKnown))
        return bad("its head has fields that this version does not know");
    const std::size_t columns = (split.parts.size() - kFirstColumnPart) / kPartsPerColumn;
    if (static_cast<std::size_t>(head.columns_size()) != columns)
        return bad(fmt::format("{} columns are named, {} are there", head.columns_size(), columns));
    return head;
}

}  // namespace

Bytes encodeChangeList(const ChangeList& list) {
    proto::change::ListHead head;
    head.set_next_free_id(list.nextFreeId);

    const std::size_t placements = list.placements.size();
    std::vector<ObjectId> creationIds(list.creations.size()), nodes(placements), parents(placements);
    std::vector<ObjectType> creationTypes(list.creations.size());
    std::vector<std::uint32_t> indices(placements);
    for (std::size_t i = 0; i < list.creations.size(); ++i) {
        creationIds[i] = list.creations[i].id;
        creationTypes[i] = list.creations[i].type;
    }
    for (std::size_t i = 0; i < placements; ++i) {
        nodes[i] = list.placements[i].node;
        parents[i] = list.placements[i].parent;
        indices[i] = list.placements[i].index;
    }
    std::vector<RangeRecord> ranges;
    Bytes rangeBytes;
    for (const RangeEdit& range : list.ranges) {
        ranges.push_back({range.object.value, range.offset, range.bytes.sizeBytes(), range.type.value,
                          range.field.value, 0, recordOf(range.result)});
        const ByteSpan own = range.bytes.bytes();
        rangeBytes.insert(rangeBytes.end(), own.begin(), own.end());
    }
    std::vector<ByteSpan> parts = {bytesOf(creationIds), bytesOf(creationTypes),     bytesOf(nodes),  bytesOf(parents),
                                   bytesOf(indices),     bytesOf(list.destructions), bytesOf(ranges), rangeBytes};
    std::vector<Bytes> packed;  // texts and blobs; reserved, so that spans on its elements stay
    packed.reserve(list.columns.size());
    for (const FieldColumn& column : list.columns) {
        TESSERA_CHECK(column.scalarCount() == column.ids.size() * column.width,
                      "a column whose ids and values differ in number");
        proto::change::Column& to = *head.add_columns();
        to.set_type(column.type.value);
        to.set_field(column.field.value);
        to.set_kind(static_cast<proto::change::Column::Kind>(column.kind()));
        to.set_width(column.width);
        parts.push_back(bytesOf(column.ids));
        std::visit(
            [&](const auto& values) {
                using Values = std::decay_t<decltype(values)>;
                if constexpr (std::is_same_v<Values, std::vector<std::string>>)
                    parts.push_back(packed.emplace_back(packTexts(values)));
                else if constexpr (std::is_same_v<Values, std::vector<Blob>>)
                    parts.push_back(packed.emplace_back(packBlobs(values)));
                else if constexpr (std::is_same_v<Values, std::vector<RefList>>)
                    parts.push_back(packed.emplace_back(packRefs(values)));
                else
                    parts.push_back(bytesOf(values));
            },
            column.values);
    }
    return joinParts(head, parts);
}

ByteSpan rangeBytesIn(ByteSpan encodedList) {
    const auto split = splitParts(encodedList, encodedList.size(), encodedList.size());
    TESSERA_CHECK(split && split->parts.size() > kRangeBytes, "of a list that is whole");
    return split->parts[kRangeBytes];
}

Expected<ChangeList> decodeChangeList(ByteSpan bytes, const BlobStore& store, AbsentBlobs absent,
                                      const ChangeLimits& limits) {
    if (bytes.size() > limits.maxBytes)
        return fail(ErrorCode::kLimit,
                    fmt::format("change list: {} bytes, more than the limit of {}", bytes.size(), limits.maxBytes));
    const auto split = splitParts(bytes, 16 + kHeadBytesPerColumn * limits.maxColumns,
                                  kFirstColumnPart + kPartsPerColumn * limits.maxColumns);
    if (!split) return failWith("change list", split.error());
    if (auto ok = checkParts(*split, limits); !ok) return tl::unexpected(ok.error());
    const auto head = parseHead(*split);
    if (!head) return tl::unexpected(head.error());

    ChangeList list;
    list.nextFreeId = head->next_free_id();
    const auto creationIds = copyAs<ObjectId>(split->parts[kCreationIds]);
    const auto creationTypes = copyAs<ObjectType>(split->parts[kCreationTypes]);
    list.creations.resize(creationIds.size());
    for (std::size_t i = 0; i < creationIds.size(); ++i) list.creations[i] = {creationIds[i], creationTypes[i]};
    const auto nodes = copyAs<ObjectId>(split->parts[kPlacementNodes]);
    const auto parents = copyAs<ObjectId>(split->parts[kPlacementParents]);
    const auto indices = copyAs<std::uint32_t>(split->parts[kPlacementIndices]);
    list.placements.resize(nodes.size());
    for (std::size_t i = 0; i < nodes.size(); ++i) list.placements[i] = {nodes[i], parents[i], indices[i]};
    list.destructions = copyAs<ObjectId>(split->parts[kDestructions]);
    Expected<std::vector<RangeEdit>> ranges = decodeRanges(split->parts[kRanges], split->parts[kRangeBytes]);
    if (!ranges) return tl::unexpected(ranges.error());
    list.ranges = std::move(*ranges);

    list.columns.reserve(static_cast<std::size_t>(head->columns_size()));
    for (int i = 0; i < head->columns_size(); ++i) {
        const std::size_t part = kFirstColumnPart + kPartsPerColumn * static_cast<std::size_t>(i);
        auto column =
            decodeColumn(head->columns(i), split->parts[part], split->parts[part + 1], {store, absent, limits});
        if (!column) return tl::unexpected(column.error());
        list.columns.push_back(std::move(*column));
    }
    return list;
}

}  // namespace tessera
