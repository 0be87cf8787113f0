/// Convex hulls beside Bullet (btGjkPairDetector, btGjkEpa2; single precision, as Debian builds it) on the same
/// vertices: bench_convex [--json FILE]. Single thread; ours and Bullet's take turns; processor time per query, mean
/// over poses.
///
/// Cold: each pose on its own. Warm: a body circles and tumbles by half a degree per frame, with our cache; Bullet's
/// detector is the same object from frame to frame. Each of our distances is proved in passing: its two points are so
/// far apart, and the plane between them has all vertices of either hull behind it, to 1e-12. Bullet's difference from
/// it is shown; it stops at a relative error of a thousandth.
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkEpaPenetrationDepthSolver.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkPairDetector.h>
#include <BulletCollision/NarrowPhaseCollision/btPointCollector.h>
#include <BulletCollision/NarrowPhaseCollision/btVoronoiSimplexSolver.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "common/base/Error.h"
#include "server/collision/convex/ConvexQuery.h"

namespace tessera {
namespace {

constexpr int kPoses = 400;
constexpr int kRounds = 9;

using Random = std::mt19937_64;

/// Positions and poses that a float holds, so that both sides are given the same bodies.
double rounded(double v) {
    return static_cast<double>(static_cast<float>(v));
}
Vec3d rounded(const Vec3d& v) {
    return {rounded(v.x()), rounded(v.y()), rounded(v.z())};
}

Vec3d unitVector(Random& random) {
    std::normal_distribution<double> n;
    const double x = n(random), y = n(random), z = n(random);
    return Vec3d(x, y, z).normalized();
}

std::vector<Vec3d> box() {
    std::vector<Vec3d> out;
    for (int i = 0; i < 8; ++i) out.emplace_back(i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 0.5 : -0.5);
    return out;
}

/// Of radius 1, a little dented, so that no two ways out are equally long.
std::vector<Vec3d> round(int count, Random& random) {
    std::uniform_real_distribution<double> dent(0.97, 1);
    std::vector<Vec3d> out;
    for (int i = 0; i < count; ++i) out.push_back(rounded(Vec3d(dent(random) * unitVector(random))));
    return out;
}

struct BulletPair {
    btConvexHullShape a, b;
    btVoronoiSimplexSolver simplex;
    btGjkEpaPenetrationDepthSolver epa;
    btGjkPairDetector distance, depth;

    static btConvexHullShape shapeOf(const ConvexHull& hull) {
        btConvexHullShape shape;
        for (const Vec3d& v : hull.vertices())
            shape.addPoint(btVector3(btScalar(v.x()), btScalar(v.y()), btScalar(v.z())), false);
        shape.recalcLocalAabb();
        shape.setMargin(0);
        return shape;
    }
    BulletPair(const ConvexHull& hullA, const ConvexHull& hullB)
        : a(shapeOf(hullA)), b(shapeOf(hullB)), distance(&a, &b, &simplex, nullptr), depth(&a, &b, &simplex, &epa) {}

    btPointCollector run(btGjkPairDetector& detector, const Affine3d& m) {
        btGjkPairDetector::ClosestPointInput input;
        input.m_transformA.setIdentity();
        const Mat3d r = m.linear();
        input.m_transformB.setBasis(btMatrix3x3(btScalar(r(0, 0)), btScalar(r(0, 1)), btScalar(r(0, 2)),
                                                btScalar(r(1, 0)), btScalar(r(1, 1)), btScalar(r(1, 2)),
                                                btScalar(r(2, 0)), btScalar(r(2, 1)), btScalar(r(2, 2))));
        const Vec3d t = m.translation();
        input.m_transformB.setOrigin(btVector3(btScalar(t.x()), btScalar(t.y()), btScalar(t.z())));
        btPointCollector points;
        detector.getClosestPoints(input, points, nullptr);
        return points;
    }
};

double now() {
    timespec time{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return double(time.tv_sec) * 1e9 + double(time.tv_nsec);
}

/// No point of one is nearer to the other than the distance says.
bool proved(const ConvexHull& hull, const Affine3d& m, const HullDistance& d) {
    const Vec3d n = (d.onB - d.onA).normalized();
    double high = -1e300, low = 1e300;
    for (const Vec3d& v : hull.vertices()) {
        high = std::max(high, n.dot(v));
        low = std::min(low, n.dot(m * v));
    }
    return std::abs((d.onB - d.onA).norm() - d.distance) < 1e-12 && low - high > d.distance - 1e-12;
}

struct Row {
    std::string name;
    double ours, theirs;  ///< ns per query
    double supports;      ///< ours, per query
    double worst;         ///< difference of lengths, in units of the bodies' radius
    int contrary;         ///< yes and no
};

double median(std::vector<double> values) {
    std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
    return values[values.size() / 2];
}

/// `ours` and `theirs` answer with a length each (below 0: they touch).
template <typename Ours, typename Theirs>
Row compare(std::string name, const std::vector<Affine3d>& poses, const ConvexWork& work, const Ours& ours,
            const Theirs& theirs) {
    Row row{std::move(name), 0, 0, 0, 0, 0};
    const std::uint64_t before = work.supports;
    for (const Affine3d& m : poses) {
        const double x = ours(m), y = theirs(m);
        row.contrary += (x < 0) != (y < 0);
        if (x >= 0 && y >= 0) row.worst = std::max(row.worst, std::abs(x - y));
    }
    row.supports = double(work.supports - before) / double(poses.size());
    std::vector<double> our, their;
    double sink = 0;
    for (int round = 0; round < kRounds; ++round) {
        double start = now();
        for (const Affine3d& m : poses) sink += ours(m);
        our.push_back((now() - start) / double(poses.size()));
        start = now();
        for (const Affine3d& m : poses) sink += theirs(m);
        their.push_back((now() - start) / double(poses.size()));
    }
    if (!std::isfinite(sink)) std::printf("(an answer was infinite)\n");
    row.ours = median(our);
    row.theirs = median(their);
    return row;
}

Affine3d roundedPose(const Vec3d& translation, const Mat3d& rotation) {
    Affine3d m = Affine3d::Identity();
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) m.linear()(i, j) = rounded(rotation(i, j));
    m.translation() = rounded(translation);
    return m;
}

void measure(const std::string& name, const std::vector<Vec3d>& points, std::vector<Row>& rows) {
    const ConvexHull hull = *ConvexHull::make(points);
    BulletPair bullet(hull, hull);
    Random random(7);
    std::vector<Affine3d> apart, deep, mixed, frames;
    ConvexWork unused;
    std::uniform_real_distribution<double> u(0, 1);
    while (mixed.size() < kPoses) {
        // Turned anyhow, along some way out: a tenth to four tenths of a radius into it or away from it.
        const Quatd turn(Eigen::AngleAxisd(2 * std::numbers::pi * u(random), unitVector(random)));
        const Vec3d way = unitVector(random);
        const HullDepth far = hullDepth(hull, hull, roundedPose(10 * way, turn.toRotationMatrix()), unused);
        const double gap = (0.1 + 0.3 * u(random)) * (mixed.size() % 2 ? 1 : -1);
        const Affine3d m = roundedPose((10 + far.depth + gap) * way, turn.toRotationMatrix());
        const HullDistance d = hullDistance(hull, hull, m, unused);
        // What single precision would have to guess is left out.
        if (d.distance > 0 && d.distance < 0.01) continue;
        mixed.push_back(m);
        (d.distance > 0 ? apart : deep).push_back(m);
    }
    for (int frame = 0; frame < 2 * kPoses; ++frame) {
        const double t = 0.009 * frame;
        frames.push_back(roundedPose(2.6 * Vec3d(std::cos(t), std::sin(t), 0.3 * std::sin(2 * t)),
                                     Eigen::AngleAxisd(1.3 * t, Vec3d(1, 2, 3).normalized()).toRotationMatrix()));
    }
    const auto label = [&](const char* what) { return fmt::format("{:<11} {}", name, what); };
    const auto theirDistance = [&](const Affine3d& m) {
        const btPointCollector p = bullet.run(bullet.distance, m);
        return p.m_hasResult && p.m_distance > 0 ? double(p.m_distance) : -1.0;
    };
    ConvexWork work;
    const auto distance = [&](ConvexCache* cache) {
        return [&, cache](const Affine3d& m) {
            const HullDistance d = hullDistance(hull, hull, m, work, cache);
            return d.distance > 0 ? d.distance : -1.0;
        };
    };
    const auto touching = [&](const Affine3d& m) {
        return hullsTouching(hull, hull, m, work) == Touch::kYes ? -1.0 : 1e-3;
    };
    for (const std::vector<Affine3d>& poses : {apart, frames})
        for (const Affine3d& m : poses) {
            const HullDistance d = hullDistance(hull, hull, m, unused);
            TESSERA_CHECK(d.distance == 0 || proved(hull, m, d), "a distance that is not the least");
        }
    ConvexCache cache;
    rows.push_back(compare(label("distance, cold"), apart, work, distance(nullptr), theirDistance));
    rows.push_back(compare(label("distance, warm"), frames, work, distance(&cache), theirDistance));
    Row touch = compare(label("touching, cold"), mixed, work, touching, theirDistance);
    touch.worst = 0;
    rows.push_back(touch);
    rows.push_back(compare(
        label("depth, cold"), deep, work, [&](const Affine3d& m) { return hullDepth(hull, hull, m, work).depth; },
        [&](const Affine3d& m) { return -double(bullet.run(bullet.depth, m).m_distance); }));
}

std::string json(const std::vector<Row>& rows) {
    std::string entries;
    for (const Row& r : rows)
        entries += fmt::format(
            "{}\n  {{\"case\": \"{}\", \"peer\": \"Bullet\", \"ours\": {:.17g}, \"theirs\": {:.17g}, \"unit\": \"ns\", "
            "\"ratio\": {:.17g}, \"supports\": {:.17g}, \"largestDifference\": {:.17g}, \"contrary\": {}}}",
            entries.empty() ? "" : ",", r.name, r.ours, r.theirs, r.ours / r.theirs, r.supports, r.worst, r.contrary);
    return "{\"cases\": [" + entries + "\n]}\n";
}

}  // namespace
}  // namespace tessera

int main(int argc, char** argv) {
    const std::vector<std::string> arguments(argv + 1, argv + argc);
    if (!arguments.empty() && (arguments.size() != 2 || arguments[0] != "--json")) {
        std::fprintf(stderr, "usage: bench_convex [--json FILE]\n");
        return 2;
    }
    std::vector<tessera::Row> rows;
    tessera::Random random(1);
    tessera::measure("box", tessera::box(), rows);
    for (const int count : {30, 200, 2000, 20'000})
        tessera::measure(fmt::format("{} points", count), tessera::round(count, random), rows);
    std::printf("%-28s %10s %10s %7s %9s %11s %9s\n", "", "ns", "Bullet", "ratio", "supports", "difference",
                "contrary");
    for (const tessera::Row& r : rows)
        std::printf("%-28s %10.0f %10.0f %7.3f %9.2f %11.1e %9d\n", r.name.c_str(), r.ours, r.theirs, r.ours / r.theirs,
                    r.supports, r.worst, r.contrary);
    if (arguments.empty()) return 0;
    std::FILE* file = std::fopen(arguments[1].c_str(), "w");
    const std::string text = tessera::json(rows);
    if (!file || std::fwrite(text.data(), 1, text.size(), file) != text.size() || std::fclose(file) != 0) {
        std::fprintf(stderr, "bench_convex: %s cannot be written\n", arguments[1].c_str());
        return 1;
    }
    return 0;
}
