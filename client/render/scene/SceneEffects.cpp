#include "client/render/scene/SceneEffects.h"

#include "common/drawable/Drawable.h"

namespace tessera {

SceneRole roleOf(const Aspect& aspect, ObjectId core) {
    const Object object = core ? aspect.find(core) : Object();
    if (!object) return SceneRole::kNothing;
    if (isDrawable(typeOf(object))) return SceneRole::kDrawable;
    if (object.info().pose) return SceneRole::kPose;
    if (object.info().light) return SceneRole::kLight;
    if (object.info().effects & Effect::kVisibility) return SceneRole::kChoice;
    if (object.is<MaterialGroup>()) return SceneRole::kMaterials;
    if (object.is<Billboard>()) return SceneRole::kBillboard;
    // Of what shines without standing anywhere there is one kind.
    return object.is<Environment>() ? SceneRole::kEnvironment : SceneRole::kNothing;
}

}  // namespace tessera
