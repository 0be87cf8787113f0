/// All types of objects that a scene can hold: this list, and a header for each. A new one: README.md, "A new core".
#pragma once

#include "common/scene/cores/Camera.h"
#include "common/scene/cores/CollisionObject.h"
#include "common/scene/cores/ComponentTransform.h"
#include "common/scene/cores/DirectionalLight.h"
#include "common/scene/cores/Environment.h"
#include "common/scene/cores/Geometry.h"
#include "common/scene/cores/Group.h"
#include "common/scene/cores/Image.h"
#include "common/scene/cores/Interest.h"
#include "common/scene/cores/InverseTransform.h"
#include "common/scene/cores/Material.h"
#include "common/scene/cores/Motion.h"
#include "common/scene/cores/Node.h"
#include "common/scene/cores/PointLight.h"
#include "common/scene/cores/SpotLight.h"
#include "common/scene/cores/Switch.h"
#include "common/scene/cores/Transform.h"

// A build of its own may hold more types: the tests' does, to try kinds of fields that no shipped type has yet.
#ifdef TESSERA_EXTRA_TYPES
#include TESSERA_EXTRA_TYPES
#else
namespace tessera {
using ExtraTypes = TypeList<>;
}
#endif

namespace tessera {

/// In the order of their numbers; Node first.
using ShippedTypes = TypeList<Node, Group, Transform, Geometry, Material, Image, Switch, DirectionalLight, PointLight, Camera,
                              Motion, Environment, Interest, CollisionObject, SpotLight, ComponentTransform,
                              InverseTransform>;
using SceneTypes = JoinedTypes<ShippedTypes, ExtraTypes>;

}  // namespace tessera
