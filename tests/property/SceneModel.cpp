#include "tests/property/SceneModel.h"

#include <algorithm>
#include <cmath>

namespace tessera {

namespace {

struct Pool {
    BlobStore store;
    std::vector<Blob> blobs;
    std::vector<Blob> kept;  ///< that ranges made: whoever reads a snapshot looks for them
    Pool() {
        for (int i = 0; i < 6; ++i) {
            const std::vector<int> values(static_cast<std::size_t>(1 + i * i), i);
            blobs.push_back(store.add(Blob::of(std::span<const int>(values))));
        }
    }
};

Pool& pool() {
    static Pool thePool;
    return thePool;
}

double someNumber(Random& random) {
    switch (below(random, 6)) {
        case 0:
            return 0.0;
        case 1:
            return -0.0;
        case 2:
            return 1e-310;  // denormal
        case 3:
            return std::ldexp(1.0, static_cast<int>(below(random, 240)) - 120);
        default:
            return std::uniform_real_distribution<double>(-100, 100)(random);
    }
}

/// Within the bounds of a field: itself, or what is nearest to 1.
double within(const FieldInfo& field, double number) {
    return number < field.least || number > field.greatest ? std::clamp(1.0, field.least, field.greatest) : number;
}

std::string someName(Random& random) {
    static const std::vector<std::string> kNames = {"",      "hall", "crane", "hook",
                                                    "Größe", "a/b",  "x[1]",  std::string("nul\0", 4)};
    return oneIn(random, 10) ? std::string(below(random, 200), 'n') : kNames[below(random, kNames.size())];
}

}  // namespace

const std::vector<Blob>& blobPool() {
    return pool().blobs;
}
const BlobStore& blobStore() {
    return pool().store;
}
Blob keepBlob(const Blob& blob) {
    return pool().kept.emplace_back(pool().store.add(blob));
}

SceneModel::SceneModel() {
    ModelObject root{typeOf<Node>(), {}, {}, {}};
    const TypeInfo& type = *findType("Node");
    for (const FieldEntry& field : type.fields) root.fields[field.id] = field.load(type.freshObject());
    objects_[kRootNode] = root;
}

std::vector<ObjectId> SceneModel::objectsOf(ObjectType type) const {
    std::vector<ObjectId> ids;
    for (const auto& [id, object] : objects_)
        if (object.type == type) ids.push_back(id);
    return ids;
}

ObjectId SceneModel::anyOf(const std::vector<ObjectId>& ids, Random& random) const {
    return ids.empty() ? ObjectId() : ids[below(random, ids.size())];
}

bool SceneModel::isBelow(ObjectId node, ObjectId ancestor) const {
    for (ObjectId at = node; at; at = objects_.at(at).parent)
        if (at == ancestor) return true;
    return false;
}

FieldValue SceneModel::someValue(const FieldInfo& field, Random& random, const std::set<ObjectId>& avoid) const {
    switch (field.kind) {
        case FieldKind::kFloat: {
            Floats values;
            values.width = field.width;
            for (int i = 0; i < field.width; ++i)
                values.values[static_cast<std::size_t>(i)] = static_cast<float>(within(field, someNumber(random)));
            return values;
        }
        case FieldKind::kDouble: {
            Doubles values;
            values.width = field.width;
            for (int i = 0; i < field.width; ++i) {
                values.values[static_cast<std::size_t>(i)] = within(field, someNumber(random));
            }
            if (field.quaternion) values.values[below(random, 4)] = 1;
            return values;
        }
        case FieldKind::kInt: {
            const double least = std::max(field.least, -1000.0), greatest = std::min(field.greatest, 1000.0);
            if (field.wordUse == WordUse::kOneOf) return field.words()[below(random, field.words().size())].number;
            return static_cast<std::int64_t>(least) +
                   static_cast<std::int64_t>(below(random, static_cast<std::size_t>(greatest - least) + 1));
        }
        case FieldKind::kRef: {
            std::vector<ObjectId> targets = {ObjectId()};
            for (const auto& [id, object] : objects_)
                if ((field.refType ? object.type == *field.refType : findType(object.type)->isCore) &&
                    !avoid.contains(id))
                    targets.push_back(id);
            return anyOf(targets, random);
        }
        case FieldKind::kText:
            return someName(random);
        case FieldKind::kBlob:
            return oneIn(random, 5) ? Blob() : blobPool()[below(random, blobPool().size())];
        case FieldKind::kBool:
            return oneIn(random, 2);
        case FieldKind::kRefs: {
            RefList refs;
            for (const auto& [id, object] : objects_)
                if ((field.refType ? object.type == *field.refType : findType(object.type)->isCore) &&
                    !avoid.contains(id) && oneIn(random, 4))
                    refs.push_back(id);
            std::shuffle(refs.begin(), refs.end(), random);
            return refs;
        }
        case FieldKind::kMatrix: {
            Matrix matrix;
            for (double& number : matrix.values) number = someNumber(random);
            return matrix;
        }
    }
    return {};
}

void SceneModel::create(ChangeListBuilder& list, ObjectType type, Random& random) {
    if (oneIn(random, 20)) nextId_ += below(random, 3000);  // ids of objects that are long gone
    const ObjectId id(nextId_++);
    list.create(id, type);
    ModelObject object{type, {}, {}, {}};
    const TypeInfo& info = *findType(type);
    for (const FieldEntry& field : info.fields) object.fields[field.id] = field.load(info.freshObject());
    objects_[id] = std::move(object);
}

void SceneModel::place(ChangeListBuilder& list, ObjectId node, ObjectId parent, std::uint32_t index) {
    ModelObject& object = objects_.at(node);
    if (object.parent) std::erase(objects_.at(object.parent).children, node);
    object.parent = parent;
    if (parent) {
        auto& children = objects_.at(parent).children;
        children.insert(index == Placement::kLast ? children.end() : children.begin() + index, node);
    }
    list.place(node, parent, index);
}

void SceneModel::moveSomething(ChangeListBuilder& list, Random& random) {
    const ObjectId node = anyOf(nodes(), random);
    if (node == kRootNode) return;
    const ObjectId parent = oneIn(random, 6) ? ObjectId() : anyOf(nodes(), random);
    if (parent && isBelow(parent, node)) return;
    std::uint32_t index = Placement::kLast;
    if (parent && !oneIn(random, 3)) {
        const std::size_t room = objects_.at(parent).children.size() + (objects_.at(node).parent == parent ? 0 : 1);
        index = static_cast<std::uint32_t>(below(random, room));
    }
    place(list, node, parent, index);
}

void SceneModel::isolate(ChangeListBuilder& list, const std::set<ObjectId>& doomed, Random& random) {
    for (const ObjectId id : doomed) {
        if (objects_.at(id).type != typeOf<Node>()) continue;
        const std::vector<ObjectId> children = objects_.at(id).children;
        for (const ObjectId child : children)
            place(list, child, oneIn(random, 2) ? ObjectId() : kRootNode, Placement::kLast);
        if (objects_.at(id).parent) place(list, id, ObjectId(), Placement::kLast);
    }
    // A doomed child that went under the root above.
    for (const ObjectId id : doomed)
        if (objects_.at(id).parent) place(list, id, ObjectId(), Placement::kLast);
}

void SceneModel::setSomething(ChangeListBuilder& list, Random& random, const std::set<ObjectId>& doomed) {
    auto it = objects_.begin();
    std::advance(it, static_cast<std::ptrdiff_t>(below(random, objects_.size())));
    const TypeInfo& type = *findType(it->second.type);
    if (type.fields.empty()) return;
    const FieldInfo& field = type.fields[below(random, type.fields.size())];
    if (type.type == typeOf<Node>() && field.id == fieldId<&Node::ofServer>)
        return;  // files and copies leave such a node out
    // What goes itself may take hold of what goes with it.
    const FieldValue value = someValue(field, random, doomed.contains(it->first) ? std::set<ObjectId>() : doomed);
    it->second.fields[field.id] = value;
    list.set(it->first, type.type, field.id, value);
}

void SceneModel::releaseRefs(ChangeListBuilder& list, const std::set<ObjectId>& doomed, Random& random) {
    for (auto& [id, object] : objects_) {
        if (doomed.contains(id)) continue;
        for (const FieldInfo& field : findType(object.type)->fields) {
            const FieldValue& held = object.fields[field.id];
            const auto goes = [&](ObjectId target) { return doomed.contains(target); };
            if (!(field.kind == FieldKind::kRef && goes(std::get<ObjectId>(held))) &&
                !(field.kind == FieldKind::kRefs && std::ranges::any_of(std::get<RefList>(held), goes)))
                continue;
            object.fields[field.id] = someValue(field, random, doomed);
            list.set(id, object.type, field.id, object.fields[field.id]);
        }
    }
}

ChangeList SceneModel::nextList(Random& random) {
    ChangeListBuilder list;
    for (std::size_t n = below(random, 8); n > 0; --n)
        create(list, oneIn(random, 2) ? typeOf<Node>() : allTypes()[below(random, allTypes().size())].type, random);
    std::set<ObjectId> doomed;
    for (std::size_t n = below(random, 4); n > 0; --n) {
        auto it = objects_.begin();
        std::advance(it, static_cast<std::ptrdiff_t>(below(random, objects_.size())));
        if (it->first != kRootNode) doomed.insert(it->first);
    }
    for (std::size_t n = below(random, 10); n > 0; --n) moveSomething(list, random);
    isolate(list, doomed, random);
    for (std::size_t n = below(random, 20); n > 0; --n) setSomething(list, random, doomed);
    releaseRefs(list, doomed, random);
    std::vector<ObjectId> order(doomed.begin(), doomed.end());
    std::shuffle(order.begin(), order.end(), random);
    for (const ObjectId id : order) {
        list.destroy(id);
        objects_.erase(id);
    }
    ChangeList made = list.take();
    setRanges(made, random);
    return made;
}

void SceneModel::setRanges(ChangeList& list, Random& random) {
    for (std::size_t tries = below(random, 30); tries > 0; --tries) {
        auto it = objects_.begin();
        std::advance(it, static_cast<std::ptrdiff_t>(below(random, objects_.size())));
        const TypeInfo& type = *findType(it->second.type);
        if (type.fields.empty()) continue;
        const FieldInfo& field = type.fields[below(random, type.fields.size())];
        if (field.kind != FieldKind::kBlob) continue;
        Blob& array = std::get<Blob>(it->second.fields[field.id]);
        if (array.empty()) continue;
        const std::size_t offset = below(random, array.sizeBytes());
        Bytes bytes(1 + below(random, array.sizeBytes() - offset));
        for (std::byte& byte : bytes) byte = static_cast<std::byte>(below(random, 256));
        const Blob after = *array.withRange(offset, bytes);
        // As a committer would name it, which is all that travels.
        list.ranges.push_back({it->first, type.type, field.id, offset, Blob(std::move(bytes)),
                               Blob::absent(after.id(), after.sizeBytes())});
        array = keepBlob(after);
    }
}

void SceneModel::expectEqual(const Aspect& aspect) const {
    ASSERT_EQ(aspect.objectCount(), objects_.size());
    EXPECT_EQ(aspect.nextFreeId(), nextId_);
    std::map<ObjectId, std::size_t> uses;
    std::vector<ObjectId> ids;
    for (const auto& [id, expected] : objects_) {
        ids.push_back(id);
        const Object object = aspect.find(id);
        ASSERT_TRUE(object) << id.value;
        ASSERT_EQ(typeOf(object), expected.type) << id.value;
        for (const FieldEntry& field : findType(expected.type)->fields) {
            const FieldValue& value = expected.fields.at(field.id);
            EXPECT_EQ(field.load(object), value) << id.value << " " << field.name;
            if (field.kind == FieldKind::kRef) ++uses[std::get<ObjectId>(value)];
            if (field.kind == FieldKind::kRefs)
                for (const ObjectId target : std::get<RefList>(value)) ++uses[target];
        }
        if (const Node* node = object.as<Node>()) {
            EXPECT_EQ(node->parent, expected.parent) << id.value;
            EXPECT_EQ(node->children, expected.children) << id.value;
        }
    }
    EXPECT_EQ(aspect.ids(), ids);
    for (const ObjectId id : ids) EXPECT_EQ(aspect.useCount(id), uses[id]) << id.value;
}

}  // namespace tessera
