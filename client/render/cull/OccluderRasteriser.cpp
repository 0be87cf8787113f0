#include "client/render/cull/OccluderRasteriser.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tessera {

namespace {

/// No vertex may be displaced by more: the near end of an occluder is cut off where it would be.
constexpr double kWorstDisplacementPx = 0.1;
/// A float counts sixteenths of a pixel up to here. What lies farther outside is left out.
constexpr double kUtmostPx = 500'000;
/// A patch that is smaller hides nothing worth the work.
constexpr float kLeastExtentPx = 4;

}  // namespace

template <typename F>
void OccluderRasteriser::forEachTriangle(F&& f) const {
    for (const OccluderMesh::Run& run : runs_)
        for (std::uint32_t t = run.first; t < run.end; ++t) f(t);
}

OccluderRasteriser::Work OccluderRasteriser::add(const OccluderMesh& mesh, const Placed& placed,
                                                 const TileProjection& tile, OcclusionBuffer& buffer) {
    const OccluderMesh::Run all = mesh.all();
    return add(mesh, std::span(&all, 1), placed, tile, buffer);
}

OccluderRasteriser::Work OccluderRasteriser::add(const OccluderMesh& mesh, std::span<const OccluderMesh::Run> runs,
                                                 const Placed& placed, const TileProjection& tile,
                                                 OcclusionBuffer& buffer) {
    tile_ = &tile;
    clip_T_mesh_ = placed.clip_T_mesh;
    noise_ = placed.noise;
    const double displacement = noise_ * tile.pixelsPerMetre();  // at 1 m
    nearest_ = std::max(1.01 * tile.nearMetres() + noise_, displacement / kWorstDisplacementPx);
    farthest_ = 0.999 * tile.farMetres() - noise_;
    Work work;
    if (!(nearest_ < farthest_ && marks_.begin(tile, noise_, buffer))) return work;
    runs_ = runs;
    if (sides_.size() < mesh.triangles().size()) {
        sides_.resize(mesh.triangles().size(), Side::kOut);
        parents_.resize(mesh.triangles().size());
        patchOf_.resize(mesh.triangles().size());
    }
    project(mesh, placed, tile);
    findSides(mesh, placed);
    findPatches(mesh);
    for (const Patch& patch : patches_) addPatch(mesh, patch, buffer, work);
    forEachTriangle([this](std::uint32_t t) { sides_[t] = Side::kOut; });
    runs_ = {};
    return work;
}

void OccluderRasteriser::project(const OccluderMesh& mesh, const Placed& placed, const TileProjection& tile) {
    const std::span<const OccluderMesh::Point> source = mesh.points();
    if (points_.size() < source.size()) {
        points_.resize(source.size());
        fates_.resize(source.size());
        projectedFor_.resize(source.size(), 0);
    }
    // A copy: the compiler cannot know that nothing written below is it.
    const Mat4d m = placed.clip_T_mesh;
    nearestVertex_ = 0;
    if (runs_.size() == 1 && runs_[0].first == 0 && runs_[0].end == mesh.triangles().size()) {
        for (std::size_t i = 0; i < source.size(); ++i) projectPoint(source[i], i, m, tile);
    } else {
        if (++call_ == 0) {
            std::fill(projectedFor_.begin(), projectedFor_.end(), 0u);
            call_ = 1;
        }
        const std::span<const OccluderMesh::Triangle> triangles = mesh.triangles();
        forEachTriangle([&](std::uint32_t t) {
            for (const std::uint32_t v : triangles[t].vertex) {
                if (projectedFor_[v] == call_) continue;
                projectedFor_[v] = call_;
                projectPoint(source[v], v, m, tile);
            }
        });
    }
    // So high that a displacement of its corners changes neither a triangle's facing nor much of its slope.
    flattest_ = tile.flattestPx(noise_, nearestVertex_);
}

void OccluderRasteriser::projectPoint(const OccluderMesh::Point& point, std::size_t index, const Mat4d& m,
                                      const TileProjection& tile) {
    const double px = point[0];
    const double py = point[1];
    const double pz = point[2];
    const double w = m(3, 0) * px + m(3, 1) * py + m(3, 2) * pz + m(3, 3);
    if (!(w >= nearest_)) {
        fates_[index] = Fate::kTooNear;
        nearestVertex_ = 1 / nearest_;
        return;
    }
    const double x = tile.xPx(m(0, 0) * px + m(0, 1) * py + m(0, 2) * pz + m(0, 3), w);
    const double y = tile.yPx(m(1, 0) * px + m(1, 1) * py + m(1, 2) * pz + m(1, 3), w);
    const bool usable = w <= farthest_ && std::abs(x) < kUtmostPx && std::abs(y) < kUtmostPx;
    fates_[index] = usable ? Fate::kUsable : Fate::kUnusable;
    points_[index] = {static_cast<float>(x), static_cast<float>(y), static_cast<float>(1 / w)};
    nearestVertex_ = std::max(nearestVertex_, 1 / w);
}

ScreenPoint OccluderRasteriser::clipEdge(const OccluderMesh::Point& from, const OccluderMesh::Point& to) const {
    const Vec4d a = clip_T_mesh_ * Vec4d(from[0], from[1], from[2], 1);
    const Vec4d b = clip_T_mesh_ * Vec4d(to[0], to[1], to[2], 1);
    const Vec4d c = a + (b - a) * ((nearest_ - a.w()) / (b.w() - a.w()));
    return {static_cast<float>(tile_->xPx(c.x(), nearest_)), static_cast<float>(tile_->yPx(c.y(), nearest_)),
            static_cast<float>(1 / nearest_)};
}

OccluderRasteriser::Polygon OccluderRasteriser::polygonOf(const OccluderMesh& mesh, std::uint32_t triangle) const {
    const auto& vertex = mesh.triangles()[triangle].vertex;
    Polygon polygon;
    if (sides_[triangle] == Side::kFront) {
        for (std::size_t i = 0; i < 3; ++i) polygon.corners[i] = points_[vertex[i]];
        polygon.size = 3;
        return polygon;
    }
    const auto push = [&polygon](const ScreenPoint& p, int edge) {
        polygon.corners[polygon.size] = p;
        polygon.edges[polygon.size] = edge;
        ++polygon.size;
    };
    for (int i = 0; i < 3; ++i) {
        const std::uint32_t a = vertex[static_cast<std::size_t>(i)];
        const std::uint32_t b = vertex[static_cast<std::size_t>(i + 1) % 3];
        const bool aInside = fates_[a] != Fate::kTooNear;
        const bool bInside = fates_[b] != Fate::kTooNear;
        if (aInside) push(points_[a], i);
        if (aInside == bInside) continue;
        // The lower vertex first, so that two neighbours cut their edge at the very same point.
        const std::uint32_t first = std::min(a, b);
        const std::uint32_t second = std::max(a, b);
        push(clipEdge(mesh.points()[first], mesh.points()[second]), aInside ? -1 : i);
    }
    return polygon;
}

bool OccluderRasteriser::facesFront(const Polygon& polygon, bool mirrored) const {
    double area = 0;
    double longest = 0;
    const ScreenPoint& origin = polygon.corners[0];
    for (int i = 0; i < polygon.size; ++i) {
        const ScreenPoint& a = polygon.corners[i];
        const ScreenPoint& b = polygon.corners[i + 1 == polygon.size ? 0 : i + 1];
        const double ax = double{a.x} - origin.x;
        const double ay = double{a.y} - origin.y;
        const double bx = double{b.x} - origin.x;
        const double by = double{b.y} - origin.y;
        area += ax * by - ay * bx;
        longest = std::max(longest, (bx - ax) * (bx - ax) + (by - ay) * (by - ay));
        if (!(std::abs(a.x) < kUtmostPx && std::abs(a.y) < kUtmostPx)) return false;
    }
    if (mirrored) area = -area;
    return area > 0 && area * area > flattest_ * flattest_ * longest;
}

void OccluderRasteriser::findSides(const OccluderMesh& mesh, const Placed& placed) {
    const std::span<const OccluderMesh::Triangle> triangles = mesh.triangles();
    forEachTriangle([&](std::uint32_t t) {
        const auto& v = triangles[t].vertex;
        const Fate fates[3] = {fates_[v[0]], fates_[v[1]], fates_[v[2]]};
        int tooNear = 0;
        bool unusable = false;
        for (const Fate fate : fates) {
            tooNear += fate == Fate::kTooNear;
            unusable = unusable || fate == Fate::kUnusable;
        }
        if (unusable || tooNear == 3) return;
        if (tooNear > 0) {
            if (facesFront(polygonOf(mesh, t), placed.mirrored)) sides_[t] = Side::kFrontClipped;
            return;
        }
        const Polygon polygon{.corners = {points_[v[0]], points_[v[1]], points_[v[2]]}, .size = 3};
        if (facesFront(polygon, placed.mirrored)) sides_[t] = Side::kFront;
    });
}

std::uint32_t OccluderRasteriser::rootOf(std::uint32_t triangle) {
    while (parents_[triangle] != triangle) {
        parents_[triangle] = parents_[parents_[triangle]];
        triangle = parents_[triangle];
    }
    return triangle;
}

void OccluderRasteriser::findPatches(const OccluderMesh& mesh) {
    const std::span<const OccluderMesh::Triangle> triangles = mesh.triangles();
    forEachTriangle([this](std::uint32_t t) { parents_[t] = t; });
    forEachTriangle([&](std::uint32_t t) {
        if (sides_[t] == Side::kOut) return;
        for (const std::uint32_t other : triangles[t].behind) {
            if (other == OccluderMesh::kNone || other > t || sides_[other] == Side::kOut) continue;
            const std::uint32_t a = rootOf(t);
            const std::uint32_t b = rootOf(other);
            parents_[std::max(a, b)] = std::min(a, b);
        }
    });
    // A root is the lowest triangle of its patch, so it is met first.
    patches_.clear();
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    forEachTriangle([&](std::uint32_t t) {
        patchOf_[t] = OccluderMesh::kNone;
        if (sides_[t] == Side::kOut) return;
        const std::uint32_t root = rootOf(t);
        if (root == t) {
            patchOf_[t] = static_cast<std::uint32_t>(patches_.size());
            patches_.push_back({0, 0, kInfinity, kInfinity, -kInfinity, -kInfinity, 0});
        }
        patchOf_[t] = patchOf_[root];
        Patch& patch = patches_[patchOf_[t]];
        ++patch.count;
        const auto extend = [&patch](const ScreenPoint& p) {
            patch.lowerX = std::min(patch.lowerX, p.x);
            patch.lowerY = std::min(patch.lowerY, p.y);
            patch.upperX = std::max(patch.upperX, p.x);
            patch.upperY = std::max(patch.upperY, p.y);
            patch.nearest = std::max(patch.nearest, p.depth);
        };
        if (sides_[t] == Side::kFront) {
            for (const std::uint32_t v : triangles[t].vertex) extend(points_[v]);
        } else {
            const Polygon polygon = polygonOf(mesh, t);
            for (int i = 0; i < polygon.size; ++i) extend(polygon.corners[i]);
        }
    });
    std::uint32_t total = 0;
    for (Patch& patch : patches_) {
        patch.first = total;
        total += patch.count;
        patch.count = 0;
    }
    ordered_.resize(total);
    forEachTriangle([this](std::uint32_t t) {
        if (patchOf_[t] == OccluderMesh::kNone) return;
        Patch& patch = patches_[patchOf_[t]];
        ordered_[patch.first + patch.count++] = t;
    });
}

void OccluderRasteriser::addPatch(const OccluderMesh& mesh, const Patch& patch, OcclusionBuffer& buffer, Work& work) {
    const float width = std::min(patch.upperX, static_cast<float>(buffer.widthPx())) - std::max(patch.lowerX, 0.0f);
    const float height = std::min(patch.upperY, static_cast<float>(buffer.heightPx())) - std::max(patch.lowerY, 0.0f);
    if (!(width >= kLeastExtentPx && height >= kLeastExtentPx)) return;
    // What is hidden already adds nothing.
    if (buffer.hides({.lowerX = patch.lowerX,
                      .lowerY = patch.lowerY,
                      .upperX = patch.upperX,
                      .upperY = patch.upperY,
                      .nearest = patch.nearest}))
        return;
    work.triangles += patch.count;
    marks_.beginPatch(patch.lowerY, patch.upperY, patch.nearest, buffer);

    const std::span<const std::uint32_t> members = std::span(ordered_).subspan(patch.first, patch.count);
    const std::span<const OccluderMesh::Triangle> triangles = mesh.triangles();
    for (const std::uint32_t t : members) {
        const Polygon polygon = polygonOf(mesh, t);
        marks_.mark({polygon.corners, static_cast<std::size_t>(polygon.size)});
    }
    for (const std::uint32_t t : members) {
        const auto& behind = triangles[t].behind;
        const bool clipped = sides_[t] == Side::kFrontClipped;
        const auto ends = [&](std::uint32_t other) {
            return other == OccluderMesh::kNone || sides_[other] == Side::kOut;
        };
        if (!clipped && !ends(behind[0]) && !ends(behind[1]) && !ends(behind[2])) continue;
        const Polygon polygon = polygonOf(mesh, t);
        for (int i = 0; i < polygon.size; ++i) {
            const int edge = polygon.edges[i];
            if (edge >= 0 && !ends(behind[static_cast<std::size_t>(edge)])) continue;
            marks_.unmark(polygon.corners[i], polygon.corners[i + 1 == polygon.size ? 0 : i + 1]);
        }
    }
    work.pixels += marks_.mergeInto(buffer);
}

}  // namespace tessera
