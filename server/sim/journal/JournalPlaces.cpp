#include "server/sim/journal/JournalPlaces.h"

#include <algorithm>
#include <unordered_set>

#include <fmt/format.h>

namespace tessera {

void FiledArray::edit(std::uint64_t offset, std::uint64_t bytes, JournalPlace place) {
    const auto cut = [&](std::uint64_t at) {
        if (at >= bytes_) return pieces_.end();
        auto piece = std::prev(pieces_.upper_bound(at));
        if (piece->first == at) return piece;
        return pieces_.emplace(at, JournalPlace{piece->second.file, piece->second.offset + (at - piece->first)}).first;
    };
    const auto end = cut(offset + bytes);
    pieces_.erase(cut(offset), end);
    pieces_.insert_or_assign(offset, std::move(place));
    contentHash.reset();
}

Expected<void> FiledArray::readInto(std::span<std::byte> out, std::uint64_t offset) const {
    for (auto piece = std::prev(pieces_.upper_bound(offset)); !out.empty(); ++piece) {
        const auto next = std::next(piece);
        const std::uint64_t in = offset - piece->first, end = next == pieces_.end() ? bytes_ : next->first;
        const auto part = out.first(std::min<std::uint64_t>(out.size(), end - offset));
        if (Expected<void> read = piece->second.file->readInto(part, piece->second.offset + in); !read) return read;
        out = out.subspan(part.size());
        offset = end;
    }
    return {};
}

Expected<void> JournalPlaces::beginEdited(std::pair<ObjectId, FieldId> field, const Blob& before) {
    const auto whole = arrays_.find(before.id());
    if (whole == arrays_.end() || whole->second.bytes() != before.sizeBytes())
        return fail(ErrorCode::kBadInput,
                    fmt::format("the array {} of #{} is in no file", toHex(before.id()), field.first.value));
    edited_.insert_or_assign(field, Edited{before.id(), whole->second});
    return {};
}

Expected<void> JournalPlaces::comes(const ChangeList& list, const Aspect& scene, JournalPlace ranges) {
    std::map<std::pair<ObjectId, FieldId>, Blob> set;
    for (const FieldColumn& column : list.columns) {
        const auto* blobs = std::get_if<std::vector<Blob>>(&column.values);
        if (!blobs || (edited_.empty() && list.ranges.empty())) continue;
        for (std::size_t row = 0; row < std::min(column.ids.size(), blobs->size()); ++row) {
            edited_.erase({column.ids[row], column.field});
            if (!list.ranges.empty()) set[{column.ids[row], column.field}] = (*blobs)[row];
        }
    }
    for (const RangeEdit& range : list.ranges) {
        const std::pair key{range.object, range.field};
        if (!edited_.contains(key)) {
            Blob before;
            if (const auto given = set.find(key); given != set.end()) {
                before = given->second;
            } else if (const Object object = scene.find(range.object)) {
                const FieldEntry* field = findField(object.info(), range.field);
                if (field && field->kind == FieldKind::kBlob) before = *field->in<Blob>(object.data());
            }
            if (Expected<void> begun = beginEdited(key, before); !begun) return begun;
        }
        Edited& edited = edited_.at(key);
        const std::uint64_t bytes = range.bytes.sizeBytes();
        if (range.offset > edited.array.bytes() || bytes > edited.array.bytes() - range.offset)
            return fail(ErrorCode::kBadInput,
                        fmt::format("a range does not lie in the array of #{}", range.object.value));
        edited.array.edit(range.offset, bytes, ranges);
        edited.id = range.result.id();
        ranges.offset += bytes;
    }
    if (!edited_.empty())
        for (const ObjectId gone : list.destructions)
            edited_.erase(edited_.lower_bound({gone, FieldId()}),
                          edited_.lower_bound({ObjectId(gone.value + 1), FieldId()}));
    return {};
}

ChangeListPtr JournalPlaces::withoutRanges(const ChangeList& list, JournalPlace ranges) {
    auto without = std::make_shared<ChangeList>(list);
    for (RangeEdit& range : without->ranges) {
        ranges_.try_emplace(range.bytes.id(), ranges);
        ranges.offset += range.bytes.sizeBytes();
        range.bytes = Blob::absent(range.bytes.id(), range.bytes.sizeBytes());
    }
    return without;
}

Expected<ChangeListPtr> JournalPlaces::withRanges(ChangeListPtr list) const {
    if (list->ranges.empty()) return list;
    auto with = std::make_shared<ChangeList>(*list);
    for (RangeEdit& range : with->ranges) {
        const auto place = ranges_.find(range.bytes.id());
        if (place == ranges_.end()) return fail(ErrorCode::kFailed, "the bytes of a range are in no file");
        Expected<Bytes> bytes = place->second.file->read(place->second.offset, range.bytes.sizeBytes());
        if (!bytes) return tl::unexpected(bytes.error());
        Blob read(std::move(*bytes));
        if (read != range.bytes) return fail(ErrorCode::kFailed, "the bytes of a range have changed in their file");
        range.bytes = std::move(read);
    }
    return ChangeListPtr(std::move(with));
}

void JournalPlaces::sweep(const EditHistory& history) {
    if (ranges_.size() < sweepAt_) return;
    std::unordered_set<BlobId> named;
    for (const EditHistory::Kept& step : history.kept())
        for (const ChangeListPtr& list : step.lists)
            for (const RangeEdit& range : list->ranges) named.insert(range.bytes.id());
    std::erase_if(ranges_, [&](const auto& known) { return !named.contains(known.first); });
    sweepAt_ = 2 * ranges_.size() + 65'536;
}

const FiledArray* JournalPlaces::find(const BlobId& id) {
    if (const auto whole = arrays_.find(id); whole != arrays_.end()) return &whole->second;
    if (results_.empty())
        for (const auto& [field, edited] : edited_) results_.emplace(edited.id, &edited.array);
    const auto result = results_.find(id);
    return result == results_.end() ? nullptr : result->second;
}

}  // namespace tessera
