#include "common/scene/ListCheck.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <map>

#include "common/base/Utf8.h"
#include "common/math/Types.h"
#include "common/scene/ColumnShapes.h"
#include "common/scene/Users.h"

namespace tessera {

namespace {

std::string nameOf(ObjectId id) {
    return isPlaceholder(id) ? fmt::format("placeholder {}", id.value - kFirstPlaceholder)
                             : fmt::format("#{}", id.value);
}

/// An exponent of all ones carries into the sign when one is added to it: a sum of integers, which compilers do for
/// several numbers at a time.
template <typename Real, typename Bits, Bits kOne>
bool finite(const std::vector<Real>& numbers) {
    constexpr Bits kSign = Bits{1} << (8 * sizeof(Bits) - 1);
    Bits carried = 0;
    for (const Real number : numbers) carried |= (std::bit_cast<Bits>(number) & ~kSign) + kOne;
    return (carried & kSign) == 0;
}
bool allFinite(const std::vector<double>& numbers) {
    return finite<double, std::uint64_t, std::uint64_t{1} << 52>(numbers);
}
bool allFinite(const std::vector<float>& numbers) {
    return finite<float, std::uint32_t, std::uint32_t{1} << 23>(numbers);
}
bool allFinite(const std::vector<std::int64_t>&) {
    return true;
}

double squaredNorm(const double* q) {
    return q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
}
bool goodRotations(const std::vector<double>& numbers) {
    bool good = true;
    for (std::size_t i = 0; i < numbers.size(); i += 4) good &= tellsRotation(squaredNorm(&numbers[i]));
    return good;
}

tl::unexpected<Error> refuse(std::string message) {
    return fail(ErrorCode::kRefused, std::move(message));
}

/// `what` of `id` cannot be done because there is no such object.
tl::unexpected<Error> missing(std::string_view what, ObjectId id) {
    if (isPlaceholder(id))
        return refuse(
            fmt::format("{} {}: placeholders stand for objects that the server still has to number, and this one "
                        "is not created by the list",
                        what, nameOf(id)));
    return refuse(fmt::format("{} {}: there is no such object", what, nameOf(id)));
}

}  // namespace

Expected<CheckedList> ListCheck::run() {
    if (list_.nextFreeId > kFirstPlaceholder)
        return fail(ErrorCode::kBadInput, "the next free id lies among the placeholders");
    for (const auto check : {&ListCheck::checkCreations, &ListCheck::checkPlacements, &ListCheck::checkColumns,
                             &ListCheck::checkRanges, &ListCheck::checkDestructions})
        if (const Expected<void> ok = (this->*check)(); !ok) return tl::unexpected(ok.error());
    return std::move(checked_);
}

const TypeInfo* ListCheck::typeOfObject(ObjectId id) const {
    if (const ObjectTable::Slot* slot = present_.find(id)) return &table_.type(*slot);
    const Created* created = created_.find(id);
    return created ? &allTypes()[created->type] : nullptr;
}

// ---- creations -----------------------------------------------------------------------------------------------------

Expected<void> ListCheck::checkCreations() {
    const std::size_t before = table_.size() + list_.creations.size();
    if (before > limits_.maxObjects && before - std::min(before, list_.destructions.size()) > limits_.maxObjects)
        return fail(ErrorCode::kLimit, fmt::format("the scene would hold {} objects, more than its limit of {}",
                                                   before - list_.destructions.size(), limits_.maxObjects));
    for (const Creation& creation : list_.creations) {
        const TypeInfo* type = findType(creation.type);
        if (!type)
            return fail(ErrorCode::kBadInput,
                        fmt::format("create {}: object type {} is unknown", nameOf(creation.id), creation.type.value));
        if (!creation.id) return fail(ErrorCode::kBadInput, fmt::format("create {}: id 0 means none", type->name));
        if (isPlaceholder(creation.id))
            return refuse(fmt::format("create {} {}: placeholders must be replaced by ids before a list is applied",
                                      type->name, nameOf(creation.id)));
        const auto [created, isNew] = created_.add(creation.id);
        if (!isNew || present_.find(creation.id))
            return refuse(fmt::format("create {} {}: the id is taken", type->name, nameOf(creation.id)));
        created.type = type->index;
    }
    return {};
}

// ---- placements ----------------------------------------------------------------------------------------------------

ObjectId ListCheck::parentOf(ObjectId node) const {
    if (const Place* known = places_.find(node)) return known->parent;
    const ObjectTable::Slot* slot = present_.find(node);
    return slot ? table_.node(*slot).parent : ObjectId();
}

ListCheck::Place& ListCheck::place(ObjectId node) {
    const auto [place, isNew] = places_.add(node);
    if (isNew)
        if (const ObjectTable::Slot* slot = present_.find(node)) {
            const Node& present = table_.node(*slot);
            place.parent = present.parent;
            place.children = static_cast<std::uint32_t>(present.children.size());
        }
    return place;
}

Expected<ListCheck::Place*> ListCheck::placeOfNode(ObjectId id, const Placement& p) {
    if (Place* known = places_.find(id)) return known;
    const TypeInfo* type = typeOfObject(id);
    const bool isParent = id == p.parent;
    if (!type) return isParent ? missing(fmt::format("place {} under", nameOf(p.node)), id) : missing("place", id);
    if (type->type == typeOf<Node>()) return &place(id);
    if (isParent)
        return refuse(fmt::format("place {} under {}: that is a {}, and only nodes have children", nameOf(p.node),
                                  nameOf(id), type->name));
    return refuse(fmt::format("place {}: it is a {}, and only nodes have a place in the tree", nameOf(id), type->name));
}

std::size_t ListCheck::depthOf(Place& node) {
    if (node.depthKnown == shapes_) return node.depth;
    std::size_t depth = 1;
    for (ObjectId above = node.parent; above; ++depth) {
        const Place* known = places_.find(above);
        if (known && known->depthKnown == shapes_) {
            depth += known->depth;
            break;
        }
        above = parentOf(above);
    }
    node.depth = static_cast<std::uint32_t>(depth);
    node.depthKnown = shapes_;
    return depth;
}

Expected<void> ListCheck::checkPlacements() {
    for (const Placement& placement : list_.placements)
        if (auto ok = checkPlacement(placement); !ok) return ok;
    if (crowded_)
        if (auto ok = checkCrowds(); !ok) return ok;
    return shapesOpen_ ? checkShape() : Expected<void>();
}

Expected<void> ListCheck::checkPlacement(const Placement& p) {
    const Expected<Place*> found = placeOfNode(p.node, p);
    if (!found) return tl::unexpected(found.error());
    Place& node = **found;
    if (p.node == kRootNode) return refuse("place #1: the root cannot be moved");
    Place* parent = nullptr;
    std::size_t depth = 1;
    if (p.parent) {
        const Expected<Place*> foundParent = placeOfNode(p.parent, p);
        if (!foundParent) return tl::unexpected(foundParent.error());
        parent = *foundParent;
        // Only what has children has anything below it, which goes deeper with it, or above it now.
        shapesOpen_ = shapesOpen_ || node.children > 0 || p.parent == p.node;
        if (!shapesOpen_) depth = depthOf(*parent) + 1;
        shapesOpen_ = shapesOpen_ || depth > limits_.maxDepth;
    }
    if (node.parent) --place(node.parent).children;
    if (parent) {
        if (p.index != Placement::kLast && p.index > parent->children)
            return refuse(fmt::format("place {} under {}: index {} is past its {} children", nameOf(p.node),
                                      nameOf(p.parent), p.index, parent->children));
        crowded_ = ++parent->children > limits_.maxChildren || crowded_;
    }
    if (node.children > 0) ++shapes_;
    node.parent = p.parent;
    node.placed = true;
    node.depth = static_cast<std::uint32_t>(depth);
    node.depthKnown = shapes_;
    return {};
}

Expected<void> ListCheck::checkCrowds() const {
    ObjectId crowd;
    places_.forEach([&](ObjectId id, const Place& place) {
        if (place.children > limits_.maxChildren) crowd = id;
    });
    if (!crowd) return {};
    return fail(ErrorCode::kLimit,
                fmt::format("place under {}: more than {} children", nameOf(crowd), limits_.maxChildren));
}

Expected<void> ListCheck::checkShape() const {
    // All that the list places, from the topmost ones down, with what lies below them.
    IdMap<std::vector<ObjectId>> placedBelow;
    std::vector<ObjectId> placed;
    places_.forEach([&](ObjectId id, const Place& place) {
        if (!place.placed) return;
        placed.push_back(id);
        if (place.parent) placedBelow.add(place.parent).value.push_back(id);
    });
    const auto isPlaced = [&](ObjectId id) {
        const Place* known = places_.find(id);
        return known && known->placed;
    };
    struct Step {
        ObjectId id;
        std::size_t depth;
    };
    std::vector<Step> open;
    std::size_t reached = 0;  // of those placed
    for (const ObjectId id : placed) {
        std::size_t depth = 1;
        ObjectId above = places_.find(id)->parent;
        for (; above && !isPlaced(above); above = parentOf(above)) ++depth;
        if (above) continue;  // found again below that one
        open.push_back({id, depth});
        while (!open.empty()) {
            const Step step = open.back();
            open.pop_back();
            reached += isPlaced(step.id) ? 1 : 0;
            if (step.depth > limits_.maxDepth)
                return fail(ErrorCode::kLimit, fmt::format("place {} under {}: the tree would be deeper than {} nodes",
                                                           nameOf(id), nameOf(parentOf(id)), limits_.maxDepth));
            if (const ObjectTable::Slot* slot = present_.find(step.id))
                for (const ObjectId child : table_.node(*slot).children)
                    if (!isPlaced(child)) open.push_back({child, step.depth + 1});
            if (const std::vector<ObjectId>* below = placedBelow.find(step.id))
                for (const ObjectId child : *below) open.push_back({child, step.depth + 1});
        }
    }
    return reached == placed.size() ? Expected<void>() : circle(placed);
}

tl::unexpected<Error> ListCheck::circle(std::span<const ObjectId> placed) const {
    // Upwards from what was not reached there is no end: after as many steps as there are nodes one stands in the
    // circle.
    IdMap<std::size_t> from;  // which walk came by
    for (std::size_t walk = 0; walk < placed.size(); ++walk)
        for (ObjectId at = placed[walk]; at; at = parentOf(at)) {
            const auto [first, isNew] = from.add(at);
            if (isNew) {
                first = walk;
                continue;
            }
            if (first != walk) break;
            while (!places_.contains(at) || !places_.find(at)->placed) at = parentOf(at);
            return refuse(
                fmt::format("place {} under {}: a node cannot be below itself", nameOf(at), nameOf(parentOf(at))));
        }
    return refuse("place: a node cannot be below itself");
}

// ---- columns -------------------------------------------------------------------------------------------------------

Expected<void> ListCheck::checkColumns() {
    std::unordered_set<std::uint32_t> seen;
    const FieldColumn* rowsChecked = nullptr;
    for (const FieldColumn& column : list_.columns) {
        const Expected<const FieldEntry*> shape = fieldOfColumn(column);
        if (!shape) return tl::unexpected(shape.error());
        const FieldEntry* const field = *shape;
        const TypeInfo* const type = findType(column.type);
        if (!seen.insert(std::uint32_t{column.type.value} << 16 | column.field.value).second)
            return fail(ErrorCode::kBadInput,
                        fmt::format("set {}.{}: the list holds this column twice", type->name, field->name));
        // Columns of one type mostly name the same objects: those were found fit already.
        const bool sameRows = rowsChecked && rowsChecked->type == column.type && rowsChecked->ids == column.ids;
        if (!sameRows)
            if (auto ok = checkRows(column, *type); !ok)
                return failWith(fmt::format("set {}.{}", type->name, field->name), ok.error());
        rowsChecked = &column;
        checked_.sameRows.push_back(sameRows);
        if (auto ok = checkValues(column, *type, *field); !ok) return ok;
    }
    return {};
}

bool ListCheck::plainRows(const FieldColumn& column, const TypeInfo& type) {
    // Rows mostly come in ascending order: then none is there twice, and all that is left to see is their type.
    const std::size_t number = static_cast<std::size_t>(&column - list_.columns.data());
    const bool keep = list_.creations.empty() &&
                      (checked_.rowsOf >= number || column.ids.size() > list_.columns[checked_.rowsOf].ids.size());
    if (keep) {
        checked_.rowsOf = ~std::size_t{0};
        rows_.resize(column.ids.size());
    }
    ObjectTable::Cursor cursor(table_);
    // Some at a time: the slots of objects that lie apart come from memory while the next ones are looked for.
    std::array<ObjectTable::Slot*, 32> slots;
    ObjectId before;
    for (std::size_t first = 0; first < column.ids.size(); first += slots.size()) {
        const std::size_t count = std::min(slots.size(), column.ids.size() - first);
        for (std::size_t i = 0; i < count; ++i) __builtin_prefetch(slots[i] = cursor.place(column.ids[first + i]), 1);
        for (std::size_t i = 0; i < count; ++i) {
            const ObjectId id = column.ids[first + i];
            if (!slots[i] || slots[i]->type != type.index || id <= before) return false;
            if (keep) rows_[first + i] = slots[i];
            before = id;
        }
    }
    if (keep) checked_.rowsOf = number;
    return true;
}

Expected<void> ListCheck::checkRows(const FieldColumn& column, const TypeInfo& type) {
    if (plainRows(column, type)) return {};
    ObjectTable::ConstCursor cursor(table_);
    const std::uint32_t mark = table_.newMark();
    for (const ObjectId id : column.ids) {
        std::uint32_t* lastMark = nullptr;
        const TypeInfo* actual = &type;
        if (const ObjectTable::Slot* slot = cursor.find(id)) {
            lastMark = &slot->mark;
            actual = &table_.type(*slot);
        } else if (Created* created = created_.find(id)) {
            lastMark = &created->mark;
            actual = &allTypes()[created->type];
        } else {
            return missing("of", id);
        }
        if (actual != &type) return refuse(fmt::format("{} is a {}", nameOf(id), actual->name));
        if (*lastMark == mark) return fail(ErrorCode::kBadInput, fmt::format("{} twice", nameOf(id)));
        *lastMark = mark;
    }
    return {};
}

Expected<void> ListCheck::checkValues(const FieldColumn& column, const TypeInfo& type, const FieldInfo& field) {
    const auto bad = [&](std::size_t row, std::string_view why) {
        return fail(ErrorCode::kBadInput,
                    fmt::format("set {}.{} of {}: {}", type.name, field.name, nameOf(column.ids[row]), why));
    };
    const auto checkNumbers = [&](const auto& numbers) -> Expected<void> {
        // First without branches, for the many that are good.
        bool good = allFinite(numbers);
        if (std::isfinite(field.least) || std::isfinite(field.greatest))
            for (const auto number : numbers)
                good &= (static_cast<double>(number) >= field.least) & (static_cast<double>(number) <= field.greatest);
        if (good) return {};
        for (std::size_t i = 0; i < numbers.size(); ++i) {
            const double number = static_cast<double>(numbers[i]);
            if (!std::isfinite(number)) return bad(i / field.width, "not a finite number");
            if (number < field.least || number > field.greatest)
                return bad(i / field.width,
                           std::isinf(field.greatest) ? fmt::format("{} is less than {}", numbers[i], field.least)
                           : std::isinf(field.least)
                               ? fmt::format("{} is more than {}", numbers[i], field.greatest)
                               : fmt::format("{} is not between {} and {}", numbers[i], field.least, field.greatest));
        }
        return {};
    };
    switch (field.kind) {
        case FieldKind::kFloat:
            return checkNumbers(std::get<std::vector<float>>(column.values));
        case FieldKind::kDouble: {
            const auto& numbers = std::get<std::vector<double>>(column.values);
            if (field.quaternion && goodRotations(numbers)) return {};
            if (auto ok = checkNumbers(numbers); !ok || !field.quaternion) return ok;
            for (std::size_t row = 0; row < column.ids.size(); ++row) {
                const double squared = squaredNorm(&numbers[4 * row]);
                if (tellsRotation(squared)) continue;
                return bad(row, squared < 1 ? "a rotation of zero has no direction"
                                            : "a rotation this long cannot be normalised");
            }
            return {};
        }
        case FieldKind::kInt: {
            const auto& numbers = std::get<std::vector<std::int64_t>>(column.values);
            if (auto ok = checkNumbers(numbers); !ok || field.wordUse != WordUse::kOneOf) return ok;
            for (std::size_t row = 0; row < numbers.size(); ++row)
                if (std::ranges::find(field.words(), numbers[row], &FieldWord::number) == field.words().end())
                    return bad(row, fmt::format("{} is none of its words", numbers[row]));
            return {};
        }
        case FieldKind::kMatrix: {
            const auto& matrices = std::get<std::vector<Matrix>>(column.values);
            for (std::size_t row = 0; row < matrices.size(); ++row)
                if (!std::ranges::all_of(matrices[row].values, [](double number) { return std::isfinite(number); }))
                    return bad(row, "not a finite number");
            return {};
        }
        case FieldKind::kBool:
            for (std::size_t row = 0; row < column.ids.size(); ++row)
                if (std::get<std::vector<std::uint8_t>>(column.values)[row] > 1) return bad(row, "neither 0 nor 1");
            return {};
        case FieldKind::kRef:
        case FieldKind::kRefs:
            if (auto ok = checkRefs(column, field); !ok)
                return failWith(fmt::format("set {}.{}", type.name, field.name), ok.error());
            return {};
        case FieldKind::kText: {
            const auto& texts = std::get<std::vector<std::string>>(column.values);
            for (std::size_t row = 0; row < texts.size(); ++row) {
                if (texts[row].size() > limits_.maxTextBytes)
                    return fail(
                        ErrorCode::kLimit,
                        fmt::format("set {}.{} of {}: {} bytes of text, more than the limit of {}", type.name,
                                    field.name, nameOf(column.ids[row]), texts[row].size(), limits_.maxTextBytes));
                if (!isUtf8(texts[row])) return bad(row, "text that is not UTF-8");
            }
            return {};
        }
        case FieldKind::kBlob:
            return {};
    }
    return {};
}

Expected<void> ListCheck::checkRefs(const FieldColumn& column, const FieldInfo& field) {
    const auto of = [&](std::size_t row, const Error& error) {
        return failWith(fmt::format("of {}", nameOf(column.ids[row])), error);
    };
    if (const auto* refs = std::get_if<std::vector<ObjectId>>(&column.values)) {
        for (std::size_t row = 0; row < refs->size(); ++row)
            if (auto ok = checkRef(field, (*refs)[row]); !ok) return of(row, ok.error());
        return {};
    }
    const auto& lists = std::get<std::vector<RefList>>(column.values);
    std::unordered_set<ObjectId> seen;
    for (std::size_t row = 0; row < lists.size(); ++row) {
        if (lists[row].size() > limits_.maxRefs)
            return fail(ErrorCode::kLimit, fmt::format("of {}: {} references, more than the limit of {}",
                                                       nameOf(column.ids[row]), lists[row].size(), limits_.maxRefs));
        seen.clear();
        for (const ObjectId id : lists[row]) {
            if (!id) return of(row, Error{ErrorCode::kBadInput, "it names none among others"});
            if (!seen.insert(id).second)
                return of(row, Error{ErrorCode::kBadInput, fmt::format("it names {} twice", nameOf(id))});
            if (auto ok = checkRef(field, id); !ok) return of(row, ok.error());
        }
    }
    return {};
}

Expected<void> ListCheck::checkRef(const FieldInfo& field, ObjectId target) {
    if (!target) return {};
    const TypeInfo* type = typeOfObject(target);
    if (!type) return missing("to", target);
    if (!field.mayReferTo(type->type, type->isCore))
        return refuse(fmt::format("{} is a {}, not a {}", nameOf(target), type->name,
                                  field.refType ? findType(*field.refType)->name : "core"));
    return {};
}

// ---- ranges --------------------------------------------------------------------------------------------------------

Expected<void> ListCheck::checkRanges() {
    if (list_.ranges.empty()) return {};
    // Arrays as the columns and the ranges before leave them.
    std::map<std::pair<ObjectId, FieldId>, Blob> arrays;
    for (const FieldColumn& column : list_.columns)
        if (const auto* blobs = std::get_if<std::vector<Blob>>(&column.values))
            for (std::size_t row = 0; row < blobs->size(); ++row)
                arrays[{column.ids[row], column.field}] = (*blobs)[row];
    for (const RangeEdit& range : list_.ranges) {
        const TypeInfo* type = typeOfObject(range.object);
        if (!type) return missing("set a range of", range.object);
        const FieldEntry* field = findField(*type, range.field);
        if (type->type != range.type || !field || field->kind != FieldKind::kBlob)
            return refuse(fmt::format("set a range of {}: a {} has no array {}.{}", nameOf(range.object), type->name,
                                      range.type.value, range.field.value));
        const std::string what =
            fmt::format("set a range of {}.{} of {}", type->name, field->name, nameOf(range.object));
        auto known = arrays.find({range.object, range.field});
        if (known == arrays.end()) {
            const ObjectTable::Slot* slot = present_.find(range.object);
            const Blob present = slot ? *field->in<Blob>(static_cast<const void*>(slot->data)) : Blob();
            known = arrays.emplace(std::pair(range.object, range.field), present).first;
        }
        Blob& array = known->second;
        if (!range.bytes.resident() || range.offset > array.sizeBytes() ||
            range.bytes.sizeBytes() > array.sizeBytes() - range.offset)
            return fail(ErrorCode::kBadInput, fmt::format("{}: bytes [{}, +{}) do not lie in its {}", what,
                                                          range.offset, range.bytes.sizeBytes(), array.sizeBytes()));
        if (range.result.resident() && range.result.sizeBytes() == array.sizeBytes()) {
            array = range.result;  // made by whoever resolved this list; nothing that came over a wire is
        } else if (array.resident()) {
            const Expected<Blob> made = array.withRange(range.offset, range.bytes.bytes());
            if (!made) return failWith(what, made.error());
            if (!range.result.empty() && range.result != *made)
                return fail(ErrorCode::kBadInput, fmt::format("{}: what comes out is {}, not {}", what,
                                                              toHex(made->id()), toHex(range.result.id())));
            array = *made;
        } else if (!range.result.empty() && range.result.sizeBytes() == array.sizeBytes()) {
            array = range.result;
        } else {
            return refuse(fmt::format("{}: its array is not here", what));
        }
        checked_.rangeResults.push_back(array);
    }
    return {};
}

// ---- destructions --------------------------------------------------------------------------------------------------

Expected<void> ListCheck::checkDestructions() {
    if (list_.destructions.empty()) return {};
    IdMap<std::int64_t> destroyed;
    for (const ObjectId id : list_.destructions) {
        const TypeInfo* type = typeOfObject(id);
        if (!type) return missing("destroy", id);
        if (id == kRootNode) return refuse("destroy #1: the root stays");
        if (!destroyed.add(id).isNew) return fail(ErrorCode::kBadInput, fmt::format("destroy {}: twice", nameOf(id)));
        if (type->type != typeOf<Node>()) continue;
        const Place& last = place(id);
        if (last.children != 0)
            return refuse(fmt::format("destroy {}: the node has {} children, detach and destroy them too", nameOf(id),
                                      last.children));
        if (last.parent)
            return refuse(fmt::format("destroy {}: the node is still below {}, detach it first", nameOf(id),
                                      nameOf(last.parent)));
    }
    countUses(destroyed);
    for (const ObjectId id : list_.destructions)
        if (const std::int64_t uses = *destroyed.find(id); uses != 0)
            return refuse(fmt::format("destroy {}: the {} is in use by {}", nameOf(id), typeOfObject(id)->name,
                                      usersInWords(aspect_, list_, id, uses)));
    return {};
}

void ListCheck::countUses(IdMap<std::int64_t>& destroyed) const {
    for (const ObjectId id : list_.destructions)
        if (const ObjectTable::Slot* slot = present_.find(id)) *destroyed.find(id) = slot->uses;

    // What columns let go of, and what they take hold of. Refs of objects that go themselves do not count.
    const auto letGo = [&](ObjectId held) {
        if (std::int64_t* uses = destroyed.find(held)) --*uses;
    };
    const auto forEachHeld = [&](ObjectId object, const FieldEntry& field, const auto& visit) {
        const ObjectTable::Slot* slot = present_.find(object);
        if (!slot) return;
        const void* data = slot->data;
        if (field.kind == FieldKind::kRef)
            visit(*field.in<ObjectId>(data));
        else
            for (const ObjectId held : *field.in<RefList>(data)) visit(held);
    };
    std::unordered_set<RefRow, RefRowHash> rowsOfDestroyed;
    for (const FieldColumn& column : list_.columns) {
        if (column.kind() != FieldKind::kRef && column.kind() != FieldKind::kRefs) continue;
        const FieldEntry& field = *findField(*findType(column.type), column.field);
        for (std::size_t row = 0; row < column.ids.size(); ++row) {
            const ObjectId object = column.ids[row];
            forEachHeld(object, field, letGo);
            if (destroyed.contains(object)) {
                rowsOfDestroyed.insert({object, column.field});
                continue;
            }
            const auto takeHold = [&](ObjectId taken) {
                if (std::int64_t* uses = destroyed.find(taken)) ++*uses;
            };
            if (const auto* refs = std::get_if<std::vector<ObjectId>>(&column.values))
                takeHold((*refs)[row]);
            else
                for (const ObjectId taken : std::get<std::vector<RefList>>(column.values)[row]) takeHold(taken);
        }
    }
    for (const ObjectId id : list_.destructions) {
        const ObjectTable::Slot* slot = present_.find(id);
        if (!slot) continue;
        for (const FieldEntry& field : table_.type(*slot).fields)
            if (field.holdsRefs() && !rowsOfDestroyed.contains({id, field.id})) forEachHeld(id, field, letGo);
    }
}

}  // namespace tessera
