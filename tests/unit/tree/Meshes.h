/// Meshes that are hard on a division, and what must hold for every tree.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "server/collision/tree/TreeStorage.h"

namespace tessera::trees {

struct Arrays {
    std::vector<double> positions;
    std::vector<std::uint32_t> indices;

    void triangle(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
        for (const Vec3d& p : {a, b, c}) {
            indices.push_back(static_cast<std::uint32_t>(positions.size() / 3));
            positions.insert(positions.end(), {p.x(), p.y(), p.z()});
        }
    }
    [[nodiscard]] TriangleMesh mesh() const { return *TriangleMesh::make(std::span<const double>(positions), indices); }
    [[nodiscard]] std::vector<Vec3d> vertices() const {
        std::vector<Vec3d> out;
        for (std::size_t i = 0; i < positions.size(); i += 3)
            out.emplace_back(positions[i], positions[i + 1], positions[i + 2]);
        return out;
    }
};

/// Small triangles in a cube of side 2 `reach` about `at`.
inline Arrays soup(std::size_t faces, std::uint64_t seed, double reach = 1, const Vec3d& at = Vec3d::Zero()) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> place(-1, 1);
    const auto point = [&] { return Vec3d(place(random), place(random), place(random)); };
    Arrays out;
    for (std::size_t f = 0; f < faces; ++f) {
        const Vec3d centre = point();
        const auto corner = [&] { return Vec3d(at + reach * (centre + 0.15 * point())); };
        const Vec3d a = corner(), b = corner();
        out.triangle(a, b, corner());
    }
    return out;
}

/// A height field over a square.
inline Arrays field(unsigned side, double height) {
    Arrays out;
    for (unsigned y = 0; y <= side; ++y)
        for (unsigned x = 0; x <= side; ++x)
            out.positions.insert(out.positions.end(), {double(x) / side, double(y) / side,
                                                       height * std::sin(7.0 * x / side) * std::cos(5.0 * y / side)});
    for (unsigned y = 0; y < side; ++y)
        for (unsigned x = 0; x < side; ++x) {
            const std::uint32_t i = y * (side + 1) + x;
            out.indices.insert(out.indices.end(), {i, i + 1, i + side + 2, i, i + side + 2, i + side + 1});
        }
    return out;
}

/// Every triangle `ratio` times the one before, about the same point.
inline Arrays series(std::size_t faces, double ratio) {
    Arrays out;
    double size = 1;
    for (std::size_t f = 0; f < faces; ++f, size *= ratio)
        out.triangle(size * Vec3d(1, 0, 0), size * Vec3d(1.5, 0, 0), size * Vec3d(1, 0.5, 0));
    return out;
}

struct NamedMesh {
    std::string name;
    Arrays arrays;
};

inline std::vector<NamedMesh> hardMeshes() {
    std::vector<NamedMesh> out;
    for (const std::size_t faces : {1, 2, 4, 5, 16, 17, 63, 64, 65, 66, 200, 1500})
        out.push_back({"soup of " + std::to_string(faces), soup(faces, faces)});
    out.push_back({"field", field(40, 0.2)});
    out.push_back({"flat", field(30, 0)});
    Arrays equal, needles, points, line;
    for (int i = 0; i < 1000; ++i) {
        const double t = 0.001 * i;
        equal.triangle({1, 2, 3}, {2, 2, 3}, {1, 3, 3});
        needles.triangle({t, 0, 0}, {t + 1e-9, 1, t}, {t + 2e-9, -1, t});
        points.triangle({t, t * t, 0}, {t, t * t, 0}, {t, t * t, 0});
        line.triangle({t, 0, 0}, {t + 0.0005, 0, 0}, {t + 0.001, 0, 0});
    }
    out.push_back({"one triangle a thousand times", equal});
    out.push_back({"needles", needles});
    out.push_back({"points", points});
    out.push_back({"a line", line});
    Arrays point;
    point.triangle({4, 5, 6}, {4, 5, 6}, {4, 5, 6});
    out.push_back({"one point", point});
    out.push_back({"halving", series(1000, 0.5)});
    out.push_back({"shrinking slowly", series(3000, 0.97)});
    out.push_back({"tiny", soup(300, 21, 1e-30)});
    out.push_back({"below float", soup(300, 22, 1e-200)});
    out.push_back({"huge", soup(300, 23, 1e30)});
    out.push_back({"far away", soup(300, 24, 1e-2, {1e7, -1e7, 3e6})});
    Arrays unused = soup(100, 25);
    unused.positions.insert(unused.positions.end(), {1e50, -1e50, 1e50});
    out.push_back({"a vertex of no triangle far away", unused});
    return out;
}

inline constexpr VolumeKind kKinds[] = {VolumeKind::kSphere, VolumeKind::kAabb,  VolumeKind::kObb,  VolumeKind::kDop6,
                                        VolumeKind::kDop14,  VolumeKind::kDop18, VolumeKind::kDop26};
inline constexpr SplitRule kRules[] = {SplitRule::kSurfaceArea, SplitRule::kLongestSideMedian,
                                       SplitRule::kLongestSideMean, SplitRule::kMinimumVolume};

/// Calls use(slot, first leaf, end leaf) for every slot that is used. Leaves of a subtree are consecutive, which is
/// checked.
template <typename Use>
std::pair<std::uint32_t, std::uint32_t> forSlots(const TreeStorage& tree, std::uint32_t node, const Use& use) {
    std::uint32_t first = ~0u, end = 0;
    for (std::uint32_t slot = node * kernel::kWidth; slot < (node + 1) * kernel::kWidth; ++slot) {
        const kernel::ChildRef ref = tree.children[slot];
        if (ref == kernel::kNoChild) continue;
        std::uint32_t begin, stop;
        if ((ref & kernel::kLeafBit) != 0) {
            begin = (ref & ~kernel::kLeafBit) >> 2;
            stop = begin + 1;
        } else {
            EXPECT_GT(ref, node) << "children come after their node";
            if (ref <= node) return {0, 0};
            std::tie(begin, stop) = forSlots(tree, ref, use);
        }
        use(slot, begin, stop);
        if (end != 0) {
            EXPECT_EQ(end, begin) << "leaves in the order of the slots";
        }
        first = std::min(first, begin);
        end = stop;
    }
    return {first, end};
}

}  // namespace tessera::trees
