/// Bodies and maps for the query tests.
#pragma once

#include <random>
#include <string>
#include <vector>

#include "common/math/Compose.h"
#include "server/collision/mesh/InstructionSet.h"
#include "server/collision/tree/TriangleTree.h"
#include "tests/unit/collision/BruteForce.h"
#include "tests/unit/collision/Shapes.h"

namespace tessera::bodies {

using Random = std::mt19937_64;

inline double between(Random& random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}
inline Vec3d inCube(Random& random, double half) {
    return {between(random, -half, half), between(random, -half, half), between(random, -half, half)};
}
inline Quatd anyRotation(Random& random) {
    std::normal_distribution<double> normal;
    return Quatd(normal(random), normal(random), normal(random), normal(random)).normalized();
}

inline TriangleMesh meshOf(const shapes::Soup& soup) {
    return *TriangleMesh::make(std::span<const float>(soup.positions), soup.indices);
}

/// A sphere with bumps, closed.
inline TriangleMesh bumpy(Random& random, std::uint32_t rings, std::uint32_t segments) {
    shapes::Soup soup = shapes::sphere(1, rings, segments);
    for (std::size_t i = 0; i < soup.positions.size(); i += 3) {
        const auto factor = static_cast<float>(between(random, 0.8, 1.2));
        for (std::size_t k = 0; k < 3; ++k) soup.positions[i + k] *= factor;
    }
    return meshOf(soup);
}

/// Loose triangles of every shape about a shell: needles, points and duplicates among them.
inline TriangleMesh strewn(Random& random, int faces, double size) {
    shapes::Soup soup;
    for (int i = 0; i < faces; ++i) {
        const Vec3d at = inCube(random, 1).normalized(), u = inCube(random, size);
        const double kind = between(random, 0, 1);
        const Vec3d v = kind < 0.1 ? Vec3d(0.5 * u) : kind < 0.15 ? Vec3d(Vec3d::Zero()) : inCube(random, size);
        soup.vertex(at);
        soup.vertex(at + (kind < 0.05 ? Vec3d(Vec3d::Zero()) : u));
        soup.vertex(at + v);
        const auto n = static_cast<std::uint32_t>(soup.positions.size() / 3);
        soup.indices.insert(soup.indices.end(), {n - 3, n - 2, n - 1});
        if (kind > 0.95) soup.indices.insert(soup.indices.end(), {n - 3, n - 2, n - 1});
    }
    return meshOf(soup);
}

struct NamedMap {
    const char* name;
    Affine3d map;
};
/// One of every kind that a_T_b may be.
inline std::vector<NamedMap> everyKindOfMap(Random& random) {
    const auto posed = [&](const Vec3d& scale) {
        return composeTransform(inCube(random, 0.8), anyRotation(random), scale);
    };
    std::vector<NamedMap> maps{{"identity", Affine3d::Identity()},
                               {"rigid", posed({1, 1, 1})},
                               {"far away", composeTransform(Vec3d(40, 3, -7), anyRotation(random), Vec3d::Ones())},
                               {"uniform scale", posed({0.3, 0.3, 0.3})},
                               {"non-uniform scale", posed({0.5, 1.5, 1.1})},
                               {"mirrored", posed({-1, 1, 1})},
                               {"mirrored and stretched", posed({-1.5, 0.7, 1})},
                               {"flattened", posed({1, 0, 1})},
                               {"a point", posed({0, 0, 0})},
                               {"tiny", posed({1e-9, 1e-9, 1e-9})},
                               {"huge", posed({1e5, 1e5, 1e5})},
                               {"beyond float", posed({1e20, 1e20, 1e20})}};
    Affine3d shear = Affine3d::Identity();
    for (int i = 0; i < 3; ++i) shear.linear().col(i) = inCube(random, 1.2);
    maps.push_back({"sheared", shear});
    return maps;
}

inline constexpr VolumeKind kVolumes[] = {VolumeKind::kSphere, VolumeKind::kAabb,  VolumeKind::kObb,  VolumeKind::kDop6,
                                          VolumeKind::kDop14,  VolumeKind::kDop18, VolumeKind::kDop26};
inline constexpr SplitRule kSplits[] = {SplitRule::kSurfaceArea, SplitRule::kLongestSideMedian,
                                        SplitRule::kLongestSideMean, SplitRule::kMinimumVolume};
inline const char* const kVolumeNames[] = {"sphere", "aabb", "obb", "6-dop", "14-dop", "18-dop", "26-dop"};

inline std::vector<InstructionSet> instructionSets() {
    std::vector<InstructionSet> sets;
    for (const InstructionSet set : {InstructionSet::kSse41, InstructionSet::kAvx2, InstructionSet::kAvx512})
        if (set <= instructionSet()) sets.push_back(set);
    return sets;
}

/// `side` by `side` vertices, `step` apart along x and z, as high or low as `height` by chance.
inline TriangleMesh roughGround(Random& random, std::uint32_t side, double step, double height) {
    shapes::Soup soup;
    for (std::uint32_t z = 0; z < side; ++z)
        for (std::uint32_t x = 0; x < side; ++x)
            soup.vertex({step * x - 2, between(random, -height, height), step * z - 2});
    for (std::uint32_t z = 0; z + 1 < side; ++z)
        for (std::uint32_t x = 0; x + 1 < side; ++x) {
            const std::uint32_t i = side * z + x;
            soup.indices.insert(soup.indices.end(), {i, i + side, i + 1, i + 1, i + side, i + side + 1});
        }
    return meshOf(soup);
}

}  // namespace tessera::bodies
