#include "server/collision/pipeline/Admission.h"

#include <algorithm>
#include <array>
#include <bit>

#include "common/cores/CollisionObject.h"
#include "common/cores/Transform.h"
#include "server/collision/pairwise/ConservativeBox.h"

namespace tessera {
namespace {

std::array<double, 10> numbersOf(const TentativeTransform& t) {
    return {t.translation.x(), t.translation.y(), t.translation.z(), t.rotation.w(), t.rotation.x(),
            t.rotation.y(),    t.rotation.z(),    t.scale.x(),       t.scale.y(),    t.scale.z()};
}

/// Whose wish counts, whatever order they come in: the lowest source; of one source the one that the numbers put first.
bool before(const TentativeTransform& x, const TentativeTransform& y) {
    if (x.transform != y.transform) return x.transform < y.transform;
    if (x.source != y.source) return x.source < y.source;
    const std::array<double, 10> nx = numbersOf(x), ny = numbersOf(y);
    return std::lexicographical_compare(nx.begin(), nx.end(), ny.begin(), ny.end(), [](double a, double b) {
        return std::bit_cast<std::uint64_t>(a) < std::bit_cast<std::uint64_t>(b);
    });
}

/// A scale on its way through zero would flatten the part.
bool turnsInsideOut(const Way& way) {
    return (way.start.scale.array() * way.end.scale.array() < 0).any();
}

/// No part that has a body now would lose it (by numbers too large or too small to work with). Rigid motions of
/// moderate length cannot do that.
bool canBeShown(const ObjectHandler& handler, const Mover& mover) {
    constexpr double kModerate = 1e12;
    if (mover.way.start.scale == mover.way.end.scale && mover.way.end.translation.cwiseAbs().maxCoeff() < kModerate)
        return true;
    bool stays = true;
    handler.forPartsCarried(mover.number, [&](std::uint32_t i, std::uint32_t) {
        if (!stays || !handler.parts()[i].solid()) return;
        const PartOnTheWay part(handler, i, mover.wish.transform);
        stays = invertible(part.world(localOf(mover.way.end)));
    });
    return stays;
}

}  // namespace

std::vector<ObjectId> holdBack(std::vector<TentativeTransform>& accepted, const Aspect& committed) {
    std::vector<ObjectId> held;
    for (TentativeTransform& t : accepted) {
        const Transform* now = committed.get<Transform>(t.transform);
        if (!now || Pose{t.translation, t.rotation, t.scale}.sound()) continue;
        t = withValue(t, {now->translation, now->rotation, now->scale});
        held.push_back(t.transform);
    }
    return held;
}

std::vector<ObjectId> holdBack(std::vector<BodyVelocity>& velocities, const Aspect& committed) {
    static constexpr double kFastest = CollisionObject::kFastest;
    const auto cut = [](Vec3d& velocity) {
        if (!velocity.allFinite()) {
            velocity.setZero();
            return true;
        }
        const double most = velocity.cwiseAbs().maxCoeff();
        if (most > kFastest) velocity = (velocity * (kFastest / most)).cwiseMax(-kFastest).cwiseMin(kFastest);
        return most > kFastest;
    };
    std::vector<ObjectId> held;
    for (BodyVelocity& body : velocities) {
        const bool fast = cut(body.velocity), spins = cut(body.spin);
        const CollisionObject* core = committed.get<CollisionObject>(body.core);
        if (core && (fast || spins)) held.push_back(core->node);
    }
    return held;
}

TentativeTransform withValue(TentativeTransform t, const Pose& value) {
    t.translation = value.translation;
    t.rotation = value.rotation;
    t.scale = value.scale;
    return t;
}

void admit(const Aspect& committed, const ObjectHandler& handler, std::span<const TentativeTransform> wanted,
           StepResult& result, std::vector<Mover>& movers) {
    const auto ascending = [](const auto& x, const auto& y) { return x.transform >= y.transform; };
    std::vector<TentativeTransform> sorted;
    if (std::ranges::adjacent_find(wanted, ascending) != wanted.end()) {
        sorted.assign(wanted.begin(), wanted.end());
        std::ranges::sort(sorted, before);
        const auto same = [](const auto& x, const auto& y) { return x.transform == y.transform; };
        sorted.erase(std::unique(sorted.begin(), sorted.end(), same), sorted.end());
        wanted = sorted;
    }
    movers.clear();
    result.accepted.reserve(wanted.size());
    std::uint32_t guess = 0;
    for (const TentativeTransform& wish : wanted) {
        const Transform* present = committed.get<Transform>(wish.transform);
        if (!present) {
            result.stopped.push_back(wish.transform);
            continue;
        }
        const std::uint32_t number = handler.transformNumber(wish.transform, guess);
        if (number != kNobody) guess = number + 1;
        const bool carries = number != kNobody && handler.carriesParts(number);
        movers.push_back(
            {wish,
             {{present->translation, present->rotation, present->scale}, {wish.translation, wish.rotation, wish.scale}},
             number});
        const Mover& mover = movers.back();
        const bool granted = possible(mover.way.end);
        if (granted && carries && !turnsInsideOut(mover.way) && canBeShown(handler, mover)) continue;
        if (granted && !carries) {
            result.accepted.push_back(wish);
        } else {
            result.accepted.push_back(withValue(wish, mover.way.start));
            result.stopped.push_back(wish.transform);
        }
        movers.pop_back();
    }
}

}  // namespace tessera
