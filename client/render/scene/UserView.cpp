// What depends on who looks at a screen: levels of detail, billboards, and the lights below them.
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "client/render/scene/SceneItems.h"
#include "client/render/scene/StudioLook.h"
#include "common/cores/Billboard.h"

namespace tessera {

Mat3d turnTowards(const Vec3d& headWorld, const Vec3d& axis, const Affine3d& world_T_node) {
    // In the node's coordinates a turn brings +Z onto the very line to the head, however these stretch or mirror it.
    const Mat3d inverse = world_T_node.linear().inverse();
    const Vec3d away = inverse * (headWorld - world_T_node.translation());
    const double distance = away.norm(), length = axis.norm();
    if (!inverse.allFinite() || !std::isfinite(distance) || !std::isfinite(length) || !(distance > 0))
        return Mat3d::Identity();
    constexpr double kLeast = 1e-9;  // of the sine of an angle: nearer than that to an axis rounding says where it is
    const Vec3d towards = away / distance;
    if (!(length > 0)) {
        Mat3d turn;
        const Vec3d side = Vec3d::UnitY().cross(towards);
        turn.col(0) = side.norm() > kLeast ? Vec3d(side / side.norm()) : Vec3d::UnitX();
        turn.col(2) = towards;
        turn.col(1) = turn.col(2).cross(turn.col(0));
        return turn;
    }
    const Vec3d about = axis / length;
    const Vec3d from = Vec3d::UnitZ() - about.z() * about, to = towards - about.dot(towards) * about;
    const double both = from.norm() * to.norm();
    if (!(from.norm() > kLeast) || !(to.norm() > kLeast)) return Mat3d::Identity();
    // Rodrigues' formula by the cosine and the sine.
    const double cosine = from.dot(to) / both, sine = about.dot(from.cross(to)) / both;
    Mat3d across;
    across << 0, -about.z(), about.y(), about.z(), 0, -about.x(), -about.y(), about.x(), 0;
    return cosine * Mat3d::Identity() + sine * across + (1 - cosine) * about * about.transpose();
}

void RenderScene::Impl::lookFrom(const ScreenCamera& camera) {
    showTo(camera);
    refineFor(camera);
    narrowFor(camera);
}

// Costs nothing where all users see the same and nothing turns; else what only some of them see where another one
// looks, and what is below billboards where a head has moved or the scene has changed there.
void RenderScene::Impl::showTo(const ScreenCamera& camera) {
    const auto bit = static_cast<std::uint8_t>(1u << (camera.user % kLevelUsers));
    if (const std::uint8_t before = std::exchange(userBit_, bit); before != bit) {
        for (const std::uint32_t item : byUser_)
            if (((items[item].seenBy & before) != 0) != ((items[item].seenBy & bit) != 0)) placeItem(item);
        if (lightsByUser_) chooseLights();
    }
    if (studioOfView_ != camera.studio) {
        studioOfView_ = camera.studio;
        chooseLights();
    }
    if (turnsStale_ || (!billboards_.empty() && head_ != camera.headWorld)) {
        head_ = camera.headWorld;
        turnBillboards();
        turnsStale_ = false;
    }
    if (changedItems_.empty()) return;
    followBoxes();
}

void RenderScene::Impl::turnBillboards() {
    for (const std::uint32_t billboard : billboards_) turnBelow(billboard);
}

void RenderScene::Impl::turnBelow(std::uint32_t billboard) {
    turning_.assign(1, {billboard, places[billboard].world_T_node});
    while (!turning_.empty()) {
        const auto [slot, world_T_parent] = turning_.back();  // of the billboard itself: where it stands
        turning_.pop_back();
        ++work_;
        const ScenePlace& place = places[slot];
        if (!place.shown) continue;
        Affine3d world_T_node = world_T_parent;
        if (const auto turn = turns_.find(slot); turn != turns_.end()) {
            if (place.role == SceneRole::kBillboard)
                world_T_node.linear() = world_T_parent.linear() * turnTowards(head_, turn->second.axis, world_T_parent);
            else
                placeBelow(turn->second.pose, world_T_parent, world_T_node);
        }
        if (place.item != kNone) {
            items[place.item].turned = true;
            items[place.item].world_T_item = world_T_node;
            placeItem(place.item);
        }
        for (std::uint32_t c = place.firstChild; c != kNone; c = places[c].sibling.next)
            turning_.emplace_back(c, world_T_node);
    }
}

/// After a place has been settled: what `turnBelow` asks of it.
void RenderScene::Impl::keepTurn(std::uint32_t slot) {
    const ScenePlace& place = places[slot];
    const bool billboard = place.shown && place.role == SceneRole::kBillboard;
    if (billboard || (place.shown && place.turns && place.role == SceneRole::kPose)) {
        const Object core = aspect_->find(place.core);
        turns_[slot] = billboard ? Turn{.pose = {}, .axis = core.as<Billboard>()->axis}
                                 : Turn{.pose = core.info().pose(core.data()), .axis = {}};
        turnsStale_ = true;
    } else if (!turns_.empty()) {
        turns_.erase(slot);
    }
    const bool top = billboard && !place.turns;
    if (top)
        billboards_.insert(slot);
    else if (!billboards_.empty())
        billboards_.erase(slot);
}

// Of the lights, and what shines from all around, that the user sees.
void RenderScene::Impl::chooseLights() {
    lights.clear();
    lightsLeftOut = shadowsLeftOut = scopesLeftOut = 0;
    // How many of a kind have asked for shadows, and how many get some.
    std::array<std::size_t, 3> asked{}, most{};
    const auto at = [](LightItem::Kind kind) { return static_cast<std::size_t>(kind); };
    most[at(LightItem::Kind::kDirectional)] = 1;
    most[at(LightItem::Kind::kSpot)] = DrawList::kMaxShadowSpots;
    most[at(LightItem::Kind::kPoint)] = DrawList::kMaxShadowPoints;
    for (const SeenLight& seen : seenLights_) {
        if (!(seen.seenBy & userBit_)) continue;
        if (seen.scope && seen.light.scope == 0) {
            ++scopesLeftOut;
            continue;
        }
        if (lights.size() == DrawList::kMaxLights) {
            ++lightsLeftOut;
            continue;
        }
        LightItem light = seen.light;
        if (light.shadows) {
            light.shadows = ++asked[at(light.kind)] <= most[at(light.kind)];
            shadowsLeftOut += light.shadows ? 0 : 1;
        }
        lights.push_back(light);
    }
    studio = attachedLights_ == 0 && seenEnvironments_.empty() ? studioOfView_ : std::nullopt;
    if (attachedLights_ == 0) lights = studio ? studioLights() : defaultLights();
    const auto first =
        std::ranges::find_if(seenEnvironments_, [&](const auto& seen) { return (seen.second & userBit_) != 0; });
    environment = first != seenEnvironments_.end() ? first->first : studio ? studioEnvironment() : Environment();
}

}  // namespace tessera
