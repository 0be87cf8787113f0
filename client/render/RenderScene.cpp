#include <algorithm>
#include <cmath>

#include "client/render/SceneItems.h"
#include "common/scene/Action.h"
#include "common/scene/FieldTable.h"

namespace tessera {

namespace {

/// Beyond this a float of the rasteriser overflows; such an item leaves no pixel.
constexpr double kUtmost = 1e30;

/// What a list does to the derived state.
struct Changes {
    bool rebuild = false;
    bool lights = false;
    bool materials = false;
    std::vector<ObjectId> transforms;
};

Changes changesOf(const ChangeList& list) {
    Changes changes;
    changes.rebuild = !list.creations.empty() || !list.placements.empty() || !list.destructions.empty() || !list.ranges.empty();
    for (const FieldColumn& column : list.columns) {
        const Effect effects = effectsOf(column);
        if (effects & Effect::kPose)
            changes.transforms.insert(changes.transforms.end(), column.ids.begin(), column.ids.end());
        if (effects & Effect::kLight) changes.lights = true;
        if (column.type == typeOf<Material>())
            changes.materials = true;
        else if (effects & (Effect::kStructure | Effect::kVisibility | Effect::kShape | Effect::kLook))
            changes.rebuild = true;
    }
    return changes;
}

Vec3d unitOr(const Vec3d& v, const Vec3d& fallback) {
    const double length = v.norm();
    return length > 0 && std::isfinite(length) ? Vec3d(v / length) : fallback;
}

}  // namespace

std::vector<LightItem> defaultLights() {
    const auto directional = [](const Vec3d& travels, const Vec3f& radiance) {
        LightItem light;
        light.kind = LightItem::Kind::kDirectional;
        light.direction = travels.normalized();
        light.radiance = radiance;
        return light;
    };
    // A key from the upper left in front (a default view looks along -Z), a weak cool fill from the right, a rim from
    // behind.
    return {directional({0.5, -0.8, -0.6}, {0.66f, 0.63f, 0.58f}), directional({-0.8, -0.15, -0.5}, {0.07f, 0.09f, 0.12f}),
            directional({0.1, -0.4, 0.9}, {0.15f, 0.15f, 0.15f})};
}

RenderScene::RenderScene() : impl_(std::make_unique<Impl>()) {}
RenderScene::~RenderScene() = default;

Box RenderScene::bounds() const {
    return impl_->tree.bounds();
}

void RenderScene::update(const Aspect& aspect, const ChangeList* list) {
    Impl& impl = *impl_;
    if (!list || impl.rebuilds == 0) return impl.rebuild(aspect);
    const Changes effect = changesOf(*list);
    if (effect.rebuild) return impl.rebuild(aspect);
    if (effect.materials) impl.refreshMaterials(aspect);
    if (!effect.transforms.empty()) {
        std::vector<std::uint32_t> moved;
        for (const ObjectId core : effect.transforms) {
            const auto by = [](const auto& user, ObjectId id) { return user.first < id; };
            auto it = std::lower_bound(impl.transformUsers.begin(), impl.transformUsers.end(), core, by);
            for (; it != impl.transformUsers.end() && it->first == core; ++it) moved.push_back(it->second);
        }
        impl.moveTransforms(aspect, std::move(moved));
    }
    if (effect.lights || !effect.transforms.empty()) impl.refreshLights(aspect);
}

void RenderScene::Impl::rebuild(const Aspect& aspect) {
    ++rebuilds;
    meshes.beginSweep();
    places.clear();
    items.clear();
    boxes.clear();
    lightPlaces.clear();
    transformUsers.clear();
    environmentCore = {};
    anyLight = false;
    maxReach = 0;
    collect(aspect);
    for (std::uint32_t i = 0; i < places.size(); ++i) {
        setWorld(aspect, places[i]);
        if (places[i].transform) transformUsers.emplace_back(places[i].transform, i);
    }
    std::sort(transformUsers.begin(), transformUsers.end());
    boxes.resize(items.size());
    for (std::size_t i = 0; i < items.size(); ++i) setItem(items[i], boxes[i]);
    refreshMaterials(aspect);
    tree.build(boxes);
    refreshLights(aspect);
    meshes.endSweep();
}

void RenderScene::Impl::collect(const Aspect& aspect) {
    // The open places from the root down; a visit's depth says how many of them are its ancestors.
    std::vector<std::uint32_t> open;
    Action action;
    action.onNode([&](const Visit& visit) {
        const auto self = static_cast<std::uint32_t>(places.size());
        while (open.size() > visit.depth) {
            places[open.back()].end = self;
            open.pop_back();
        }
        ScenePlace place;
        place.node = visit.nodeId;
        if (!open.empty()) place.parent = open.back();
        if (aspect.coreOf<Transform>(visit.node)) place.transform = visit.node.core;
        places.push_back(place);
        open.push_back(self);
        return Descend::kInto;
    });
    action.on<Geometry>([&](const Visit& visit, const Geometry& geometry) {
        const RenderMesh* mesh = meshes.of(geometry);
        if (mesh->drawable()) {
            const auto place = static_cast<std::uint32_t>(places.size() - 1);
            places[place].item = static_cast<std::uint32_t>(items.size());
            SceneItem item;
            item.node = visit.nodeId;
            item.geometry = visit.node.core;
            item.material = geometry.material;
            item.mesh = mesh;
            item.place = place;
            items.push_back(item);
        }
        return Descend::kInto;
    });
    const auto addLight = [&](const Visit& visit) {
        anyLight = true;
        if (lightPlaces.size() < DrawList::kMaxLights)
            lightPlaces.push_back({static_cast<std::uint32_t>(places.size() - 1), visit.node.core});
        return Descend::kInto;
    };
    action.on<DirectionalLight>([&](const Visit& visit, const DirectionalLight&) { return addLight(visit); });
    action.on<PointLight>([&](const Visit& visit, const PointLight&) { return addLight(visit); });
    action.on<Environment>([&](const Visit& visit, const Environment&) {
        if (!environmentCore) environmentCore = visit.node.core;
        return Descend::kInto;
    });
    action.run(aspect);
    for (const std::uint32_t place : open) places[place].end = static_cast<std::uint32_t>(places.size());

    if (anyLight) return;
    // Lights that are switched off are meant to be off: no default light then.
    Action search;
    search.visitHidden(true);
    search.on<DirectionalLight>([this](const Visit&, const DirectionalLight&) {
        anyLight = true;
        return Descend::kPast;
    });
    search.on<PointLight>([this](const Visit&, const PointLight&) {
        anyLight = true;
        return Descend::kPast;
    });
    search.run(aspect);
}

// The one place where world transforms come from, so that following changes and starting anew give the same bits on
// every host.
void RenderScene::Impl::setWorld(const Aspect& aspect, ScenePlace& place) {
    place.world_T_node = place.parent == ScenePlace::kNone ? Affine3d::Identity() : places[place.parent].world_T_node;
    const Transform* t = place.transform ? aspect.get<Transform>(place.transform) : nullptr;
    if (t) place.world_T_node = place.world_T_node * composeTransform(t->translation, t->rotation, t->scale);
}

void RenderScene::Impl::setItem(SceneItem& item, Box& box) {
    const Affine3d& world_T_item = places[item.place].world_T_node;
    item.mirrored = world_T_item.linear().determinant() < 0;
    box = item.mesh->bounds.transformed(world_T_item);
    const Vec3d farthest = item.mesh->bounds.lower.cwiseAbs().cwiseMax(item.mesh->bounds.upper.cwiseAbs());
    item.reach = (world_T_item.linear().cwiseAbs() * farthest).norm();
    // Written so that it is false for NaN.
    const bool sane = (box.lower.array() > -kUtmost).all() && (box.upper.array() < kUtmost).all() && !box.empty() &&
                      item.reach < kUtmost;
    if (!sane) {
        box = Box();
        item.reach = 0;
    }
    maxReach = std::max(maxReach, item.reach);
}

void RenderScene::Impl::moveTransforms(const Aspect& aspect, std::vector<std::uint32_t> moved) {
    std::sort(moved.begin(), moved.end());
    std::vector<std::uint32_t> movedItems;
    std::uint32_t done = 0;
    for (const std::uint32_t from : moved) {
        // Below a place that has been done already.
        if (from < done) continue;
        done = places[from].end;
        for (std::uint32_t i = from; i < done; ++i) {
            setWorld(aspect, places[i]);
            if (places[i].item != ScenePlace::kNone) movedItems.push_back(places[i].item);
        }
    }
    for (const std::uint32_t i : movedItems) setItem(items[i], boxes[i]);
    tree.refit(boxes, movedItems);
}

void RenderScene::Impl::refreshMaterials(const Aspect& aspect) {
    for (SceneItem& item : items) setMaterial(aspect, item);
}

void RenderScene::Impl::setMaterial(const Aspect& aspect, SceneItem& item) {
    item.transparent = false;
    item.occludes = item.mesh->opaque;
    const Material* material = item.material ? aspect.get<Material>(item.material) : nullptr;
    if (!material) return;
    item.transparent = material->baseColor.w() < 1.0f;
    if (item.transparent) item.occludes = false;
    if (!item.occludes) return;
    const Image* image = material->baseColorImage ? aspect.get<Image>(material->baseColorImage) : nullptr;
    if (image) item.occludes = meshes.opaque(*image);
}

void RenderScene::Impl::refreshLights(const Aspect& aspect) {
    lights.clear();
    for (const SceneLight& source : lightPlaces) {
        const Affine3d& world_T_node = places[source.place].world_T_node;
        LightItem light;
        light.position = world_T_node.translation();
        light.direction = unitOr(world_T_node.linear() * -Vec3d::UnitZ(), -Vec3d::UnitZ());
        if (const auto* sun = aspect.get<DirectionalLight>(source.core)) {
            light.kind = LightItem::Kind::kDirectional;
            light.radiance = sun->color * sun->intensity;
        } else if (const auto* lamp = aspect.get<PointLight>(source.core)) {
            light.kind = LightItem::Kind::kPoint;
            light.radiance = lamp->color * lamp->intensity;
            light.range = lamp->range;
        }
        lights.push_back(light);
    }
    if (!anyLight) lights = defaultLights();
    const Environment* found = environmentCore ? aspect.get<Environment>(environmentCore) : nullptr;
    environment = found ? *found : Environment();
}

}  // namespace tessera
