/// All types of objects that a scene can hold: this list, and a header for each. A new one: README.md, "A new core".
#pragma once

#include "common/cores/Animation.h"
#include "common/cores/ApplicationData.h"
#include "common/cores/Billboard.h"
#include "common/cores/Camera.h"
#include "common/cores/CollisionObject.h"
#include "common/cores/ComponentTransform.h"
#include "common/cores/Deformation.h"
#include "common/cores/DirectionalLight.h"
#include "common/cores/DistanceLOD.h"
#include "common/cores/Environment.h"
#include "common/cores/Geometry.h"
#include "common/cores/Group.h"
#include "common/cores/Image.h"
#include "common/cores/Inline.h"
#include "common/cores/Interest.h"
#include "common/cores/InverseTransform.h"
#include "common/cores/Manipulator.h"
#include "common/cores/Material.h"
#include "common/cores/MaterialGroup.h"
#include "common/cores/Motion.h"
#include "common/cores/Movie.h"
#include "common/cores/Node.h"
#include "common/cores/NurbsSurface.h"
#include "common/cores/Particles.h"
#include "common/cores/PointLight.h"
#include "common/cores/ProxyGroup.h"
#include "common/cores/Skin.h"
#include "common/cores/SpotLight.h"
#include "common/cores/SubdivisionSurface.h"
#include "common/cores/SurfaceParts.h"
#include "common/cores/Switch.h"
#include "common/cores/Text.h"
#include "common/cores/Transform.h"
#include "common/cores/Volume.h"

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
                              InverseTransform, SubdivisionSurface, NurbsSurfaceCore, Deformation, MaterialGroup,
                              DistanceLOD, Billboard, KeyFrames, Animation, Skin, Text, Inline, ProxyGroup,
                              Particles, Volume, TextureLayer, SurfaceProgram, Uniform, Movie, Manipulator, ApplicationData>;
using SceneTypes = JoinedTypes<ShippedTypes, ExtraTypes>;

}  // namespace tessera
