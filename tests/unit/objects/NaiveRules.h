/// The rules of Cores.h (CollisionObject, Interest) read off one question at a time: no tables, no groups, no ranges.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <vector>

#include "common/cores/CollisionObject.h"
#include "common/cores/Geometry.h"
#include "common/cores/Interest.h"
#include "common/cores/Switch.h"
#include "common/scene/Aspect.h"

namespace tessera {

/// Made for one state of a scene. Slow.
class NaiveRules {
public:
    NaiveRules(const Aspect& aspect, std::size_t maxInterests) : aspect_(aspect) {
        walk(kRootNode);
        std::vector<ObjectId> enabled;
        for (const ObjectId id : visible_) {
            const ObjectId coreId = aspect.get<Node>(id)->core;
            const Interest* interest = coreId ? aspect.get<Interest>(coreId) : nullptr;
            if (!interest || interest->enabled == 0) continue;
            if (std::find(enabled.begin(), enabled.end(), coreId) != enabled.end()) continue;
            enabled.push_back(coreId);
            if (interests_.size() == maxInterests)
                ++leftOut;
            else
                interests_.push_back(coreId);
        }
    }

    struct BodyName {
        ObjectId node, core;
        auto operator<=>(const BodyName&) const = default;
    };
    struct Answer {
        bool relevant = false, firstIsObject = true, contacts = false, dynamic = false, distance = false;
        std::int64_t response = Interest::kReport;
        double threshold = 0;
        std::vector<ObjectId> interests;
    };

    [[nodiscard]] const std::vector<ObjectId>& visible() const { return visible_; }
    [[nodiscard]] const std::vector<ObjectId>& interests() const { return interests_; }
    std::size_t leftOut = 0;

    [[nodiscard]] BodyName bodyOf(ObjectId geometryNode) const {
        const ObjectId named = ownerNode(geometryNode);
        if (named) {
            const ObjectId core = objectAt(named);
            return {itemNode(geometryNode, named, *aspect_.get<CollisionObject>(core)), core};
        }
        for (ObjectId at = geometryNode; at; at = aspect_.get<Node>(at)->parent)
            if (isMadeAnObject(at)) return {at, {}};
        return {geometryNode, {}};
    }
    [[nodiscard]] bool takesPart(ObjectId node) const {
        if (!isGeometry(node) || layersOf(node) == 0) return false;
        return std::any_of(interests_.begin(), interests_.end(), [&](ObjectId id) {
            const Interest& interest = *aspect_.get<Interest>(id);
            return interest.mode != Interest::kIgnore && awake(interest) &&
                   (onObjectSide(interest, node) || onOtherSide(interest, node));
        });
    }
    /// Of two nodes that take part, the first before the second in document order.
    [[nodiscard]] Answer relation(ObjectId a, ObjectId b) const {
        Answer answer;
        if (bodyOf(a) == bodyOf(b)) return answer;
        for (const ObjectId id : interests_) {
            const Interest& interest = *aspect_.get<Interest>(id);
            if (!awake(interest)) continue;
            const bool forth = onObjectSide(interest, a) && onOtherSide(interest, b);
            const bool back = onObjectSide(interest, b) && onOtherSide(interest, a);
            if (!forth && !back) continue;
            if (interest.mode == Interest::kIgnore) return {};
            if (answer.interests.empty()) {
                answer.relevant = true;
                answer.firstIsObject = forth;
                answer.response = interest.response;
            }
            answer.interests.push_back(id);
            if (interest.mode == Interest::kDistance) {
                answer.distance = true;
                answer.threshold = std::max(answer.threshold, interest.threshold);
            } else {
                answer.contacts = true;
                if (interest.mode == Interest::kDynamic) answer.dynamic = true;
            }
        }
        return answer.relevant ? answer : Answer{};
    }
    [[nodiscard]] std::int64_t layersOf(ObjectId geometryNode) const {
        const ObjectId named = ownerNode(geometryNode);
        return named ? aspect_.get<CollisionObject>(objectAt(named))->layers : 1;
    }
    [[nodiscard]] bool isVisible(ObjectId node) const {
        return std::find(visible_.begin(), visible_.end(), node) != visible_.end();
    }
    [[nodiscard]] bool isGeometry(ObjectId node) const {
        return aspect_.coreOf<Geometry>(*aspect_.get<Node>(node)) != nullptr;
    }
    [[nodiscard]] bool atOrBelow(ObjectId node, ObjectId top) const {
        for (ObjectId at = node; at; at = aspect_.get<Node>(at)->parent)
            if (at == top) return true;
        return false;
    }

private:
    void walk(ObjectId id) {
        visible_.push_back(id);
        const Node& node = *aspect_.get<Node>(id);
        const Switch* choice = aspect_.coreOf<Switch>(node);
        for (std::size_t i = 0; i < node.children.size(); ++i)
            if (!choice || choice->choice == Switch::kAll || choice->choice == static_cast<std::int64_t>(i) ||
                (choice->choice == Switch::kMask && i < 63 && (choice->mask >> i) % 2 == 1))
                walk(node.children[i]);
    }
    /// The CollisionObject that names a node, if any: the lowest id of those that some visible node bears.
    [[nodiscard]] ObjectId objectAt(ObjectId named) const {
        const auto known = objectAt_.find(named);
        if (known != objectAt_.end()) return known->second;
        ObjectId lowest;
        for (const ObjectId id : visible_) {
            const ObjectId coreId = aspect_.get<Node>(id)->core;
            const CollisionObject* core = coreId ? aspect_.get<CollisionObject>(coreId) : nullptr;
            if (core && core->node == named && (!lowest || coreId < lowest)) lowest = coreId;
        }
        return objectAt_[named] = lowest;
    }
    /// The nearest named node at or above.
    [[nodiscard]] ObjectId ownerNode(ObjectId node) const {
        for (ObjectId at = node; at; at = aspect_.get<Node>(at)->parent)
            if (objectAt(at)) return at;
        return {};
    }
    [[nodiscard]] ObjectId itemNode(ObjectId node, ObjectId named, const CollisionObject& core) const {
        if (core.division == CollisionObject::kEachGeometry) return node;
        if (core.division == CollisionObject::kEachChild && node != named) {
            ObjectId at = node;
            while (aspect_.get<Node>(at)->parent != named) at = aspect_.get<Node>(at)->parent;
            return at;
        }
        return named;
    }
    /// Whether a node is the top of an object, or of an item of a divided one.
    [[nodiscard]] bool isTop(ObjectId node) const {
        if (const ObjectId core = objectAt(node)) return aspect_.get<CollisionObject>(core)->layers != 0;
        const ObjectId named = ownerNode(node);
        if (!named) return false;
        const CollisionObject& core = *aspect_.get<CollisionObject>(objectAt(named));
        if (core.layers == 0) return false;
        if (core.division == CollisionObject::kEachChild) return aspect_.get<Node>(node)->parent == named;
        return core.division == CollisionObject::kEachGeometry && isGeometry(node);
    }
    [[nodiscard]] bool anyObjectAtOrBelow(ObjectId top) const {
        return std::any_of(visible_.begin(), visible_.end(),
                           [&](ObjectId node) { return atOrBelow(node, top) && isTop(node); });
    }
    [[nodiscard]] ObjectId againstOf(const Interest& interest) const {
        if (interest.mode == Interest::kSelf) return interest.object;
        return interest.against ? interest.against : kRootNode;
    }
    [[nodiscard]] bool awake(const Interest& interest) const {
        return interest.object && isVisible(interest.object) && isVisible(againstOf(interest));
    }
    [[nodiscard]] bool isMadeAnObject(ObjectId node) const {
        return std::any_of(interests_.begin(), interests_.end(), [&](ObjectId id) {
            const Interest& interest = *aspect_.get<Interest>(id);
            return interest.object == node && interest.mode != Interest::kIgnore && awake(interest) &&
                   !anyObjectAtOrBelow(node);
        });
    }
    [[nodiscard]] bool onObjectSide(const Interest& interest, ObjectId node) const {
        if (!atOrBelow(node, interest.object)) return false;
        if (!anyObjectAtOrBelow(interest.object)) return true;
        const BodyName body = bodyOf(node);
        return body.core && atOrBelow(body.node, interest.object) &&
               (aspect_.get<CollisionObject>(body.core)->layers & interest.objectLayers) != 0;
    }
    [[nodiscard]] bool onOtherSide(const Interest& interest, ObjectId node) const {
        if (interest.mode == Interest::kSelf || !atOrBelow(node, againstOf(interest))) return false;
        // One object never meets itself.
        if (atOrBelow(node, interest.object) && !anyObjectAtOrBelow(interest.object)) return false;
        return (layersOf(node) & interest.againstLayers) != 0;
    }

    const Aspect& aspect_;
    std::vector<ObjectId> visible_;
    std::vector<ObjectId> interests_;
    mutable std::map<ObjectId, ObjectId> objectAt_;
};

}  // namespace tessera
