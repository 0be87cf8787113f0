/// Kinds and numbers of Coin's nodes.
#pragma once

#include <Inventor/SbVec3f.h>
#include <Inventor/VRMLnodes/SoVRMLColor.h>
#include <Inventor/fields/SoSFNode.h>
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

/// What a field of this name holds; null: there is none.
[[nodiscard]] inline SoNode* nodeIn(const SoNode& node, const char* name) {
    const SoField* const field = node.getField(name);
    return field != nullptr && field->isOfType(SoSFNode::getClassTypeId())
               ? static_cast<const SoSFNode*>(field)->getValue()
               : nullptr;
}

/// Whether a geometry of VRML 2 has a Color: the material's does not count then, even if all of it are the same.
[[nodiscard]] inline bool hasColors(const SoNode& geometry) {
    const SoNode* const color = nodeIn(geometry, "color");
    return color != nullptr && is<SoVRMLColor>(*color) && as<SoVRMLColor>(*color).color.getNum() > 0;
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
