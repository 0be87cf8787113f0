#include "common/scene/Aspect.h"

#include <algorithm>

#include "common/scene/InverseRecorder.h"
#include "common/scene/ListCheck.h"

namespace tessera {

struct Aspect::Impl {
    explicit Impl(SceneLimits l) : limits(l) {
        ObjectTable::Slot& root = table.insert(kRootNode, allTypes()[kTypeIndex<Node>]);
        table.rehash(kRootNode, root, table.data(root));
    }

    /// The list has passed its check: from here on nothing fails.
    void applyChecked(const ChangeList& list, const CheckedList& checked, InverseRecorder* inverse);

    void create(const Creation& creation);
    void place(const Placement& placement, InverseRecorder* inverse);
    /// Columns of one type with the same ids. `final`: nothing else touches objects of that type any more, so they can be
    /// hashed while they are at hand.
    void setColumns(std::span<const FieldColumn> columns, bool final, InverseRecorder* inverse);
    void rehashRows(const std::vector<ObjectId>& ids);
    void setColumn(const FieldColumn& column, const FieldEntry& field);
    void setRange(const RangeEdit& range, const Blob& result, InverseRecorder* inverse);
    void destroy(ObjectId id);
    void rehash(ObjectId id, ObjectTable::Slot& slot) {
        table.rehash(id, slot, table.data(slot));
        slot.mark = hashedMark;
    }
    void rehashTouched();

    void touch(ObjectId id, ObjectTable::Slot& slot) {
        if (slot.mark == touchedMark) return;
        slot.mark = touchedMark;
        touched.push_back({id, &slot});
    }
    void findRows(const FieldColumn& column);
    void findObjects();
    void hold(ObjectId target) {
        if (target) ++table.find(target)->uses;
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
    std::vector<const ObjectTable::Slot*> rows;         ///< of the columns at hand
    std::vector<const ObjectTable::Slot*> checkedRows;  ///< CheckedList::rowsOf
    std::vector<std::byte*> objects;       ///< the same
};

void Aspect::Impl::create(const Creation& creation) {
    touch(creation.id, table.insert(creation.id, *findType(creation.type)));
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

void Aspect::Impl::findObjects() {
    objects.resize(rows.size());
    const Slab& slab = table.slab(rows.front()->type);
    for (std::size_t row = 0; row < rows.size(); ++row) objects[row] = static_cast<std::byte*>(slab.at(rows[row]->place));
}

namespace {

template <typename Scalar, std::size_t width>
void writeRows(const std::vector<Scalar>& values, std::span<std::byte* const> objects, std::size_t offset) {
    const Scalar* from = values.data();
    for (std::byte* object : objects) {
        auto* to = reinterpret_cast<Scalar*>(object + offset);
        for (std::size_t i = 0; i < width; ++i) to[i] = from[i];
        from += width;
    }
}

template <typename Scalar>
void writeNumbers(const std::vector<Scalar>& values, std::span<std::byte* const> objects, const FieldEntry& field) {
    if (field.quaternion) {  // said as w x y z, lies as x y z w
        const Scalar* from = values.data();
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
            return writeRows<Scalar, 1>(values, objects, field.offset);
        case 2:
            return writeRows<Scalar, 2>(values, objects, field.offset);
        case 3:
            return writeRows<Scalar, 3>(values, objects, field.offset);
        default:
            return writeRows<Scalar, 4>(values, objects, field.offset);
    }
}

}  // namespace

void Aspect::Impl::setColumn(const FieldColumn& column, const FieldEntry& field) {
    std::visit(
        [&](const auto& values) {
            using Scalar = typename std::decay_t<decltype(values)>::value_type;
            if constexpr (std::is_same_v<Scalar, float> || std::is_same_v<Scalar, double>) {
                writeNumbers(values, objects, field);
            } else if constexpr (std::is_same_v<Scalar, ObjectId>) {
                for (std::size_t row = 0; row < objects.size(); ++row) {
                    ObjectId& held = *field.in<ObjectId>(objects[row]);
                    letGo(held);
                    held = values[row];
                    hold(held);
                }
            } else if constexpr (std::is_same_v<Scalar, RefList>) {
                for (std::size_t row = 0; row < objects.size(); ++row) {
                    RefList& held = *field.in<RefList>(objects[row]);
                    for (const ObjectId id : held) letGo(id);
                    held = values[row];
                    for (const ObjectId id : held) hold(id);
                }
            } else if constexpr (std::is_same_v<Scalar, std::uint8_t>) {
                for (std::size_t row = 0; row < objects.size(); ++row) *field.in<bool>(objects[row]) = values[row] != 0;
            } else {
                for (std::size_t row = 0; row < objects.size(); ++row) *field.in<Scalar>(objects[row]) = values[row];
            }
        },
        column.values);
}

void Aspect::Impl::setColumns(std::span<const FieldColumn> columns, bool final, InverseRecorder* inverse) {
    if (rows.empty()) return;
    findObjects();
    const TypeInfo& type = table.type(*rows.front());
    for (const FieldColumn& column : columns) {
        const FieldEntry& field = *findField(type, column.field);
        if (inverse) inverse->overwritten(column, field, objects);
        setColumn(column, field);
    }
    const std::vector<ObjectId>& ids = columns.front().ids;
    if (final)
        rehashRows(ids);
    else
        for (std::size_t row = 0; row < rows.size(); ++row) touch(ids[row], const_cast<ObjectTable::Slot&>(*rows[row]));
}

void Aspect::Impl::rehashRows(const std::vector<ObjectId>& ids) {
    for (std::size_t row = 0; row < rows.size(); ++row) {
        auto& slot = const_cast<ObjectTable::Slot&>(*rows[row]);
        table.rehash(ids[row], slot, objects[row]);
        slot.mark = hashedMark;
    }
}

void Aspect::Impl::setRange(const RangeEdit& range, const Blob& result, InverseRecorder* inverse) {
    ObjectTable::Slot& slot = *table.find(range.object);
    const FieldEntry& field = *findField(table.type(slot), range.field);
    Blob& held = *field.in<Blob>(table.data(slot));
    if (inverse) inverse->edited(range, held);
    held = result;
    touch(range.object, slot);
}

void Aspect::Impl::destroy(ObjectId id) {
    forEachRef(table.object(*table.find(id)), [this](ObjectId target) { letGo(target); });
    table.erase(id);
}

void Aspect::Impl::rehashTouched() {
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
        for (end = first + 1; end < list.columns.size(); ++end)
            if (list.columns[end].type != column.type || list.columns[end].ids != column.ids) break;
        const auto sameType = [&](const auto& later) { return later.type == column.type; };
        const bool final = std::none_of(list.columns.begin() + static_cast<std::ptrdiff_t>(end), list.columns.end(), sameType) &&
                           std::ranges::none_of(list.ranges, sameType);
        if (checked.rowsOf == first)
            rows.swap(checkedRows);
        else
            findRows(column);
        setColumns(std::span(list.columns).subspan(first, end - first), final, inverse);
    }
    for (std::size_t i = 0; i < list.ranges.size(); ++i) setRange(list.ranges[i], checked.rangeResults[i], inverse);
    rehashTouched();  // while every slot still stands
    for (const ObjectId id : list.destructions) destroy(id);
    nextFreeId = std::max(nextFreeId, list.nextFreeId);
}

// ---- Aspect --------------------------------------------------------------------------------------------------------

Aspect::Aspect(SceneLimits limits) : impl_(std::make_unique<Impl>(limits)) {}
Aspect::~Aspect() = default;
Aspect::Aspect(Aspect&&) noexcept = default;
Aspect& Aspect::operator=(Aspect&&) noexcept = default;

Expected<void> Aspect::apply(const ChangeList& list) {
    const Expected<CheckedList> checked = ListCheck(impl_->table, impl_->limits, list, impl_->checkedRows).run();
    if (!checked) return tl::unexpected(checked.error());
    impl_->applyChecked(list, *checked, nullptr);
    return {};
}

Expected<ChangeList> Aspect::applyWithInverse(const ChangeList& list) {
    const Expected<CheckedList> checked = ListCheck(impl_->table, impl_->limits, list, impl_->checkedRows).run();
    if (!checked) return tl::unexpected(checked.error());
    InverseRecorder inverse(list, impl_->table);
    impl_->applyChecked(list, *checked, &inverse);
    return inverse.take();
}

Object Aspect::find(ObjectId id) const {
    const ObjectTable::Slot* slot = std::as_const(impl_->table).find(id);
    return slot ? impl_->table.object(*slot) : Object();
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
std::vector<Aspect::MemoryUse> Aspect::memoryUse() const {
    return impl_->table.memoryUse();
}
std::uint64_t Aspect::stateHash() const {
    return impl_->table.rootHash();
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
FieldColumn columnOf(const ObjectTable& table, const TypeInfo& type, const FieldEntry& field, std::span<const ObjectId> ids) {
    FieldColumn column = FieldColumn::ofShape(type.type, field.id, field.kind, field.width);
    ObjectTable::ConstCursor cursor(table);
    std::visit(
        [&](auto& values) {
            using Scalar = typename std::decay_t<decltype(values)>::value_type;
            using Stored = std::conditional_t<std::is_same_v<Scalar, std::uint8_t>, bool, Scalar>;
            const auto* usual = field.in<Stored>(type.fresh);
            for (const ObjectId id : ids) {
                const auto* held = field.in<Stored>(static_cast<const void*>(table.data(*cursor.find(id))));
                if constexpr (std::is_same_v<Scalar, Matrix>) {
                    if (*held == *usual) continue;
                    values.push_back(*held);
                } else {
                    if (std::equal(held, held + field.width, usual)) continue;
                    if (field.quaternion) values.push_back(held[3]);
                    for (std::size_t i = 0; i < (field.quaternion ? 3u : field.width); ++i) values.push_back(held[i]);
                }
                column.ids.push_back(id);
            }
        },
        column.values);
    return column;
}

}  // namespace

ChangeList snapshot(const Aspect& aspect) {
    const ObjectTable& table = aspect.impl_->table;
    ChangeList list;
    std::vector<std::vector<ObjectId>> byType(allTypes().size());
    ObjectTable::ConstCursor cursor(table);
    for (const ObjectId id : table.ids()) {
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
