#include "server/sim/display/ContactDisplay.h"

#include <algorithm>
#include <bit>
#include <unordered_map>
#include <unordered_set>

#include "common/cores/CollisionObject.h"
#include "common/cores/Geometry.h"
#include "common/cores/Interest.h"
#include "common/cores/Material.h"
#include "common/cores/Transform.h"
#include "common/scene/FieldTable.h"
#include "common/scene/ServerNodes.h"

namespace tessera {
namespace {

constexpr std::array<const char*, kMarkKinds> kGroupNames{"points", "normals", "faces", "lines", "ticks"};
constexpr std::size_t kFewest = 16;

/// Told apart at a glance and unlike most of what stands in scenes: yellow, lime, magenta, cyan, red.
const std::array<Vec3f, kMarkKinds> kColors{Vec3f(1.0f, 0.75f, 0.0f), Vec3f(0.25f, 1.0f, 0.0f),
                                            Vec3f(1.0f, 0.05f, 0.45f), Vec3f(0.0f, 0.85f, 1.0f),
                                            Vec3f(1.0f, 0.1f, 0.0f)};

template <typename Core>
ObjectId createIn(ChangeListBuilder& list, ObjectId id) {
    list.create(id, typeOf<Core>());
    return id;
}

/// Only what differs from what is there.
void setPose(ChangeListBuilder& list, ObjectId id, const Transform* now, const Mark& to) {
    const ObjectType type = typeOf<Transform>();
    const Transform fresh;
    const Transform& from = now ? *now : fresh;
    if (to.translation != from.translation)
        list.set(id, type, fieldId<&Transform::translation>, toValue(to.translation));
    if (to.rotation.coeffs() != from.rotation.coeffs())
        list.set(id, type, fieldId<&Transform::rotation>, toValue(to.rotation));
    if (to.scale != from.scale) list.set(id, type, fieldId<&Transform::scale>, toValue(to.scale));
}

}  // namespace

template <typename F>
void ContactDisplay::State::forEachId(F&& f) {
    f(node);
    f(object);
    for (Kind& kind : kinds) {
        f(kind.group);
        f(kind.geometry);
        f(kind.material);
        for (Slot& slot : kind.slots)
            for (ObjectId* id : {&slot.node, &slot.transform, &slot.inner, &slot.innerTransform, &slot.leaf}) f(*id);
    }
}

void ContactDisplay::sceneChanged(const Aspect& scene, const ChangeList* list) {
    if (!list) {
        asked_.clear();
        for (const ObjectId id : scene.ids()) look(scene, id);
        return;
    }
    // Fresh interests show nothing until a column says so.
    for (const FieldColumn& column : list->columns)
        if (column.type == typeOf<Interest>() &&
            (column.field == fieldId<&Interest::show> || column.field == fieldId<&Interest::enabled>))
            for (const ObjectId id : column.ids) look(scene, id);
    if (!asked_.empty())
        for (const ObjectId id : list->destructions) asked_.erase(id);
}

void ContactDisplay::look(const Aspect& scene, ObjectId id) {
    const Interest* interest = scene.get<Interest>(id);
    if (interest && interest->enabled && interest->show != 0)
        asked_[id] = interest->show;
    else
        asked_.erase(id);
}

ChangeListPtr ContactDisplay::commit(Committer& committer, const StepResult& step) {
    if (asked_.empty() && !state_.node) {
        counts_ = {};
        return nullptr;
    }
    const State before = state_;
    const Counts countsBefore = counts_;
    ChangeList list = update(committer.scene(), step);
    if (list.empty()) return nullptr;
    const Expected<Committer::Applied> applied = committer.apply(std::move(list));
    if (!applied) {
        state_ = before;
        counts_ = countsBefore;
        return nullptr;
    }
    if (!applied->ids.empty()) {
        const std::unordered_map<ObjectId, ObjectId> given(applied->ids.begin(), applied->ids.end());
        state_.forEachId([&](ObjectId& id) {
            if (const auto it = given.find(id); it != given.end()) id = it->second;
        });
    }
    if (!applied->ids.empty() || before.node != state_.node) ++version_;
    return applied->list;
}

ChangeList ContactDisplay::update(const Aspect& scene, const StepResult& step) {
    placeholders_ = 0;
    counts_ = {};
    ChangeListBuilder list;
    std::vector<InterestShow> shows;
    for (const auto& [interest, show] : asked_) shows.push_back({interest, show});
    if (state_.node && (shows.empty() || !intact(scene))) {
        dismantle(list, scene);
        return list.take();  // anew in the next frame, where that is wanted
    }
    if (shows.empty()) return {};

    const Marks marks = maker_.make(scene, step, shows, state_.node);
    counts_.leftOut = marks.leftOut;
    if (!state_.node) {
        if (std::ranges::all_of(marks.of, [](const std::vector<Mark>& of) { return of.empty(); })) return {};
        build(list);
    } else if (const auto& children = scene.root().children; children[children.size() - 1] != state_.node) {
        list.place(state_.node, kRootNode);
    }
    for (const MarkKind kind :
         {MarkKind::kPoint, MarkKind::kNormal, MarkKind::kFace, MarkKind::kLine, MarkKind::kTick}) {
        const auto index = static_cast<std::size_t>(kind);
        const std::vector<Mark>& wanted = marks.of[index];
        counts_.drawn[index] = wanted.size();
        if (wanted.size() > state_.kinds[index].slots.size())
            growTo(list, kind, std::min(kMaxMarks[index], std::max(kFewest, std::bit_ceil(wanted.size()))));
        place(list, scene, kind, wanted);
    }
    return list.take();
}

void ContactDisplay::build(ChangeListBuilder& list) {
    state_.node = createIn<Node>(list, fresh());
    state_.object = createIn<CollisionObject>(list, fresh());
    list.set(state_.node, typeOf<Node>(), fieldId<&Node::name>, std::string(kContactsName));
    list.set(state_.node, typeOf<Node>(), fieldId<&Node::core>, state_.object);
    list.set(state_.node, typeOf<Node>(), fieldId<&Node::ofServer>, true);
    list.set(state_.object, typeOf<CollisionObject>(), fieldId<&CollisionObject::node>, state_.node);
    list.set(state_.object, typeOf<CollisionObject>(), fieldId<&CollisionObject::layers>, std::int64_t{0});
    list.place(state_.node, kRootNode);
    for (std::size_t i = 0; i < kMarkKinds; ++i) {
        Kind& kind = state_.kinds[i];
        kind.material = createIn<Material>(list, fresh());
        const Vec3f& color = kColors[i];
        list.set(kind.material, typeOf<Material>(), fieldId<&Material::baseColor>,
                 toValue(Vec4f(0.3f * color.x(), 0.3f * color.y(), 0.3f * color.z(), 1.0f)));
        list.set(kind.material, typeOf<Material>(), fieldId<&Material::emissive>, toValue(Vec3f(0.8f * color)));
        list.set(kind.material, typeOf<Material>(), fieldId<&Material::doubleSided>, true);
        kind.geometry = createIn<Geometry>(list, fresh());
        const MeshArrays& shape = markShapes()[i];
        const ObjectType type = typeOf<Geometry>();
        list.set(kind.geometry, type, fieldId<&Geometry::positions>, shape.positions);
        if (!shape.normals.empty()) list.set(kind.geometry, type, fieldId<&Geometry::normals>, shape.normals);
        list.set(kind.geometry, type, fieldId<&Geometry::indices>, shape.indices);
        list.set(kind.geometry, type, fieldId<&Geometry::material>, kind.material);
        kind.group = createIn<Node>(list, fresh());
        list.set(kind.group, typeOf<Node>(), fieldId<&Node::name>, std::string(kGroupNames[i]));
        list.place(kind.group, state_.node);
    }
}

void ContactDisplay::growTo(ChangeListBuilder& list, MarkKind kind, std::size_t count) {
    Kind& marks = state_.kinds[static_cast<std::size_t>(kind)];
    const auto below = [&](ObjectId parent, const char* name, ObjectId core) {
        const ObjectId node = createIn<Node>(list, fresh());
        list.set(node, typeOf<Node>(), fieldId<&Node::name>, std::string(name));
        list.set(node, typeOf<Node>(), fieldId<&Node::core>, core);
        list.place(node, parent);
        return node;
    };
    while (marks.slots.size() < count) {
        Slot slot;
        slot.transform = createIn<Transform>(list, fresh());
        slot.node = below(marks.group, "mark", slot.transform);
        ObjectId parent = slot.node;
        if (kind == MarkKind::kFace) {
            slot.innerTransform = createIn<Transform>(list, fresh());
            parent = slot.inner = below(slot.node, "turn", slot.innerTransform);
        }
        slot.leaf = below(parent, "shape", marks.geometry);
        marks.slots.push_back(slot);
    }
}

void ContactDisplay::place(ChangeListBuilder& list, const Aspect& scene, MarkKind kind,
                           std::span<const Mark> marks) const {
    const std::vector<Slot>& slots = state_.kinds[static_cast<std::size_t>(kind)].slots;
    for (std::size_t i = 0; i < slots.size(); ++i) {
        const Transform* now = scene.get<Transform>(slots[i].transform);
        if (i < marks.size()) {
            setPose(list, slots[i].transform, now, marks[i]);
            if (slots[i].innerTransform)
                setPose(list, slots[i].innerTransform, scene.get<Transform>(slots[i].innerTransform),
                        {.rotation = marks[i].turn});
        } else {
            // Where it was, or among the others: never alone at the origin, far from everything.
            Mark away{.translation = Vec3d::Zero(), .rotation = Quatd::Identity(), .scale = Vec3d::Zero()};
            if (now) {
                away.translation = now->translation;
                away.rotation = now->rotation;
            } else if (!marks.empty()) {
                away.translation = marks.front().translation;
            }
            setPose(list, slots[i].transform, now, away);
        }
    }
}

std::vector<ObjectId> ContactDisplay::ids() const {
    std::vector<ObjectId> all;
    if (!state_.node) return all;
    State state = state_;
    for (const Kind& kind : state.kinds) all.emplace_back(kind.slots.size());
    state.forEachId([&](ObjectId id) { all.push_back(id); });
    return all;
}

void ContactDisplay::goOnWith(std::span<const ObjectId> ids) {
    state_ = State();
    if (ids.size() < kMarkKinds) return;
    std::size_t slots = 0;
    for (std::size_t i = 0; i < kMarkKinds; ++i) {
        if (ids[i].value > kMaxMarks[i]) return;
        slots += ids[i].value;
        state_.kinds[i].slots.resize(ids[i].value);
    }
    constexpr std::size_t kOfAll = 2, kOfKind = 3, kOfSlot = 5;
    if (ids.size() != kMarkKinds + kOfAll + kOfKind * kMarkKinds + kOfSlot * slots) {
        state_ = State();
        return;
    }
    auto next = ids.begin() + kMarkKinds;
    state_.forEachId([&](ObjectId& id) { id = *next++; });
}

bool ContactDisplay::intact(const Aspect& scene) const {
    const auto isNode = [&](ObjectId id, ObjectId core, ObjectId parent, std::size_t children) {
        const Node* node = scene.get<Node>(id);
        return node && node->core == core && node->parent == parent && node->children.size() == children;
    };
    const CollisionObject* object = scene.get<CollisionObject>(state_.object);
    if (!object || object->node != state_.node || object->layers != 0 ||
        !isNode(state_.node, state_.object, kRootNode, kMarkKinds))
        return false;
    return std::ranges::all_of(state_.kinds, [&](const Kind& kind) {
        const Geometry* geometry = scene.get<Geometry>(kind.geometry);
        return geometry && geometry->material == kind.material &&
               isNode(kind.group, {}, state_.node, kind.slots.size()) &&
               std::ranges::all_of(kind.slots, [&](const Slot& slot) {
                   return isNode(slot.node, slot.transform, kind.group, 1) &&
                          (!slot.inner || isNode(slot.inner, slot.innerTransform, slot.node, 1)) &&
                          isNode(slot.leaf, kind.geometry, slot.inner ? slot.inner : slot.node, 0);
               });
    });
}

void ContactDisplay::dismantle(ChangeListBuilder& list, const Aspect& scene) {
    State old = std::exchange(state_, State());
    std::vector<ObjectId> own;
    old.forEachId([&](ObjectId id) {
        if (id && scene.find(id)) own.push_back(id);
    });
    // Everything goes but what somebody else holds: a ref that is not ours, a child that is not ours. What then stays
    // holds others in its turn, so it takes as many rounds as it takes.
    std::unordered_set<ObjectId> going(own.begin(), own.end());
    for (bool more = true; more;) {
        std::unordered_map<ObjectId, std::size_t> held;  // refs by those that go
        for (const ObjectId id : going) {
            forEachRef(scene.find(id), [&](ObjectId target) { ++held[target]; });
        }
        const std::size_t before = going.size();
        for (const ObjectId id : own) {
            if (!going.contains(id)) continue;
            const Node* node = scene.get<Node>(id);
            const auto use = held.find(id);
            const bool usedByOthers = scene.useCount(id) > (use == held.end() ? 0 : use->second);
            const bool bearsOthers =
                node && !std::ranges::all_of(node->children, [&](ObjectId child) { return going.contains(child); });
            if (usedByOthers || bearsOthers) going.erase(id);
        }
        more = going.size() != before;
    }
    for (const ObjectId id : own) {
        if (!going.contains(id)) continue;
        const Node* node = scene.get<Node>(id);
        if (node && node->parent) list.detach(id);
        list.destroy(id);
    }
}

std::vector<Blob> ContactDisplay::blobs() {
    std::vector<Blob> all;
    for (const MeshArrays& shape : markShapes())
        for (const Blob& blob : {shape.positions, shape.normals, shape.indices})
            if (!blob.empty() && std::ranges::find(all, blob) == all.end()) all.push_back(blob);
    return all;
}

}  // namespace tessera
