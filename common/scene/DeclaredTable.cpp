#include "common/scene/DeclaredTable.h"

#include <span>

#include "common/scene/Edits.h"

namespace tessera {

std::set<ObjectId> DeclaredData::follow(const Aspect& aspect, const ChangeList& list) {
    std::set<ObjectId> stale;
    const auto fieldsOf = [&](ObjectType type, FieldId field, ObjectId id) {
        if (type == typeOf<Node>() && field == fieldId<&Node::core>) {
            const Node* node = aspect.get<Node>(id);
            if (bearers_.contains(id) || (node && aspect.coreOf<ApplicationData>(*node))) stale.insert(id);
        } else if (type == typeOf<ApplicationData>()) {
            if (const auto known = bearersOf_.find(id); known != bearersOf_.end())
                stale.insert(known->second.begin(), known->second.end());
        }
    };
    for (const FieldColumn& column : list.columns)
        if (column.type == typeOf<Node>() || column.type == typeOf<ApplicationData>())
            for (const ObjectId id : column.ids) fieldsOf(column.type, column.field, id);
    for (const RangeEdit& range : list.ranges) fieldsOf(range.type, range.field, range.object);
    for (const Placement& placement : list.placements)
        if (bearers_.contains(placement.node)) stale.insert(placement.node);
    if (!bearers_.empty())
        for (const ObjectId id : list.destructions) {
            if (bearers_.contains(id)) stale.insert(id);
            if (const auto known = bearersOf_.find(id); known != bearersOf_.end())
                stale.insert(known->second.begin(), known->second.end());
        }
    std::set<ObjectId> touched;
    for (const ObjectId id : stale) look(aspect, id, touched);
    return touched;
}

std::set<ObjectId> DeclaredData::lookAnew(const Aspect& aspect) {
    std::set<ObjectId> touched, stale;
    for (const auto& [id, place] : bearers_) stale.insert(id);
    for (const ObjectId id : aspect.ids())
        if (const Node* node = aspect.get<Node>(id); node && aspect.coreOf<ApplicationData>(*node)) stale.insert(id);
    for (const ObjectId id : stale) look(aspect, id, touched);
    return touched;
}

void DeclaredData::look(const Aspect& aspect, ObjectId bearer, std::set<ObjectId>& touched) {
    if (const auto known = bearers_.find(bearer); known != bearers_.end()) {
        const Place before = known->second;
        bearers_.erase(known);
        if (const auto of = bearersOf_.find(before.core);
            of != bearersOf_.end() && of->second.erase(bearer) > 0 && of->second.empty())
            bearersOf_.erase(of);
        if (before.node) {
            touched.insert(before.node);
            if (const auto of = ofNode_.find(before.node);
                of != ofNode_.end() && of->second.erase(bearer) > 0 && of->second.empty())
                ofNode_.erase(of);
        }
    }
    const Node* node = aspect.get<Node>(bearer);
    const auto* core = node ? aspect.coreOf<ApplicationData>(*node) : nullptr;
    if (!core) return;
    const Place now{.core = node->core, .node = core->key == key_ ? node->parent : ObjectId()};
    bearers_[bearer] = now;
    bearersOf_[now.core].insert(bearer);
    if (!now.node) return;
    ofNode_[now.node].insert(bearer);
    touched.insert(now.node);
}

ObjectId DeclaredData::bearerOf(ObjectId node) const {
    const auto known = ofNode_.find(node);
    return known == ofNode_.end() ? ObjectId() : *known->second.begin();
}

ChangeList DeclaredData::write(const Aspect& aspect, ObjectId node, Blob data) const {
    ChangeListBuilder edits;
    if (const ObjectId bearer = bearerOf(node)) {
        const ObjectId core = aspect.get<Node>(bearer)->core;
        if (!(aspect.get<ApplicationData>(core)->data == data))
            edits.set(core, typeOf<ApplicationData>(), fieldId<&ApplicationData::data>, FieldValue(std::move(data)));
        return edits.take();
    }
    if (!aspect.get<Node>(node)) return {};
    const ObjectId bearer{kFirstPlaceholder}, core{kFirstPlaceholder + 1};
    edits.create(bearer, typeOf<Node>());
    edits.create(core, typeOf<ApplicationData>());
    edits.set(bearer, typeOf<Node>(), fieldId<&Node::core>, core);
    edits.set(core, typeOf<ApplicationData>(), fieldId<&ApplicationData::key>, toValue(key_));
    edits.set(core, typeOf<ApplicationData>(), fieldId<&ApplicationData::data>, FieldValue(std::move(data)));
    edits.place(bearer, node);
    return edits.take();
}

ChangeList DeclaredData::erase(const Aspect& aspect, ObjectId node) const {
    const ObjectId bearer = bearerOf(node);
    if (!bearer) return {};
    return removalOf(aspect, std::span(&bearer, 1));
}

}  // namespace tessera
