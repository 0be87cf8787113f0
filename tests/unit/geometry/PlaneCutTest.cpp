/// Surfaces cut at planes: beside each triangle cut by itself, and closed but along the planes.
#include "common/geometry/PlaneCut.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <random>
#include <string>

#include "common/geometry/IsoSurface.h"
#include "tests/support/words/Words.h"

namespace tessera {
namespace {

using Exact = Eigen::Matrix<long double, 3, 1>;

std::vector<unsigned> cutSeeds(unsigned count) {
    if (const char* one = std::getenv("TESSERA_SEED")) return {static_cast<unsigned>(std::atoi(one))};
    std::vector<unsigned> seeds(count);
    for (unsigned i = 0; i < count; ++i) seeds[i] = i + 1;
    return seeds;
}
std::string cutAgain(unsigned seed) {
    return "TESSERA_SEED=" + std::to_string(seed) + " build/bin/unit_geometry --gtest_filter=PlaneCut.*";
}

/// A random field's surface and planes: anywhere, along layers of voxels, through corners of the surface, through one
/// another, some twice.
struct CutCase {
    MeshArrays whole;
    std::vector<Vec4d> planes;
    Box box;

    explicit CutCase(unsigned seed) : random_(seed) {
        std::vector<std::uint8_t> numbers;
        const std::array<std::size_t, 3> size = {2 + below(5), 2 + below(5), 2 + below(5)};
        // Few values: many corners lie in voxels, and planes go through them.
        const bool rough = below(2) == 0;
        for (std::size_t i = 0; i < size[0] * size[1] * size[2]; ++i)
            numbers.push_back(static_cast<std::uint8_t>(rough ? 50 * below(5) : below(256)));
        const VoxelGrid grid{
            .format = VoxelFormat::kUint8,
            .size = size,
            .origin = below(2) == 0 ? Vec3d(Vec3d::Zero()) : Vec3d(any(-3, 3), any(-3, 3), any(-3, 3)),
            .spacing = below(2) == 0 ? Vec3d(Vec3d::Ones()) : Vec3d(any(0.1, 2), any(0.1, 2), any(0.1, 2)),
            .voxels = std::as_bytes(std::span<const std::uint8_t>(numbers))};
        whole = isoSurface(grid, rough ? 100 : 127.5, 1'000'000).value().toArrays();
        box = boundsOf(whole.positions.as<float>());
        if (box.empty()) return;
        for (std::size_t i = 0, count = 1 + below(below(4) == 0 ? 12 : 3); i < count; ++i) {
            const Vec3d normal = below(3) == 0 ? Vec3d(Vec3d::Unit(static_cast<int>(below(3))))
                                               : Vec3d(any(-1, 1), any(-1, 1), any(-1, 1));
            Vec3d through = box.center() + 0.5 * box.size().cwiseProduct(Vec3d(any(-1, 1), any(-1, 1), any(-1, 1)));
            if (below(3) == 0) through = corner(below(whole.positions.sizeBytes() / 12));
            if (below(4) == 0) through = box.center();
            const Vec3d n = (below(2) == 0 ? 1 : -1) * std::pow(10, any(-6, 6)) * normal;
            planes.emplace_back(n.x(), n.y(), n.z(), n.dot(through));
            if (below(5) == 0) planes.push_back(3.1 * planes.back());
        }
    }
    std::size_t below(std::size_t n) { return random_() % n; }
    double any(double from, double to) { return std::uniform_real_distribution<double>(from, to)(random_); }
    Vec3d corner(std::size_t v) const { return at(whole.positions.as<float>(), v); }
    static Vec3d at(std::span<const float> numbers, std::size_t v) {
        return {numbers[3 * v], numbers[3 * v + 1], numbers[3 * v + 2]};
    }
    /// What rounding to floats may move.
    double rounding() const { return 3e-7 * (box.lower.cwiseAbs().maxCoeff() + box.size().maxCoeff()); }
    /// How far beyond the plane that it is farthest beyond; below 0 inside.
    double beyond(const Vec3d& p) const {
        double most = -1e300;
        for (const Vec4d& plane : planes)
            most = std::max(most, (plane.head<3>().dot(p) - plane.w()) / plane.head<3>().norm());
        return most;
    }

private:
    std::mt19937 random_;
};

using ExactPolygon = std::vector<Exact>;

long double cutAreaOf(const ExactPolygon& polygon) {
    Exact sum = Exact::Zero();
    for (std::size_t i = 2; i < polygon.size(); ++i)
        sum += (polygon[i - 1] - polygon[0]).cross(polygon[i] - polygon[0]);
    return sum.norm() / 2;
}

/// One triangle by itself, in long double.
ExactPolygon leftOf(ExactPolygon polygon, const std::vector<Vec4d>& planes) {
    for (const Vec4d& plane : planes) {
        const Exact n = plane.head<3>().cast<long double>();
        const auto off = [&](const Exact& p) { return n.dot(p) - static_cast<long double>(plane.w()); };
        ExactPolygon left;
        for (std::size_t i = 0; i < polygon.size(); ++i) {
            const Exact &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
            const long double da = off(a), db = off(b);
            if (da <= 0) left.push_back(a);
            if ((da < 0 && db > 0) || (da > 0 && db < 0)) left.push_back(a + da / (da - db) * (b - a));
        }
        polygon = left;
    }
    return polygon;
}

double distanceToFace(const std::array<Vec3d, 3>& t, const Vec3d& p) {
    const Vec3d n = (t[1] - t[0]).cross(t[2] - t[0]);
    bool over = n.squaredNorm() > 0;
    double least = 1e300;
    for (std::size_t k = 0; k < 3; ++k) {
        const Vec3d &a = t[k], edge = t[(k + 1) % 3] - a;
        over = over && n.cross(edge).dot(p - a) >= 0;
        const double along = edge.squaredNorm() > 0 ? std::clamp(edge.dot(p - a) / edge.squaredNorm(), 0.0, 1.0) : 0;
        least = std::min(least, (a + along * edge - p).norm());
    }
    return over ? std::min(least, std::abs(n.normalized().dot(p - t[0]))) : least;
}

std::vector<std::array<Vec3d, 3>> cutFacesOf(std::span<const float> positions, std::span<const std::uint32_t> indices) {
    std::vector<std::array<Vec3d, 3>> triangles;
    for (std::size_t i = 0; i + 2 < indices.size(); i += 3)
        triangles.push_back({CutCase::at(positions, indices[i]), CutCase::at(positions, indices[i + 1]),
                             CutCase::at(positions, indices[i + 2])});
    return triangles;
}

TEST(PlaneCut, WhatIsInsideStaysAndNothingElseDoes) {
    std::size_t cutAway = 0, kept = 0;
    for (const unsigned seed : cutSeeds(120)) {
        CutCase c(seed);
        if (c.planes.empty()) continue;
        const auto left = cutAtPlanes(c.whole, c.planes, 1'000'000);
        ASSERT_TRUE(left) << left.error().message;
        ASSERT_TRUE(left->empty() || checkMesh(left->toArrays())) << cutAgain(seed);
        ASSERT_EQ(left->normals.size(), left->positions.size());
        for (std::size_t v = 0; v < left->positions.size() / 3; ++v)
            ASSERT_LE(c.beyond(CutCase::at(left->positions, v)), c.rounding()) << cutAgain(seed);
        const auto before = cutFacesOf(c.whole.positions.as<float>(), c.whole.indices.as<std::uint32_t>()),
                   after = cutFacesOf(left->positions, left->indices);
        long double wanted = 0, is = 0, all = 0, inPlanes = 0;
        for (const auto& t : before) {
            const ExactPolygon whole{t[0].cast<long double>(), t[1].cast<long double>(), t[2].cast<long double>()};
            all += cutAreaOf(whole);
            wanted += cutAreaOf(leftOf(whole, c.planes));
            // Which side of a plane is the side of what lies in it only rounding says.
            const auto lies = [&](const Vec4d& plane) {
                return std::ranges::all_of(t, [&](const Vec3d& p) {
                    return std::abs(plane.head<3>().dot(p) - plane.w()) <= c.rounding() * plane.head<3>().norm();
                });
            };
            if (std::ranges::any_of(c.planes, lies)) inPlanes += cutAreaOf(whole);
        }
        for (const auto& t : after)
            is += cutAreaOf({t[0].cast<long double>(), t[1].cast<long double>(), t[2].cast<long double>()});
        // Each triangle's corners are rounded.
        const long double off =
            3 * c.rounding() * c.box.size().norm() * static_cast<long double>(before.size() + after.size());
        ASSERT_LE(std::abs(is - wanted), off + inPlanes) << "of " << static_cast<double>(all) << ", " << cutAgain(seed);
        for (std::size_t i = 0; i < before.size(); i += 1 + before.size() / 60) {
            const double u = c.any(0, 1), v = c.any(0, 1 - u);
            const Vec3d p = before[i][0] + u * (before[i][1] - before[i][0]) + v * (before[i][2] - before[i][0]);
            const double beyond = c.beyond(p);
            if (std::abs(beyond) < 10 * c.rounding()) continue;
            double nearest = 1e300;
            for (const auto& t : after) nearest = std::min(nearest, distanceToFace(t, p));
            ++(beyond < 0 ? kept : cutAway);
            if (beyond < 0) {
                ASSERT_LE(nearest, 2 * c.rounding()) << "a piece is missing, " << cutAgain(seed);
            } else {
                ASSERT_GE(nearest, 0.5 * beyond) << "a piece stands out, " << cutAgain(seed);
            }
        }
    }
    if (!std::getenv("TESSERA_SEED")) {
        EXPECT_GT(kept, 500u);
        EXPECT_GT(cutAway, 500u);
    }
}

// Corners told by their places: faces of the box have corners of their own.
TEST(PlaneCut, OpenAlongThePlanesAlone) {
    std::size_t open = 0, closed = 0;
    for (const unsigned seed : cutSeeds(300)) {
        const CutCase c(seed);
        if (c.planes.empty()) continue;
        const MeshData left = cutAtPlanes(c.whole, c.planes, 1'000'000).value();
        using Key = std::array<float, 3>;
        std::map<std::pair<Key, Key>, int> balance;
        for (std::size_t i = 0; i < left.indices.size(); ++i) {
            const auto key = [&](std::size_t at) {
                const float* p = &left.positions[3 * std::size_t{left.indices[at]}];
                return Key{p[0], p[1], p[2]};
            };
            const Key a = key(i), b = key(i % 3 == 2 ? i - 2 : i + 1);
            if (a == b) continue;
            ++balance[{a, b}];
            --balance[{b, a}];
        }
        for (const auto& [edge, count] : balance) {
            closed += count == 0;
            open += count != 0;
            if (count == 0) continue;
            const Vec3d a(edge.first[0], edge.first[1], edge.first[2]),
                b(edge.second[0], edge.second[1], edge.second[2]);
            const bool along = std::ranges::any_of(c.planes, [&](const Vec4d& plane) {
                const double size = plane.head<3>().norm();
                return std::abs(plane.head<3>().dot(a) - plane.w()) <= c.rounding() * size &&
                       std::abs(plane.head<3>().dot(b) - plane.w()) <= c.rounding() * size;
            });
            ASSERT_TRUE(along) << "open between " << a.transpose() << " and " << b.transpose() << ", "
                               << cutAgain(seed);
        }
    }
    if (!std::getenv("TESSERA_SEED")) {
        EXPECT_GT(open, 3000u);
        EXPECT_GT(closed, 10'000u);
    }
}

TEST(PlaneCut, NormalsGoOnAlongTheCut) {
    const MeshArrays ball = makeSphere(2, 48).toArrays();
    const std::array<Vec4d, 2> planes = {Vec4d(0.3, 0.9, -0.2, 0.4), Vec4d(-1, 0.1, 0, 0.7)};
    const MeshData left = cutAtPlanes(ball, planes, 100'000).value();
    ASSERT_GT(left.positions.size(), 300u);
    for (std::size_t v = 0; v < left.positions.size() / 3; ++v) {
        const Vec3d p = CutCase::at(left.positions, v), n = CutCase::at(left.normals, v);
        ASSERT_NEAR(n.norm(), 1, 1e-6);
        ASSERT_GT(n.dot(p.normalized()), 0.999);
    }
    // What a plane does not reach is as it was.
    const std::array<Vec4d, 1> far = {Vec4d(0, 1, 0, 3)};
    const MeshData same = cutAtPlanes(ball, far, 100'000).value();
    ASSERT_EQ(same.indices.size(), ball.indices.as<std::uint32_t>().size());
    for (std::size_t i = 0; i < same.indices.size(); ++i)
        ASSERT_EQ(CutCase::at(same.positions, same.indices[i]),
                  CutCase::at(ball.positions.as<float>(), ball.indices.as<std::uint32_t>()[i]));
    const std::array<Vec4d, 1> all = {Vec4d(0, 1, 0, -3)};
    EXPECT_TRUE(cutAtPlanes(ball, all, 100'000).value().empty());
}

TEST(PlaneCut, TooMuchIsRefusedInWords) {
    const MeshArrays ball = makeSphere(2, 48).toArrays();
    const std::array<Vec4d, 1> far = {Vec4d(0, 1, 0, 3)};
    const auto few = cutAtPlanes(ball, far, 100);
    ASSERT_FALSE(few);
    EXPECT_WORDS(few.error().message);
    const std::vector<Vec4d> many(65, far[0]);
    ASSERT_FALSE(cutAtPlanes(ball, many, 100'000));
}

}  // namespace
}  // namespace tessera
