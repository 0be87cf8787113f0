/// A small world for the tests of free bodies: hulls and meshes, stepped as the frame loop does it.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include "common/base/Workers.h"
#include "common/math/Compose.h"
#include "server/collision/rigid_bodies/RigidBodyStage.h"

namespace tessera::rigidbodytest {

inline constexpr double kFrame = 1.0 / 60;
inline const Vec3d kGravity{0, -9.81, 0};

/// A surface, solid or not.
struct Shape {
    std::unique_ptr<TriangleTree> tree;
    std::unique_ptr<ConvexHull> hull;
};

inline TriangleMesh meshOf(const std::vector<Vec3d>& points, const std::vector<std::uint32_t>& indices) {
    std::vector<double> xyz;
    for (const Vec3d& p : points) xyz.insert(xyz.end(), {p.x(), p.y(), p.z()});
    return *TriangleMesh::make(std::span<const double>(xyz), indices);
}

inline Shape hullShape(const std::vector<Vec3d>& points) {
    Shape out;
    out.hull = std::make_unique<ConvexHull>(*ConvexHull::make(points));
    std::vector<std::uint32_t> indices;
    for (const ConvexHull::Face& f : out.hull->faces()) indices.insert(indices.end(), f.begin(), f.end());
    out.tree =
        std::make_unique<TriangleTree>(meshOf({out.hull->vertices().begin(), out.hull->vertices().end()}, indices));
    return out;
}

inline Shape meshShape(const std::vector<Vec3d>& points, const std::vector<std::uint32_t>& indices,
                       VolumeKind volume = VolumeKind::kObb) {
    Shape out;
    TreeOptions options;
    options.volume = volume;
    out.tree = std::make_unique<TriangleTree>(meshOf(points, indices), options);
    return out;
}

inline std::vector<Vec3d> boxPoints(const Vec3d& size) {
    std::vector<Vec3d> out;
    for (int i = 0; i < 8; ++i)
        out.emplace_back((i & 1 ? 0.5 : -0.5) * size.x(), (i & 2 ? 0.5 : -0.5) * size.y(),
                         (i & 4 ? 0.5 : -0.5) * size.z());
    return out;
}

/// Nearly even points on a sphere.
inline std::vector<Vec3d> spherePoints(double radius, int count) {
    std::vector<Vec3d> out;
    const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
    for (int i = 0; i < count; ++i) {
        const double z = 1 - (2.0 * i + 1) / count, r = std::sqrt(1 - z * z);
        out.push_back(radius * Vec3d(r * std::cos(golden * i), r * std::sin(golden * i), z));
    }
    return out;
}

/// A square grid of triangles in the plane y = height(x, z), from -half to half, n cells a side.
template <typename Height>
Shape terrain(double half, int n, const Height& height, VolumeKind volume = VolumeKind::kObb) {
    std::vector<Vec3d> points;
    std::vector<std::uint32_t> indices;
    for (int i = 0; i <= n; ++i)
        for (int j = 0; j <= n; ++j) {
            const double x = half * (2.0 * i / n - 1), z = half * (2.0 * j / n - 1);
            points.emplace_back(x, height(x, z), z);
        }
    const auto at = [&](int i, int j) { return static_cast<std::uint32_t>(i * (n + 1) + j); };
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
            indices.insert(indices.end(), {at(i, j), at(i, j + 1), at(i + 1, j + 1)});
            indices.insert(indices.end(), {at(i, j), at(i + 1, j + 1), at(i + 1, j)});
        }
    return meshShape(points, indices, volume);
}

/// Two triangles per side of a box, closed, outwards; not a hull.
inline Shape boxMesh(const Vec3d& size, VolumeKind volume = VolumeKind::kObb) {
    Shape hull = hullShape(boxPoints(size));
    hull.hull.reset();
    hull.tree = std::make_unique<TriangleTree>(hull.tree->mesh(), TreeOptions{.volume = volume});
    return hull;
}

struct World {
    std::vector<RigidBody> bodies;
    std::vector<RigidPart> parts;
    std::vector<RigidEncounter> encounters;
    RigidOptions options;
    std::unique_ptr<RigidBodyStage> stage = std::make_unique<RigidBodyStage>();
    Vec3d gravity = kGravity;
    ContactLaw law = ContactLaw::kBounce;
    bool leaveOutSleepers = true;
    RigidFrame last;
    QueryWork work;

    explicit World(RigidOptions o = {}, Workers* workers = nullptr)
        : options(o), stage(std::make_unique<RigidBodyStage>(o, workers)) {}

    /// Mass 0: fixed.
    std::uint32_t add(const Shape& shape, const Affine3d& world, double mass) {
        const auto index = static_cast<std::uint32_t>(bodies.size());
        RigidBody body;
        body.id = 100 + index;
        body.mass = mass;
        body.parts = {static_cast<std::uint32_t>(parts.size())};
        RigidPart part;
        part.id = 10'000'000 + parts.size();
        part.body = index;
        part.tree = shape.tree.get();
        part.hull = shape.hull.get();
        part.world = world;
        bodies.push_back(body);
        parts.push_back(part);
        return index;
    }
    std::uint32_t add(const Shape& shape, const Vec3d& at, double mass, const Quatd& turned = Quatd::Identity()) {
        return add(shape, composeTransform(at, turned, Vec3d::Ones()), mass);
    }

    [[nodiscard]] Affine3d& pose(std::uint32_t body) { return parts[bodies[body].parts.front()].world; }
    [[nodiscard]] Vec3d at(std::uint32_t body) const { return parts[bodies[body].parts.front()].world.translation(); }
    [[nodiscard]] Box boxOf(std::uint32_t body) const {
        Box box;
        for (const std::uint32_t p : bodies[body].parts)
            box.extend(parts[p].tree->mesh().bounds().transformed(parts[p].world));
        return box;
    }

    /// Whose boxes, grown by their reaches, meet: a sweep along x.
    void findEncounters(double seconds) {
        struct Item {
            Box box;
            std::uint32_t part;
        };
        std::vector<Item> items;
        for (std::uint32_t p = 0; p < parts.size(); ++p) {
            const RigidBody& body = bodies[parts[p].body];
            Box box = parts[p].tree->mesh().bounds().transformed(parts[p].world);
            if (!box.lower.allFinite() || !box.upper.allFinite()) continue;
            const double reach = RigidBodyStage::reach(body, boxOf(parts[p].body).size().norm(), gravity, seconds);
            box.lower.array() -= reach;
            box.upper.array() += reach;
            items.push_back({box, p});
        }
        std::sort(items.begin(), items.end(), [](const Item& a, const Item& b) {
            return std::pair(a.box.lower.x(), a.part) < std::pair(b.box.lower.x(), b.part);
        });
        encounters.clear();
        const auto rests = [&](const RigidBody& b) {
            return b.mass > 0 ? leaveOutSleepers && stage->asleep(b.id) && !b.disturbed
                              : b.velocity.isZero(0) && b.spin.isZero(0);
        };
        for (std::size_t i = 0; i < items.size(); ++i)
            for (std::size_t j = i + 1; j < items.size() && items[j].box.lower.x() <= items[i].box.upper.x(); ++j) {
                const RigidBody &a = bodies[parts[items[i].part].body], &b = bodies[parts[items[j].part].body];
                if (&a == &b || (a.mass == 0 && b.mass == 0) || (rests(a) && rests(b)) ||
                    !items[i].box.overlaps(items[j].box))
                    continue;
                encounters.push_back({items[i].part, items[j].part, law});
            }
    }

    /// Takes over what the stage says; bodies without mass go on as they are told.
    void apply(double seconds) {
        for (std::size_t i = 0; i < bodies.size(); ++i) {
            RigidBody& body = bodies[i];
            body.disturbed = false;
            if (body.mass > 0) {
                const RigidMotion& motion = last.motions[i];
                body.velocity = motion.velocity;
                body.spin = motion.spin;
                for (const std::uint32_t p : body.parts) parts[p].world = motion.world_T_before * parts[p].world;
            } else if (!body.velocity.isZero(0) || !body.spin.isZero(0)) {
                Isometry3d step = Isometry3d::Identity();
                const double angle = body.spin.norm() * seconds;
                if (angle > 0) step.linear() = Eigen::AngleAxisd(angle, body.spin.normalized()).toRotationMatrix();
                step.translation() = body.anchor + seconds * body.velocity - step.linear() * body.anchor;
                for (const std::uint32_t p : body.parts) parts[p].world = step * parts[p].world;
                body.anchor += seconds * body.velocity;
            }
        }
    }

    void step(double seconds = kFrame) {
        findEncounters(seconds);
        last = stage->advance(bodies, parts, encounters, gravity, seconds, work);
        apply(seconds);
    }
    void run(int frames) {
        for (int i = 0; i < frames; ++i) step();
    }
};

}  // namespace tessera::rigidbodytest
