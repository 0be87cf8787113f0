#include "server/collision/rigid_bodies/FrameBodies.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <type_traits>
#include <utility>

namespace tessera::rigid {

namespace {

constexpr double kLeastMass = 1e-12, kMostMass = 1e12;
constexpr double kMostCoordinate = 1e12;
constexpr double kMostFriction = 100;

/// rank of each, and the order; of equal ids the first one passed comes first.
template <typename Thing>
std::vector<std::uint32_t> orderById(std::span<const Thing> things, std::vector<std::uint32_t>& rank) {
    std::vector<std::uint32_t> order(things.size());
    std::iota(order.begin(), order.end(), 0U);
    const auto less = [&](std::uint32_t a, std::uint32_t b) { return things[a].id < things[b].id; };
    if (!std::is_sorted(order.begin(), order.end(), less)) std::stable_sort(order.begin(), order.end(), less);
    rank.resize(things.size());
    for (std::uint32_t r = 0; r < order.size(); ++r) rank[order[r]] = r;
    return order;
}

bool sane(const Affine3d& world) {
    return world.matrix().allFinite() && world.matrix().cwiseAbs().maxCoeff() < kMostCoordinate &&
           std::abs(world.linear().determinant()) > 0;
}

Vec3d cut(const Vec3d& v, double most) {
    const double length = v.norm();
    return length > most ? Vec3d(v * (most / length)) : v;
}

double between(double value, double low, double high, double otherwise) {
    return std::isfinite(value) ? std::clamp(value, low, high) : otherwise;
}

}  // namespace

std::uint32_t FrameBodies::findPart(std::uint64_t id) const {
    const auto found = std::lower_bound(parts.begin(), parts.end(), id,
                                        [](const FramePart& p, std::uint64_t x) { return p.given->id < x; });
    return found != parts.end() && found->given->id == id ? static_cast<std::uint32_t>(found - parts.begin()) : kNoBody;
}

std::uint32_t FrameBodies::findBody(std::uint64_t id) const {
    const auto found = std::lower_bound(bodies.begin(), bodies.end(), id,
                                        [](const FrameBody& b, std::uint64_t x) { return b.given->id < x; });
    return found != bodies.end() && found->given->id == id ? static_cast<std::uint32_t>(found - bodies.begin())
                                                           : kNoBody;
}

namespace {

/// False where it is nowhere, or has nothing to meet with.
bool fill(FramePart& part, const RigidPart& from, ShapeMemory& shapes, std::uint64_t frame) {
    if (from.tree == nullptr || from.tree->mesh().faceCount() == 0 || !sane(from.world)) return false;
    part.surface = &shapes.of(*from.tree, from.hull, frame);
    part.box = from.tree->mesh().bounds().transformed(from.world);
    return true;
}

bool saneMotion(const RigidBody& body) {
    return body.velocity.allFinite() && body.spin.allFinite() && body.anchor.allFinite();
}

/// What follows from where its parts are.
void fill(FrameBody& body, const Box& box, const VolumeMoments& moments, const Vec3d& gravity, double seconds) {
    body.size = box.size().norm();
    body.velocity = cut(body.given->velocity, kMostSpeed);
    body.spin = cut(body.given->spin, kMostTurnPerFrame / std::max(seconds, 1e-9));
    body.restitution = between(body.given->restitution, 0, 1, 0);
    body.friction = between(body.given->friction, 0, kMostFriction, 0);
    body.free = std::isfinite(body.given->mass) && body.given->mass > 0;
    body.moving = !body.free && (!body.velocity.isZero(0) || !body.spin.isZero(0));
    body.reach = RigidBodyStage::reach(*body.given, body.size, gravity, seconds);
    if (body.free) {
        body.mass =
            massProperties(moments, std::clamp(body.given->mass, kLeastMass, kMostMass), body.size, box.center());
    } else {
        body.mass.centre = body.given->anchor;
    }
}

}  // namespace

void FrameBodies::gather(std::span<const RigidBody> given, std::span<const RigidPart> givenParts, const Vec3d& gravity,
                         double seconds, ShapeMemory& shapes, std::uint64_t frame) {
    const std::vector<std::uint32_t> order = orderById(given, bodyRank), partOrder = orderById(givenParts, partRank);
    bodies.assign(given.size(), {});
    parts.assign(givenParts.size(), {});
    fetched_.clear();
    for (std::uint32_t r = 0; r < order.size(); ++r) {
        FrameBody& body = bodies[r];
        body.given = &given[order[r]];
        body.index = order[r];
        body.usable = (r == 0 || bodies[r - 1].given->id != body.given->id) && saneMotion(*body.given);
    }
    for (std::uint32_t r = 0; r < partOrder.size(); ++r) {
        FramePart& part = parts[r];
        const RigidPart& from = givenParts[partOrder[r]];
        part.given = &from;
        const bool twice = r > 0 && parts[r - 1].given->id == from.id;
        if (!twice && from.body < given.size() && fill(part, from, shapes, frame)) part.body = bodyRank[from.body];
    }
    for (FrameBody& body : bodies) {
        Box box;
        VolumeMoments moments;
        bool any = false;
        for (const std::uint32_t index : body.given->parts) {
            if (index >= givenParts.size() ||
                bodyRank[givenParts[index].body < given.size() ? givenParts[index].body : 0] != bodyRank[body.index])
                continue;
            const FramePart& part = parts[partRank[index]];
            // A body a part of which is nowhere is nowhere.
            if (part.body == kNoBody) {
                body.usable = false;
                break;
            }
            box.extend(part.box);
            moments += transformed(part.given->world, part.surface->moments);
            any = true;
        }
        body.usable = body.usable && any && !box.empty();
        if (body.usable) fill(body, box, moments, gravity, seconds);
    }
    for (FramePart& part : parts)
        if (part.body != kNoBody && !bodies[part.body].usable) part.body = kNoBody;
}

FrameBodies::Ranks FrameBodies::insert(std::vector<Fetched> some, const Vec3d& gravity, double seconds,
                                       ShapeMemory& shapes, std::uint64_t frame) {
    struct NewPart {
        FramePart part;
        std::uint32_t index = 0;
    };
    std::vector<FrameBody> newBodies;
    std::vector<NewPart> newParts;  // their bodies: places in newBodies, then ranks
    for (Fetched& one : some) {
        const Fetched& kept = fetched_.emplace_back(std::move(one));
        FrameBody body;
        body.given = &kept.body;
        body.index = static_cast<std::uint32_t>(bodyRank.size() + newBodies.size());
        body.usable = saneMotion(kept.body);
        Box box;
        VolumeMoments moments;
        const std::size_t first = newParts.size();
        for (const RigidPart& from : kept.parts) {
            NewPart& next = newParts.emplace_back();
            next.index = static_cast<std::uint32_t>(partRank.size() + newParts.size() - 1);
            next.part.given = &from;
            if (findPart(from.id) != kNoBody || !fill(next.part, from, shapes, frame)) {
                body.usable = false;
                continue;
            }
            box.extend(next.part.box);
            moments += transformed(from.world, next.part.surface->moments);
        }
        body.usable = body.usable && !kept.parts.empty() && !box.empty();
        if (body.usable) {
            fill(body, box, moments, gravity, seconds);
            for (std::size_t i = first; i < newParts.size(); ++i)
                newParts[i].part.body = static_cast<std::uint32_t>(newBodies.size());
        }
        newBodies.push_back(body);
    }
    // Merged by their ids; of each list the ranks before and after.
    const auto merge = [](auto& old, const auto& fresh, const auto& idOf, const auto& put,
                          std::vector<std::uint32_t>& now) {
        std::vector<std::uint32_t> order(fresh.size()), at(fresh.size());
        std::iota(order.begin(), order.end(), 0U);
        std::sort(order.begin(), order.end(),
                  [&](std::uint32_t a, std::uint32_t b) { return idOf(fresh[a]) < idOf(fresh[b]); });
        std::remove_reference_t<decltype(old)> merged;
        merged.reserve(old.size() + fresh.size());
        now.resize(old.size());
        std::size_t next = 0;
        for (std::size_t r = 0; r <= old.size(); ++r) {
            while (next < order.size() && (r == old.size() || idOf(fresh[order[next]]) < old[r].given->id)) {
                at[order[next]] = static_cast<std::uint32_t>(merged.size());
                merged.push_back(put(fresh[order[next++]]));
            }
            if (r == old.size()) break;
            now[r] = static_cast<std::uint32_t>(merged.size());
            merged.push_back(old[r]);
        }
        old = std::move(merged);
        return at;
    };
    Ranks ranks;
    const std::vector<std::uint32_t> bodyAt = merge(
        bodies, newBodies, [](const FrameBody& b) { return b.given->id; }, [](const FrameBody& b) { return b; },
        ranks.body);
    for (FramePart& part : parts)
        if (part.body != kNoBody) part.body = ranks.body[part.body];
    for (NewPart& next : newParts)
        if (next.part.body != kNoBody) next.part.body = bodyAt[next.part.body];
    const std::vector<std::uint32_t> partAt = merge(
        parts, newParts, [](const NewPart& p) { return p.part.given->id; }, [](const NewPart& p) { return p.part; },
        ranks.part);
    for (std::uint32_t& rank : bodyRank) rank = ranks.body[rank];
    for (std::uint32_t& rank : partRank) rank = ranks.part[rank];
    bodyRank.insert(bodyRank.end(), bodyAt.begin(), bodyAt.end());
    partRank.insert(partRank.end(), partAt.begin(), partAt.end());
    ranks.parts = parts.size();
    return ranks;
}

}  // namespace tessera::rigid
