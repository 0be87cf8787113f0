#include "tests/truth/CgalOracle.h"

#include <limits>

#ifdef TESSERA_CGAL

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Exact_rational.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/box_intersection_d.h>
#include <CGAL/intersections.h>
#include <CGAL/squared_distance_3.h>

#include <algorithm>
#include <cmath>

namespace tessera::cgal {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using BoxOfFace = CGAL::Box_intersection_d::Box_with_info_d<double, 3, std::uint32_t>;

struct Side {
    std::vector<Triangle> triangles;
    std::vector<CGAL::Bbox_3> boxes;
    CGAL::Bbox_3 bounds;
};

Side sideOf(const TriangleMesh& mesh, const Affine3d* map) {
    Side side;
    for (std::uint32_t f = 0; f < mesh.faceCount(); ++f) {
        side.triangles.push_back(map ? transformed(*map, mesh.triangle(f)) : mesh.triangle(f));
        CGAL::Bbox_3 box;
        for (const Vec3d& p : side.triangles.back()) box += CGAL::Bbox_3(p.x(), p.y(), p.z(), p.x(), p.y(), p.z());
        side.boxes.push_back(box);
        side.bounds += box;
    }
    return side;
}

/// The boxes of those triangles that come within `margin` of the other side's bounds, grown by half of it.
std::vector<BoxOfFace> boxesNear(const Side& side, const CGAL::Bbox_3& others, double margin) {
    std::vector<BoxOfFace> out;
    const double half = 0.5 * margin;
    const auto grown = [half](const CGAL::Bbox_3& b) {
        return CGAL::Bbox_3(b.xmin() - half, b.ymin() - half, b.zmin() - half, b.xmax() + half, b.ymax() + half,
                            b.zmax() + half);
    };
    const CGAL::Bbox_3 reach = grown(others);
    for (std::uint32_t f = 0; f < side.boxes.size(); ++f) {
        const CGAL::Bbox_3 box = grown(side.boxes[f]);
        if (CGAL::do_overlap(box, reach)) out.emplace_back(box, f);
    }
    return out;
}

template <typename K>
typename K::Triangle_3 in(const Triangle& t) {
    const auto point = [](const Vec3d& p) { return typename K::Point_3(p.x(), p.y(), p.z()); };
    return {point(t[0]), point(t[1]), point(t[2])};
}

/// Calls found(faceA, faceB) for all pairs whose boxes, grown, overlap.
template <typename Found>
void forPairs(const Side& a, const Side& b, double margin, Found&& found) {
    std::vector<BoxOfFace> ofA = boxesNear(a, b.bounds, margin), ofB = boxesNear(b, a.bounds, margin);
    CGAL::box_intersection_d(ofA.begin(), ofA.end(), ofB.begin(), ofB.end(),
                             [&](const BoxOfFace& x, const BoxOfFace& y) { found(x.info(), y.info()); });
}

using Plain = CGAL::Simple_cartesian<double>;

double gap(const CGAL::Bbox_3& a, const CGAL::Bbox_3& b) {
    double squared = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const double g = std::max({0.0, a.min(axis) - b.max(axis), b.min(axis) - a.max(axis)});
        squared += g * g;
    }
    return std::sqrt(squared);
}

/// Of two triangles that do not meet: the least of corners to faces and of edges to edges.
double roundedDistance(const Plain::Triangle_3& s, const Plain::Triangle_3& t) {
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 3; ++i) {
        least = std::min({least, CGAL::squared_distance(s.vertex(i), t), CGAL::squared_distance(t.vertex(i), s)});
        for (int j = 0; j < 3; ++j)
            least = std::min(least, CGAL::squared_distance(Plain::Segment_3(s.vertex(i), s.vertex(i + 1)),
                                                           Plain::Segment_3(t.vertex(j), t.vertex(j + 1))));
    }
    return std::sqrt(least);
}

}  // namespace

bool available() {
    return true;
}

std::vector<FacePair> intersectingPairs(const TriangleMesh& a, const TriangleMesh& b, const Affine3d& a_T_b) {
    const Side ofA = sideOf(a, nullptr), ofB = sideOf(b, &a_T_b);
    std::vector<FacePair> pairs;
    forPairs(ofA, ofB, 0, [&](std::uint32_t f, std::uint32_t g) {
        if (CGAL::do_intersect(in<Kernel>(ofA.triangles[f]), in<Kernel>(ofB.triangles[g]))) pairs.push_back({f, g});
    });
    std::sort(pairs.begin(), pairs.end());
    return pairs;
}

double distance(const TriangleMesh& a, const TriangleMesh& b, const Affine3d& a_T_b, double atMost) {
    if (!intersectingPairs(a, b, a_T_b).empty()) return 0;
    using Exact = CGAL::Simple_cartesian<CGAL::Exact_rational>;
    const Side ofA = sideOf(a, nullptr), ofB = sideOf(b, &a_T_b);
    // Distances in double first, with a margin for their rounding: few pairs are left for rational numbers.
    struct Candidate {
        std::uint32_t a, b;
        double about;
    };
    const double margin = atMost + 1e-9 * (1 + atMost);
    std::vector<Candidate> candidates;
    double least = std::numeric_limits<double>::infinity();
    forPairs(ofA, ofB, margin, [&](std::uint32_t f, std::uint32_t g) {
        if (gap(ofA.boxes[f], ofB.boxes[g]) > std::min(margin, least + 1e-6)) return;
        const double about = roundedDistance(in<Plain>(ofA.triangles[f]), in<Plain>(ofB.triangles[g]));
        least = std::min(least, about);
        if (about <= least + 1e-6) candidates.push_back({f, g, about});
    });
    Exact::FT best = -1;
    for (const Candidate& c : candidates) {
        if (c.about > least + 1e-6) continue;
        const Exact::FT d = CGAL::squared_distance(in<Exact>(ofA.triangles[c.a]), in<Exact>(ofB.triangles[c.b]));
        if (best < 0 || d < best) best = d;
    }
    return best < 0 ? std::numeric_limits<double>::infinity() : std::sqrt(CGAL::to_double(best));
}

double distance(const Vec3d& point, const Triangle& triangle) {
    return std::sqrt(CGAL::squared_distance(Plain::Point_3(point.x(), point.y(), point.z()), in<Plain>(triangle)));
}

}  // namespace tessera::cgal

#else

namespace tessera::cgal {

bool available() {
    return false;
}
std::vector<FacePair> intersectingPairs(const TriangleMesh&, const TriangleMesh&, const Affine3d&) {
    return {};
}
double distance(const TriangleMesh&, const TriangleMesh&, const Affine3d&, double) {
    return std::numeric_limits<double>::quiet_NaN();
}
double distance(const Vec3d&, const Triangle&) {
    return std::numeric_limits<double>::quiet_NaN();
}

}  // namespace tessera::cgal

#endif
