// The nearest point of a triangle beside the distance to it in exact arithmetic: of triangles with area, nearly without
// and without.
#include <gtest/gtest.h>

#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <random>

#include "server/collision/mesh/TriangleContact.h"

namespace tessera {
namespace {

/// Coordinates in units of 2^-100: of numbers from 1e-14 to 8 nothing is cut off.
using Whole = boost::multiprecision::cpp_int;
using Exact = std::array<Whole, 3>;
constexpr int kBits = 100;

Exact exact(const Vec3d& v) {
    const auto whole = [](double x) { return Whole(std::ldexp(x, kBits)); };
    return {whole(v.x()), whole(v.y()), whole(v.z())};
}
Exact operator-(const Exact& a, const Exact& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
Whole dot(const Exact& a, const Exact& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
Exact cross(const Exact& a, const Exact& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
/// Of a fraction of squares.
double root(const Whole& above, const Whole& below) {
    return std::ldexp(std::sqrt(above.convert_to<double>() / below.convert_to<double>()), -kBits);
}

double toSegment(const Exact& a, const Exact& b, const Exact& p) {
    const Exact along = b - a, away = p - a;
    const Whole square = dot(along, along), at = dot(along, away);
    if (square == 0 || at <= 0) return root(dot(away, away), 1);
    if (at >= square) return root(dot(p - b, p - b), 1);
    return root(dot(away, away) * square - at * at, square);
}

/// The plane's where the foot of the plumb line is inside, else the nearest edge's.
double exactDistance(const Triangle& triangle, const Vec3d& place) {
    const Exact t[3] = {exact(triangle[0]), exact(triangle[1]), exact(triangle[2])}, p = exact(place);
    const Exact n = cross(t[1] - t[0], t[2] - t[0]);
    const Whole square = dot(n, n);
    bool inside = square != 0;
    for (std::size_t i = 0; i < 3 && inside; ++i) inside = dot(n, cross(t[(i + 1) % 3] - t[i], p - t[i])) >= 0;
    if (inside) {
        const Whole height = dot(n, p - t[0]);
        return root(height * height, square);
    }
    return std::min({toSegment(t[0], t[1], p), toSegment(t[1], t[2], p), toSegment(t[2], t[0], p)});
}

class NearestOnTriangle : public testing::Test {
protected:
    void expectNearest(const Triangle& t, const Vec3d& p, const std::string& story) {
        const Vec3d nearest = nearestOnTriangle(t, p);
        const double rounding = 1e-14 * std::max({t[0].norm(), t[1].norm(), t[2].norm(), p.norm()});
        ASSERT_NEAR((nearest - p).norm(), exactDistance(t, p), rounding) << story;
        ASSERT_LE(exactDistance(t, nearest), rounding) << story << ": it is on the triangle";
    }
    /// In every order of its corners, from places all around it.
    void expectNearestOfAll(Triangle t, const std::string& kind) {
        for (int i = 0; i < 8; ++i) {
            const Vec3d on = weight() * t[0] + weight() * t[1] + (i % 2 == 0 ? 0 : weight()) * t[2];
            const Vec3d p = i == 0 ? t[random_() % 3] : Vec3d(on + std::pow(10.0, 3 - 2.0 * (i % 5)) * point());
            for (int order = 0; order < 6; ++order) {
                expectNearest(t, p, kind + ", place " + std::to_string(i) + ", order " + std::to_string(order));
                if (HasFatalFailure()) return;
                std::swap(t[1], t[order % 2 == 0 ? 2 : 0]);
            }
        }
    }
    double number(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
    double weight() { return number(-0.3, 1); }
    Vec3d point() { return {number(-1, 1), number(-1, 1), number(-1, 1)}; }
    /// A few bits each: sums and products of such coordinates are exact, and so is what lies on one line.
    Vec3d coarse() {
        return Vec3d(double(int(random_() % 17)) - 8, double(int(random_() % 17)) - 8,
                     double(int(random_() % 17)) - 8) /
               8;
    }

    std::mt19937_64 random_{2};
};

TEST_F(NearestOnTriangle, OfTwoCornersInOnePlaceIsTheOtherOneToo) {
    const Vec3d a(0, 0, 0), c(1, 0, 0);
    EXPECT_EQ(nearestOnTriangle({a, a, c}, Vec3d(2, 1, 0)), c);
    EXPECT_EQ(nearestOnTriangle({a, c, a}, Vec3d(2, 1, 0)), c);
    EXPECT_EQ(nearestOnTriangle({c, a, a}, Vec3d(2, 1, 0)), c);
    EXPECT_EQ(nearestOnTriangle({a, a, c}, Vec3d(0.25, 1, 0)), Vec3d(0.25, 0, 0));
    EXPECT_EQ(nearestOnTriangle({a, a, a}, Vec3d(2, 1, 0)), a);
    for (int i = 0; i < 200; ++i) {
        const Vec3d p = point(), q = point();
        expectNearestOfAll({p, p, q}, "two equal");
        expectNearestOfAll({p, p, p}, "three equal");
    }
}

TEST_F(NearestOnTriangle, OfCornersOnOneLineIsOnTheirSegment) {
    for (int i = 0; i < 200; ++i) {
        const Vec3d a = coarse(), along = coarse();
        expectNearestOfAll({a, a + along, a + number(0, 1) * along}, "rounded to about one line");
        expectNearestOfAll({a, a + along, a + double(int(random_() % 65) - 16) / 32 * along}, "on one line");
        const Vec3d far = std::pow(10.0, number(-12, 0)) * along;
        expectNearestOfAll({a, a + along, a + far}, "two nearly equal, on about one line");
    }
}

TEST_F(NearestOnTriangle, OfThinTrianglesIsInsideAndOnEdgesAsExactlyAsElsewhere) {
    for (int i = 0; i < 200; ++i) {
        const Vec3d a = point(), along = point();
        const double width = std::pow(10.0, number(-17, -1));
        expectNearestOfAll({a, a + along, a + number(-0.5, 1.5) * along + width * point()}, "thin");
        expectNearestOfAll({a, a + width * point(), a + along}, "a needle");
        expectNearestOfAll({a, a + width * point(), a + width * width * point()}, "small and thin");
    }
}

TEST_F(NearestOnTriangle, OfTrianglesWithAreaIsTheOneThatExactArithmeticFinds) {
    for (int i = 0; i < 200; ++i) {
        expectNearestOfAll({point(), point(), point()}, "any");
        expectNearestOfAll({coarse(), coarse(), coarse()}, "coarse");
        const Vec3d a = point(), along = point();
        expectNearestOfAll({a, a + along, a + number(0, 1) * along + 0.003 * point()}, "just wide enough");
    }
}

}  // namespace
}  // namespace tessera
