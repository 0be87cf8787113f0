#include "server/collision/representation/BallCover.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>

namespace tessera {

namespace {

constexpr double kSmallestMesh = 1e-100;
/// What a hundred cuts may be off by, in sizes of the mesh; and measuring, in radii.
constexpr double kCutting = 1e-14, kMeasuring = 1e-12;

/// Convex bits of triangles, each with its corners in a row.
struct Pieces {
    struct Piece {
        std::uint32_t face;
        std::uint32_t end;  ///< behind its last corner
    };
    std::vector<Vec3d> corners;
    std::vector<Piece> pieces;

    [[nodiscard]] bool empty() const { return pieces.empty(); }
    void close(std::uint32_t face) { pieces.push_back({face, static_cast<std::uint32_t>(corners.size())}); }
};

struct Halves {
    Pieces below, above;
};

/// What lies in the plane goes below.
Halves cut(const Pieces& whole, int axis, double at) {
    Halves out;
    std::uint32_t first = 0;
    for (const auto& [face, end] : whole.pieces) {
        bool below = false, above = false;
        for (std::uint32_t i = first; i < end; ++i) {
            below = below || whole.corners[i][axis] < at;
            above = above || whole.corners[i][axis] > at;
        }
        if (below && above) {
            Vec3d from = whole.corners[end - 1];
            for (std::uint32_t i = first; i < end; ++i) {
                const Vec3d& to = whole.corners[i];
                if ((from[axis] < at && to[axis] > at) || (from[axis] > at && to[axis] < at)) {
                    Vec3d through = from + (at - from[axis]) / (to[axis] - from[axis]) * (to - from);
                    through[axis] = at;
                    out.below.corners.push_back(through);
                    out.above.corners.push_back(through);
                }
                if (to[axis] <= at) out.below.corners.push_back(to);
                if (to[axis] >= at) out.above.corners.push_back(to);
                from = to;
            }
            out.below.close(face);
            out.above.close(face);
        } else {
            Pieces& side = above ? out.above : out.below;
            side.corners.insert(side.corners.end(), whole.corners.begin() + first, whole.corners.begin() + end);
            side.close(face);
        }
        first = end;
    }
    return out;
}

/// Whether a ball of this radius holds all of it, and where; the centre goes towards the farthest corner in ever
/// shorter steps (Badoiu and Clarkson, Smaller core-sets for balls, SODA 2003).
std::optional<Vec3d> ballAround(const Pieces& pieces, const Box& box, double radius) {
    constexpr int kSteps = 12;
    Vec3d centre = box.center();
    if (0.5 * box.size().norm() <= radius) return centre;
    if (box.size().maxCoeff() > 2 * radius) return std::nullopt;
    for (int step = 1; step <= kSteps; ++step) {
        const Vec3d* farthest = &pieces.corners.front();
        for (const Vec3d& p : pieces.corners)
            if ((p - centre).squaredNorm() > (*farthest - centre).squaredNorm()) farthest = &p;
        if ((*farthest - centre).norm() <= radius) return centre;
        centre += (*farthest - centre) / (step + 1);
    }
    return std::nullopt;
}

/// That of the piece whose middle is nearest.
std::uint32_t faceAt(const Pieces& pieces, const Vec3d& place) {
    std::uint32_t best = 0, first = 0;
    double least = std::numeric_limits<double>::infinity();
    for (const auto& [face, end] : pieces.pieces) {
        Vec3d sum = Vec3d::Zero();
        for (std::uint32_t i = first; i < end; ++i) sum += pieces.corners[i];
        if (const double away = (sum / (end - first) - place).squaredNorm(); away < least) {
            least = away;
            best = face;
        }
        first = end;
    }
    return best;
}

/// Where it is cut: parts of one length, none of them longer than what a ball holds of a plane in all likelihood.
double middleOf(const Box& box, int axis, double radius) {
    constexpr double kPart = 1.41;
    const double length = box.size()[axis], parts = std::max(2.0, std::ceil(length / (kPart * radius)));
    return box.lower[axis] + length * (std::floor(parts / 2) / parts);
}

}  // namespace

Expected<BallCover> coverOf(const TriangleMesh& mesh, double radius, const BallCoverLimits& limits) {
    if (mesh.faceCount() == 0) return fail(ErrorCode::kBadInput, "there is nothing to cover");
    const Box& bounds = mesh.bounds();
    const double size = bounds.size().maxCoeff();
    if (size > 0 && size < kSmallestMesh) return fail(ErrorCode::kBadInput, "it is too small to be covered by balls");
    // Beside the origin and of size 1, so that rounding is that of the mesh, not that of its place.
    const Vec3d origin = bounds.center();
    const double scale = size > 0 ? std::exp2(-std::ilogb(size)) : 1;
    const double farthest = std::max(bounds.lower.cwiseAbs().maxCoeff(), bounds.upper.cwiseAbs().maxCoeff());
    const double floatRounding = 2 * 0x1p-24 * farthest;
    const bool asFloats = floatRounding <= radius / 64 && farthest < 0.5 * std::numeric_limits<float>::max();
    const double rounding = (asFloats ? floatRounding : 4 * 0x1p-53 * farthest) + kCutting * size;
    const double inner = size > 0 ? (radius * (1 - kMeasuring) - rounding) * scale : 0;
    if (size > 0 && !(inner > 0.5 * radius * scale))
        return fail(ErrorCode::kBadInput, "the balls are too small beside the coordinates");

    BallCover out;
    out.radius = radius;
    std::vector<Pieces> open(1);
    open[0].corners.reserve(3 * mesh.faceCount());
    for (std::uint32_t face = 0; face < mesh.faceCount(); ++face) {
        for (const Vec3d& p : mesh.triangle(face)) open[0].corners.push_back((p - origin) * scale);
        open[0].close(face);
    }
    std::uint64_t looked = 0;
    while (!open.empty()) {
        const Pieces pieces = std::move(open.back());
        open.pop_back();
        looked += pieces.corners.size();
        if (looked > limits.maxCorners) return fail(ErrorCode::kLimit, "covering it by balls takes too much work");
        Box box;
        for (const Vec3d& p : pieces.corners) box.extend(p);
        if (const std::optional<Vec3d> centre = ballAround(pieces, box, inner)) {
            if (out.centres.size() == limits.maxBalls)
                return fail(ErrorCode::kLimit,
                            "covering it takes more than " + std::to_string(limits.maxBalls) + " balls");
            const Vec3d place = origin + *centre / scale;
            out.centres.push_back(asFloats ? Vec3d(place.cast<float>().cast<double>()) : place);
            out.faces.push_back(faceAt(pieces, *centre));
            continue;
        }
        int axis = 0;
        box.size().maxCoeff(&axis);
        auto [below, above] = cut(pieces, axis, middleOf(box, axis, inner));
        for (Pieces* side : {&above, &below})
            if (!side->empty()) open.push_back(std::move(*side));
    }
    return out;
}

double coverRadius(const Box& bounds, unsigned level) {
    return std::ldexp(bounds.size().stableNorm(), -static_cast<int>(level) - 1);
}

}  // namespace tessera
