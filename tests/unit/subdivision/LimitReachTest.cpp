/// Where faces can be and how far their triangles are off, beside the finest triangles.
#include "common/freeform/subdivision/LimitReach.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <numeric>

#include "common/freeform/subdivision/LimitTessellation.h"
#include "tests/unit/subdivision/SomeMesh.h"

namespace tessera {
namespace {

using namespace test;

/// From a point to a triangle (Ericson, Real-Time Collision Detection, 5.1.5, by regions of its edges).
double reachDistance(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    const auto toEdge = [&p](const Vec3d& from, const Vec3d& to) {
        const Vec3d along = to - from;
        const double length2 = along.squaredNorm();
        const double t = length2 > 0 ? std::clamp((p - from).dot(along) / length2, 0.0, 1.0) : 0.0;
        return (p - from - t * along).norm();
    };
    const Vec3d normal = (b - a).cross(c - a);
    const bool inside = normal.norm() > 0 && (b - a).cross(p - a).dot(normal) >= 0 &&
                        (c - b).cross(p - b).dot(normal) >= 0 && (a - c).cross(p - c).dot(normal) >= 0;
    if (inside) return std::abs((p - a).dot(normal)) / normal.norm();
    return std::min({toEdge(a, b), toEdge(b, c), toEdge(c, a)});
}

struct ReachSubject {
    std::shared_ptr<const LimitPlan> plan;
    std::vector<float> points;
    std::vector<LimitReach> reaches;

    explicit ReachSubject(const ControlMesh& mesh) : plan(LimitPlan::build(mesh).value()) {
        for (const Vec3d& p : mesh.positions)
            for (int k = 0; k < 3; ++k) points.push_back(static_cast<float>(p[k]));
        reaches.resize(plan->topology().mesh().faceCount());
        std::vector<std::uint32_t> all(reaches.size());
        std::iota(all.begin(), all.end(), 0U);
        measureReaches(*plan, all, points, reaches);
    }
    /// Corners of triangles, by control face: three each.
    [[nodiscard]] std::vector<std::vector<Vec3d>> triangles(unsigned level) const {
        const auto even =
            LimitTessellation::build(plan, std::vector<std::uint8_t>(reaches.size(), static_cast<std::uint8_t>(level)))
                .value();
        std::vector<float> positions(3 * even->vertexCount()), normals(positions.size());
        even->evaluate(points, positions, normals);
        std::vector<std::vector<Vec3d>> out(reaches.size());
        std::size_t next = 0;
        for (std::uint32_t f = 0; f < reaches.size(); ++f) {
            if (!plan->topology().hasSurface(f)) continue;
            const std::size_t n = std::size_t{1} << even->level(), size = plan->topology().mesh().faceSize(f);
            for (std::size_t i = 0; i < 3 * (plan->triangular() ? n * n : size * n * n / 2); ++i, ++next) {
                const float* p = &positions[3 * std::size_t{even->indices()[next]}];
                out[f].emplace_back(p[0], p[1], p[2]);
            }
        }
        return out;
    }
};

/// All kinds: poles of 3 to 60, creases, corners, boundaries, holes, polygons, places that are no manifold; sheets that
/// bend much or a little.
ControlMesh reachMesh(std::mt19937_64& random) {
    ControlMesh mesh;
    do {
        const SubdivisionScheme scheme = random() % 2 ? SubdivisionScheme::kCatmullClark : SubdivisionScheme::kLoop;
        switch (random() % 4) {
            case 0:
                mesh = poleMesh(3 + static_cast<std::uint32_t>(random() % 58), scheme);
                break;
            case 1:
                mesh = gridMesh(5, 4, random() % 2 == 0, scheme);
                break;
            default:
                mesh = someMesh(random);
        }
        const double wild = std::uniform_real_distribution<double>(0, 0.5)(random);
        for (Vec3d& p : mesh.positions)
            p += wild * Vec3d::NullaryExpr([&] { return std::uniform_real_distribution<double>(-1, 1)(random); });
        if (mesh.scheme == SubdivisionScheme::kCatmullClark && random() % 10 == 0)
            mesh.scheme = SubdivisionScheme::kBilinear;
    } while (!SubdivisionTopology::build(mesh));
    return mesh;
}

TEST(LimitReach, NothingIsFartherOffOrElsewhereThanIsSaid) {
    const Seeds seeds(30);
    std::vector<double> regular, others;
    for (std::uint64_t seed = seeds.first; seed < seeds.first + seeds.count; ++seed) {
        TESSERA_TRACE_SEED("unit_subdivision", seed);
        std::mt19937_64 random(seed);
        const ControlMesh mesh = reachMesh(random);
        const ReachSubject subject(mesh);
        const auto truth = subject.triangles(5);
        std::vector<std::uint32_t> faces;
        for (std::uint32_t f = 0; f < truth.size(); ++f)
            if (!truth[f].empty()) faces.push_back(f);
        std::shuffle(faces.begin(), faces.end(), random);
        if (faces.size() > 12) faces.resize(12);
        for (unsigned level = 0; level < 4; ++level) {
            const auto coarse = subject.triangles(level);
            for (const std::uint32_t f : faces) {
                const LimitReach& reach = subject.reaches[f];
                const double said = static_cast<double>(reach.deviation[level]);
                double farthest = 0;
                for (int i = 0; i < 60; ++i) {
                    const Vec3d& p = truth[f][random() % truth[f].size()];
                    for (int k = 0; k < 3; ++k) {
                        ASSERT_GE(p[k], static_cast<double>(reach.lower[static_cast<std::size_t>(k)]) - 1e-6)
                            << "face " << f;
                        ASSERT_LE(p[k], static_cast<double>(reach.upper[static_cast<std::size_t>(k)]) + 1e-6)
                            << "face " << f;
                    }
                    double nearest = std::numeric_limits<double>::infinity();
                    const auto lookAt = [&](const std::vector<Vec3d>& corners) {
                        for (std::size_t t = 0; t < corners.size(); t += 3)
                            nearest = std::min(nearest, reachDistance(p, corners[t], corners[t + 1], corners[t + 2]));
                    };
                    lookAt(coarse[f]);
                    // What lies beside the face's own triangles lies before its neighbours'.
                    if (nearest > said)
                        for (const auto& corners : coarse) lookAt(corners);
                    farthest = std::max(farthest, nearest);
                }
                const LimitPlan::Face& face = subject.plan->faces()[subject.plan->topology().firstPtexOf(f)];
                EXPECT_LE(farthest, said + 2e-6)
                    << "face " << f << ", level " << level << ", scheme " << int(mesh.scheme) << ", regular "
                    << (face.spline != nullptr) << ", most " << face.most << ", sharpest " << face.sharpest << ", rims "
                    << int(face.rims);
                if (farthest > 1e-4) (face.spline ? regular : others).push_back(said / farthest);
            }
        }
    }
    if (seeds.count == 1) return;
    for (auto* ratios : {&regular, &others}) {
        std::sort(ratios->begin(), ratios->end());
        ASSERT_GT(ratios->size(), 200u);
        std::cout << (ratios == &regular ? "regular" : "others") << ": " << ratios->size()
                  << " faces and levels, said beside true: median " << (*ratios)[ratios->size() / 2] << ", nine tenths "
                  << (*ratios)[ratios->size() * 9 / 10] << ", most " << ratios->back() << ", least " << ratios->front()
                  << '\n';
    }
    // Four is a level.
    EXPECT_LT(regular[regular.size() / 2], 3.5);
    EXPECT_LT(others[others.size() / 2], 3);
}

TEST(LimitReach, OfWhatMovedIsThatOfAll) {
    const Seeds seeds(25);
    for (std::uint64_t seed = seeds.first; seed < seeds.first + seeds.count; ++seed) {
        TESSERA_TRACE_SEED("unit_subdivision", seed);
        std::mt19937_64 random(seed);
        ControlMesh mesh = reachMesh(random);
        ReachSubject subject(mesh);
        const auto moved = static_cast<std::uint32_t>(random() % mesh.positions.size());
        mesh.positions[moved] += Vec3d(0.3, -0.1, 0.2);
        for (std::uint32_t k = 0; k < 3; ++k)
            subject.points[3 * moved + k] = static_cast<float>(mesh.positions[moved][static_cast<int>(k)]);
        std::vector<std::uint32_t> faces;
        for (const std::uint32_t p : subject.plan->topology().touchedBy(std::span(&moved, 1)))
            faces.push_back(subject.plan->topology().ptexFace(p).face);
        measureReaches(*subject.plan, faces, subject.points, subject.reaches);
        const ReachSubject fresh(mesh);
        for (std::size_t f = 0; f < fresh.reaches.size(); ++f) {
            ASSERT_EQ(subject.reaches[f].deviation, fresh.reaches[f].deviation) << "face " << f;
            ASSERT_EQ(subject.reaches[f].lower, fresh.reaches[f].lower);
            ASSERT_EQ(subject.reaches[f].upper, fresh.reaches[f].upper);
        }
    }
}

TEST(LimitReach, OfAPlaneIsNothing) {
    for (const SubdivisionScheme scheme : {SubdivisionScheme::kCatmullClark, SubdivisionScheme::kLoop}) {
        ControlMesh mesh = gridMesh(5, 4, false, scheme);
        for (Vec3d& p : mesh.positions) p.z() = 0;
        const ReachSubject subject(mesh);
        for (const LimitReach& reach : subject.reaches)
            EXPECT_LT(reach.deviation[4], 2e-3F) << "but for the round corners of its rim";
        const auto inside =
            std::min_element(subject.reaches.begin(), subject.reaches.end(),
                             [](const LimitReach& a, const LimitReach& b) { return a.deviation[0] < b.deviation[0]; });
        EXPECT_LT(inside->deviation[0], 1e-6F);
    }
}

}  // namespace
}  // namespace tessera
