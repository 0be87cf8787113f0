/// Where the files of a journal have the arrays that its records name.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "common/scene/Aspect.h"
#include "server/sim/frame/Frame.h"
#include "server/sim/recording/RecordBytes.h"

namespace tessera {

/// Bytes of a file.
struct JournalPlace {
    std::shared_ptr<const RecordSource> file;
    std::uint64_t offset = 0;
};

/// An array as it lies in files: in one piece, or as edits of ranges have left it.
class FiledArray {
public:
    FiledArray(JournalPlace place, std::uint64_t bytes) : bytes_(bytes) { pieces_.emplace(0, std::move(place)); }

    [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
    /// From `offset` on it has other bytes, as many as lie at `place`.
    void edit(std::uint64_t offset, std::uint64_t bytes, JournalPlace place);
    [[nodiscard]] Expected<void> readInto(std::span<std::byte> out, std::uint64_t offset) const;

    /// hash64 of the whole, where it is known.
    std::optional<std::uint64_t> contentHash;

private:
    std::map<std::uint64_t, JournalPlace> pieces_;  ///< by where they begin; each goes on to the next
    std::uint64_t bytes_;
};

/// For whoever reads a journal without its arrays. Their bytes stay in the files, which are kept open; in memory are
/// names and places: of arrays; of the bytes of ranges that the history names; and of fields whose arrays came about by
/// edits of ranges, piece by piece.
class JournalPlaces {
public:
    void arrayIs(const BlobId& id, FiledArray array) { arrays_.try_emplace(id, std::move(array)); }
    /// The list is about to be applied to `scene`; the bytes of its ranges lie there, one behind the other. Refused
    /// where an array that it edits is in no file.
    [[nodiscard]] Expected<void> comes(const ChangeList& list, const Aspect& scene, JournalPlace ranges);
    /// The same list with the bytes of its ranges absent.
    [[nodiscard]] ChangeListPtr withoutRanges(const ChangeList& list, JournalPlace ranges);
    /// The other way round: reads them.
    [[nodiscard]] Expected<ChangeListPtr> withRanges(ChangeListPtr list) const;
    /// Forgets ranges that no list of the history names any more, now and then.
    void sweep(const EditHistory& history);

    /// No field changes after this. Null: it is in no file.
    [[nodiscard]] const FiledArray* find(const BlobId& id);

private:
    struct Edited {
        BlobId id;
        FiledArray array;
    };
    [[nodiscard]] Expected<void> beginEdited(std::pair<ObjectId, FieldId> field, const Blob& before);

    std::unordered_map<BlobId, FiledArray> arrays_;
    std::unordered_map<BlobId, JournalPlace> ranges_;
    std::size_t sweepAt_ = 65'536;
    std::map<std::pair<ObjectId, FieldId>, Edited> edited_;
    std::unordered_map<BlobId, const FiledArray*> results_;  ///< of `edited_`, once somebody asks
};

}  // namespace tessera
