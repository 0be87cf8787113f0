/// The one way a scene changes: an ordered value, applied whole or not at all.
#pragma once

#include <memory>
#include <span>
#include <variant>
#include <vector>

#include "common/change/Value.h"

namespace tessera {

struct Creation {
    ObjectId id;
    ObjectType type;
    bool operator==(const Creation&) const = default;
};

/// Puts a node under a parent (taking it from where it was), or takes it out of the tree.
struct Placement {
    static constexpr std::uint32_t kLast = 0xffffffffu;

    ObjectId node;
    ObjectId parent;              ///< none: detach
    std::uint32_t index = kLast;  ///< among the parent's children once the node is gone from its old place
    bool operator==(const Placement&) const = default;
};

/// The new values of one field for many objects of one type, in a packed array. `width` scalars per object for the
/// float kinds. The variant's index is the FieldKind. Bools are bytes, 0 or 1.
struct FieldColumn {
    using Values = std::variant<std::vector<float>, std::vector<double>, std::vector<std::int64_t>,
                                std::vector<ObjectId>, std::vector<std::string>, std::vector<Blob>,
                                std::vector<std::uint8_t>, std::vector<RefList>, std::vector<Matrix>>;

    ObjectType type;
    FieldId field;
    std::uint8_t width = 1;
    std::vector<ObjectId> ids;
    Values values;

    [[nodiscard]] FieldKind kind() const { return static_cast<FieldKind>(values.index()); }
    [[nodiscard]] FieldValue value(std::size_t row) const;
    /// The value's kind and width must be the column's.
    void append(ObjectId id, const FieldValue& value);
    /// Replaces the value of a row.
    void assign(std::size_t row, const FieldValue& value);
    /// Entries of `values`: rows times width in a well-formed column.
    [[nodiscard]] std::size_t scalarCount() const;
    /// A column without rows.
    [[nodiscard]] static FieldColumn ofShape(ObjectType type, FieldId field, FieldKind kind, std::uint8_t width);
    bool operator==(const FieldColumn&) const = default;
};

/// New bytes for a part of a large array: only they travel and are hashed.
struct RangeEdit {
    ObjectId object;
    ObjectType type;
    FieldId field;             ///< of kind kBlob
    std::uint64_t offset = 0;  ///< in bytes; the array keeps its size
    Blob bytes;                ///< resident, not empty
    /// The array afterwards. Empty: not known yet (in proposals). Absent: its name is known, which whoever holds the
    /// array compares with what comes out.
    Blob result;
    bool operator==(const RangeEdit&) const = default;
};

/// Applied in this order: creations, placements one after the other, columns (each field of an object at most once),
/// ranges one after the other, destructions. Immutable once shared.
struct ChangeList {
    std::vector<Creation> creations;
    std::vector<Placement> placements;
    std::vector<FieldColumn> columns;
    std::vector<RangeEdit> ranges;
    std::vector<ObjectId> destructions;
    /// Ids from here on have never been given. In snapshots, and in compacted lists that leave out an object which came
    /// and went; zero elsewhere.
    std::uint64_t nextFreeId = 0;

    [[nodiscard]] bool empty() const {
        return creations.empty() && placements.empty() && columns.empty() && ranges.empty() && destructions.empty() &&
               nextFreeId == 0;
    }
    /// Creations + placements + column rows + ranges + destructions.
    [[nodiscard]] std::size_t changeCount() const;
    bool operator==(const ChangeList&) const = default;
};

using ChangeListPtr = std::shared_ptr<const ChangeList>;

/// Collects edits in any order and packs them. Setting a field of an object twice keeps the last value.
class ChangeListBuilder {
public:
    void create(ObjectId id, ObjectType type);
    void place(ObjectId node, ObjectId parent, std::uint32_t index = Placement::kLast);
    void detach(ObjectId node) { place(node, ObjectId{}); }
    /// The type is the object's; kind and width must be the same for every object of one (type, field).
    void set(ObjectId id, ObjectType type, FieldId field, const FieldValue& value);
    /// The same for a field of numbers, as many as it is wide.
    void set(ObjectId id, ObjectType type, FieldId field, std::span<const double> numbers);
    void set(ObjectId id, ObjectType type, FieldId field, std::span<const float> numbers);
    /// Takes effect after all values that are set.
    void setRange(ObjectId id, ObjectType type, FieldId field, std::uint64_t offset, Blob bytes);
    void destroy(ObjectId id);

    [[nodiscard]] bool empty() const;
    /// The packed list; the builder is empty afterwards. Columns are ordered by (type, field), rows by first set.
    [[nodiscard]] ChangeList take();

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;

public:
    ChangeListBuilder();
    ~ChangeListBuilder();
    ChangeListBuilder(ChangeListBuilder&&) noexcept;
    ChangeListBuilder& operator=(ChangeListBuilder&&) noexcept;
};

/// Fewer lists with the same effect as `lists` applied in order: overwritten values are gone. Usually one list; a new
/// one starts where an object destroyed earlier comes back under its old id.
[[nodiscard]] std::vector<ChangeList> compact(std::span<const ChangeListPtr> lists);

/// The same list with every id replaced by `replace(id)` (placeholders becoming ids).
template <typename Replace>
void replaceIds(ChangeList& list, Replace&& replace) {
    for (Creation& c : list.creations) c.id = replace(c.id);
    for (Placement& p : list.placements) {
        p.node = replace(p.node);
        p.parent = replace(p.parent);
    }
    for (FieldColumn& column : list.columns) {
        for (ObjectId& id : column.ids) id = replace(id);
        if (auto* refs = std::get_if<std::vector<ObjectId>>(&column.values))
            for (ObjectId& id : *refs) id = replace(id);
        if (auto* lists = std::get_if<std::vector<RefList>>(&column.values))
            for (RefList& refs : *lists)
                for (ObjectId& id : refs) id = replace(id);
    }
    for (RangeEdit& range : list.ranges) range.object = replace(range.object);
    for (ObjectId& id : list.destructions) id = replace(id);
}

}  // namespace tessera
