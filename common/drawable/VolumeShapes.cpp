#include "common/drawable/VolumeShapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "common/drawable/GlyphArrays.h"

namespace tessera {
namespace {

/// n·x <= d is kept; |n| = 1, in coordinates in which the box is from -1 to 1.
struct ClipPlane {
    Vec3d n;
    double d = 0;
};

constexpr double kOnPlane = 1e-12, kOneCorner = 1e-9;

/// From the node's coordinates to the cube's; |n| > 0.
ClipPlane planeInCube(const Vec4d& plane, const Vec3d& middle, const Vec3d& half) {
    const Vec3d normal = plane.head<3>();
    const Vec3d n = half.cwiseProduct(normal);
    const double d = plane.w() - normal.dot(middle), size = n.norm();
    // Of numbers so small that nothing is left of them: the plane is far away, or through the middle.
    if (!(size > 0)) return {Vec3d::UnitX(), d < 0 ? -4.0 : d > 0 ? 4.0 : 0.0};
    return {n / size, std::clamp(d / size, -4.0, 4.0)};
}

/// As Sutherland and Hodgman ("Reentrant polygon clipping", 1974) cut a convex polygon at a plane.
std::vector<Vec3d> cutAt(const std::vector<Vec3d>& polygon, const ClipPlane& plane) {
    std::vector<Vec3d> kept;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const Vec3d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
        const double da = plane.n.dot(a) - plane.d, db = plane.n.dot(b) - plane.d;
        if (da <= kOnPlane) kept.push_back(a);
        if ((da > kOnPlane) == (db > kOnPlane)) continue;
        // From the one inside to the one outside, whichever comes first: the same corner for both faces of an edge.
        const bool fromA = da <= kOnPlane;
        const Vec3d &in = fromA ? a : b, &out = fromA ? b : a;
        const double din = fromA ? da : db, dout = fromA ? db : da;
        kept.push_back(in + std::clamp(din / (din - dout), 0.0, 1.0) * (out - in));
    }
    return kept;
}

/// What of a plane lies in all the others, counter-clockwise seen from where its normal points.
std::vector<Vec3d> polygonOn(const ClipPlane& plane, std::span<const ClipPlane> others, std::size_t but) {
    int least = 0;
    plane.n.cwiseAbs().minCoeff(&least);
    const Vec3d u = plane.n.cross(Vec3d::Unit(least)).normalized(), v = plane.n.cross(u), at = plane.d * plane.n;
    // The cube reaches 1.73 from its middle.
    std::vector<Vec3d> polygon = {at - 8 * u - 8 * v, at + 8 * u - 8 * v, at + 8 * u + 8 * v, at - 8 * u + 8 * v};
    for (std::size_t i = 0; i < others.size() && !polygon.empty(); ++i)
        if (i != but) polygon = cutAt(polygon, others[i]);
    return polygon;
}

bool samePlane(const ClipPlane& a, const ClipPlane& b) {
    return (a.n - b.n).cwiseAbs().maxCoeff() < kOneCorner && std::abs(a.d - b.d) < kOneCorner;
}

/// Corners that are one, and fans of triangles between them.
class Corners {
public:
    MeshData mesh;

    [[nodiscard]] const std::vector<Vec3d>& places() const { return places_; }
    /// Of a slice which one it is: its corners are no other's.
    void add(const std::vector<Vec3d>& polygon, bool turned, std::uint32_t slice = 0) {
        std::vector<std::uint32_t> corners;
        for (const Vec3d& place : polygon)
            if (const std::uint32_t corner = find(place, slice);
                corners.empty() || (corner != corners.back() && corner != corners.front()))
                corners.push_back(corner);
        if (turned) std::ranges::reverse(corners);
        for (std::size_t i = 2; i < corners.size(); ++i)
            for (const std::size_t corner : {std::size_t{0}, i - 1, i}) mesh.indices.push_back(corners[corner]);
    }
    [[nodiscard]] std::uint32_t sliceOf(std::size_t corner) const { return slices_[corner]; }

private:
    using Cell = std::array<std::int64_t, 4>;
    /// Cells of eight times what is one corner: another one lies in its own, or in those that it is near.
    [[nodiscard]] static std::int64_t cellAt(double at) { return std::llround(std::floor(at / (8 * kOneCorner))); }

    std::uint32_t find(const Vec3d& place, std::uint32_t slice) {
        const Vec3d reach = Vec3d::Constant(kOneCorner), lower = place - reach, upper = place + reach;
        for (std::int64_t z = cellAt(lower.z()); z <= cellAt(upper.z()); ++z)
            for (std::int64_t y = cellAt(lower.y()); y <= cellAt(upper.y()); ++y)
                for (std::int64_t x = cellAt(lower.x()); x <= cellAt(upper.x()); ++x)
                    if (const auto known = cells_.find({x, y, z, slice}); known != cells_.end())
                        for (const std::uint32_t corner : known->second)
                            if ((places_[corner] - place).cwiseAbs().maxCoeff() < kOneCorner) return corner;
        const auto corner = static_cast<std::uint32_t>(places_.size());
        places_.push_back(place);
        slices_.push_back(slice);
        cells_[{cellAt(place.x()), cellAt(place.y()), cellAt(place.z()), slice}].push_back(corner);
        return corner;
    }

    std::vector<Vec3d> places_;
    std::vector<std::uint32_t> slices_;
    std::map<Cell, std::vector<std::uint32_t>> cells_;
};

/// Cut where earlier planes go through it: each piece lies on one side of each of these (Fuchs, Kedem and Naylor, "On
/// visible surface generation by a priori tree structures", 1980), so that an eye can have them back to front.
std::vector<std::vector<Vec3d>> piecesOf(std::vector<Vec3d> polygon, std::span<const ClipPlane> earlier) {
    std::vector<std::vector<Vec3d>> pieces;
    if (polygon.size() > 2) pieces.push_back(std::move(polygon));
    for (const ClipPlane& plane : earlier) {
        std::vector<std::vector<Vec3d>> cut;
        for (std::vector<Vec3d>& piece : pieces) {
            const auto beyond = [&](double side) {
                return std::ranges::any_of(
                    piece, [&](const Vec3d& p) { return side * (plane.n.dot(p) - plane.d) > kOnPlane; });
            };
            if (!beyond(1) || !beyond(-1)) {
                cut.push_back(std::move(piece));
                continue;
            }
            for (const ClipPlane& side : {plane, ClipPlane{-plane.n, -plane.d}})
                if (std::vector<Vec3d> half = cutAt(piece, side); half.size() > 2) cut.push_back(std::move(half));
        }
        pieces = std::move(cut);
    }
    return pieces;
}

}  // namespace

Fineness finenessOnScreens(const Aspect& aspect, ObjectId core) {
    if (core && aspect.get<Glyphs>(core)) return kGlyphsOnScreens;
    const auto* volume = core ? aspect.get<Volume>(core) : nullptr;
    return volume && volume->mode != Volume::kSurface ? Fineness(kVolumeOnScreens) : Fineness();
}

Box boxOf(const Volume& v) {
    const Vec3d last(static_cast<double>(v.sizeX - 1), static_cast<double>(v.sizeY - 1),
                     static_cast<double>(v.sizeZ - 1));
    return {v.origin, v.origin + v.spacing.cwiseProduct(last)};
}

Box boxOnScreens(const Aspect& aspect, ObjectId core) {
    const auto* volume = core ? aspect.get<Volume>(core) : nullptr;
    return volume && volume->mode != Volume::kSurface && !volume->voxels.empty() ? boxOf(*volume) : Box();
}

MeshData shapeOnScreens(const Volume& v) {
    const Box box = boxOf(v);
    const Vec3d middle = box.center(), half = 0.5 * box.size();
    std::vector<ClipPlane> planes;
    for (int axis = 0; axis < 3; ++axis)
        for (const double side : {1.0, -1.0}) planes.push_back({side * Vec3d::Unit(axis), 1});
    const auto add = [&](const Blob& blob, std::vector<ClipPlane>& to) {
        const std::span<const double> numbers = blob.as<double>();
        for (std::size_t i = 0; i + 3 < numbers.size(); i += 4) {
            const ClipPlane plane =
                planeInCube({numbers[i], numbers[i + 1], numbers[i + 2], numbers[i + 3]}, middle, half);
            if (std::ranges::none_of(to, [&](const ClipPlane& known) { return samePlane(known, plane); }))
                to.push_back(plane);
        }
    };
    add(v.clipPlanes, planes);
    Corners corners;
    if (v.mode == Volume::kSlices) {
        std::vector<ClipPlane> slices;
        add(v.slices, slices);
        for (std::uint32_t i = 0; i < slices.size(); ++i)
            for (const std::vector<Vec3d>& piece :
                 piecesOf(polygonOn(slices[i], planes, planes.size()), std::span(slices).first(i)))
                corners.add(piece, false, i);
    } else {
        for (std::size_t i = 0; i < planes.size(); ++i) corners.add(polygonOn(planes[i], planes, i), true);
    }
    MeshData& mesh = corners.mesh;
    if (mesh.indices.empty()) return {};
    for (std::size_t i = 0; i < corners.places().size(); ++i) {
        const Vec3f place = (middle + half.cwiseProduct(corners.places()[i])).cast<float>();
        mesh.positions.insert(mesh.positions.end(), {place.x(), place.y(), place.z()});
        if (v.mode == Volume::kSlices)
            mesh.texcoords.insert(mesh.texcoords.end(), {0, static_cast<float>(corners.sliceOf(i))});
    }
    return mesh;
}

}  // namespace tessera
