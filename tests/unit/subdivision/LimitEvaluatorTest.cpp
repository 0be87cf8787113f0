/// The limit surface beside what has to be true of it whatever computes it; tests/truth/subdivision has OpenSubdiv.
#include "common/freeform/subdivision/LimitEvaluator.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/subdivision/SomeMesh.h"

namespace tessera {
namespace {

using test::Seeds;

/// The control mesh after naive refinement of everything, Catmull and Clark's rules alone, for closed smooth meshes:
/// what the limit tends from.
struct NaiveMesh {
    std::vector<Vec3d> points;
    std::vector<std::vector<std::uint32_t>> faces;

    NaiveMesh refined() const {
        NaiveMesh out;
        const std::size_t n = points.size();
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<std::uint32_t>> edges;
        std::vector<Vec3d> centres;
        for (std::uint32_t f = 0; f < faces.size(); ++f) {
            Vec3d sum = Vec3d::Zero();
            for (std::size_t i = 0; i < faces[f].size(); ++i) {
                sum += points[faces[f][i]];
                edges[std::minmax(faces[f][i], faces[f][(i + 1) % faces[f].size()])].push_back(f);
            }
            centres.push_back(sum / static_cast<double>(faces[f].size()));
        }
        std::vector<Vec3d> faceSum(n, Vec3d::Zero()), edgeSum(n, Vec3d::Zero());
        std::vector<double> valence(n, 0);
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> edgePoint;
        out.points = points;
        for (const auto& [ends, around] : edges) {
            edgePoint[ends] = static_cast<std::uint32_t>(out.points.size());
            out.points.push_back((points[ends.first] + points[ends.second] + centres[around[0]] + centres[around[1]]) /
                                 4);
            for (const std::uint32_t v : {ends.first, ends.second}) {
                edgeSum[v] += (points[ends.first] + points[ends.second]) / 2;
                valence[v] += 1;
            }
        }
        for (std::uint32_t f = 0; f < faces.size(); ++f) {
            for (const std::uint32_t v : faces[f]) faceSum[v] += centres[f];
        }
        for (std::size_t v = 0; v < n; ++v) {
            const double k = valence[v];
            if (k > 0) out.points[v] = (faceSum[v] / k + 2 * edgeSum[v] / k + (k - 3) * points[v]) / k;
        }
        for (std::uint32_t f = 0; f < faces.size(); ++f) {
            const auto centre = static_cast<std::uint32_t>(out.points.size());
            out.points.push_back(centres[f]);
            const std::size_t size = faces[f].size();
            for (std::size_t i = 0; i < size; ++i) {
                const std::uint32_t here = faces[f][i], next = faces[f][(i + 1) % size],
                                    before = faces[f][(i + size - 1) % size];
                out.faces.push_back(
                    {here, edgePoint.at(std::minmax(here, next)), centre, edgePoint.at(std::minmax(before, here))});
            }
        }
        return out;
    }
};

TEST(LimitEvaluator, IsWhatNaiveRefinementTendsTo) {
    for (const std::uint32_t valence : {3U, 5U, 8U}) {
        const ControlMesh mesh = test::poleMesh(valence, SubdivisionScheme::kCatmullClark);
        NaiveMesh naive{.points = mesh.positions, .faces = {}};
        std::size_t begin = 0;
        for (const std::uint32_t size : mesh.faceSizes) {
            naive.faces.emplace_back(mesh.faceVertices.begin() + static_cast<std::ptrdiff_t>(begin),
                                     mesh.faceVertices.begin() + static_cast<std::ptrdiff_t>(begin + size));
            begin += size;
        }
        const auto topology = SubdivisionTopology::build(mesh);
        ASSERT_TRUE(topology.has_value());
        LimitEvaluator evaluator(*topology);
        std::vector<double> distances;
        for (int level = 1; level <= 5; ++level) {
            naive = naive.refined();
            // The vertices stay the first ones, at corners of the faces that they had.
            double most = 0;
            std::size_t corner = 0;
            for (std::uint32_t f = 0; f < mesh.faceSizes.size(); ++f) {
                for (std::uint32_t i = 0; i < mesh.faceSizes[f]; ++i, ++corner) {
                    const bool whole = mesh.faceSizes[f] == 4;
                    const PtexPoint at{topology->firstPtexOf(f) + (whole ? 0 : i),
                                       whole && (i == 1 || i == 2) ? 1.0 : 0.0, whole && i >= 2 ? 1.0 : 0.0};
                    const auto point = evaluator.evaluate(mesh.positions, at);
                    ASSERT_TRUE(point.has_value());
                    most = std::max(most, (point->point - naive.points[mesh.faceVertices[corner]]).norm());
                }
            }
            distances.push_back(most);
        }
        // By a factor of four at each refinement, or the square of the slower second eigenvalue at valence 8.
        EXPECT_LT(distances.back(), 0.01) << valence;
        for (std::size_t i = 1; i < distances.size(); ++i) EXPECT_LT(distances[i], 0.5 * distances[i - 1]) << valence;
    }
}

/// The two faces of an edge, and where its ends are in them.
struct Seam {
    PtexPoint aFrom, aTo, bFrom, bTo;
};
std::vector<Seam> seamsOf(const SubdivisionTopology& topology) {
    std::vector<Seam> seams;
    const TaggedMesh& mesh = topology.mesh();
    const bool triangle = topology.scheme() == SubdivisionScheme::kLoop;
    for (std::uint32_t e = 0; e < mesh.edges.size(); ++e) {
        const auto& edge = mesh.edges[e];
        if (edge.faces[1] == kNoIndex) continue;
        std::array<std::array<PtexPoint, 2>, 2> ends;
        bool usable = true;
        for (std::size_t side = 0; side < 2; ++side) {
            const std::uint32_t f = edge.faces[side];
            const auto size = mesh.faceSize(f);
            usable = usable && topology.hasSurface(f) && (triangle || size == 4);
            for (std::uint32_t i = 0; usable && i < size; ++i) {
                for (std::size_t end = 0; end < 2; ++end) {
                    if (mesh.verticesOf(f)[i] != edge.vertices[end]) continue;
                    const double u = triangle ? (i == 1 ? 1 : 0) : (i == 1 || i == 2 ? 1 : 0), v = i >= 2 ? 1 : 0;
                    ends[side][end] = {topology.firstPtexOf(f), u, v};
                }
            }
        }
        if (usable) seams.push_back({ends[0][0], ends[0][1], ends[1][0], ends[1][1]});
    }
    return seams;
}
PtexPoint between(const PtexPoint& a, const PtexPoint& b, double t) {
    return {a.face, (1 - t) * a.u + t * b.u, (1 - t) * a.v + t * b.v};
}

TEST(LimitEvaluator, HasNoGapsAcrossAnyEdge) {
    std::size_t seamsSeen = 0;
    const Seeds seeds(150);
    for (std::uint64_t seed = seeds.first; seed < seeds.first + seeds.count; ++seed) {
        TESSERA_TRACE_SEED("unit_subdivision", seed);
        std::mt19937_64 random(seed);
        const ControlMesh mesh = test::someMesh(random);
        const auto topology = SubdivisionTopology::build(mesh);
        ASSERT_TRUE(topology.has_value()) << topology.error().message;
        LimitEvaluator evaluator(*topology);
        for (const Seam& seam : seamsOf(*topology)) {
            for (const double t : {0.0, 1e-9, 0.25, 0.3719, 1.0}) {
                const auto a = evaluator.evaluate(mesh.positions, between(seam.aFrom, seam.aTo, t)),
                           b = evaluator.evaluate(mesh.positions, between(seam.bFrom, seam.bTo, t));
                ASSERT_TRUE(a.has_value() && b.has_value());
                // 40 refinements of points below 10, each to 1e-15 of them.
                EXPECT_LT((a->point - b->point).norm(), 1e-12)
                    << seam.aFrom.face << " " << seam.bFrom.face << " at " << t;
            }
            ++seamsSeen;
        }
    }
    EXPECT_GT(seamsSeen, 10 * seeds.count);
}

TEST(LimitEvaluator, DerivativesAreThoseOfThePoints) {
    const Seeds seeds(100);
    for (std::uint64_t seed = seeds.first; seed < seeds.first + seeds.count; ++seed) {
        TESSERA_TRACE_SEED("unit_subdivision", seed);
        std::mt19937_64 random(seed);
        const ControlMesh mesh = test::someMesh(random);
        const auto topology = SubdivisionTopology::build(mesh);
        ASSERT_TRUE(topology.has_value());
        LimitEvaluator evaluator(*topology);
        for (std::uint32_t f = 0; f < topology->ptexFaceCount(); ++f) {
            const auto [u, v] = test::somePlace(random, mesh.scheme == SubdivisionScheme::kLoop);
            constexpr double h = 1e-6;
            if (u < 0.01 || v < 0.01 || u + v > 0.99) continue;
            const auto here = evaluator.evaluate(mesh.positions, {f, u, v});
            if (!here) continue;
            const auto right = evaluator.evaluate(mesh.positions, {f, u + h, v}),
                       left = evaluator.evaluate(mesh.positions, {f, u - h, v});
            const auto up = evaluator.evaluate(mesh.positions, {f, u, v + h}),
                       down = evaluator.evaluate(mesh.positions, {f, u, v - h});
            // Second derivatives grow as sharpness runs out: by h · 2^2 · 8 at most here, where it is below 3.
            EXPECT_LT(((right->point - left->point) / (2 * h) - here->du).norm(), 1e-3) << f << " " << u << " " << v;
            EXPECT_LT(((up->point - down->point) / (2 * h) - here->dv).norm(), 1e-3) << f << " " << u << " " << v;
            EXPECT_LT((here->normal - here->du.cross(here->dv).normalized()).norm(), 1e-12);
        }
    }
}

TEST(LimitEvaluator, TendsToWhatItSaysAtCorners) {
    const Seeds seeds(100);
    for (std::uint64_t seed = seeds.first; seed < seeds.first + seeds.count; ++seed) {
        TESSERA_TRACE_SEED("unit_subdivision", seed);
        std::mt19937_64 random(seed);
        const ControlMesh mesh = test::someMesh(random);
        const auto topology = SubdivisionTopology::build(mesh);
        ASSERT_TRUE(topology.has_value());
        LimitEvaluator evaluator(*topology);
        for (std::uint32_t f = 0; f < topology->ptexFaceCount(); ++f) {
            const auto corner = evaluator.evaluate(mesh.positions, {f, 0, 0}),
                       near = evaluator.evaluate(mesh.positions, {f, 1e-13, 1e-13});
            if (!corner) continue;
            // 43 halvings; the slowest vertex of these, of valence 8 or fixed, shrinks to 0.67 at each: 3e-8.
            EXPECT_LT((corner->point - near->point).norm(), 1e-7) << f;
        }
    }
}

TEST(LimitEvaluator, DerivativesAtVerticesOfRefinementsAreThoseBesideThem) {
    // Inside a face and on its edges all vertices of refinements are regular, or on creases: there the limit's masks
    // give derivatives.
    const Seeds seeds(150);
    std::size_t seen = 0;
    for (std::uint64_t seed = seeds.first; seed < seeds.first + seeds.count; ++seed) {
        TESSERA_TRACE_SEED("unit_subdivision", seed);
        std::mt19937_64 random(seed);
        ControlMesh mesh = test::someMesh(random);
        const auto topology = SubdivisionTopology::build(mesh);
        ASSERT_TRUE(topology.has_value());
        LimitEvaluator evaluator(*topology);
        const bool triangle = mesh.scheme == SubdivisionScheme::kLoop;
        for (std::uint32_t f = 0; f < topology->ptexFaceCount(); ++f) {
            if (topology->ptexFace(f).corner != kNoIndex) continue;
            for (int i = 0; i <= 8; ++i) {
                for (int j = 0; i + j <= (triangle ? 8 : 16) && j <= 8; ++j) {
                    if (i % 8 == 0 && j % 8 == 0) continue;
                    // Inwards, so not across a crease.
                    const double u = i / 8.0, v = j / 8.0, step = 1e-9, toU = (triangle ? 1.0 / 3 : 0.5) - u,
                                 toV = (triangle ? 1.0 / 3 : 0.5) - v;
                    const auto here = evaluator.evaluate(mesh.positions, {f, u, v});
                    const auto beside = evaluator.evaluate(
                        mesh.positions, {f, u + step * toU + 0.1 * step * v, v + step * toV - 0.1 * step * u});
                    if (!here) continue;
                    ++seen;
                    EXPECT_LT((here->du - beside->du).norm(), 1e-5) << f << " " << u << " " << v;
                    EXPECT_LT((here->dv - beside->dv).norm(), 1e-5) << f << " " << u << " " << v;
                }
            }
        }
    }
    EXPECT_GT(seen, 100 * seeds.count);
}

TEST(LimitEvaluator, NormalsAtBoundariesAreTheLimitOfNormals) {
    // A fan of faces around a vertex of the boundary, bent.
    for (const SubdivisionScheme scheme : {SubdivisionScheme::kCatmullClark, SubdivisionScheme::kLoop}) {
        for (std::uint32_t faces = 2; faces <= 5; ++faces) {
            std::vector<Vec3d> positions{{0, 0, 0.3}};
            std::vector<std::vector<std::uint32_t>> all;
            const auto on = [&](double turn, double radius) {
                positions.emplace_back(radius * std::cos(turn), radius * std::sin(turn), 0.2 * turn * radius);
            };
            for (std::uint32_t i = 0; i <= faces; ++i) on(3.2 * i / faces, 1);
            for (std::uint32_t i = 0; i < faces; ++i) {
                if (scheme == SubdivisionScheme::kLoop) {
                    all.push_back({0, 1 + i, 2 + i});
                } else {
                    on(3.2 * (i + 0.5) / faces, 1.5);
                    all.push_back({0, 1 + i, faces + 2 + i, 2 + i});
                }
            }
            const ControlMesh mesh = test::meshOf(positions, all, scheme);
            const auto topology = SubdivisionTopology::build(mesh);
            ASSERT_TRUE(topology.has_value());
            LimitEvaluator evaluator(*topology);
            const auto at = evaluator.evaluate(mesh.positions, {0, 0, 0}),
                       near = evaluator.evaluate(mesh.positions, {0, 1e-12, 1e-12});
            EXPECT_NEAR(at->normal.norm(), 1, 1e-12);
            // Of more faces the second way across shrinks no faster than the way along, and what is beside has no
            // tangent plane in common.
            if (faces <= 3) {
                EXPECT_LT((at->normal - near->normal).norm(), 2e-3) << faces;
            }
        }
    }
}

TEST(LimitEvaluator, NormalsAtSmoothVerticesAreTheLimitOfNormals) {
    for (const SubdivisionScheme scheme : {SubdivisionScheme::kCatmullClark, SubdivisionScheme::kLoop}) {
        for (std::uint32_t valence = 3; valence <= 60; valence += valence < 10 ? 1 : 25) {
            const ControlMesh mesh = test::poleMesh(valence, scheme);
            const auto topology = SubdivisionTopology::build(mesh);
            ASSERT_TRUE(topology.has_value());
            LimitEvaluator evaluator(*topology);
            const auto pole = evaluator.evaluate(mesh.positions, {0, 0, 0}),
                       near = evaluator.evaluate(mesh.positions, {0, 1e-12, 1e-12});
            ASSERT_TRUE(pole.has_value() && near.has_value());
            EXPECT_LT((pole->normal - Vec3d(0, 0, 1)).norm(), 1e-9) << valence;
            // At more edges the third eigenvalue comes so near the second that 40 refinements do not part them.
            if (valence < 10) {
                EXPECT_LT((near->normal - Vec3d(0, 0, 1)).norm(), 1e-3) << valence;
            }
        }
    }
}

TEST(LimitEvaluator, MovesOnlyWhatDependsOnAPoint) {
    const Seeds seeds(60);
    for (std::uint64_t seed = seeds.first; seed < seeds.first + seeds.count; ++seed) {
        TESSERA_TRACE_SEED("unit_subdivision", seed);
        std::mt19937_64 random(seed);
        ControlMesh mesh = test::someMesh(random);
        const auto topology = SubdivisionTopology::build(mesh);
        ASSERT_TRUE(topology.has_value());
        LimitEvaluator evaluator(*topology);
        const auto moved = static_cast<std::uint32_t>(random() % mesh.positions.size());
        std::vector<Vec3d> other = mesh.positions;
        other[moved] += Vec3d(0.5, -0.25, 1);
        const auto touched = topology->touchedBy(std::span(&moved, 1));
        EXPECT_TRUE(std::is_sorted(touched.begin(), touched.end()));
        const std::size_t nodes = evaluator.graph().nodeCount();
        for (std::uint32_t f = 0; f < topology->ptexFaceCount(); ++f) {
            const auto before = evaluator.evaluate(mesh.positions, {f, 0.3, 0.4}),
                       after = evaluator.evaluate(other, {f, 0.3, 0.4});
            if (!before) continue;
            if (!std::binary_search(touched.begin(), touched.end(), f)) {
                EXPECT_EQ(before->point, after->point) << f;
            }
        }
        EXPECT_GT(evaluator.graph().nodeCount(), nodes);
    }
}

TEST(LimitEvaluator, AffineMapsMapTheSurface) {
    std::mt19937_64 random(5);
    const ControlMesh mesh = test::someMesh(random);
    const auto topology = SubdivisionTopology::build(mesh);
    ASSERT_TRUE(topology.has_value());
    LimitEvaluator evaluator(*topology);
    Mat3d m;
    m << 1, 2, 0, -1, 0.5, 3, 0, 1, 1;
    std::vector<Vec3d> mapped;
    for (const Vec3d& p : mesh.positions) mapped.emplace_back(m * p + Vec3d(1, 2, 3));
    for (std::uint32_t f = 0; f < topology->ptexFaceCount(); ++f) {
        const auto a = evaluator.evaluate(mesh.positions, {f, 0.2, 0.1}), b = evaluator.evaluate(mapped, {f, 0.2, 0.1});
        if (a) {
            EXPECT_LT((m * a->point + Vec3d(1, 2, 3) - b->point).norm(), 1e-12);
        }
    }
}

TEST(LimitEvaluator, RefusesPlacesThatAreNone) {
    const ControlMesh mesh = test::gridMesh(3, 3, false, SubdivisionScheme::kCatmullClark);
    const auto topology = SubdivisionTopology::build(mesh);
    ASSERT_TRUE(topology.has_value());
    LimitEvaluator evaluator(*topology);
    EXPECT_EQ(evaluator.evaluate(mesh.positions, {9, 0, 0}).error().message, "face 9: there are 9");
    for (const double bad : {-0.1, 1.1, std::nan(""), std::numeric_limits<double>::infinity()}) {
        EXPECT_FALSE(evaluator.evaluate(mesh.positions, {0, bad, 0}).has_value());
        EXPECT_FALSE(evaluator.evaluate(mesh.positions, {0, 0, bad}).has_value());
    }
    EXPECT_FALSE(evaluator.evaluate(std::span(mesh.positions).first(3), {0, 0, 0}).has_value());
}

TEST(LimitEvaluator, ForgetsWhatItHeldAndAnswersTheSame) {
    std::mt19937_64 random(11);
    const ControlMesh mesh = test::someMesh(random);
    const auto topology = SubdivisionTopology::build(mesh);
    LimitEvaluator evaluator(*topology);
    const auto before = evaluator.evaluate(mesh.positions, {0, 0.123, 0.456});
    evaluator.graph().shrink(0);
    EXPECT_EQ(evaluator.graph().nodeCount(), 0U);
    EXPECT_EQ(evaluator.evaluate(mesh.positions, {0, 0.123, 0.456})->point, before->point);
}

}  // namespace
}  // namespace tessera
