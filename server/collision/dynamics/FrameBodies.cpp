#include "server/collision/dynamics/FrameBodies.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace tessera::dynamics {

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
    return found != parts.end() && found->given->id == id ? static_cast<std::uint32_t>(found - parts.begin()) : kNobody;
}

std::uint32_t FrameBodies::findBody(std::uint64_t id) const {
    const auto found = std::lower_bound(bodies.begin(), bodies.end(), id,
                                        [](const FrameBody& b, std::uint64_t x) { return b.given->id < x; });
    return found != bodies.end() && found->given->id == id ? static_cast<std::uint32_t>(found - bodies.begin())
                                                           : kNobody;
}

void FrameBodies::gather(std::span<const RigidBody> given, std::span<const RigidPart> givenParts, const Vec3d& gravity,
                         double seconds, ShapeMemory& shapes, std::uint64_t frame) {
    const std::vector<std::uint32_t> order = orderById(given, bodyRank), partOrder = orderById(givenParts, partRank);
    bodies.assign(given.size(), {});
    parts.assign(givenParts.size(), {});
    for (std::uint32_t r = 0; r < order.size(); ++r) {
        FrameBody& body = bodies[r];
        body.given = &given[order[r]];
        body.index = order[r];
        body.usable = (r == 0 || bodies[r - 1].given->id != body.given->id) && body.given->velocity.allFinite() &&
                      body.given->spin.allFinite() && body.given->anchor.allFinite();
    }
    for (std::uint32_t r = 0; r < partOrder.size(); ++r) {
        FramePart& part = parts[r];
        const RigidPart& from = givenParts[partOrder[r]];
        part.given = &from;
        const bool twice = r > 0 && parts[r - 1].given->id == from.id;
        if (twice || from.body >= given.size() || from.tree == nullptr || from.tree->mesh().faceCount() == 0 ||
            !sane(from.world))
            continue;
        part.surface = &shapes.of(*from.tree, from.hull, frame);
        part.box = from.tree->mesh().bounds().transformed(from.world);
        part.body = bodyRank[from.body];
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
            if (part.body == kNobody) {
                body.usable = false;
                break;
            }
            box.extend(part.box);
            moments += transformed(part.given->world, part.surface->moments);
            any = true;
        }
        body.usable = body.usable && any && !box.empty();
        if (!body.usable) continue;
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
    for (FramePart& part : parts)
        if (part.body != kNobody && !bodies[part.body].usable) part.body = kNobody;
}

}  // namespace tessera::dynamics
