/// What a motion may not do, by looking: samples a way densely and asks the predicate about every pair of faces. Knows
/// nothing of how times of impact are found.
#pragma once

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/cores/Geometry.h"
#include "common/math/Box.h"
#include "common/scene/Action.h"
#include "common/scene/Aspect.h"
#include "server/collision/mesh/TriangleMesh.h"
#include "server/collision/mesh/TriangleTriangle.h"

namespace tessera {

/// How far two triangles reach into each other along the direction in which they do so least: of their normals and of
/// what is square to an edge of each.
inline double leastOverlap(const Triangle& a, const Triangle& b) {
    double least = 1e300;
    const auto offer = [&](const Vec3d& direction) {
        const double length = direction.norm();
        if (!(length > 1e-12)) return;
        double highA = -1e300, lowA = 1e300, highB = -1e300, lowB = 1e300;
        for (std::size_t i = 0; i < 3; ++i) {
            // From one of the corners, so that large coordinates do not matter.
            const double x = direction.dot(a[i] - a[0]) / length, y = direction.dot(b[i] - a[0]) / length;
            highA = std::max(highA, x);
            lowA = std::min(lowA, x);
            highB = std::max(highB, y);
            lowB = std::min(lowB, y);
        }
        least = std::min({least, highA - lowB, highB - lowA});
    };
    const auto edge = [](const Triangle& t, std::size_t i) -> Vec3d { return (t[(i + 1) % 3] - t[i]).normalized(); };
    offer(edge(a, 0).cross(edge(a, 1)));
    offer(edge(b, 0).cross(edge(b, 1)));
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j) {
            const Vec3d across = edge(a, i).cross(edge(b, j));
            if (across.norm() > 1e-6) offer(across);
        }
    return std::max(0.0, least);
}

class FaceOracle {
public:
    struct Surface {
        ObjectId shape;
        TriangleMesh mesh;
    };
    /// Of every pair of faces that meet: how deep.
    using Meetings = std::map<std::array<std::uint32_t, 4>, double>;

    FaceOracle(const Aspect& aspect, const std::vector<ObjectId>& movers, const std::vector<ObjectId>& others)
        : aspect_(aspect) {
        for (const ObjectId id : movers) movers_.push_back({id, meshOf(id)});
        for (const ObjectId id : others) others_.push_back({id, meshOf(id)});
    }

    /// As the scene is now.
    [[nodiscard]] Meetings meetings() const {
        std::vector<Affine3d> worldsA, worldsB;
        for (const Surface& surface : movers_) worldsA.push_back(worldTransform(aspect_, surface.shape));
        for (const Surface& surface : others_) worldsB.push_back(worldTransform(aspect_, surface.shape));
        return meetings(worldsA, worldsB);
    }
    [[nodiscard]] Meetings meetings(const std::vector<Affine3d>& worldsA, const std::vector<Affine3d>& worldsB) const {
        Meetings out;
        for (std::uint32_t i = 0; i < movers_.size(); ++i)
            for (std::uint32_t j = 0; j < others_.size(); ++j) {
                if (movers_[i].shape == others_[j].shape) continue;
                const Affine3d &worldA = worldsA[i], &worldB = worldsB[j];
                const Affine3d b_T_a = worldB.inverse() * worldA;
                std::vector<Triangle> a;
                Box all;
                for (std::uint32_t f = 0; f < movers_[i].mesh.faceCount(); ++f) {
                    a.push_back(transformed(b_T_a, movers_[i].mesh.triangle(f)));
                    for (const Vec3d& p : a.back()) all.extend(p);
                }
                for (std::uint32_t g = 0; g < others_[j].mesh.faceCount(); ++g) {
                    const Triangle b = others_[j].mesh.triangle(g);
                    const Box box = boxOf(b);
                    if (!box.overlaps(all)) continue;
                    for (std::uint32_t f = 0; f < a.size(); ++f)
                        if (boxOf(a[f]).overlaps(box) && trianglesIntersect(b, a[f]))
                            out[{i, j, f, g}] = leastOverlap(transformed(worldB, b), transformed(worldB, a[f]));
                }
            }
        return out;
    }

    /// What is wrong with the scene as it is now, beside how it was at the start.
    [[nodiscard]] static std::optional<std::string> wrong(const Meetings& start, const Meetings& now, double tolerance,
                                                          double rounding) {
        for (const auto& [faces, depth] : now) {
            const auto was = start.find(faces);
            const bool stuck = was != start.end() && was->second > tolerance;
            if (stuck || depth <= tolerance + rounding) continue;
            return "faces " + std::to_string(faces[2]) + " of " + std::to_string(faces[0]) + " and " +
                   std::to_string(faces[3]) + " of " + std::to_string(faces[1]) + " meet " + std::to_string(depth) +
                   " deep" + (was == start.end() ? ", new" : "");
        }
        return std::nullopt;
    }

private:
    static Box boxOf(const Triangle& t) {
        Box box;
        for (const Vec3d& p : t) box.extend(p);
        return box;
    }

    [[nodiscard]] TriangleMesh meshOf(ObjectId shape) const {
        const Geometry& g = *aspect_.coreOf<Geometry>(*aspect_.get<Node>(shape));
        return *TriangleMesh::make(g.positions.as<float>(), g.indices.as<std::uint32_t>());
    }

    const Aspect& aspect_;
    std::vector<Surface> movers_, others_;
};

}  // namespace tessera
