/// What a file held when it was read last, and which objects of the scene have come of it.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/change/ChangeList.h"
#include "common/scene/Aspect.h"
#include "common/scene/FieldTable.h"

namespace tessera {

/// Kept as long as the file may be read again. Arrays are kept by their names alone.
struct HeldFile {
    ChangeList list;            ///< as the importer made it: placeholders in a row from kFirstPlaceholder up
    std::vector<ObjectId> ids;  ///< in the scene, by place among the placeholders; none: it is not there

    std::size_t bytes = 0;            ///< of memory, as it is counted
    std::vector<std::uint32_t> tops;  ///< places of nodes that hang below what is not of the file, the first ones
    static constexpr std::size_t kMostTops = 1000;
    /// Places of nodes that are not made yet, for what they hang below had been removed: they are as good as new.
    std::vector<std::uint32_t> leftOut;

    /// Nothing where its objects are not in a row. Costs what the list holds.
    [[nodiscard]] static std::optional<HeldFile> of(const ChangeList& list);
    /// The objects have these ids, in a row.
    void standsFrom(ObjectId first);
    /// Other values of objects of the list, and more objects: creations behind those of the list, in their row, and
    /// columns. No other kind of change.
    void write(const ChangeList& others, std::span<const ObjectId> idsOfMore);

private:
    [[nodiscard]] std::size_t count() const;
};

/// Looks at the list of a file object by object. The list outlives it and stays as it is.
class FileObjects {
public:
    static constexpr std::uint32_t kNone = 0xffffffffu;

    explicit FileObjects(const ChangeList& list);

    [[nodiscard]] std::uint32_t count() const { return static_cast<std::uint32_t>(types_.size()); }
    [[nodiscard]] const TypeInfo& type(std::uint32_t place) const { return *types_[place]; }
    [[nodiscard]] bool isNode(std::uint32_t place) const { return types_[place]->index == kTypeIndex<Node>; }
    /// The place of an object of the file; kNone: it is none.
    [[nodiscard]] std::uint32_t placeOf(ObjectId id) const;
    /// kNone: it hangs below what is not of the file, or nowhere.
    [[nodiscard]] std::uint32_t parent(std::uint32_t node) const { return parents_[node]; }
    /// In their order; of `count()` those that hang below what is not of the file.
    [[nodiscard]] std::span<const std::uint32_t> children(std::uint32_t node) const;
    /// As the scene has it once the list has been applied.
    [[nodiscard]] FieldValue value(std::uint32_t place, const FieldEntry& field) const;
    /// Calls `visit` with each object of the file that this one refers to, once for each time.
    template <typename Visit>
    void forEachRef(std::uint32_t place, Visit&& visit) const {
        for (const Row& row : rowsOf(place)) {
            const FieldColumn& column = list_.columns[row.column];
            if (const auto* refs = std::get_if<std::vector<ObjectId>>(&column.values))
                visitRef((*refs)[row.row], visit);
            if (const auto* lists = std::get_if<std::vector<RefList>>(&column.values))
                for (const ObjectId id : (*lists)[row.row]) visitRef(id, visit);
        }
    }
    /// Of all that it says but references: of two objects of one type that say the same, the same.
    [[nodiscard]] std::uint64_t contentHash(std::uint32_t place) const;

private:
    struct Row {
        std::uint32_t column = 0, row = 0;
    };
    [[nodiscard]] std::span<const Row> rowsOf(std::uint32_t place) const;
    template <typename Visit>
    void visitRef(ObjectId id, Visit& visit) const {
        if (const std::uint32_t to = placeOf(id); to != kNone) visit(to);
    }

    const ChangeList& list_;
    std::vector<const TypeInfo*> types_;
    std::vector<std::uint32_t> parents_, childStarts_, children_, rowStarts_;
    std::vector<Row> rows_;
};

/// Fills in the ids of a file that somebody else has loaded below a node, as far as it is there: nodes by their names,
/// equal ones by their order, if their cores are of the same type; other objects by who refers to them. Returns how
/// many were found.
std::size_t findAgain(const Aspect& scene, ObjectId below, HeldFile& file);

/// Which object of the former content each object of the next one is, by place; kNone: it is new.
///
/// Nodes by their names, among equal names by the type of their core, what is below them, and their order. Other
/// objects by who refers to them, in which field; in a list by what they say, then by their order. Materials and the
/// like of what is new by what they say.
[[nodiscard]] std::vector<std::uint32_t> matchObjects(const FileObjects& former, const FileObjects& next);

}  // namespace tessera
