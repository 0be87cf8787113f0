/// Writes down, while a list is applied, the list that leads back. Internal to common/scene.
#pragma once

#include <set>
#include <unordered_set>

#include "common/scene/FieldTable.h"
#include "common/scene/IdMap.h"
#include "common/scene/ObjectTable.h"

namespace tessera {

/// The inverse of creations C, placements P, values V, destructions D creates D, undoes P backwards, sets the values
/// that were there before V, and destroys C.
///
/// A node that came and went within the list comes and goes within the inverse too: while it was there it held children
/// and shifted its siblings' indices, and the steps backwards count on that.
class InverseRecorder {
public:
    /// Before anything is applied; `table` is the scene as it still is.
    InverseRecorder(const ChangeList& list, const ObjectTable& table);

    /// Before a node is taken from `parent` (none: it was detached), where it stands at `index`.
    void moved(ObjectId node, ObjectId parent, std::uint32_t index);
    /// Before rows of a column are written: those from `first` on, whose objects these are. Called for the rows in
    /// order.
    void overwritten(const FieldColumn& column, const FieldEntry& field, std::size_t first,
                     std::span<std::byte* const> objects);
    /// Before a range of an array is written.
    void edited(const RangeEdit& range, const Blob& before);

    [[nodiscard]] ChangeList take();

private:
    [[nodiscard]] bool comesOrGoes(ObjectId id) const { return created_.contains(id) || destroyed_.contains(id); }
    /// The column of the inverse that a column of the list is written down in.
    [[nodiscard]] FieldColumn& columnFor(const FieldColumn& column, const FieldEntry& field);

    struct Nothing {};
    ChangeList inverse_;
    IdMap<Nothing> created_, destroyed_;
    /// Arrays that go back as a whole: a column of the same list replaces them, or they are not here.
    std::set<std::pair<ObjectId, FieldId>> wholes_;
    /// Of the objects that the list destroys, and arrays that are not here; rows of survivors are recorded column by
    /// column.
    ChangeListBuilder lost_;
};

}  // namespace tessera
