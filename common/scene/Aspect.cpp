#include "common/scene/Aspect.h"

#include <algorithm>

#include "common/scene/InverseRecorder.h"
#include "common/scene/ListCheck.h"

namespace tessera {

struct Aspect::Impl {
    explicit Impl(SceneLimits l) : limits(l) {
        ObjectTable::Slot& root = table.insert(kRootNode, Node());
        table.setHash(kRootNode, root, hashObject(kRootNode, *root.object, scratch));
    }

    /// The list has passed its check: from here on nothing fails.
    void applyChecked(const ChangeList& list, InverseRecorder* inverse);

    void create(const Creation& creation);
    void place(const Placement& placement, InverseRecorder* inverse);
    void setColumn(const FieldColumn& column);
    void destroy(ObjectId id);
    void rehashTouched();

    void touch(ObjectId id, ObjectTable::Slot& slot) {
        if (slot.mark == touchedMark) return;
        slot.mark = touchedMark;
        touched.push_back(id);
    }
    void letGo(ObjectId target) {
        if (ObjectTable::Slot* slot = target ? table.find(target) : nullptr) --slot->uses;
    }

    SceneLimits limits;
    ObjectTable table;
    std::uint64_t nextFreeId = kRootNode.value + 1;
    // During one apply:
    std::uint32_t touchedMark = 0;
    std::vector<ObjectId> touched;
    std::vector<std::byte> scratch;
};

namespace {

/// Writes `width` scalars per row into the objects; refs are counted by the caller.
template <typename Scalar>
void writeNumbers(const FieldColumn& column, const FieldInfo& field, Object& object, std::size_t row) {
    const Scalar* from = std::get<std::vector<Scalar>>(column.values).data() + row * field.width;
    Scalar* to = fieldAt<Scalar>(field, object);
    if (field.quaternion) {
        std::copy_n(from + 1, 3, to);
        to[3] = from[0];
    } else {
        std::copy_n(from, field.width, to);
    }
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

void Aspect::Impl::setColumn(const FieldColumn& column) {
    const FieldInfo& field = *findField(*findType(column.type), column.field);
    ObjectTable::Cursor cursor(table);
    const auto forEachRow = [&](auto&& write) {
        for (std::size_t row = 0; row < column.ids.size(); ++row) {
            ObjectTable::Slot& slot = *cursor.find(column.ids[row]);
            write(*slot.object, row);
            touch(column.ids[row], slot);
        }
    };
    switch (field.kind) {
        case FieldKind::kFloat:
            forEachRow([&](Object& object, std::size_t row) { writeNumbers<float>(column, field, object, row); });
            break;
        case FieldKind::kDouble:
            forEachRow([&](Object& object, std::size_t row) { writeNumbers<double>(column, field, object, row); });
            break;
        case FieldKind::kInt:
            forEachRow([&](Object& object, std::size_t row) { writeNumbers<std::int64_t>(column, field, object, row); });
            break;
        case FieldKind::kRef:
            forEachRow([&, &refs = std::get<std::vector<ObjectId>>(column.values)](Object& object, std::size_t row) {
                ObjectId& held = *fieldAt<ObjectId>(field, object);
                letGo(held);
                held = refs[row];
                if (held) ++table.find(held)->uses;
            });
            break;
        case FieldKind::kText:
            forEachRow([&, &texts = std::get<std::vector<std::string>>(column.values)](Object& object, std::size_t row) {
                *fieldAt<std::string>(field, object) = texts[row];
            });
            break;
        case FieldKind::kBlob:
            forEachRow([&, &blobs = std::get<std::vector<Blob>>(column.values)](Object& object, std::size_t row) {
                *fieldAt<Blob>(field, object) = blobs[row];
            });
            break;
    }
}

void Aspect::Impl::destroy(ObjectId id) {
    const Object& object = *table.find(id)->object;
    for (const FieldInfo& field : typeInfo(object).fields)
        if (field.kind == FieldKind::kRef) letGo(*fieldAt<ObjectId>(field, object));
    table.erase(id);
}

void Aspect::Impl::rehashTouched() {
    ObjectTable::Cursor cursor(table);
    for (const ObjectId id : touched)
        if (ObjectTable::Slot* slot = cursor.find(id)) table.setHash(id, *slot, hashObject(id, *slot->object, scratch));
    touched.clear();
}

void Aspect::Impl::applyChecked(const ChangeList& list, InverseRecorder* inverse) {
    touchedMark = table.newMark();
    for (const Creation& creation : list.creations) create(creation);
    for (const Placement& placement : list.placements) place(placement, inverse);
    for (const FieldColumn& column : list.columns) {
        if (inverse) inverse->overwritten(column, *findField(*findType(column.type), column.field), table);
        setColumn(column);
    }
    for (const ObjectId id : list.destructions) destroy(id);
    rehashTouched();
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

std::size_t Aspect::objectCount() const { return impl_->table.size(); }
std::vector<ObjectId> Aspect::ids() const { return impl_->table.ids(); }
std::uint64_t Aspect::nextFreeId() const { return impl_->nextFreeId; }
std::uint64_t Aspect::stateHash() const { return impl_->table.rootHash(); }
std::vector<Aspect::LeafHash> Aspect::leafHashes() const { return impl_->table.leafHashes(); }
std::vector<Aspect::ObjectHash> Aspect::objectHashes(std::uint64_t leaf) const { return impl_->table.objectHashes(leaf); }

}  // namespace tessera
