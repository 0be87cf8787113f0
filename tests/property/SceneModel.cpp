#include "tests/property/SceneModel.h"

#include <algorithm>
#include <cmath>

namespace tessera {

namespace {

struct Pool {
    BlobStore store;
    std::vector<Blob> blobs;
    Pool() {
        for (int i = 0; i < 6; ++i) {
            const std::vector<int> values(static_cast<std::size_t>(1 + i * i), i);
            blobs.push_back(store.add(Blob::of(std::span<const int>(values))));
        }
    }
};

const Pool& pool() {
    static const Pool thePool;
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

SceneModel::SceneModel() {
    ModelObject root{typeOf<Node>(), {}, {}, {}};
    for (const FieldInfo& field : findType("Node")->fields) root.fields[field.id] = field.load(Object(Node()));
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
                values.values[static_cast<std::size_t>(i)] = static_cast<float>(someNumber(random));
            return values;
        }
        case FieldKind::kDouble: {
            Doubles values;
            values.width = field.width;
            for (int i = 0; i < field.width; ++i) {
                const double number = someNumber(random);
                values.values[static_cast<std::size_t>(i)] =
                    number < field.least || number > field.greatest ? 1.0 : number;
            }
            if (field.quaternion) values.values[below(random, 4)] = 1;
            return values;
        }
        case FieldKind::kInt: {
            const double least = std::max(field.least, -1000.0), greatest = std::min(field.greatest, 1000.0);
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
    }
    return {};
}

void SceneModel::create(ChangeListBuilder& list, ObjectType type, Random& random) {
    if (oneIn(random, 20)) nextId_ += below(random, 3000);  // ids of objects that are long gone
    const ObjectId id(nextId_++);
    list.create(id, type);
    ModelObject object{type, {}, {}, {}};
    const TypeInfo& info = *findType(type);
    for (const FieldInfo& field : info.fields) object.fields[field.id] = field.load(info.make());
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
    // What goes itself may take hold of what goes with it.
    const FieldValue value = someValue(field, random, doomed.contains(it->first) ? std::set<ObjectId>() : doomed);
    it->second.fields[field.id] = value;
    list.set(it->first, type.type, field.id, value);
}

void SceneModel::releaseRefs(ChangeListBuilder& list, const std::set<ObjectId>& doomed, Random& random) {
    for (auto& [id, object] : objects_) {
        if (doomed.contains(id)) continue;
        for (const FieldInfo& field : findType(object.type)->fields) {
            if (field.kind != FieldKind::kRef || !doomed.contains(std::get<ObjectId>(object.fields[field.id])))
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
    return list.take();
}

void SceneModel::expectEqual(const Aspect& aspect) const {
    ASSERT_EQ(aspect.objectCount(), objects_.size());
    EXPECT_EQ(aspect.nextFreeId(), nextId_);
    std::map<ObjectId, std::size_t> uses;
    std::vector<ObjectId> ids;
    for (const auto& [id, expected] : objects_) {
        ids.push_back(id);
        const Object* object = aspect.find(id);
        ASSERT_NE(object, nullptr) << id.value;
        ASSERT_EQ(typeOf(*object), expected.type) << id.value;
        for (const FieldInfo& field : findType(expected.type)->fields) {
            const FieldValue& value = expected.fields.at(field.id);
            EXPECT_EQ(field.load(*object), value) << id.value << " " << field.name;
            if (field.kind == FieldKind::kRef) ++uses[std::get<ObjectId>(value)];
        }
        if (const Node* node = std::get_if<Node>(object)) {
            EXPECT_EQ(node->parent, expected.parent) << id.value;
            EXPECT_EQ(node->children, expected.children) << id.value;
        }
    }
    EXPECT_EQ(aspect.ids(), ids);
    for (const ObjectId id : ids) EXPECT_EQ(aspect.useCount(id), uses[id]) << id.value;
}

}  // namespace tessera
