/// What has changed in a file since it was read last. The scene is not looked at.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "server/sim/reload/HeldFile.h"

namespace tessera {

/// Made on any thread, and handed on.
struct FileChange {
    FileChange(std::shared_ptr<const HeldFile> formerFile, ChangeList nextList, HeldFile nextFile);
    FileChange(const FileChange&) = delete;
    FileChange& operator=(const FileChange&) = delete;

    const std::shared_ptr<const HeldFile> former;
    const ChangeList list;  ///< of the file as it is, with its arrays
    HeldFile next;  ///< the same, to be held; ids are there of what the former one had, and of what has been made since
    const FileObjects before, after;
    const std::vector<std::uint32_t> formerOf;  ///< by place in `after`: the place in `before`; kNone: it is new
    std::vector<bool> vanished;                 ///< by place in `before`

    /// A value of an object that was there, with placeholders of its own list each.
    struct Row {
        std::uint32_t object = 0;  ///< its place in `after`
        const FieldEntry* field = nullptr;
        FieldValue was, is;
    };
    std::vector<Row> rows;
    /// Nodes of `after` that were there and have other children, or in another order; `count()` stands for what the
    /// file was loaded below.
    std::vector<std::uint32_t> reordered;
    std::vector<std::uint32_t>
        siblingsBefore;  ///< by place in `before`: of a node, how many stand before it below its parent

    [[nodiscard]] bool empty() const;

private:
    void findRows();
    void findOrder();
    [[nodiscard]] bool sameRef(ObjectId was, ObjectId is) const;
    [[nodiscard]] bool sameValue(const FieldValue& was, const FieldValue& is) const;
};

/// Whether two values of a field are the same, but for what rounding does to a rotation that is normalised again.
[[nodiscard]] bool areSame(const FieldEntry& field, const FieldValue& a, const FieldValue& b);

}  // namespace tessera
