/// What takes part in collisions as one.
#pragma once

#include <cstdint>
#include <vector>

#include "common/cores/CollisionWords.h"

namespace tessera {

/// A CollisionObject (or one item of a divided one), an interest's object, or one geometry.
struct Body {
    ObjectId node;  ///< its topmost node
    ObjectId core;  ///< its CollisionObject; none: what an interest or a geometry makes one
    std::uint32_t place = 0;
    std::int64_t kind = CollisionWords::kRigid;
    std::int64_t layers = 1;
    double mass = 0;  ///< above 0: a free body (all conditions of CollisionObject::mass hold)
    double restitution = 0.2;
    double friction = 0.5;
    double tolerance = 0;  ///< of motions; 0: not said
    Vec3d velocity = Vec3d::Zero(), spin = Vec3d::Zero();
    /// Of a free body: the Transform core that carries it. What is above it is rigid but for one uniform scale.
    ObjectId transform;
    /// Of a body that may be free in document order, else in any.
    std::vector<std::uint32_t> parts;

    [[nodiscard]] bool free() const { return mass > 0; }
};

}  // namespace tessera
