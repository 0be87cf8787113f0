// What is to be known of a place, from its parent down.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>

#include "client/render/scene/SceneItems.h"
#include "common/cores/MaterialGroup.h"
#include "common/geometry/Utmost.h"

namespace tessera {

namespace {

bool sameBits(const Affine3d& a, const Affine3d& b) {
    return std::memcmp(a.data(), b.data(), 16 * sizeof(double)) == 0;
}

bool standsInOrder(SceneRole role) {
    return role == SceneRole::kLight || role == SceneRole::kEnvironment;
}

}  // namespace

double ReachCounts::bound() const {
    for (std::size_t i = kOctaves; i-- > 1;)
        if (counts_[i] > 0) return std::ldexp(1.0, static_cast<int>(i) + kLowest);
    return 0;
}

std::size_t ReachCounts::octave(double reach) {
    if (!(reach > 0)) return 0;
    return static_cast<std::size_t>(std::clamp(std::ilogb(reach) - kLowest + 1, 1, static_cast<int>(kOctaves) - 1));
}

// Whoever is settled finds its parent settled: from the top down. Those below that inherit a change are settled on the
// way, those that do not are found again here.
void RenderScene::Impl::settleAll(bool treeChanged) {
    // By depth; those as deep in the order in which they lie in memory.
    byDepth_.clear();
    for (const std::uint32_t slot : dirty_) {
        if (!places[slot].id) continue;  // gone
        const std::uint64_t depth = treeChanged ? depthNow(slot) : places[slot].depth;
        byDepth_.push_back(depth << 32 | slot);
    }
    dirty_.clear();
    std::sort(byDepth_.begin(), byDepth_.end());
    for (const std::uint64_t next : byDepth_) {
        const auto slot = static_cast<std::uint32_t>(next);
        if (places[slot].dirty != 0) settle(slot);
    }
}

/// As the links are now; each place is counted once in an update.
std::uint32_t RenderScene::Impl::depthNow(std::uint32_t slot) {
    path_.clear();
    for (; slot != kNone && places[slot].newDepthIn != update_; slot = places[slot].parent) path_.push_back(slot);
    std::uint32_t depth = slot == kNone ? 0 : places[slot].newDepth + 1;
    for (auto it = path_.rbegin(); it != path_.rend(); ++it) {
        places[*it].newDepth = depth++;
        places[*it].newDepthIn = update_;
    }
    work_ += path_.size();
    return depth - 1;
}

void RenderScene::Impl::settle(std::uint32_t top) {
    open_.assign(1, {top, false});
    while (!open_.empty()) {
        const auto [slot, inPlaced] = open_.back();
        open_.pop_back();
        ++work_;
        ScenePlace& place = places[slot];
        const std::uint8_t dirty = place.dirty;
        place.dirty = 0;
        const bool reorder = inPlaced || (dirty & kPlaced) != 0;

        const ScenePlace* parent = place.parent == kNone ? nullptr : &places[place.parent];
        const bool isRoot = place.id == kRootNode;
        const bool attached = isRoot || (parent && parent->attached);
        const std::uint8_t seenBy = isRoot ? 0xff
                                    : parent && parent->shown
                                        ? static_cast<std::uint8_t>(parent->seenBy & mayBeSeenBy(place.parent, slot))
                                        : 0;
        const bool shown = seenBy != 0;
        const std::uint32_t depth = parent ? parent->depth + 1 : 0;
        const bool wasShown = place.shown;
        const bool forAll = attached != place.attached || depth != place.depth;
        place.attached = attached;
        place.shown = shown;
        place.depth = depth;
        bool moved = false, relooked = false, rescoped = false, reowned = false;
        if (shown) {
            const Affine3d world_T_node = worldOf(place);
            const bool turns = parent && parent->turnsBelow, turnsBelow = turns || place.role == SceneRole::kBillboard;
            moved = !wasShown || !sameBits(world_T_node, place.world_T_node) || seenBy != place.seenBy ||
                    turns != place.turns || turnsBelow != place.turnsBelow;
            if (moved) place.world_T_node = world_T_node;
            place.turns = turns;
            place.turnsBelow = turnsBelow;
            const GroupMaterials materials = materialsBelow(place);
            relooked = materials != place.materials;
            place.materials = materials;
            const std::uint32_t lies = (parent ? parent->scopes : 0) | scopeBit(place.id);
            rescoped = lies != place.scopes;
            place.scopes = lies;
            const bool ofServer = place.topOfServer || (parent && parent->ofServer);
            reowned = ofServer != place.ofServer;
            place.ofServer = ofServer;
        }
        place.seenBy = seenBy;
        keepTurn(slot);

        const bool light = place.role == SceneRole::kLight;
        if (place.counted != (attached && light)) {
            place.counted = !place.counted;
            place.counted ? ++attachedLights_ : --attachedLights_;
            lightsStale_ = true;
        }
        const bool stands = shown && standsInOrder(place.role);
        if (place.ordered && (!stands || reorder)) takeOut(slot);
        if (stands && !place.ordered) arrivals_.push_back(slot);
        if (stands && moved) lightsStale_ = true;
        settleItem(slot, moved, relooked || (dirty & kDrawn) != 0);
        if (place.item != kNone) items[place.item].scopes = place.scopes;
        if (reowned && place.item != kNone) shadows.changed(place.item);  // it casts some, or none

        // Which children inherit something new?
        const std::uint32_t showed = place.shows;
        const SeenChildren before = showed == ScenePlace::kSome ? some_.at(slot) : SeenChildren();
        if (place.role != SceneRole::kChoice)
            place.shows = ScenePlace::kAll;
        else if (shown)
            place.shows = shownChild(slot);
        const bool othersOfSome = showed == ScenePlace::kSome && place.shows == showed && before != some_.at(slot);
        if (showed == ScenePlace::kSome && place.shows != showed) some_.erase(slot);
        const bool seen = (wasShown && showed == ScenePlace::kAll) || (shown && place.shows == ScenePlace::kAll);
        const bool news =
            wasShown != shown || moved || relooked || rescoped || reowned || othersOfSome || showed != place.shows;
        if (forAll || (seen && news)) {
            enterBelow(slot, reorder);
            continue;
        }
        if (reorder && place.orderedBelow > 0) {
            for (std::uint32_t c = place.firstChild; c != kNone; c = places[c].sibling.next)
                if (places[c].orderedBelow > 0) open_.push_back({c, true});
        }
        if (!news) continue;
        const auto enter = [&, slot = slot](std::uint32_t shows, const SeenChildren& some) {
            if (shows == ScenePlace::kSome)
                for (const auto& [child, users] : some) enterChild(slot, child, reorder);
            else if (shows != ScenePlace::kAll)
                enterChild(slot, shows, reorder);
        };
        enter(showed, before);
        enter(place.shows, place.shows == ScenePlace::kSome ? some_.at(slot) : SeenChildren());
    }
}

void RenderScene::Impl::enterBelow(std::uint32_t slot, bool reorder) {
    for (std::uint32_t c = places[slot].firstChild; c != kNone; c = places[c].sibling.next)
        open_.push_back({c, reorder});
}

void RenderScene::Impl::enterChild(std::uint32_t slot, std::uint32_t child, bool reorder) {
    if (child != kNone && places[child].parent == slot) open_.push_back({child, reorder});
}

std::uint32_t RenderScene::Impl::shownChild(std::uint32_t slot) {
    const ScenePlace& place = places[slot];
    const Object core = aspect_->find(place.core);
    const Node& node = *aspect_->get<Node>(place.id);
    SeenChildren seen;
    const auto add = [&](std::size_t index, unsigned users) {
        if (index < node.children.size()) seen[places.find(node.children[index])] |= static_cast<std::uint8_t>(users);
    };
    if (core.is<DistanceLOD>()) {
        for (std::size_t user = 0; user < kLevelUsers; ++user) add(levelOf(node, user), 1u << user);
    } else {
        const std::optional<std::vector<std::size_t>> chosen = seenChildren(core, node.children.size());
        if (!chosen) return ScenePlace::kAll;
        for (const std::size_t index : *chosen) add(index, 0xff);
    }
    if (seen.empty()) return kNone;
    if (seen.size() == 1 && seen.begin()->second == 0xff) return seen.begin()->first;
    some_[slot] = std::move(seen);
    return ScenePlace::kSome;
}

std::uint8_t RenderScene::Impl::mayBeSeenBy(std::uint32_t slot, std::uint32_t child) const {
    const std::uint32_t shows = places[slot].shows;
    if (shows != ScenePlace::kSome) return shows == ScenePlace::kAll || shows == child ? 0xff : 0;
    const SeenChildren& seen = some_.at(slot);
    const auto found = seen.find(child);
    return found == seen.end() ? 0 : found->second;
}

// As MaterialGroup.h says: the nearest of those that do not override, the topmost of those that do, up to who protects.
GroupMaterials RenderScene::Impl::materialsBelow(const ScenePlace& place) const {
    GroupMaterials materials = place.parent == kNone ? GroupMaterials() : places[place.parent].materials;
    const MaterialGroup* group =
        place.role == SceneRole::kMaterials ? aspect_->get<MaterialGroup>(place.core) : nullptr;
    if (!group) return materials;
    if (group->protects) materials.over = {};
    if (!group->material) return materials;
    if (!group->overrides)
        materials.nearest = group->material;
    else if (!materials.over)
        materials.over = group->material;
    return materials;
}

void RenderScene::Impl::lend(SceneItem& item, ObjectId material) {
    if (item.lent == material) return;
    if (item.lent) {
        const auto borrowers = lentTo_.find(item.lent);
        borrowers->second.erase(item.place);
        if (borrowers->second.empty()) lentTo_.erase(borrowers);
        looks_.release(item.lent);
    }
    item.lent = material;
    if (!material) return;
    looks_.hold(*aspect_, material);
    lentTo_[material].insert(item.place);
}

// The one place where world transforms come from, so that following changes and starting anew give the same bits on
// every host.
Affine3d RenderScene::Impl::worldOf(const ScenePlace& place) const {
    static const Affine3d kTop = Affine3d::Identity();
    const Affine3d& world_T_parent = place.parent == kNone ? kTop : places[place.parent].world_T_node;
    if (place.role != SceneRole::kPose) return world_T_parent;
    const Object core = aspect_->find(place.core);
    Affine3d world_T_node;
    core.info().place(core.data(), world_T_parent, world_T_node);
    return world_T_node;
}

void RenderScene::Impl::settleItem(std::uint32_t slot, bool moved, bool another) {
    ScenePlace& place = places[slot];
    if (!place.shown || place.role != SceneRole::kDrawable) {
        undrawn.erase(place.id);
        return freeItem(place);
    }
    const auto placed = [&] {
        SceneItem& item = items[place.item];
        item.turned = false;
        item.world_T_item = place.world_T_node;
        item.seenBy = place.seenBy;
        item.seenBy == 0xff ? (void)byUser_.erase(place.item) : (void)byUser_.insert(place.item);
        turnsStale_ = turnsStale_ || place.turns;
        placeItem(place.item);
    };
    if (place.item != kNone && !another) {
        if (moved) placed();
        return;
    }
    SceneLook look = looks_.of(*aspect_, place.core);
    if (!look.mesh || !look.mesh->drawable()) {
        look.mesh&& look.mesh->refused ? (void)undrawn.insert(place.id) : (void)undrawn.erase(place.id);
        return freeItem(place);
    }
    const bool isNew = place.item == kNone;
    if (isNew && freeItems_.empty()) {
        place.item = static_cast<std::uint32_t>(items.size());
        items.emplace_back();
        boxes.emplace_back();
    } else if (isNew) {
        place.item = freeItems_.back();
        freeItems_.pop_back();
    }
    SceneItem& item = items[place.item];
    const bool otherReach = item.base != look.mesh || item.slack != look.slack;
    if (isNew) reaches.add(item.reach);
    countLooks(place.item, -1);
    item.place = slot;
    const ObjectId group = place.materials.over || look.material ? place.materials.over : place.materials.nearest;
    lend(item, group == look.material ? ObjectId() : group);
    if (item.lent) look = looks_.of(*aspect_, place.core, item.lent);
    item.node = place.id;
    item.geometry = place.core;
    item.material = look.material;
    item.look = look.drawn;
    item.mesh = item.base = look.mesh;
    item.fineness = look.fineness;
    item.asWhole = look.asWhole;
    item.over = look.over;
    item.coarser = look.coarser;
    item.fill = look.fill;
    item.byScreen = look.byScreen;
    item.slack = look.slack;
    item.cut = look.cut;
    item.transparent = look.transparent;
    item.occludes = look.occludes;
    item.detailed = look.detailed;
    item.coated = look.coated;
    item.glossy = look.glossy;
    item.kind = look.kind;
    item.lineWidth = look.lineWidth;
    item.lineLayers = look.lineLayers;
    item.cornersAlone = look.cornersAlone;
    item.state = look.state;
    countLooks(place.item, 1);
    shadows.changed(place.item);
    if (isNew || moved || otherReach) placed();
}

void RenderScene::Impl::placeItem(std::uint32_t index) {
    SceneItem& item = items[index];
    Box& box = boxes[index];
    const Affine3d& world_T_item = item.world_T_item;
    reaches.remove(item.reach);
    transparentChanges += item.transparent || item.over;
    item.mirrored = world_T_item.linear().determinant() < 0;
    const Box reached = reachedBy(item);
    box = reached.transformed(world_T_item);
    const Vec3d farthest = reached.lower.cwiseAbs().cwiseMax(reached.upper.cwiseAbs());
    item.reach = (world_T_item.linear().cwiseAbs() * farthest).norm();
    // Written so that it is false for NaN.
    const bool sane = (box.lower.array() >= -kUtmostCoordinate).all() &&
                      (box.upper.array() <= kUtmostCoordinate).all() && !box.empty() &&
                      item.reach <= 2 * kUtmostCoordinate;
    if (sane) {
        undrawn.erase(item.node);
    } else {
        undrawn.insert(item.node);
        box = Box();
        item.reach = 0;
    }
    reaches.add(item.reach);
    if (!(item.seenBy & userBit_)) box = Box();
    queue(index);
}

void RenderScene::Impl::freeItem(ScenePlace& place) {
    if (place.item == kNone) return;
    const std::uint32_t index = std::exchange(place.item, kNone);
    reaches.remove(items[index].reach);
    countLooks(index, -1);
    lend(items[index], {});
    byUser_.erase(index);
    boxes[index] = Box();
    queue(index);
    items[index] = {.queued = true};
    freeItems_.push_back(index);
}

Box RenderScene::Impl::reachedBy(const SceneItem& item) {
    Box box = item.base->bounds;
    box.lower.array() -= item.slack;
    box.upper.array() += item.slack;
    return box;
}

void RenderScene::Impl::countLooks(std::uint32_t index, int sign) {
    const SceneItem& item = items[index];
    if (item.byScreen && sign > 0) byScreen.insert(index);
    if (item.lineWidth > 1) sign > 0 ? (void)wideLines.insert(index) : (void)wideLines.erase(index);
    if (item.byScreen && sign < 0) {
        byScreen.erase(index);
        if (item.transparent) finerTransparentTriangles -= item.mesh->triangles - item.base->triangles;
    }
    if (item.detailed) detailedItems += static_cast<std::size_t>(sign);
    if (item.over) ++transparentChanges;
    if (item.transparent && item.base) {
        transparentTriangles += static_cast<std::uint64_t>(sign) * item.base->triangles;
        ++transparentChanges;
    }
    if (item.coated) coatedItems += static_cast<std::size_t>(sign);
    if (item.glossy) glossyItems += static_cast<std::size_t>(sign);
    if (item.lineWidth > 0 || rowOf(item.kind).standsOut)
        linesByReach[std::min(kWidestReachPx, static_cast<std::size_t>(lineReachPx(item.lineWidth)))] +=
            static_cast<std::size_t>(sign);
}

double RenderScene::Impl::widestLineReachPx() const {
    for (std::size_t reach = linesByReach.size(); reach-- > 0;)
        if (linesByReach[reach] > 0) return static_cast<double>(reach);
    return 0;
}

void RenderScene::Impl::queue(std::uint32_t item) {
    if (!items[item].queued) changedItems_.push_back(item);
    items[item].queued = true;
}

void RenderScene::Impl::leaveRole(std::uint32_t slot) {
    ScenePlace& place = places[slot];
    undrawn.erase(place.id);
    freeItem(place);
    if (place.ordered) takeOut(slot);
    if (!place.counted) return;
    place.counted = false;
    --attachedLights_;
    lightsStale_ = true;
}

// ---- document order ------------------------------------------------------------------------------------------------

// Two places that were not moved keep their order, so the sets stay sorted: what a placement moves is taken out before,
// and put in after, the tree of places is as it is now.
bool RenderScene::Impl::before(std::uint32_t a, std::uint32_t b) const {
    if (a == b) return false;
    const bool deeper = places[a].depth > places[b].depth;
    std::uint32_t x = a, y = b;
    for (; places[x].depth > places[y].depth; ++work_) x = places[x].parent;
    for (; places[y].depth > places[x].depth; ++work_) y = places[y].parent;
    if (x == y) return !deeper;  // one lies below the other
    for (; places[x].parent != places[y].parent; ++work_) {
        x = places[x].parent;
        y = places[y].parent;
    }
    const auto& children = aspect_->get<Node>(places[places[x].parent].id)->children;
    const auto indexOf = [&](std::uint32_t slot) { return children.indexOf(places[slot].id); };
    return indexOf(x) < indexOf(y);
}

void RenderScene::Impl::takeOut(std::uint32_t slot) {
    ScenePlace& place = places[slot];
    const auto standing = standing_.find(slot);
    (place.role == SceneRole::kLight ? shownLights_ : shownEnvironments_).erase(standing->second);
    standing_.erase(standing);
    place.ordered = false;
    countOrdered(slot, -1);
    lightsStale_ = true;
}

void RenderScene::Impl::putIn(std::uint32_t slot) {
    ScenePlace& place = places[slot];
    if (place.ordered) return;
    OrderedPlaces& order = place.role == SceneRole::kLight ? shownLights_ : shownEnvironments_;
    standing_[slot] = order.insert(slot).first;
    place.ordered = true;
    countOrdered(slot, 1);
    lightsStale_ = true;
}

void RenderScene::Impl::countOrdered(std::uint32_t slot, std::int64_t more) {
    for (; slot != kNone; slot = places[slot].parent) {
        ++work_;
        places[slot].orderedBelow = static_cast<std::uint32_t>(places[slot].orderedBelow + more);
    }
}

}  // namespace tessera
