#include "client/render/SceneEffects.h"

#include "client/render/Drawables.h"
#include "common/scene/FieldTable.h"

namespace tessera {

SceneEffect effectOf(ObjectType type, FieldId field) {
    switch (static_cast<TypeNumber>(type.value)) {
        case TypeNumber::kNode:
            return field == field::kNodeCore ? SceneEffect::kStructure : SceneEffect::kNothing;
        case TypeNumber::kSwitch:
            return SceneEffect::kVisibility;
        case TypeNumber::kTransform:
            return SceneEffect::kPose;
        case TypeNumber::kGeometry:
            return field == field::kGeometryMaterial ? SceneEffect::kLook : SceneEffect::kShape;
        case TypeNumber::kMaterial:
        case TypeNumber::kImage:
            return SceneEffect::kLook;
        case TypeNumber::kDirectionalLight:
        case TypeNumber::kPointLight:
        case TypeNumber::kEnvironment:
            return SceneEffect::kLight;
        case TypeNumber::kGroup:
        case TypeNumber::kCamera:
        case TypeNumber::kMotion:
        case TypeNumber::kInterest:
        case TypeNumber::kCollisionObject:
            break;
    }
    return SceneEffect::kNothing;
}

SceneRole roleOf(const Aspect& aspect, ObjectId core) {
    const Object* object = core ? aspect.find(core) : nullptr;
    if (!object) return SceneRole::kNothing;
    const ObjectType type = typeOf(*object);
    if (isDrawable(type)) return SceneRole::kDrawable;
    switch (static_cast<TypeNumber>(type.value)) {
        case TypeNumber::kTransform:
            return SceneRole::kPose;
        case TypeNumber::kSwitch:
            return SceneRole::kChoice;
        case TypeNumber::kDirectionalLight:
        case TypeNumber::kPointLight:
            return SceneRole::kLight;
        case TypeNumber::kEnvironment:
            return SceneRole::kEnvironment;
        default:
            return SceneRole::kNothing;
    }
}

}  // namespace tessera
