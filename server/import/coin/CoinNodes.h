/// Kinds and numbers of Coin's nodes.
#pragma once

#include <Inventor/SbVec3f.h>
#include <Inventor/nodes/SoNode.h>

#include "common/math/Types.h"
#include "server/import/reader/PlainScene.h"

namespace tessera {

template <typename Node>
[[nodiscard]] bool is(const SoNode& node) {
    return node.isOfType(Node::getClassTypeId());
}

/// Of a node that is one.
template <typename Node>
[[nodiscard]] const Node& as(const SoNode& node) {
    return static_cast<const Node&>(node);
}

[[nodiscard]] inline Vec3d vectorOf(const SbVec3f& v) {
    return {v[0], v[1], v[2]};
}

inline void setVector(proto::scene::Vector& to, const SbVec3f& from) {
    to.set_x(from[0]);
    to.set_y(from[1]);
    to.set_z(from[2]);
}

}  // namespace tessera
