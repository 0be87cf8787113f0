#include "common/scene/Aspect.h"

#include <algorithm>

#include "common/scene/FieldLayout.h"
#include "common/scene/InverseRecorder.h"
#include "common/scene/ListCheck.h"

namespace tessera {

struct Aspect::Impl {
    explicit Impl(SceneLimits l) : limits(l) {
        ObjectTable::Slot& root = table.insert(kRootNode, Node());
        table.setHash(kRootNode, root, hashObject(kRootNode, root, scratch));
    }

    /// The list has passed its check: from here on nothing fails.
    void applyChecked(const ChangeList& list, InverseRecorder* inverse);

    void create(const Creation& creation);
    void place(const Placement& placement, InverseRecorder* inverse);
    /// Columns of one type with the same ids. `final`: no other column of that type follows, so the objects can be
    /// hashed while they are at hand.
    void setColumns(std::span<const FieldColumn> columns, bool final, InverseRecorder* inverse);
    void setRow(const FieldColumn& column, const FieldLayout& field, Object& object, std::size_t row);
    void destroy(ObjectId id);
    void rehash(ObjectId id, ObjectTable::Slot& slot) {
        table.setHash(id, slot, hashObject(id, slot, scratch));
        slot.mark = hashedMark;
    }
    void rehashTouched();

    void touch(ObjectId id, ObjectTable::Slot& slot) {
        if (slot.mark == touchedMark) return;
        slot.mark = touchedMark;
        touched.push_back({id, &slot});
    }
    void findRows(const FieldColumn& column);
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
    std::vector<ObjectTable::Slot*> rows;  ///< of the columns at hand
    std::vector<std::byte> scratch;
};

namespace {

template <typename Scalar>
void writeNumbers(const FieldColumn& column, const FieldLayout& field, Object& object, std::size_t row) {
    const std::size_t width = field.info->width;
    const Scalar* from = std::get<std::vector<Scalar>>(column.values).data() + row * width;
    Scalar* to = field.in<Scalar>(object);
    if (field.info->quaternion) {  // said as w x y z, lies as x y z w
        to[0] = from[1];
        to[1] = from[2];
        to[2] = from[3];
        to[3] = from[0];
        return;
    }
    // Widths are 1 to 4: written out, since a loop over so few costs more than its work.
    to[0] = from[0];
    if (width > 1) to[1] = from[1];
    if (width > 2) to[2] = from[2];
    if (width > 3) to[3] = from[3];
}

std::size_t indexOf(const std::vector<ObjectId>& children, ObjectId child) {
    // From both ends: whole families are mostly taken apart from one of them.
    for (std::size_t front = 0, back = children.size() - 1;; ++front, --back) {
        if (children[front] == child) return front;
        if (children[back] == child) return back;
        TESSERA_CHECK(front < back, "a node is not among its parent's children");
    }
}

}  // namespace

void Aspect::Impl::create(const Creation& creation) {
    touch(creation.id, table.insert(creation.id, findType(creation.type)->make()));
    nextFreeId = std::max(nextFreeId, creation.id.value + 1);
}

void Aspect::Impl::place(const Placement& p, InverseRecorder* inverse) {
    ObjectTable::Slot& slot = *table.find(p.node);
    Node& node = std::get<Node>(*slot.object);
    std::size_t oldIndex = 0;
    const ObjectId oldParent = node.parent;
    if (oldParent) {
        ObjectTable::Slot& parent = *table.find(oldParent);
        std::vector<ObjectId>& siblings = std::get<Node>(*parent.object).children;
        oldIndex = indexOf(siblings, p.node);
        siblings.erase(siblings.begin() + static_cast<std::ptrdiff_t>(oldIndex));
        touch(oldParent, parent);
    }
    if (inverse) inverse->moved(p.node, oldParent, static_cast<std::uint32_t>(oldIndex));
    if (p.parent) {
        ObjectTable::Slot& parent = *table.find(p.parent);
        std::vector<ObjectId>& siblings = std::get<Node>(*parent.object).children;
        const std::size_t index = p.index == Placement::kLast ? siblings.size() : p.index;
        siblings.insert(siblings.begin() + static_cast<std::ptrdiff_t>(index), p.node);
        touch(p.parent, parent);
    }
    node.parent = p.parent;
    touch(p.node, slot);
}

void Aspect::Impl::findRows(const FieldColumn& column) {
    rows.clear();
    rows.reserve(column.ids.size());
    ObjectTable::Cursor cursor(table);
    for (const ObjectId id : column.ids) rows.push_back(cursor.find(id));
}

void Aspect::Impl::setRow(const FieldColumn& column, const FieldLayout& field, Object& object, std::size_t row) {
    switch (field.info->kind) {
        case FieldKind::kFloat:
            writeNumbers<float>(column, field, object, row);
            break;
        case FieldKind::kDouble:
            writeNumbers<double>(column, field, object, row);
            break;
        case FieldKind::kInt:
            writeNumbers<std::int64_t>(column, field, object, row);
            break;
        case FieldKind::kRef: {
            ObjectId& held = *field.in<ObjectId>(object);
            letGo(held);
            held = std::get<std::vector<ObjectId>>(column.values)[row];
            if (held) ++table.find(held)->uses;
            break;
        }
        case FieldKind::kText:
            *field.in<std::string>(object) = std::get<std::vector<std::string>>(column.values)[row];
            break;
        case FieldKind::kBlob:
            *field.in<Blob>(object) = std::get<std::vector<Blob>>(column.values)[row];
            break;
    }
}

void Aspect::Impl::setColumns(std::span<const FieldColumn> columns, bool final, InverseRecorder* inverse) {
    findRows(columns.front());
    if (rows.empty()) return;
    std::vector<const FieldLayout*> fields;
    for (const FieldColumn& column : columns) {
        fields.push_back(&layoutOf(rows.front()->alternative, column.field));
        if (inverse) inverse->overwritten(column, *fields.back()->info, table);
    }
    for (std::size_t row = 0; row < rows.size(); ++row) {
        ObjectTable::Slot& slot = *rows[row];
        for (std::size_t i = 0; i < columns.size(); ++i) setRow(columns[i], *fields[i], *slot.object, row);
        const ObjectId id = columns.front().ids[row];
        if (final)
            rehash(id, slot);
        else
            touch(id, slot);
    }
}

void Aspect::Impl::destroy(ObjectId id) {
    const Object& object = *table.find(id)->object;
    for (const FieldInfo& field : typeInfo(object).fields)
        if (field.kind == FieldKind::kRef) letGo(*fieldAt<ObjectId>(field, object));
    table.erase(id);
}

void Aspect::Impl::rehashTouched() {
    for (const Touched& object : touched)
        if (object.slot->mark != hashedMark) rehash(object.id, *object.slot);
}

void Aspect::Impl::applyChecked(const ChangeList& list, InverseRecorder* inverse) {
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
        const bool final = std::none_of(list.columns.begin() + static_cast<std::ptrdiff_t>(end), list.columns.end(),
                                        [&](const FieldColumn& later) { return later.type == column.type; });
        setColumns(std::span(list.columns).subspan(first, end - first), final, inverse);
    }
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
    if (auto ok = ListCheck(impl_->table, impl_->limits, list).run(); !ok) return ok;
    impl_->applyChecked(list, nullptr);
    return {};
}

Expected<ChangeList> Aspect::applyWithInverse(const ChangeList& list) {
    if (auto ok = ListCheck(impl_->table, impl_->limits, list).run(); !ok) return tl::unexpected(ok.error());
    InverseRecorder inverse(list, impl_->table);
    impl_->applyChecked(list, &inverse);
    return inverse.take();
}

const Object* Aspect::find(ObjectId id) const {
    const ObjectTable::Slot* slot = std::as_const(impl_->table).find(id);
    return slot ? slot->object.get() : nullptr;
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
std::uint64_t Aspect::stateHash() const {
    return impl_->table.rootHash();
}
std::vector<Aspect::LeafHash> Aspect::leafHashes() const {
    return impl_->table.leafHashes();
}
std::vector<Aspect::ObjectHash> Aspect::objectHashes(std::uint64_t leaf) const {
    return impl_->table.objectHashes(leaf);
}

}  // namespace tessera
