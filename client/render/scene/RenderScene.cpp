// From a change list to the places of the scene that it concerns. What becomes of those: ScenePlaces.cpp.
#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "client/render/scene/SceneItems.h"
#include "common/scene/Action.h"

namespace tessera {

namespace {

Vec3d unitOr(const Vec3d& v, const Vec3d& fallback) {
    const double length = v.norm();
    return length > 0 && std::isfinite(length) ? Vec3d(v / length) : fallback;
}

}  // namespace

RenderScene::RenderScene() : impl_(std::make_unique<Impl>()) {}
RenderScene::~RenderScene() = default;

void RenderScene::beginFrame() {
    impl_->shadows.beginFrame();
}

Box RenderScene::bounds() const {
    return impl_->tree.bounds();
}

const std::set<ObjectId>& RenderScene::undrawn() const {
    return impl_->undrawn;
}

SceneVersion RenderScene::version() const {
    return impl_->version;
}

const RenderScene::Impl& RenderScene::seenFrom(const ScreenCamera& camera) const {
    impl_->lookFrom(camera);
    return *impl_;
}

void RenderScene::update(const Aspect& aspect, const ChangeList* list) {
    if (!list || impl_->rebuilds == 0) return impl_->rebuild(aspect);
    impl_->follow(aspect, *list);
}

void RenderScene::Impl::rebuild(const Aspect& aspect) {
    ++rebuilds;
    ++version.scene;
    ++version.contents;
    places.clear();
    items.clear();
    boxes.clear();
    reaches = {};
    detailedItems = coatedItems = glossyItems = 0;
    scopes = {};
    transparentTriangles = finerTransparentTriangles = 0;
    undrawn.clear();
    byScreen.clear();
    wideLines.clear();
    ++transparentChanges;
    linesByReach = {};
    users_.clear();
    looks_.clear();
    freeItems_.clear();
    shownLights_.clear();
    shownEnvironments_.clear();
    standing_.clear();
    attachedLights_ = 0;
    lightsStale_ = true;
    some_.clear();
    byUser_.clear();
    turns_.clear();
    billboards_.clear();
    lentTo_.clear();
    shadows.clear();

    aspect_ = &aspect;
    places.reserve(aspect.objectCount());
    adopt(kRootNode);
    for (const ObjectId id : aspect.ids()) {
        const auto* node = aspect.get<Node>(id);
        if (node && !node->parent && id != kRootNode) adopt(id);
    }
    settle(places.find(kRootNode));
    for (const std::uint32_t item : changedItems_) items[item].queued = false;
    changedItems_.clear();
    tree.build(boxes);
    finish();
}

void RenderScene::Impl::follow(const Aspect& aspect, const ChangeList& list) {
    aspect_ = &aspect;
    ++update_;
    for (const Creation& creation : list.creations)
        if (creation.type == typeOf<Node>()) addPlace(creation.id, kNone);
    if (!list.placements.empty()) {
        ++version.scene;
        lightsStale_ = lightsStale_ || beacons_;
    }
    // First all out, then in where they are at the end: what stood below what in between may have been a circle.
    for (const Placement& placement : list.placements) takeOut(placement.node);
    for (const Placement& placement : list.placements) putUnderParent(placement.node);
    for (const FieldColumn& column : list.columns) followField(effectsOf(column), column.ids);
    for (const RangeEdit& range : list.ranges)
        followField(effectsOf(range.type, range.field), std::span(&range.object, 1));
    for (const ObjectId id : list.destructions)
        if (const std::uint32_t place = places.find(id); place != kNone) removePlace(place);
    settleAll(!list.placements.empty());

    followBoxes();
    finish();
}

void RenderScene::Impl::followBoxes() {
    tree.follow(boxes, changedItems_);
    for (const std::uint32_t item : changedItems_) {
        items[item].queued = false;
        shadows.changed(item);
    }
    changedItems_.clear();
}

void RenderScene::Impl::finish() {
    for (const std::uint32_t place : arrivals_) putIn(place);
    arrivals_.clear();
    if (lightsStale_) refreshLights();
    lightsStale_ = false;
    looks_.endUpdate();
    aspect_ = nullptr;
}

void RenderScene::Impl::followField(Effect effects, std::span<const ObjectId> ids) {
    constexpr Effect kDrawnByContent = Effect::kShape | Effect::kLook;
    if (!(effects & (Effect::kStructure | Effect::kVisibility | Effect::kPose | Effect::kLight | kDrawnByContent)))
        return;
    ++version.scene;
    if (effects & Effect::kStructure)
        for (const ObjectId id : ids) {
            const auto* node = aspect_->get<Node>(id);
            const std::uint32_t place = places.find(id);
            if (!node || place == kNone) continue;
            if (places[place].topOfServer != node->ofServer) {
                places[place].topOfServer = node->ofServer;
                mark(place, kCore);
            }
            if (places[place].core == node->core) continue;
            setCore(place, node->core);
            mark(place, kCore);
        }
    if (effects & Effect::kVisibility)
        for (const ObjectId id : ids) {
            markUsers(id, kChoice);
            // What users see of levels of detail stands in the node.
            if (const std::uint32_t place = places.find(id); place != kNone && places[place].role == SceneRole::kChoice)
                mark(place, kChoice);
        }
    if (effects & Effect::kPose)
        for (const ObjectId id : ids) markUsers(id, kPose);
    if (effects & kDrawnByContent) {
        // Much of a look is the renderer's affair alone.
        ++version.contents;
        for (const ObjectId id : ids) {
            looks_.shapeChanged(*aspect_, id, changedLooks_);
            looks_.lookChanged(*aspect_, id, changedLooks_);
        }
        for (const ObjectId id : ids)
            if (const std::uint32_t user = users_.find(id); user != kNone && places[user].role == SceneRole::kMaterials)
                markUsers(id, kCore);
        for (const ObjectId changed : changedLooks_) {
            markUsers(changed, kDrawn);
            if (const auto lent = lentTo_.find(changed); lent != lentTo_.end())
                for (const std::uint32_t place : lent->second) mark(place, kDrawn);
        }
        changedLooks_.clear();
    }
    if (effects & Effect::kLight) lightsStale_ = true;
    if (beacons_ && (effects & (Effect::kStructure | Effect::kPose))) lightsStale_ = true;
}

void RenderScene::Impl::adopt(ObjectId top) {
    struct Found {
        ObjectId node;
        std::uint32_t parent;
    };
    std::vector<Found> found{{top, kNone}};
    while (!found.empty()) {
        const auto [id, parent] = found.back();
        found.pop_back();
        const std::uint32_t place = addPlace(id, parent);
        const std::size_t before = found.size();
        for (const ObjectId child : aspect_->get<Node>(id)->children) found.push_back({child, place});
        // The first is the next to be found.
        std::reverse(found.begin() + static_cast<std::ptrdiff_t>(before), found.end());
    }
}

std::uint32_t RenderScene::Impl::addPlace(ObjectId id, std::uint32_t parent) {
    ++work_;
    const std::uint32_t slot = places.add(id);
    ScenePlace& place = places[slot];
    if (parent != kNone) {
        place.parent = parent;
        place.depth = places[parent].depth + 1;
        linkFirst(places, places[parent].firstChild, slot, &ScenePlace::sibling);
    }
    const auto* node = aspect_->get<Node>(id);
    if (node) places[slot].topOfServer = node->ofServer;
    if (node && node->core) setCore(slot, node->core);
    return slot;
}

void RenderScene::Impl::removePlace(std::uint32_t slot) {
    ++work_;
    TESSERA_CHECK(places[slot].parent == kNone && places[slot].firstChild == kNone, "who goes stands alone");
    setCore(slot, {});
    some_.erase(slot);
    turns_.erase(slot);
    billboards_.erase(slot);
    places.erase(slot);
}

void RenderScene::Impl::takeOut(ObjectId node) {
    const std::uint32_t slot = places.find(node);
    TESSERA_CHECK(slot != kNone, "every node has its place");
    ScenePlace& place = places[slot];
    mark(slot, kPlaced);
    const std::uint32_t parent = std::exchange(place.parent, kNone);
    if (parent == kNone) return;
    if (places[parent].role == SceneRole::kChoice) mark(parent, kChoice);  // it may show another child now
    if (place.orderedBelow > 0) countOrdered(parent, -std::int64_t{place.orderedBelow});
    unlink(places, places[parent].firstChild, slot, &ScenePlace::sibling);
}

void RenderScene::Impl::putUnderParent(ObjectId node) {
    const Node* now = aspect_->get<Node>(node);
    const std::uint32_t slot = places.find(node), parent = now ? places.find(now->parent) : kNone;
    ScenePlace& place = places[slot];
    if (parent == kNone || place.parent != kNone) return;  // a top, or named twice
    place.parent = parent;
    if (places[parent].role == SceneRole::kChoice) mark(parent, kChoice);
    linkFirst(places, places[parent].firstChild, slot, &ScenePlace::sibling);
    if (place.orderedBelow > 0) countOrdered(parent, place.orderedBelow);
}

void RenderScene::Impl::setCore(std::uint32_t slot, ObjectId core) {
    ScenePlace& place = places[slot];
    leaveRole(slot);
    if (place.core) {
        std::uint32_t first = users_.find(place.core);
        unlink(places, first, slot, &ScenePlace::user);
        if (first == kNone) {
            users_.erase(place.core);
            looks_.drop(place.core);
        } else {
            users_.set(place.core, first);
        }
    }
    place.core = core;
    place.role = roleOf(*aspect_, core);
    if (!core) return;
    std::uint32_t first = users_.find(core);
    linkFirst(places, first, slot, &ScenePlace::user);
    users_.set(core, first);
}

void RenderScene::Impl::mark(std::uint32_t slot, Dirty why) {
    ScenePlace& place = places[slot];
    ++work_;
    if (place.dirty == 0) dirty_.push_back(slot);
    place.dirty = static_cast<std::uint8_t>(place.dirty | why);
}

void RenderScene::Impl::markUsers(ObjectId core, Dirty why) {
    for (std::uint32_t user = users_.find(core); user != kNone; user = places[user].user.next) mark(user, why);
}

// Anew for any change of a light: 0.1 us each, where most scenes have a few.
void RenderScene::Impl::refreshLights() {
    seenLights_.clear();
    seenEnvironments_.clear();
    beacons_ = lightsByUser_ = false;
    std::vector<ObjectId> named;  // scopes, in the order of the document
    for (const std::uint32_t place : shownLights_) {
        ++work_;
        const Object core = aspect_->find(places[place].core);
        const LightSource source = core.info().light(core.data());
        if (!source.on) continue;
        beacons_ = beacons_ || source.beacon;
        lightsByUser_ = lightsByUser_ || places[place].seenBy != 0xff;
        seenLights_.push_back({lightAt(place, source), places[place].seenBy, source.scope});
        if (source.scope && named.size() < scopes.size() && std::ranges::find(named, source.scope) == named.end())
            named.push_back(source.scope);
    }
    setScopes(named);
    for (SeenLight& seen : seenLights_)
        if (seen.scope) seen.light.scope = static_cast<std::uint8_t>(std::bit_width(scopeBit(seen.scope)));
    for (const std::uint32_t place : shownEnvironments_) {
        ++work_;
        seenEnvironments_.emplace_back(*aspect_->get<Environment>(places[place].core), places[place].seenBy);
        if (places[place].seenBy == 0xff) break;
        lightsByUser_ = true;
    }
    chooseLights();
}

// A scope keeps its bit as long as a light names it: what lies below others is not looked at again.
void RenderScene::Impl::setScopes(std::span<const ObjectId> now) {
    const auto markBelow = [&](ObjectId node) {
        if (const std::uint32_t place = places.find(node); place != kNone) mark(place, kScoped);
    };
    for (ObjectId& scope : scopes) {
        if (!scope || std::ranges::find(now, scope) != now.end()) continue;
        markBelow(scope);
        scope = {};
    }
    for (const ObjectId node : now) {
        if (scopeBit(node) != 0) continue;
        *std::ranges::find(scopes, ObjectId()) = node;
        markBelow(node);
    }
    settleAll(false);
}

std::uint32_t RenderScene::Impl::scopeBit(ObjectId node) const {
    for (std::size_t bit = 0; bit < scopes.size(); ++bit)
        if (scopes[bit] == node) return 1u << bit;
    return 0;
}

LightItem RenderScene::Impl::lightAt(std::uint32_t slot, const LightSource& source) const {
    const ScenePlace& place = places[slot];
    Affine3d world_T_light = place.world_T_node;
    // A beacon that is hidden stands where it would be seen.
    if (const std::uint32_t at = places.find(source.beacon); at != kNone && places[at].attached)
        world_T_light = places[at].shown ? places[at].world_T_node : worldTransform(*aspect_, source.beacon);
    LightItem light;
    light.position = world_T_light.translation();
    light.direction = unitOr(world_T_light.linear() * -Vec3d::UnitZ(), -Vec3d::UnitZ());
    light.kind = source.kind;
    // Each factor may be large: their product stays a number that shaders can square.
    constexpr float kUtmostRadiance = 1e18f;
    for (int i = 0; i < 3; ++i) light.radiance[i] = std::clamp(source.radiance[i], -kUtmostRadiance, kUtmostRadiance);
    light.range = source.range;
    light.attenuation = source.attenuation;
    light.innerAngle = source.innerAngle;
    light.outerAngle = source.outerAngle;
    light.shadows = source.shadows;
    light.outside = source.outside;
    return light;
}

// What a box is inside of is not tested again below it.
void collectInFrustum(const RenderScene::Impl& scene, const Frustum& frustum, std::vector<std::uint32_t>& found,
                      Frustum::Mask planes) {
    if (scene.tree.empty()) return;
    struct Open {
        std::uint32_t node;
        Frustum::Mask mask;
    };
    std::vector<Open> open{{BoxTree::kRoot, planes}};
    while (!open.empty()) {
        const auto [index, mask] = open.back();
        open.pop_back();
        const BoxTree::Node& node = scene.tree.node(index);
        const Frustum::Result result = mask == 0 ? Frustum::Result{} : frustum.classify(node.box, mask);
        if (result.outside) continue;
        if (!node.leaf) {
            open.push_back({node.below[1], result.undecided});
            open.push_back({node.below[0], result.undecided});
            continue;
        }
        for (const std::uint32_t item : node.items()) {
            if (result.undecided == 0 || !frustum.classify(scene.boxes[item], result.undecided).outside)
                found.push_back(item);
        }
    }
}

}  // namespace tessera
