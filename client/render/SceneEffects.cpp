#include "client/render/SceneEffects.h"

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

LightSetting lightSettingOf(const Object& core) {
    const auto pointLike = [](const auto* light) { return LightSetting{.on = light->on, .beacon = light->beacon, .attenuation = light->attenuation}; };
    if (const auto* point = core.as<PointLight>()) return pointLike(point);
    if (const auto* spot = core.as<SpotLight>()) return pointLike(spot);
    if (const auto* sun = core.as<DirectionalLight>()) return {.on = sun->on, .beacon = sun->beacon};
    return {};
}

}  // namespace tessera
