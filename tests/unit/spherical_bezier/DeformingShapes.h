/// Shapes and deformations from a seed: of each kind that a bound by radius finds hard, one.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "server/collision/mesh/QueryWork.h"
#include "server/collision/mesh/TriangleMesh.h"

namespace tessera::deforming {

class Random {
public:
    explicit Random(std::uint64_t seed) : engine_(seed) {}
    double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
    double uniform(double low, double high) { return low + (high - low) * uniform(); }
    std::uint32_t below(std::size_t n) { return static_cast<std::uint32_t>(engine_() % n); }
    Vec3d direction() {
        const double z = uniform(-1, 1), angle = uniform(0, 2 * std::numbers::pi), r = std::sqrt(1 - z * z);
        return {r * std::cos(angle), r * std::sin(angle), z};
    }
    Vec3d inBox(double side) { return {uniform(-side, side), uniform(-side, side), uniform(-side, side)}; }
    Quatd rotation() { return Quatd(Eigen::AngleAxisd(uniform(-3.1, 3.1), direction())); }

private:
    std::mt19937_64 engine_;
};

/// The seeds of a test: 0 to `count` - 1, or the one that TESSERA_SEED names.
inline std::vector<std::uint64_t> seeds(std::uint64_t count) {
    if (const char* only = std::getenv("TESSERA_SEED")) return {std::strtoull(only, nullptr, 10)};
    std::vector<std::uint64_t> all(count);
    for (std::uint64_t i = 0; i < count; ++i) all[i] = i;
    return all;
}
inline std::string repeat(std::uint64_t seed, const char* test) {
    return "TESSERA_SEED=" + std::to_string(seed) + " build/bin/unit_spherical_bezier --gtest_filter=" + test;
}

struct Shape {
    std::vector<Vec3d> positions;
    std::vector<std::uint32_t> indices;

    [[nodiscard]] TriangleMesh mesh() const {
        std::vector<double> numbers;
        for (const Vec3d& p : positions) numbers.insert(numbers.end(), {p.x(), p.y(), p.z()});
        return TriangleMesh::make(std::span<const double>(numbers), indices).value();
    }
    void quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
        indices.insert(indices.end(), {a, b, c, a, c, d});
    }
};

/// A grid that is wrapped around: `place(u, v)`, u around once, v from 0 to 1 or around too.
template <typename Place>
Shape wrapped(std::uint32_t around, std::uint32_t along, bool closed, Place&& place) {
    Shape s;
    const std::uint32_t rows = closed ? along : along + 1;
    for (std::uint32_t j = 0; j < rows; ++j)
        for (std::uint32_t i = 0; i < around; ++i)
            s.positions.push_back(place(static_cast<double>(i) / around, static_cast<double>(j) / along));
    for (std::uint32_t j = 0; j < along; ++j)
        for (std::uint32_t i = 0; i < around; ++i) {
            const std::uint32_t next = (i + 1) % around, below = (j + 1) % rows;
            s.quad(around * j + i, around * j + next, around * below + next, around * below + i);
        }
    return s;
}

constexpr std::uint32_t kKinds = 6;

/// 0: a bumpy ball; 1: a ring (not star-shaped, the middle is empty); 2: a flat disc; 3: large triangles anywhere,
/// through the middle too; 4: a ball far from the origin beside one point that many triangles share; 5: needles,
/// segments and points.
inline Shape shape(std::uint32_t kind, Random& random, std::uint32_t fineness = 12) {
    constexpr double kTurn = 2 * std::numbers::pi;
    const double a = random.uniform(0, 0.3), f = 2 + random.below(5);
    const auto ball = [&](double u, double v) {
        const double t = std::numbers::pi * v;
        return Vec3d((1 + a * std::sin(f * kTurn * u)) *
                     Vec3d(std::sin(t) * std::cos(kTurn * u), std::sin(t) * std::sin(kTurn * u), std::cos(t)));
    };
    switch (kind) {
        case 0:
            return wrapped(2 * fineness, fineness, false, ball);
        case 1:
            return wrapped(fineness, 2 * fineness, true, [&](double u, double v) {
                const double r = 1 + 0.25 * std::cos(kTurn * u);
                return Vec3d(r * std::cos(kTurn * v), r * std::sin(kTurn * v), 0.25 * std::sin(kTurn * u));
            });
        case 2:
            return wrapped(2 * fineness, fineness, false, [&](double u, double v) {
                return Vec3d(v * std::cos(kTurn * u), v * std::sin(kTurn * u), 0);
            });
        case 3: {
            Shape s;
            for (int i = 0; i < 90; ++i) s.positions.push_back(random.inBox(1));
            for (int i = 0; i < 60; ++i)
                s.indices.insert(s.indices.end(), {random.below(90), random.below(90), random.below(90)});
            return s;
        }
        case 4: {
            Shape s = wrapped(2 * fineness, fineness, false, ball);
            for (Vec3d& p : s.positions) p += Vec3d(100, -50, 30);
            s.positions.push_back(Vec3d(100, -50, 30));
            const auto middle = static_cast<std::uint32_t>(s.positions.size() - 1);
            for (int i = 0; i < 20; ++i)
                s.indices.insert(s.indices.end(), {middle, random.below(middle), random.below(middle)});
            return s;
        }
        default: {
            Shape s;
            for (int i = 0; i < 120; ++i) {
                const Vec3d p = random.inBox(1), along = 0.3 * random.direction();
                const auto at = static_cast<std::uint32_t>(s.positions.size());
                s.positions.insert(s.positions.end(),
                                   {p, Vec3d(p + along), Vec3d(p + 0.5 * along + 1e-9 * random.direction())});
                s.indices.insert(s.indices.end(), {at, i % 3 == 0 ? at : at + 1, i % 5 == 0 ? at : at + 2});
            }
            return s;
        }
    }
}

constexpr std::uint32_t kDeformations = 8;

/// 0: a wave; 1: bent; 2: noise; 3: folded over; 4: all in one point; 5: carried away; 6: flattened; 7: a hundred times
/// as large.
inline void deform(std::uint32_t how, std::vector<Vec3d>& positions, Random& random) {
    const double phase = random.uniform(0, 6), strength = random.uniform(0.5, 2);
    const Vec3d away = random.uniform(0, 20) * random.direction(), point = random.inBox(1);
    for (Vec3d& p : positions) switch (how) {
            case 0:
                p += 0.1 * Vec3d(std::sin(5 * p.y() + phase), std::sin(4 * p.z()), std::sin(6 * p.x() - phase));
                break;
            case 1:
                p = Eigen::AngleAxisd(strength * std::clamp(p.z(), -3.0, 3.0), Vec3d::UnitX()) * p;
                break;
            case 2:
                p += random.inBox(0.2 * strength);
                break;
            case 3:
                p = Vec3d(std::abs(p.x() - 0.1), p.y(), p.z() * (p.x() < 0.1 ? -1 : 1));
                break;
            case 4:
                p = point;
                break;
            case 5:
                p += away;
                break;
            case 6:
                p.z() = 0;
                break;
            default:
                p *= 100;
                break;
        }
}

/// Every pair that meets, by the predicate. Boxes of the very numbers that it looks at leave out what is apart for
/// certain.
inline std::vector<FacePair> everyPair(const TriangleMesh& a, const TriangleMesh& b, const Affine3d& a_T_b) {
    struct Boxed {
        Triangle triangle;
        Box box;
        explicit Boxed(const Triangle& t) : triangle(t) {
            for (const Vec3d& p : t) box.extend(p);
        }
    };
    std::vector<Boxed> ofA, ofB;
    for (std::uint32_t f = 0; f < a.faceCount(); ++f) ofA.emplace_back(a.triangle(f));
    for (std::uint32_t g = 0; g < b.faceCount(); ++g) ofB.emplace_back(transformed(a_T_b, b.triangle(g)));
    std::vector<FacePair> pairs;
    for (std::uint32_t f = 0; f < ofA.size(); ++f)
        for (std::uint32_t g = 0; g < ofB.size(); ++g)
            if (ofA[f].box.overlaps(ofB[g].box) && trianglesIntersect(ofA[f].triangle, ofB[g].triangle))
                pairs.push_back({f, g});
    return pairs;
}

/// A point of a triangle: a corner, on an edge, inside, near a corner.
inline Vec3d pointOf(const Triangle& t, Random& random) {
    const std::uint32_t kind = random.below(4);
    double a = random.uniform(), b = random.uniform() * (1 - a);
    if (kind == 0) return t[random.below(3)];
    if (kind == 1) b = 0;
    if (kind == 2) {
        a *= 1e-6;
        b *= 1e-6;
    }
    return (1 - a - b) * t[0] + a * t[1] + b * t[2];
}

}  // namespace tessera::deforming
