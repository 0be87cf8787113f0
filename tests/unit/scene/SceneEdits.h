/// Short ways to write change lists in tests.
#pragma once

#include <gtest/gtest.h>

#include <functional>

#include "common/cores/Geometry.h"
#include "common/cores/Material.h"
#include "common/cores/Transform.h"
#include "common/scene/Aspect.h"
#include "common/scene/FieldTable.h"

namespace tessera {

/// A builder that knows the cores' types.
class Edits : public ChangeListBuilder {
public:
    Edits& node(std::uint64_t id, std::string name, std::uint64_t parent = kRootNode.value) {
        create(ObjectId(id), typeOf<Node>());
        set(ObjectId(id), typeOf<Node>(), fieldId<&Node::name>, toValue(std::move(name)));
        if (parent != 0) place(ObjectId(id), ObjectId(parent));
        return *this;
    }
    template <typename Core>
    Edits& core(std::uint64_t id, std::uint64_t nodeId = 0) {
        create(ObjectId(id), typeOf<Core>());
        if (nodeId != 0) set(ObjectId(nodeId), typeOf<Node>(), fieldId<&Node::core>, ObjectId(id));
        return *this;
    }
    template <typename Core>
    Edits& value(std::uint64_t id, FieldId field, const FieldValue& v) {
        set(ObjectId(id), typeOf<Core>(), field, v);
        return *this;
    }
    Edits& coreOfNode(std::uint64_t nodeId, std::uint64_t core) {
        return value<Node>(nodeId, fieldId<&Node::core>, ObjectId(core));
    }
    Edits& under(std::uint64_t nodeId, std::uint64_t parent, std::uint32_t index = Placement::kLast) {
        place(ObjectId(nodeId), ObjectId(parent), index);
        return *this;
    }
    Edits& gone(std::uint64_t id) {
        destroy(ObjectId(id));
        return *this;
    }
};

inline void mustApply(Aspect& aspect, const ChangeList& list) {
    const Expected<void> done = aspect.apply(list);
    ASSERT_TRUE(done) << done.error().message;
}

/// root ─ hall(2) ─ crane(3), hook(4); crane has the Transform 5, hook the Geometry 6 with the Material 7.
inline Aspect hall(SceneLimits limits = {}) {
    Aspect aspect(limits);
    Edits e;
    e.node(2, "hall").node(3, "crane", 2).node(4, "hook", 2);
    e.core<Transform>(5, 3).core<Geometry>(6, 4).core<Material>(7);
    e.value<Transform>(5, fieldId<&Transform::translation>, toValue(Vec3d(1, 2, 3)));
    e.value<Geometry>(6, fieldId<&Geometry::material>, ObjectId(7));
    mustApply(aspect, e.take());
    return aspect;
}

}  // namespace tessera
