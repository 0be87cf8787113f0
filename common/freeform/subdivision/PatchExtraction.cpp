#include "common/freeform/subdivision/PatchExtraction.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

namespace tessera {
namespace {

/// Control points of a patch: 16 of a bicubic, u fastest, or 15 of a quartic triangle.
using PatchPoints = std::vector<Vec3d>;

PatchPoints splineBezier(const SparseRows& spline, std::span<const Vec3d> points) {
    if (spline.count() == 16) {
        std::array<Vec3d, 16> p;
        for (std::size_t i = 0; i < 16; ++i) p[i] = spline.apply(i, points);
        const auto bezier = bezierOfSpline(p);
        return {bezier.begin(), bezier.end()};
    }
    std::array<Vec3d, 12> p;
    for (std::size_t i = 0; i < 12; ++i) p[i] = spline.apply(i, points);
    const auto bezier = bezierOfBoxSpline(p);
    return {bezier.begin(), bezier.end()};
}

/// Both halves of a cubic.
void splitCubic(const std::array<Vec3d, 4>& p, std::array<Vec3d, 4>& low, std::array<Vec3d, 4>& high) {
    const Vec3d a = (p[0] + p[1]) / 2, b = (p[1] + p[2]) / 2, c = (p[2] + p[3]) / 2, ab = (a + b) / 2, bc = (b + c) / 2;
    low = {p[0], a, ab, (ab + bc) / 2};
    high = {low[3], bc, c, p[3]};
}

/// The part of a patch that is child `which`.
PatchPoints partOfPatch(const PatchPoints& points, std::uint32_t which) {
    if (points.size() == 15) {
        const BezierTriangle whole{.degree = 4, .points = points};
        return split(whole)[which].points;
    }
    const bool right = which == 1 || which == 2, up = which >= 2;
    PatchPoints out = points;
    std::array<Vec3d, 4> low, high;
    for (std::size_t y = 0; y < 4; ++y) {
        splitCubic({out[4 * y], out[4 * y + 1], out[4 * y + 2], out[4 * y + 3]}, low, high);
        for (std::size_t x = 0; x < 4; ++x) out[4 * y + x] = (right ? high : low)[x];
    }
    for (std::size_t x = 0; x < 4; ++x) {
        splitCubic({out[x], out[x + 4], out[x + 8], out[x + 12]}, low, high);
        for (std::size_t y = 0; y < 4; ++y) out[4 * y + x] = (up ? high : low)[y];
    }
    return out;
}

/// Bilinear between four points, or linear between three, as a patch of the usual degree.
PatchPoints flatPatch(const std::vector<Vec3d>& corners) {
    PatchPoints out;
    if (corners.size() == 3) {
        for (int j = 0; j <= 4; ++j) {
            for (int i = 0; i + j <= 4; ++i)
                out.push_back(((4 - i - j) * corners[0] + i * corners[1] + j * corners[2]) / 4);
        }
        return out;
    }
    for (int y = 0; y < 4; ++y) {
        for (int x = 0; x < 4; ++x) {
            const double s = x / 3.0, t = y / 3.0;
            out.push_back((1 - t) * ((1 - s) * corners[0] + s * corners[1]) +
                          t * ((1 - s) * corners[3] + s * corners[2]));
        }
    }
    return out;
}

double farthest(std::span<const Vec3d> points, const Vec3d& from) {
    double most = 0;
    for (const Vec3d& p : points) most = std::max(most, (p - from).squaredNorm());
    return std::sqrt(most);
}

class PatchExtractor {
public:
    PatchExtractor(NeighbourhoodGraph& graph, const PatchOptions& options, double rounding)
        : graph_(graph),
          options_(options),
          rounding_(rounding),
          triangle_(graph.rules().scheme == SubdivisionScheme::kLoop) {}

    /// False: too many.
    bool add(const NeighbourhoodGraph::Node& node, const std::vector<Vec3d>& points, const SurfacePatch& place,
             int level) {
        if (out_.size() >= options_.mostPatches) return false;
        if (node.spline) {
            emit(splineBezier(*node.spline, points), place, rounding_);
            return true;
        }
        const SparseRows* const rows = options_.approximate ? graph_.approximationOf(node) : nullptr;
        const PatchPoints patch = candidate(node, points, rows);
        double error = hullError(points, patch);
        if (options_.approximate && error > options_.tolerance && level < kMostPatchLevels) {
            error = 0;
            bound(node, points, patch, error, kMostPatchLevels);
        }
        if (error + rounding_ <= options_.tolerance || level >= kMostPatchLevels) {
            emit(patch, place, error + rounding_);
            return true;
        }
        for (std::uint32_t c = 0; c < 4; ++c) {
            const NeighbourhoodGraph::Child& child = graph_.childOf(node, c);
            std::vector<Vec3d> finer;
            child.points.apply(points, finer);
            if (!add(*child.node, finer, partOfPlace(place, c), level + 1)) return false;
        }
        return true;
    }

    std::vector<SurfacePatch> take() { return std::move(out_); }

private:
    void emit(const PatchPoints& points, const SurfacePatch& place, double error) {
        SurfacePatch patch = place;
        patch.error = error;
        if (triangle_) {
            patch.shape = BezierTriangle{.degree = 4, .points = points};
        } else {
            BezierPatch bezier;
            bezier.points.reserve(points.size());
            for (const Vec3d& p : points) bezier.points.emplace_back(p.x(), p.y(), p.z(), 1.0);
            patch.shape = std::move(bezier);
        }
        out_.push_back(std::move(patch));
    }

    SurfacePatch partOfPlace(const SurfacePatch& place, std::uint32_t child) const {
        SurfacePatch part{.ptex = place.ptex, .u = place.u, .v = place.v, .size = place.size / 2, .shape = {}};
        if (triangle_ && child == 3) {
            part.u += part.size;
            part.v += part.size;
            part.size = -part.size;
            return part;
        }
        if (child == 1 || (child == 2 && !triangle_)) part.u += part.size;
        if (child == 2 || child == 3) part.v += part.size;
        return part;
    }

    static PatchPoints candidate(const NeighbourhoodGraph::Node& node, const std::vector<Vec3d>& points,
                                 const SparseRows* rows) {
        if (rows != nullptr) {
            PatchPoints out;
            rows->apply(points, out);
            return out;
        }
        return flatPatch({points.begin(), points.begin() + node.faceSize()});
    }

    static double hullError(const std::vector<Vec3d>& points, const PatchPoints& patch) {
        Vec3d middle = Vec3d::Zero();
        for (const Vec3d& p : patch) middle += p;
        middle /= static_cast<double>(patch.size());
        return farthest(points, middle) + farthest(patch, middle);
    }

    /// Raises `worst` to a bound of how far the surface is from the patch, or above the tolerance where that is shown
    /// first.
    void bound(const NeighbourhoodGraph::Node& node, const std::vector<Vec3d>& points, const PatchPoints& patch,
               double& worst, int levels) {
        if (node.spline) {
            const PatchPoints exact = splineBezier(*node.spline, points);
            for (std::size_t i = 0; i < exact.size(); ++i) worst = std::max(worst, (exact[i] - patch[i]).norm());
            return;
        }
        const double hull = hullError(points, patch);
        if (hull <= std::max(worst, options_.tolerance / 4) || levels == 0 || worst > options_.tolerance) {
            worst = std::max(worst, hull);
            return;
        }
        for (const bool regular : {true, false}) {  // what is regular is quick to judge
            for (std::uint32_t c = 0; c < 4; ++c) {
                if (worst > options_.tolerance) return;
                const NeighbourhoodGraph::Child& child = graph_.childOf(node, c);
                if (child.node->spline.has_value() != regular) continue;
                std::vector<Vec3d> finer;
                child.points.apply(points, finer);
                bound(*child.node, finer, partOfPatch(patch, c), worst, levels - 1);
            }
        }
    }

    NeighbourhoodGraph& graph_;
    const PatchOptions& options_;
    const double rounding_;
    const bool triangle_;
    std::vector<SurfacePatch> out_;
};

}  // namespace

Expected<std::vector<SurfacePatch>> patchesOf(NeighbourhoodGraph& graph, std::span<const Vec3d> positions,
                                              std::span<const std::uint32_t> ptexFaces, const PatchOptions& options) {
    const SubdivisionTopology& topology = graph.topology();
    if (positions.size() != topology.controlPointCount())
        return fail(ErrorCode::kBadInput, "there are not as many positions as control points");
    if (!(options.tolerance > 0) || !std::isfinite(options.tolerance))
        return fail(ErrorCode::kBadInput, "a tolerance has to be above 0");
    if (topology.scheme() == SubdivisionScheme::kBilinear)
        return fail(ErrorCode::kBadInput, "a bilinear surface is no set of smooth patches");
    double largest = 0;
    for (const Vec3d& p : positions) largest = std::max(largest, p.lpNorm<Eigen::Infinity>());
    PatchExtractor extractor(graph, options, 1e-13 * largest);
    std::vector<Vec3d> points, finer;
    for (const std::uint32_t ptex : ptexFaces) {
        if (ptex >= topology.ptexFaceCount()) {
            return fail(ErrorCode::kBadInput,
                        "face " + std::to_string(ptex) + ": there are " + std::to_string(topology.ptexFaceCount()));
        }
        const PtexFace face = topology.ptexFace(ptex);
        if (!topology.hasSurface(face.face)) continue;
        graph.shrink();
        const NeighbourhoodGraph::Face& base = graph.faceOf(face.face);
        const NeighbourhoodGraph::Node* node = base.node;
        points.clear();
        for (const std::uint32_t p : base.points) points.push_back(positions[p]);
        if (face.corner != kNoIndex) {
            const NeighbourhoodGraph::Child& child = graph.childOf(*node, face.corner);
            child.points.apply(points, finer);
            points.swap(finer);
            node = child.node;
        }
        if (!extractor.add(*node, points, {.ptex = ptex, .shape = {}}, 0)) {
            return fail(ErrorCode::kLimit, "face " + std::to_string(ptex) + ": more than " +
                                               std::to_string(options.mostPatches) +
                                               " patches; take a larger tolerance");
        }
    }
    return extractor.take();
}

Expected<std::vector<SurfacePatch>> patchesOf(NeighbourhoodGraph& graph, std::span<const Vec3d> positions,
                                              const PatchOptions& options) {
    std::vector<std::uint32_t> all(graph.topology().ptexFaceCount());
    std::iota(all.begin(), all.end(), 0U);
    return patchesOf(graph, positions, all, options);
}

SurfacePoint evaluate(const SurfacePatch& patch, double s, double t) {
    SurfacePoint p = std::visit([&](const auto& shape) { return evaluate(shape, s, t); }, patch.shape);
    p.du /= patch.size;
    p.dv /= patch.size;
    p.error = patch.error;
    return p;
}

}  // namespace tessera
