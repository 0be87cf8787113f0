#include <unordered_map>
#include <unordered_set>

#include <fmt/format.h>

#include "common/scene/Aspect.h"

namespace tessera {

std::vector<Blob> blobsOf(const ChangeList& list) {
    std::vector<Blob> blobs;
    std::unordered_set<BlobId> seen;
    for (const FieldColumn& column : list.columns)
        if (const auto* values = std::get_if<std::vector<Blob>>(&column.values))
            for (const Blob& blob : *values)
                if (!blob.empty() && seen.insert(blob.id()).second) blobs.push_back(blob);
    return blobs;
}

namespace {

/// In elements where the array has such, as people count them.
std::string outsideOf(const Object& object, const RangeEdit& range, std::uint64_t size) {
    const FieldEntry* field = object ? findField(object.info(), range.field) : nullptr;
    const std::string what = field ? fmt::format("{} of #{}", field->name, range.object.value)
                                   : fmt::format("an array of #{}", range.object.value);
    if (size == 0) return what + " is empty: there is nothing to edit a range of; set all of it";
    const std::uint64_t each = field && field->numbersEach > 0 ? field->elementBytes() : 1;
    return fmt::format(
        "{} has {} {}, numbered from 0; a range of {} from {} on does not lie in it; to make it longer, set all of it",
        what, size / each, each > 1 ? "elements" : "bytes", range.bytes.sizeBytes() / each, range.offset / each);
}

}  // namespace

Expected<void> resolveRanges(const Aspect& aspect, ChangeList& list) {
    std::unordered_map<ObjectId, std::unordered_map<std::uint32_t, Blob>>
        arrays;  // as earlier parts of the list leave them
    if (list.ranges.empty()) return {};
    for (const FieldColumn& column : list.columns)
        if (const auto* blobs = std::get_if<std::vector<Blob>>(&column.values))
            for (std::size_t row = 0; row < std::min(column.ids.size(), blobs->size()); ++row)
                arrays[column.ids[row]][column.field.value] = (*blobs)[row];
    for (RangeEdit& range : list.ranges) {
        auto& fields = arrays[range.object];
        auto known = fields.find(range.field.value);
        if (known == fields.end()) {
            const Object object = aspect.find(range.object);
            const FieldEntry* field = object ? findField(object.info(), range.field) : nullptr;
            if (!field || field->kind != FieldKind::kBlob)
                continue;  // the scene refuses it in words, and must not stumble over later ones
            known = fields.emplace(range.field.value, *field->in<Blob>(object.data())).first;
        }
        Blob& array = known->second;
        if (range.offset > array.sizeBytes() || range.bytes.sizeBytes() > array.sizeBytes() - range.offset)
            return fail(ErrorCode::kRefused, outsideOf(aspect.find(range.object), range, array.sizeBytes()));
        if (array.resident() && range.bytes.resident()) {
            const Expected<Blob> made = array.withRange(range.offset, range.bytes.bytes());
            if (!made) return failWith(fmt::format("a range of #{}", range.object.value), made.error());
            range.result = *made;
        } else if (range.result.empty()) {
            return fail(ErrorCode::kRefused, fmt::format("a range of #{}: its array is not here", range.object.value));
        }
        array = range.result;
    }
    return {};
}

}  // namespace tessera
