/// Whether a change list may be applied to a scene, found out without touching the scene. Internal to common/scene.
#pragma once

#include <unordered_set>

#include "common/scene/FieldTable.h"
#include "common/scene/IdMap.h"
#include "common/scene/ObjectTable.h"

namespace tessera {

/// What was found out on the way and is needed to apply the list.
struct CheckedList {
    std::vector<Blob> rangeResults;  ///< per range: the array afterwards
    /// Per column: it names the same objects, in the same order, as the one before it.
    std::vector<bool> sameRows;
    /// The column whose rows `ListCheck` has left in its caller's memory: the longest of a list that creates nothing.
    std::size_t rowsOf = ~std::size_t{0};
};

/// Plays a list on an overlay of the scene: what it creates, where it places nodes, what it lets go of. Everything the
/// contract of Aspect names is refused here, so that applying afterwards cannot fail. Used once.
///
/// Cost: proportional to the list, plus the subtrees that it moves (their depth is bounded).
class ListCheck {
public:
    /// `rows` is the caller's memory, reused from list to list: where the rows of a column stand, because finding many
    /// objects costs as much as writing them (see CheckedList::rowsOf).
    ListCheck(const Aspect& aspect, ObjectTable& table, const SceneLimits& limits, const ChangeList& list,
              std::vector<ObjectTable::Slot*>& rows)
        : aspect_(aspect), table_(table), limits_(limits), list_(list), present_(table), rows_(rows) {}

    [[nodiscard]] Expected<CheckedList> run();

private:
    struct Created {
        std::uint16_t type = 0;  ///< index into allTypes()
        std::uint32_t mark = 0;
    };
    /// A node's place in the overlay.
    struct Place {
        ObjectId parent;
        std::uint32_t children = 0;
        std::uint32_t depth = 0;       ///< nodes from the top, this one included; see below
        std::uint32_t depthKnown = 0;  ///< `depth` holds while this is shapes_
        bool placed = false;           ///< named by a placement, not only as a parent
    };
    /// (type, field, object) of a ref column's row.
    struct RefRow {
        ObjectId object;
        FieldId field;
        bool operator==(const RefRow&) const = default;
    };
    struct RefRowHash {
        std::size_t operator()(const RefRow& row) const { return row.object.value * 31 + row.field.value; }
    };

    [[nodiscard]] Expected<void> checkCreations();
    [[nodiscard]] Expected<void> checkPlacements();
    [[nodiscard]] Expected<void> checkPlacement(const Placement& placement);
    [[nodiscard]] Expected<void> checkCrowds() const;
    [[nodiscard]] Expected<void> checkShape() const;
    /// Names a node of a circle; there is one.
    [[nodiscard]] tl::unexpected<Error> circle(std::span<const ObjectId> placed) const;
    [[nodiscard]] Expected<void> checkColumns();
    [[nodiscard]] Expected<void> checkRows(const FieldColumn& column, const TypeInfo& type);
    /// Whether all rows are present objects of the type in ascending order; keeps where they stand.
    [[nodiscard]] bool plainRows(const FieldColumn& column, const TypeInfo& type);
    [[nodiscard]] Expected<void> checkValues(const FieldColumn& column, const TypeInfo& type, const FieldInfo& field);
    [[nodiscard]] Expected<void> checkRef(const FieldInfo& field, ObjectId target);
    [[nodiscard]] Expected<void> checkRefs(const FieldColumn& column, const FieldInfo& field);
    [[nodiscard]] Expected<void> checkRanges();
    [[nodiscard]] Expected<void> checkDestructions();
    /// How many refs of objects that stay name each destroyed object: written to its value.
    void countUses(IdMap<std::int64_t>& destroyed) const;

    /// Null where there is no such object, in the scene or created by the list.
    [[nodiscard]] const TypeInfo* typeOfObject(ObjectId id) const;
    [[nodiscard]] Place& place(ObjectId node);
    /// As `place`, of an object that has yet to be seen to be a node; `what` is said of it otherwise.
    [[nodiscard]] Expected<Place*> placeOfNode(ObjectId id, const Placement& placement);
    [[nodiscard]] ObjectId parentOf(ObjectId node) const;
    [[nodiscard]] std::size_t depthOf(Place& node);

    const Aspect& aspect_;  ///< of the table; for words
    ObjectTable& table_;    ///< not written here: who is left the rows will
    const SceneLimits& limits_;
    const ChangeList& list_;
    mutable ObjectTable::ConstCursor present_;  ///< nothing comes or goes while a list is checked
    IdMap<Created> created_;
    IdMap<Place> places_;
    std::uint32_t shapes_ =
        1;                     ///< another one whenever a node with children has moved: depths below it are others then
    bool shapesOpen_ = false;  ///< the tree may have become too deep, or have a circle: looked at when all is placed
    bool crowded_ = false;     ///< a node had too many children at some time
    std::vector<ObjectTable::Slot*>& rows_;
    CheckedList checked_;
};

}  // namespace tessera
