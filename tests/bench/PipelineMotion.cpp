#include "tests/bench/PipelineMotion.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "server/collision/convex/ConvexHull.h"

namespace tessera {

namespace {

using Random = std::mt19937_64;

double uniform(Random& random, double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
}

Vec3d unitVector(Random& random) {
    while (true) {
        const Vec3d v(uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1));
        if (v.squaredNorm() > 0.01 && v.squaredNorm() <= 1) return v.normalized();
    }
}

Quatd turn(double angle, const Vec3d& axis) {
    return Quatd(Eigen::AngleAxisd(angle, axis));
}

Quatd anyRotation(Random& random) {
    return turn(uniform(random, 0, 2 * std::numbers::pi), unitVector(random));
}

/// Where single and double precision agree.
Vec3d rounded(const Vec3d& v) {
    return v.cast<float>().cast<double>();
}

MeshArrays3 arraysOf(const ConvexHull& hull) {
    MeshArrays3 out;
    for (const Vec3d& v : hull.vertices()) out.positions.insert(out.positions.end(), {v.x(), v.y(), v.z()});
    for (const ConvexHull::Face& f : hull.faces()) out.indices.insert(out.indices.end(), f.begin(), f.end());
    return out;
}

}  // namespace

std::vector<MeshArrays3> makeHulls(std::size_t count, std::uint64_t seed) {
    Random random(seed);
    std::vector<MeshArrays3> out;
    for (std::size_t i = 0; i < count; ++i) {
        const auto corners = static_cast<std::size_t>(uniform(random, 8, 61));
        const Vec3d axes(0.5, uniform(random, 0.35, 0.5), uniform(random, 0.35, 0.5));
        std::vector<Vec3d> points;
        for (std::size_t k = 0; k < corners; ++k)
            points.push_back(rounded(axes.cwiseProduct(uniform(random, 0.97, 1) * unitVector(random))));
        const Expected<ConvexHull> hull = ConvexHull::make(points);
        TESSERA_CHECK(hull && hull->dimension() == 3, "points that have no hull");
        out.push_back(arraysOf(*hull));
    }
    return out;
}

std::vector<std::vector<TentativeTransform>> BodyFrames::wishes(const PipelineScene& scene) const {
    std::vector<std::vector<TentativeTransform>> out;
    for (const std::vector<Pose>& frame : poses) {
        std::vector<TentativeTransform>& wanted = out.emplace_back();
        for (const std::uint32_t i : movers)
            wanted.push_back({scene.transformOf(i), frame[i].translation, frame[i].rotation, frame[i].scale});
    }
    return out;
}

BodyFrames flyingBodies(std::size_t count, double volume, std::size_t everyNth, std::size_t frames,
                        std::uint64_t seed) {
    Random random(seed);
    const double side = std::cbrt(volume * static_cast<double>(count));
    struct Flight {
        Vec3d at, speed, axis;
        Quatd rotation;
    };
    std::vector<Flight> flights;
    BodyFrames out;
    for (std::size_t i = 0; i < count; ++i) {
        const Vec3d at(uniform(random, 0, side), uniform(random, 0, side), uniform(random, 0, side));
        flights.push_back({at, 0.05 * unitVector(random), unitVector(random), anyRotation(random)});
        if (i % everyNth == 0) out.movers.push_back(static_cast<std::uint32_t>(i));
    }
    for (std::size_t f = 0; f <= frames; ++f) {
        std::vector<Pose>& poses = out.poses.emplace_back();
        for (std::size_t i = 0; i < count; ++i) {
            Flight& flight = flights[i];
            poses.push_back({rounded(flight.at), flight.rotation, Vec3d::Ones()});
            if (i % everyNth != 0) continue;
            for (int a = 0; a < 3; ++a) {
                flight.at[a] += flight.speed[a];
                if (flight.at[a] < 0 || flight.at[a] > side) flight.speed[a] = -flight.speed[a];
            }
            flight.rotation = (turn(0.03, flight.axis) * flight.rotation).normalized();
        }
    }
    return out;
}

BodyFrames packedBodies(std::size_t count, double spacing, std::size_t frames, std::uint64_t seed) {
    Random random(seed);
    const int side = static_cast<int>(std::ceil(std::cbrt(0.5 * static_cast<double>(count))));
    struct Swing {
        Vec3d place, way, axis;
        double phase;
        Quatd rotation;
    };
    std::vector<Swing> swings;
    BodyFrames out;
    for (std::size_t i = 0; i < count; ++i) {
        const int cell = static_cast<int>(i / 2);
        const Vec3d corner(cell % side, cell / side % side, cell / side / side);
        const Vec3d place = spacing * (corner + Vec3d::Constant(i % 2 == 0 ? 0 : 0.5));
        swings.push_back({place, 0.05 * unitVector(random), unitVector(random),
                          uniform(random, 0, 2 * std::numbers::pi), anyRotation(random)});
        out.movers.push_back(static_cast<std::uint32_t>(i));
    }
    for (std::size_t f = 0; f <= frames; ++f) {
        std::vector<Pose>& poses = out.poses.emplace_back();
        for (const Swing& s : swings) {
            const double angle = s.phase + 2 * std::numbers::pi * static_cast<double>(f) / 60;
            poses.push_back({rounded(s.place + std::sin(angle) * s.way),
                             (turn(0.03 * static_cast<double>(f), s.axis) * s.rotation).normalized(), Vec3d::Ones()});
        }
    }
    return out;
}

BodyFrames swingingParts(const std::vector<double>& sizes, const std::vector<TriangleMesh>& surfaces,
                         std::size_t frames, std::uint64_t seed) {
    Random random(seed);
    // Places on the surfaces, alike for each area.
    std::vector<double> areas;
    std::vector<std::pair<std::size_t, std::uint32_t>> faces;
    double sum = 0;
    for (std::size_t m = 0; m < surfaces.size(); ++m)
        for (std::uint32_t f = 0; f < surfaces[m].faceCount(); ++f) {
            const Triangle t = surfaces[m].triangle(f);
            sum += (t[1] - t[0]).cross(t[2] - t[0]).norm();
            areas.push_back(sum);
            faces.emplace_back(m, f);
        }
    struct Swing {
        Vec3d middle, first, second, axis;
        double phase;
        Quatd rotation;
    };
    std::vector<Swing> swings;
    BodyFrames out;
    for (std::size_t i = 0; i < sizes.size(); ++i) {
        const auto at = std::lower_bound(areas.begin(), areas.end(), uniform(random, 0, sum));
        const auto [mesh, face] =
            faces[std::min<std::size_t>(faces.size() - 1, static_cast<std::size_t>(at - areas.begin()))];
        const Triangle t = surfaces[mesh].triangle(face);
        const Vec3d normal = (t[1] - t[0]).cross(t[2] - t[0]).stableNormalized();
        const Vec3d middle = (t[0] + t[1] + t[2]) / 3 + sizes[i] * uniform(random, 0, 1) * normal;
        swings.push_back({middle, 0.5 * sizes[i] * unitVector(random), 0.25 * sizes[i] * unitVector(random),
                          unitVector(random), uniform(random, 0, 2 * std::numbers::pi), anyRotation(random)});
        out.movers.push_back(static_cast<std::uint32_t>(i));
    }
    for (std::size_t f = 0; f <= frames; ++f) {
        std::vector<Pose>& poses = out.poses.emplace_back();
        for (const Swing& s : swings) {
            const double angle = s.phase + 2 * std::numbers::pi * static_cast<double>(f) / 120;
            poses.push_back({s.middle + std::sin(angle) * s.first + std::sin(2 * angle) * s.second,
                             (turn(0.02 * static_cast<double>(f), s.axis) * s.rotation).normalized(), Vec3d::Ones()});
        }
    }
    return out;
}

}  // namespace tessera
