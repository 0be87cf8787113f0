/// The shapes that a scene file may write instead of meshes.
#pragma once

#include <string>

#include "common/base/Error.h"
#include "common/geometry/Mesh.h"
#include "proto/scene.pb.h"

namespace tessera {

[[nodiscard]] bool isShape(proto::scene::Node::ContentCase content);

/// The mesh of a node's shape. Errors name the measure that is not above zero, or the count that is out of range.
[[nodiscard]] Expected<MeshData> makeShape(const proto::scene::Node& node);

/// Equal for equal shapes, whatever else the nodes hold.
[[nodiscard]] std::string shapeKey(const proto::scene::Node& node);

}  // namespace tessera
