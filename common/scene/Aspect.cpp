#include "common/scene/Aspect.h"

#include <algorithm>
#include <array>

#include "common/base/Limits.h"
#include "common/scene/InverseRecorder.h"
#include "common/scene/ListCheck.h"

namespace tessera {

static_assert(SceneLimits().maxObjects == limits::kMaxObjects && SceneLimits().maxTextBytes == limits::kMaxTextBytes,
              "whatever a scene may hold can be sent, read and joined");

struct Aspect::Impl {
    explicit Impl(SceneLimits l) : limits(l) {
        ObjectTable::Slot& root = table.insert(kRootNode, allTypes()[kTypeIndex<Node>]);
        table.rehash(kRootNode, root);
    }

    /// The list has passed its check: from here on nothing fails.
    void applyChecked(const ChangeList& list, const CheckedList& checked, InverseRecorder* inverse);

    void create(const Creation& creation);
    void place(const Placement& placement, InverseRecorder* inverse);
    /// Columns of one type with the same ids. `final`: nothing else touches objects of that type any more, so they can
    /// be hashed while they are at hand.
    void setColumns(std::span<const FieldColumn> columns, bool final, InverseRecorder* inverse);
    /// Rows of a column from `first` on, whose objects these are.
    void setRows(const FieldColumn& column, const FieldEntry& field, std::size_t first,
                 std::span<std::byte* const> objects);
    void setRange(const RangeEdit& range, const Blob& result, InverseRecorder* inverse);
    void destroy(ObjectId id);
    void rehash(ObjectId id, ObjectTable::Slot& slot) {
        table.rehash(id, slot);
        slot.mark = hashedMark;
    }
    void rehashTouched(const ChangeList& list);

    void touch(ObjectId id, ObjectTable::Slot& slot) {
        if (slot.mark == touchedMark) return;
        slot.mark = touchedMark;
        touched.push_back({id, &slot});
    }
    void findRows(const FieldColumn& column);
    void hold(ObjectId target, ObjectTable::Cursor& cursor) {
        if (target) ++cursor.find(target)->uses;
    }
    void letGo(ObjectId target) {
        if (ObjectTable::Slot* slot = target ? table.find(target) : nullptr) --slot->uses;
    }

    SceneLimits limits;
    ObjectTable table;
    std::uint64_t nextFreeId = kRootNode.value + 1;
    // During one apply:
    std::uint32_t touchedMark = 0, hashedMark = 0;
    struct Touched {
        ObjectId id;
        ObjectTable::Slot* slot;
    };
    std::vector<Touched> touched;
    std::vector<ObjectTable::Slot*> rows;         ///< of the columns at hand
    std::vector<ObjectTable::Slot*> checkedRows;  ///< CheckedList::rowsOf
    std::vector<const FieldEntry*> fields;        ///< of the columns at hand
};

void Aspect::Impl::create(const Creation& creation) {
    table.insert(creation.id, *findType(creation.type)).mark = touchedMark;  // hashed at the end: see rehashTouched
    nextFreeId = std::max(nextFreeId, creation.id.value + 1);
}

void Aspect::Impl::place(const Placement& p, InverseRecorder* inverse) {
    ObjectTable::Slot& slot = *table.find(p.node);
    Node& node = table.node(slot);
    std::size_t oldIndex = 0;
    const ObjectId oldParent = node.parent;
    if (oldParent) {
        ObjectTable::Slot& parent = *table.find(oldParent);
        oldIndex = table.node(parent).children.erase(p.node);
        touch(oldParent, parent);
    }
    if (inverse) inverse->moved(p.node, oldParent, static_cast<std::uint32_t>(oldIndex));
    if (p.parent) {
        ObjectTable::Slot& parent = *table.find(p.parent);
        ChildList& siblings = table.node(parent).children;
        siblings.insert(p.index == Placement::kLast ? siblings.size() : p.index, p.node);
        touch(p.parent, parent);
    }
    node.parent = p.parent;
    touch(p.node, slot);
}

void Aspect::Impl::findRows(const FieldColumn& column) {
    rows.resize(column.ids.size());
    ObjectTable::Cursor cursor(table);
    for (std::size_t row = 0; row < rows.size(); ++row) rows[row] = cursor.find(column.ids[row]);
}

namespace {

template <typename Scalar, std::size_t width>
void writeRows(const Scalar* from, std::span<std::byte* const> objects, std::size_t offset) {
    for (std::byte* object : objects) {
        auto* to = reinterpret_cast<Scalar*>(object + offset);
        for (std::size_t i = 0; i < width; ++i) to[i] = from[i];
        from += width;
    }
}

template <typename Scalar>
void writeNumbers(const Scalar* from, std::span<std::byte* const> objects, const FieldEntry& field) {
    if (field.quaternion) {  // said as w x y z, lies as x y z w
        for (std::byte* object : objects) {
            auto* to = reinterpret_cast<Scalar*>(object + field.offset);
            to[0] = from[1];
            to[1] = from[2];
            to[2] = from[3];
            to[3] = from[0];
            from += 4;
        }
        return;
    }
    switch (field.width) {
        case 1:
            return writeRows<Scalar, 1>(from, objects, field.offset);
        case 2:
            return writeRows<Scalar, 2>(from, objects, field.offset);
        case 3:
            return writeRows<Scalar, 3>(from, objects, field.offset);
        default:
            return writeRows<Scalar, 4>(from, objects, field.offset);
    }
}

}  // namespace

void Aspect::Impl::setRows(const FieldColumn& column, const FieldEntry& field, std::size_t first,
                           std::span<std::byte* const> objects) {
    std::visit(
        [&](const auto& values) {
            using Scalar = typename std::decay_t<decltype(values)>::value_type;
            if constexpr (std::is_same_v<Scalar, float> || std::is_same_v<Scalar, double>) {
                writeNumbers(values.data() + first * field.width, objects, field);
            } else if constexpr (std::is_same_v<Scalar, ObjectId>) {
                ObjectTable::Cursor cursor(table);
                for (std::size_t row = 0; row < objects.size(); ++row) {
                    ObjectId& held = *field.in<ObjectId>(objects[row]);
                    letGo(held);
                    held = values[first + row];
                    hold(held, cursor);
                }
            } else if constexpr (std::is_same_v<Scalar, RefList>) {
                ObjectTable::Cursor cursor(table);
                for (std::size_t row = 0; row < objects.size(); ++row) {
                    RefList& held = *field.in<RefList>(objects[row]);
                    for (const ObjectId id : held) letGo(id);
                    held = values[first + row];
                    for (const ObjectId id : held) hold(id, cursor);
                }
            } else if constexpr (std::is_same_v<Scalar, std::uint8_t>) {
                for (std::size_t row = 0; row < objects.size(); ++row)
                    *field.in<bool>(objects[row]) = values[first + row] != 0;
            } else {
                for (std::size_t row = 0; row < objects.size(); ++row)
                    *field.in<Scalar>(objects[row]) = values[first + row];
            }
        },
        column.values);
}

void Aspect::Impl::setColumns(std::span<const FieldColumn> columns, bool final, InverseRecorder* inverse) {
    if (rows.empty()) return;
    const TypeInfo& type = table.type(*rows.front());
    fields.clear();
    for (const FieldColumn& column : columns) fields.push_back(findField(type, column.field));
    const std::vector<ObjectId>& ids = columns.front().ids;
    // Some rows at a time, written and hashed while their objects are in the cache.
    std::array<std::byte*, 128> objects;
    for (std::size_t first = 0; first < rows.size(); first += objects.size()) {
        const std::size_t count = std::min(objects.size(), rows.size() - first);
        const std::span here(objects.data(), count);
        for (std::size_t i = 0; i < count; ++i) {
            here[i] = static_cast<std::byte*>(rows[first + i]->data);
            __builtin_prefetch(here[i], 1);
            __builtin_prefetch(here[i] + 64, 1);
        }
        for (std::size_t i = 0; i < columns.size(); ++i) {
            if (inverse) inverse->overwritten(columns[i], *fields[i], first, here);
            setRows(columns[i], *fields[i], first, here);
        }
        if (final)
            table.rehash(type, std::span(ids).subspan(first, count), std::span(rows).subspan(first, count), hashedMark);
        else
            for (std::size_t i = first; i < first + count; ++i) touch(ids[i], *rows[i]);
    }
}

void Aspect::Impl::setRange(const RangeEdit& range, const Blob& result, InverseRecorder* inverse) {
    ObjectTable::Slot& slot = *table.find(range.object);
    const FieldEntry& field = *findField(table.type(slot), range.field);
    Blob& held = *field.in<Blob>(slot.data);
    if (inverse) inverse->edited(range, held);
    held = result;
    touch(range.object, slot);
}

void Aspect::Impl::destroy(ObjectId id) {
    forEachRef(table.object(*table.find(id)), [this](ObjectId target) { letGo(target); });
    table.erase(id);
}

void Aspect::Impl::rehashTouched(const ChangeList& list) {
    ObjectTable::Cursor cursor(table);
    for (const Creation& creation : list.creations)
        if (ObjectTable::Slot& slot = *cursor.find(creation.id); slot.mark != hashedMark) rehash(creation.id, slot);
    for (const Touched& object : touched)
        if (object.slot->mark != hashedMark) rehash(object.id, *object.slot);
}

void Aspect::Impl::applyChecked(const ChangeList& list, const CheckedList& checked, InverseRecorder* inverse) {
    touchedMark = table.newMark();
    hashedMark = table.newMark();
    touched.clear();
    for (const Creation& creation : list.creations) create(creation);
    for (const Placement& placement : list.placements) place(placement, inverse);
    for (std::size_t first = 0, end = 0; first < list.columns.size(); first = end) {
        // Columns of one type mostly name the same objects: those are found and fetched once for all.
        const FieldColumn& column = list.columns[first];
        for (end = first + 1; end < list.columns.size() && checked.sameRows[end];) ++end;
        const auto sameType = [&](const auto& later) { return later.type == column.type; };
        const bool final =
            std::none_of(list.columns.begin() + static_cast<std::ptrdiff_t>(end), list.columns.end(), sameType) &&
            std::ranges::none_of(list.ranges, sameType);
        if (checked.rowsOf == first)
            rows.swap(checkedRows);
        else
            findRows(column);
        setColumns(std::span(list.columns).subspan(first, end - first), final, inverse);
    }
    for (std::size_t i = 0; i < list.ranges.size(); ++i) setRange(list.ranges[i], checked.rangeResults[i], inverse);
    rehashTouched(list);  // while every slot still stands
    for (const ObjectId id : list.destructions) destroy(id);
    nextFreeId = std::max(nextFreeId, list.nextFreeId);
}

// ---- Aspect --------------------------------------------------------------------------------------------------------

Aspect::Aspect(SceneLimits limits) : impl_(std::make_unique<Impl>(limits)) {}
Aspect::~Aspect() = default;
Aspect::Aspect(Aspect&&) noexcept = default;
Aspect& Aspect::operator=(Aspect&&) noexcept = default;

Expected<void> Aspect::apply(const ChangeList& list) {
    const Expected<CheckedList> checked = ListCheck(*this, impl_->table, impl_->limits, list, impl_->checkedRows).run();
    if (!checked) return tl::unexpected(checked.error());
    impl_->applyChecked(list, *checked, nullptr);
    return {};
}

Expected<ChangeList> Aspect::applyWithInverse(const ChangeList& list) {
    const Expected<CheckedList> checked = ListCheck(*this, impl_->table, impl_->limits, list, impl_->checkedRows).run();
    if (!checked) return tl::unexpected(checked.error());
    InverseRecorder inverse(list, impl_->table);
    impl_->applyChecked(list, *checked, &inverse);
    return inverse.take();
}

Object Aspect::find(ObjectId id) const {
    const ObjectTable::Slot* slot = std::as_const(impl_->table).find(id);
    return slot ? impl_->table.object(*slot) : Object();
}

const ObjectTable& Aspect::table() const {
    return impl_->table;
}

std::size_t Aspect::useCount(ObjectId id) const {
    const ObjectTable::Slot* slot = impl_->table.find(id);
    return slot ? slot->uses : 0;
}

std::size_t Aspect::objectCount() const {
    return impl_->table.size();
}
std::vector<ObjectId> Aspect::ids() const {
    return impl_->table.ids();
}
std::uint64_t Aspect::nextFreeId() const {
    return impl_->nextFreeId;
}
StateHash Aspect::stateHash() const {
    return StateHash(impl_->table.rootHash());
}
std::vector<Aspect::LeafHash> Aspect::leafHashes() const {
    return impl_->table.leafHashes();
}
std::vector<Aspect::ObjectHash> Aspect::objectHashes(std::uint64_t leaf) const {
    return impl_->table.objectHashes(leaf);
}

// ---- snapshot ------------------------------------------------------------------------------------------------------

namespace {

/// The values of one field, of all objects of a type whose value is not the default.
FieldColumn columnOf(const ObjectTable& table, const TypeInfo& type, const FieldEntry& field,
                     std::span<const ObjectId> ids) {
    FieldColumn column = FieldColumn::ofShape(type.type, field.id, field.kind, field.width);
    ObjectTable::ConstCursor cursor(table);
    std::visit(
        [&](auto& values) {
            using Scalar = typename std::decay_t<decltype(values)>::value_type;
            using Stored = std::conditional_t<std::is_same_v<Scalar, std::uint8_t>, bool, Scalar>;
            const auto* usual = field.in<Stored>(type.fresh);
            const auto heldBy = [&](ObjectId id) {
                return field.in<Stored>(static_cast<const void*>(cursor.find(id)->data));
            };
            for (const ObjectId id : ids) {
                const auto* held = heldBy(id);
                if constexpr (std::is_same_v<Scalar, Matrix>) {
                    if (*held != *usual) column.ids.push_back(id);
                } else if (!std::equal(held, held + field.width, usual)) {
                    column.ids.push_back(id);
                }
            }
            values.reserve(column.ids.size() * column.width);  // a scene has many: no more memory than they take
            for (const ObjectId id : column.ids) {
                const auto* held = heldBy(id);
                if constexpr (std::is_same_v<Scalar, Matrix>) {
                    values.push_back(*held);
                } else {
                    if (field.quaternion) values.push_back(held[3]);
                    for (std::size_t i = 0; i < (field.quaternion ? 3u : field.width); ++i) values.push_back(held[i]);
                }
            }
        },
        column.values);
    return column;
}

}  // namespace

ChangeList snapshot(const Aspect& aspect) {
    const ObjectTable& table = aspect.table();
    ChangeList list;
    std::vector<std::vector<ObjectId>> byType(allTypes().size());
    ObjectTable::ConstCursor cursor(table);
    const std::vector<ObjectId> ids = table.ids();
    list.creations.reserve(ids.size());
    for (const ObjectId id : ids) {
        const ObjectTable::Slot& slot = *cursor.find(id);
        byType[slot.type].push_back(id);
        if (id != kRootNode) list.creations.push_back({id, table.type(slot).type});
        if (slot.type == kTypeIndex<Node>)
            for (const ObjectId child : table.node(slot).children) list.placements.push_back({child, id});
    }
    for (const TypeInfo& type : allTypes())
        for (const FieldEntry& field : type.fields) {
            FieldColumn column = columnOf(table, type, field, byType[type.index]);
            if (!column.ids.empty()) list.columns.push_back(std::move(column));
        }
    list.nextFreeId = aspect.nextFreeId();
    return list;
}

}  // namespace tessera
