/// Points beside loops: integer polygons in integers, circles by their radius, random curves beside the angle that fine
/// polygons turn in long double. A failing seed: TESSERA_SEED=N build/bin/unit_nurbs.
#include "common/freeform/nurbs/TrimRegion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>

#include "tests/support/words/Words.h"
#include "tests/unit/nurbs/NurbsOracle.h"

namespace tessera {
namespace {

TrimLoop loopOf(LoopRole role, std::vector<Vec2d> corners) {
    corners.push_back(corners.front());
    return {role, {polyline(corners)}};
}
TrimRegion regionOf(const ParameterRectangle& rectangle, const std::vector<TrimLoop>& loops) {
    Expected<TrimRegion> region = TrimRegion::make(rectangle, loops);
    EXPECT_TRUE(region) << region.error().message;
    return std::move(*region);
}
constexpr ParameterRectangle kSquare{{-12, 12}, {-12, 12}};

struct Cell {
    long x, y;
};
/// Winding number, or nothing on the edge: exact in integers.
std::optional<int> windingOf(const std::vector<Cell>& polygon, const Cell& p) {
    int winding = 0;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const Cell &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
        const long side = (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
        if (side == 0 && std::min(a.x, b.x) <= p.x && p.x <= std::max(a.x, b.x) && std::min(a.y, b.y) <= p.y &&
            p.y <= std::max(a.y, b.y))
            return std::nullopt;
        if (a.y <= p.y && b.y > p.y && side > 0) ++winding;
        if (b.y <= p.y && a.y > p.y && side < 0) --winding;
    }
    return winding;
}

TEST(TrimRegions, OfIntegerPolygonsAreExactAtVerticesAndAlongEdges) {
    // Small grids: points fall on corners, on level edges, on edges that lie on each other, and polygons cross
    // themselves.
    int edges = 0, kept = 0, away = 0;
    for (std::uint64_t seed = firstSeed(), end = seed + seedCount(600); seed < end; ++seed) {
        std::mt19937_64 random(seed);
        std::uniform_int_distribution<long> coordinate(-4, 4);
        std::vector<std::vector<Cell>> polygons;
        std::vector<TrimLoop> loops;
        for (std::size_t l = 0, count = 1 + random() % 3; l < count; ++l) {
            std::vector<Cell> polygon(3 + random() % 8);
            std::vector<Vec2d> corners;
            for (Cell& c : polygon) {
                c = {coordinate(random), coordinate(random)};
                corners.emplace_back(c.x, c.y);
            }
            polygons.push_back(polygon);
            loops.push_back(loopOf(random() % 3 == 0 ? LoopRole::kHole : LoopRole::kOuter, corners));
        }
        const TrimRegion region = regionOf(kSquare, loops);
        const bool hasOuter =
            std::any_of(loops.begin(), loops.end(), [](const TrimLoop& l) { return l.role == LoopRole::kOuter; });
        for (long y = -5; y <= 5; ++y)
            for (long x = -5; x <= 5; ++x) {
                bool onEdge = false;
                int around = hasOuter ? 0 : 1;
                for (std::size_t l = 0; l < loops.size(); ++l) {
                    const std::optional<int> winding = windingOf(polygons[l], {x, y});
                    onEdge = onEdge || !winding;
                    if (winding.value_or(0) != 0) around += loops[l].role == LoopRole::kHole ? -1 : 1;
                }
                const TrimSide expected = onEdge       ? TrimSide::kOnEdge
                                          : around > 0 ? TrimSide::kKept
                                                       : TrimSide::kTrimmedAway;
                ASSERT_EQ(region.side(Vec2d(static_cast<double>(x), static_cast<double>(y))), expected)
                    << x << " " << y << " TESSERA_SEED=" << seed;
                ++(onEdge ? edges : around > 0 ? kept : away);
            }
    }
    if (!std::getenv("TESSERA_SEED")) {
        EXPECT_GT(std::min({edges, kept, away}), 5000);
    }
}

TEST(TrimRegions, OfCirclesAreRightToTwelveDigitsAndAtTangents) {
    for (std::uint64_t seed = firstSeed(), end = seed + seedCount(200); seed < end; ++seed) {
        std::mt19937_64 random(seed);
        const Vec2d center(between(random, {-5, 5}), between(random, {-5, 5}));
        const double radius = between(random, {0.01, 4});
        TrimLoop loop{seed % 2 == 0 ? LoopRole::kOuter : LoopRole::kHole, {circle(center, radius)}};
        if (seed % 3 == 0) std::swap(loop.curves[0].begin, loop.curves[0].end);  // which way it runs is all the same
        const TrimRegion region = regionOf(kSquare, {loop});
        const TrimSide within = seed % 2 == 0 ? TrimSide::kKept : TrimSide::kTrimmedAway,
                       without = seed % 2 == 0 ? TrimSide::kTrimmedAway : TrimSide::kKept;
        EXPECT_EQ(region.side(center), within);
        // What the header says. That the last boxes are within 2 tolerances both ways is √8 of them; the rest is the
        // circle's own rounding.
        const double clear = 4 * region.tolerance();
        for (int k = 0; k < 100; ++k) {
            const double angle = k % 10 == 0 ? (k / 10) * std::numbers::pi / 2 : between(random, {0, 7}),
                         off = std::pow(10, between(random, {std::log10(clear), -1})) * radius;
            const double gap = std::max(off, clear);
            const Vec2d out(std::cos(angle), std::sin(angle));
            ASSERT_EQ(region.side(Vec2d(center + (radius - gap) * out)), within)
                << angle << " " << gap << " TESSERA_SEED=" << seed;
            ASSERT_EQ(region.side(Vec2d(center + (radius + gap) * out)), without)
                << angle << " " << gap << " TESSERA_SEED=" << seed;
            const TrimSide on = region.side(Vec2d(center + radius * out));
            EXPECT_TRUE(on == TrimSide::kOnEdge || region.tolerance() < 1e-14) << "TESSERA_SEED=" << seed;
        }
        // On the lines that touch the circle at its top and bottom and at its joints.
        for (const double side : {-1.0, 0.0, 1.0})
            for (const double away : {-1.5, -1.01, 1.01, 1.5})
                ASSERT_EQ(region.side(Vec2d(center.x() + away * radius, center.y() + side * radius)), without)
                    << "TESSERA_SEED=" << seed;
    }
}

/// A closed loop of random rational curves, each from where the last one ends.
TrimLoop someLoop(std::mt19937_64& random) {
    TrimLoop loop{random() % 4 == 0 ? LoopRole::kHole : LoopRole::kOuter, {}};
    const std::size_t curves = 1 + random() % 4;
    std::vector<Vec2d> joints;
    for (std::size_t c = 0; c < curves; ++c) joints.emplace_back(between(random, {-5, 5}), between(random, {-5, 5}));
    for (std::size_t c = 0; c < curves; ++c) {
        TrimCurve curve{.knots = someKnots(random, 6), .points = {}, .begin = 0, .end = 1};
        // Clamped, so that its ends are where they are wanted.
        const auto order = static_cast<std::size_t>(curve.knots.degree) + 1;
        for (std::size_t i = 0; i < order; ++i) {
            curve.knots.knots[i] = curve.knots.knots.front();
            curve.knots.knots[curve.knots.knots.size() - 1 - i] = curve.knots.knots.back();
        }
        for (std::size_t i = order; i + order < curve.knots.knots.size(); ++i)
            curve.knots.knots[i] =
                curve.knots.knots.front() + (curve.knots.knots.back() - curve.knots.knots.front()) *
                                                static_cast<double>(i + 1 - order) /
                                                static_cast<double>(curve.knots.knots.size() - 2 * order + 1);
        const int count = curve.knots.count();
        for (int i = 0; i < count; ++i) {
            const double w = random() % 2 == 0 ? 1 : between(random, {0.2, 3});
            const Vec2d p = i == 0           ? joints[c]
                            : i + 1 == count ? joints[(c + 1) % curves]
                                             : Vec2d(between(random, {-5, 5}), between(random, {-5, 5}));
            curve.points.emplace_back(w * p.x(), w * p.y(), w);
        }
        curve.begin = curve.knots.domain().lower;
        curve.end = curve.knots.domain().upper;
        if (random() % 3 == 0 && curves > 1) {
            std::reverse(curve.points.begin(), curve.points.end());  // knots are even: the same curve backwards
            std::swap(curve.begin, curve.end);
        }
        loop.curves.push_back(std::move(curve));
    }
    return loop;
}
Vec2d curveByCoxDeBoor(const TrimCurve& curve, double t) {
    Eigen::Matrix<long double, 3, 1> sum = Eigen::Matrix<long double, 3, 1>::Zero();
    for (int i = 0; i < curve.knots.count(); ++i)
        sum += coxDeBoor(curve.knots, i, curve.knots.degree, t) *
               curve.points[static_cast<std::size_t>(i)].cast<long double>();
    return (sum.head<2>() / sum.z()).cast<double>();
}
/// Fine: `sag` is at least as far as the curve goes from it.
struct FinePolygon {
    std::vector<Vec2d> points;
    double sag = 0;
};
FinePolygon finePolygon(const TrimLoop& loop) {
    constexpr std::size_t kSteps = 200;
    FinePolygon fine;
    for (const TrimCurve& curve : loop.curves) {
        std::vector<Vec2d> at;  // and the middles of the steps
        for (std::size_t k = 0; k <= 2 * kSteps; ++k)
            at.push_back(curveByCoxDeBoor(
                curve, curve.begin + (curve.end - curve.begin) * static_cast<double>(k) / (2 * kSteps)));
        for (std::size_t k = 0; k < kSteps; ++k) {
            fine.points.push_back(at[2 * k]);
            // The middle of a smooth step is as far off as a step gets; twice that, and as much again for what is not
            // smooth.
            fine.sag = std::max(fine.sag, 4 * (at[2 * k + 1] - 0.5 * (at[2 * k] + at[2 * k + 2])).norm());
        }
    }
    return fine;
}
std::optional<int> windingByAngle(const FinePolygon& polygon, const Vec2d& p) {
    long double angle = 0;
    for (std::size_t i = 0; i < polygon.points.size(); ++i) {
        const Vec2d a = polygon.points[i] - p, b = polygon.points[(i + 1) % polygon.points.size()] - p;
        const double along = std::clamp(-a.dot(b - a) / std::max((b - a).squaredNorm(), 1e-300), 0.0, 1.0);
        if ((a + along * (b - a)).norm() <= polygon.sag) return std::nullopt;
        angle += std::atan2(static_cast<long double>(a.x()) * b.y() - static_cast<long double>(a.y()) * b.x(),
                            static_cast<long double>(a.dot(b)));
    }
    return static_cast<int>(std::lround(angle / (2 * std::numbers::pi_v<long double>)));
}

TEST(TrimRegions, OfAnyLoopsAreTheirWindingNumbers) {
    int judged = 0, kept = 0;
    for (std::uint64_t seed = firstSeed(), end = seed + seedCount(90); seed < end; ++seed) {
        std::mt19937_64 random(seed);
        std::vector<TrimLoop> loops;
        std::vector<FinePolygon> polygons;
        for (std::size_t l = 0, count = 1 + random() % 3; l < count; ++l) {
            loops.push_back(someLoop(random));
            polygons.push_back(finePolygon(loops.back()));
        }
        const TrimRegion region = regionOf(kSquare, loops);
        const bool hasOuter =
            std::any_of(loops.begin(), loops.end(), [](const TrimLoop& l) { return l.role == LoopRole::kOuter; });
        for (int k = 0; k < 60; ++k) {
            // Anywhere, or level with a joint.
            const Vec2d p(between(random, {-5, 5}), k % 3 == 0 ? polygons[random() % polygons.size()].points.front().y()
                                                               : between(random, {-5, 5}));
            int around = hasOuter ? 0 : 1;
            bool near = false;
            for (std::size_t l = 0; l < loops.size() && !near; ++l) {
                const std::optional<int> winding = windingByAngle(polygons[l], p);
                near = !winding;
                if (winding.value_or(0) != 0) around += loops[l].role == LoopRole::kHole ? -1 : 1;
            }
            if (near) continue;
            ASSERT_EQ(region.side(p), around > 0 ? TrimSide::kKept : TrimSide::kTrimmedAway)
                << p.transpose() << " TESSERA_SEED=" << seed;
            ++judged;
            kept += around > 0;
        }
    }
    if (!std::getenv("TESSERA_SEED")) {
        EXPECT_GT(judged, 3000);
        EXPECT_GT(kept, 400);
    }
}

TEST(TrimRegions, SayOfRectanglesWhatIsTrueOfAllTheirPoints) {
    int kept = 0, away = 0, crossed = 0;
    for (std::uint64_t seed = firstSeed(), end = seed + seedCount(150); seed < end; ++seed) {
        std::mt19937_64 random(seed);
        std::vector<TrimLoop> loops;
        for (std::size_t l = 0, count = 1 + random() % 2; l < count; ++l) loops.push_back(someLoop(random));
        const TrimRegion region = regionOf(kSquare, loops);
        for (int k = 0; k < 40; ++k) {
            const double size = std::pow(10, between(random, {-3, 0.5}));
            ParameterRectangle part{{between(random, {-13, 12}), 0}, {between(random, {-13, 12}), 0}};
            part.u.upper = part.u.lower + size;
            part.v.upper = part.v.lower + size * between(random, {0.1, 1});
            const RectangleSide side = region.side(part);
            ++(side == RectangleSide::kKept ? kept : side == RectangleSide::kCrossed ? crossed : away);
            if (side == RectangleSide::kCrossed) continue;
            for (int i = 0; i < 30; ++i) {
                const Vec2d p(i % 5 == 0 ? part.u.upper : between(random, part.u),
                              i % 7 == 0 ? part.v.lower : between(random, part.v));
                ASSERT_EQ(region.side(p), side == RectangleSide::kKept ? TrimSide::kKept : TrimSide::kTrimmedAway)
                    << "TESSERA_SEED=" << seed;
            }
        }
    }
    if (!std::getenv("TESSERA_SEED")) {
        EXPECT_GT(std::min({kept, away, crossed}), 300);
    }
}

TEST(TrimRegions, KeepIslandsInHolesAndNothingOutsideOfTheDomain) {
    const auto square = [](LoopRole role, double half) {
        return loopOf(role, {{-half, -half}, {half, -half}, {half, half}, {-half, half}});
    };
    const TrimRegion region = regionOf(
        {{-8, 3}, {-8, 8}}, {square(LoopRole::kOuter, 6), square(LoopRole::kHole, 4), square(LoopRole::kOuter, 2)});
    EXPECT_EQ(region.side(Vec2d(0, 0)), TrimSide::kKept);
    EXPECT_EQ(region.side(Vec2d(-3, 0)), TrimSide::kTrimmedAway);
    EXPECT_EQ(region.side(Vec2d(-5, 0)), TrimSide::kKept);
    EXPECT_EQ(region.side(Vec2d(-7, 0)), TrimSide::kTrimmedAway);
    EXPECT_EQ(region.side(Vec2d(3, 5)), TrimSide::kKept);
    EXPECT_EQ(region.side(Vec2d(3.01, 5)), TrimSide::kTrimmedAway);  // the loop goes on, the domain does not
    EXPECT_EQ(region.side(ParameterRectangle{{2.5, 3.5}, {4.5, 5.5}}), RectangleSide::kCrossed);
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(region.side(Vec2d(kNone, 0)), TrimSide::kTrimmedAway);
    // Holes alone are holes in all of the domain; no loops, no trimming.
    EXPECT_EQ(regionOf({{0, 9}, {0, 9}}, {square(LoopRole::kHole, 4)}).side(Vec2d(5, 5)), TrimSide::kKept);
    EXPECT_EQ(regionOf({{0, 9}, {0, 9}}, {square(LoopRole::kHole, 4)}).side(Vec2d(1, 1)), TrimSide::kTrimmedAway);
    EXPECT_EQ(TrimRegion({{0, 9}, {0, 9}}).side(Vec2d(9, 0)), TrimSide::kKept);
}

TEST(TrimRegions, CloseWhatSixDigitsLeaveOpenAndRefuseWhatIsOpen) {
    const auto withGap = [](double gap) {
        return TrimRegion::make(kSquare, std::vector<TrimLoop>{{LoopRole::kOuter,
                                                                {polyline(std::vector<Vec2d>{{1, 1}, {5, 1}, {5, 5}}),
                                                                 polyline(std::vector<Vec2d>{{5, 5 + gap}, {1, 1}})}}});
    };
    ASSERT_TRUE(withGap(4e-5));
    EXPECT_EQ(withGap(4e-5)->side(Vec2d(4, 2)), TrimSide::kKept);
    ASSERT_FALSE(withGap(7e-5));
    EXPECT_EQ(withGap(0.5).error().message,
              "outer loop (loop 1): it is open: a curve ends at (5 5), the next begins at (5 5.5)");
    const auto says = [](const TrimLoop& loop) {
        const Expected<TrimRegion> region = TrimRegion::make(kSquare, std::vector<TrimLoop>{loop});
        ASSERT_FALSE(region);
        EXPECT_EQ(region.error().code, ErrorCode::kBadInput);
        EXPECT_WORDS(region.error().message);
    };
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    const auto spoilt = [](const std::function<void(TrimCurve&)>& spoil) {
        TrimLoop loop{LoopRole::kHole, {circle({0, 0}, 2)}};
        spoil(loop.curves[0]);
        return loop;
    };
    says({LoopRole::kOuter, {}});
    says({LoopRole::kOuter, {polyline({})}});
    says({LoopRole::kOuter, {polyline(std::vector<Vec2d>{{1, 1}})}});
    says(spoilt([](auto& c) { c.end = 3; }));
    says(spoilt([](auto& c) { c.end = 4.5; }));
    says(spoilt([](auto& c) { c.end = 0; }));
    says(spoilt([](auto& c) { c.begin = kNone; }));
    says(spoilt([](auto& c) { c.points[2].z() = 0; }));
    says(spoilt([](auto& c) { c.points[2].x() = kNone; }));
    says(spoilt([](auto& c) { c.knots.knots[4] = 0.5; }));
}

TEST(TrimRegions, AnswerOfCurvesThatShrinkToPointsAndOfExtremeWeights) {
    // A loop that is one point, one that goes there and back, and a curve whose weights differ by 1e24.
    const TrimRegion point = regionOf(kSquare, {loopOf(LoopRole::kOuter, {{1, 1}, {1, 1}, {1, 1}})});
    EXPECT_EQ(point.side(Vec2d(1, 1)), TrimSide::kOnEdge);
    EXPECT_EQ(point.side(Vec2d(0, 1)), TrimSide::kTrimmedAway);
    const TrimRegion there = regionOf(kSquare, {loopOf(LoopRole::kOuter, {{-3, -3}, {3, 3}})});
    EXPECT_EQ(there.side(Vec2d(2, 2)), TrimSide::kOnEdge);
    EXPECT_EQ(there.side(Vec2d(2, 1)), TrimSide::kTrimmedAway);
    TrimLoop extreme{LoopRole::kOuter, {circle({0, 0}, 5)}};
    for (std::size_t i = 0; i < extreme.curves[0].points.size(); ++i)
        extreme.curves[0].points[i] *= i % 2 == 0 ? 1e-12 : 1e12;
    const TrimRegion square = regionOf(kSquare, {extreme});  // as good as the square of its control points
    EXPECT_EQ(square.side(Vec2d(4.9, 4.9)), TrimSide::kKept);
    EXPECT_EQ(square.side(Vec2d(-5.1, 0)), TrimSide::kTrimmedAway);
    EXPECT_EQ(square.side(Vec2d(5, 5)), TrimSide::kOnEdge);
}

}  // namespace
}  // namespace tessera
