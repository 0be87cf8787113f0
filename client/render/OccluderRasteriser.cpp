#include "client/render/OccluderRasteriser.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace tessera {

namespace {

/// No vertex may be displaced by more: the near end of an occluder is cut off where it would be.
constexpr double kWorstDisplacementPx = 0.1;
/// Greater than that displacement + half a step of a 1/256 grid + our own rounding of far-away pixels (1/16).
constexpr double kMarkMarginPx = 0.25;
/// Greater by the same again: a border that might touch a marked square unmarks it.
constexpr double kUnmarkMarginPx = 0.45;
/// Half a step of the grid that a rasteriser snaps vertices to, diagonally.
constexpr double kSnapPx = 0.003;
/// Nor is any triangle of use that is so flat that this grid decides how it lies.
constexpr double kFlattestPx = 0.02;
/// A float counts sixteenths of a pixel up to here. What lies farther outside is left out.
constexpr double kUtmostPx = 500'000;
/// A patch that is smaller hides nothing worth the work.
constexpr float kLeastExtentPx = 4;
/// Rounding of an interpolated attribute, relative to what it would be at the far corner of the screen.
constexpr double kPlaneRounding = 1.0 / (1 << 21);

/// Four pixels at a time, in what g++ and clang make of it on any processor.
using Floats4 = float __attribute__((vector_size(16)));
using Ints4 = std::int32_t __attribute__((vector_size(16)));

/// Lowers values[from..to] to max(base + step * x, least). `values` is a row of whole blocks.
void lowerRow(float* values, int from, int to, float base, float step, float least) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    const Floats4 leasts = {least, least, least, least};
    const Floats4 infinities = {kInfinity, kInfinity, kInfinity, kInfinity};
    const auto choose = [](const Ints4& mask, const Floats4& a, const Floats4& b) {
        return reinterpret_cast<Floats4>((reinterpret_cast<Ints4>(a) & mask) | (reinterpret_cast<Ints4>(b) & ~mask));
    };
    for (int x = from & ~3; x <= to; x += 4) {
        const Ints4 pixel = {x, x + 1, x + 2, x + 3};
        const Ints4 inside = (pixel >= from) & (pixel <= to);
        const Floats4 at = __builtin_convertvector(pixel, Floats4);
        Floats4 depth = at * step + base;
        depth = choose(depth < leasts, leasts, depth);
        depth = choose(inside, depth, infinities);
        Floats4 value;
        std::memcpy(&value, values + x, sizeof value);
        value = choose(depth < value, depth, value);
        std::memcpy(values + x, &value, sizeof value);
    }
}

}  // namespace

/// Over the spans found last.
template <typename F>
void OccluderRasteriser::forEachTouchedRow(F&& f) {
    float* row = values_.data() + static_cast<std::ptrdiff_t>(spans_.firstRow()) * columns_;
    for (int y = spans_.firstRow(); y < spans_.endRow(); ++y, row += columns_) {
        const int from = spans_.from(y);
        const int to = spans_.to(y);
        if (from > to) continue;
        Touched& touched = touched_[static_cast<std::size_t>(y / OcclusionBuffer::kBlock)];
        touched.from = std::min(touched.from, from);
        touched.to = std::max(touched.to, to);
        f(row, y, from, to);
    }
}

OccluderRasteriser::Work OccluderRasteriser::add(const OccluderMesh& mesh, const Placed& placed,
                                                 const TileProjection& tile, OcclusionBuffer& buffer) {
    tile_ = &tile;
    clip_T_mesh_ = placed.clip_T_mesh;
    noise_ = placed.noise;
    const double displacement = noise_ * tile.pixelsPerMetre();  // at 1 m
    nearest_ = std::max(1.01 * tile.nearMetres() + noise_, displacement / kWorstDisplacementPx);
    farthest_ = 0.999 * tile.farMetres() - noise_;
    Work work;
    shift_ = tile.farther(0, noise_);
    shrink_ = tile.farther(1, noise_) - shift_;
    if (!(nearest_ < farthest_ && shrink_ > 0.5)) return work;
    project(mesh, placed, tile);
    findSides(mesh, placed);
    findPatches(mesh);
    if (columns_ != buffer.stridePx() || rows_ != buffer.rows()) {
        columns_ = buffer.stridePx();
        rows_ = buffer.rows();
        values_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_),
                       std::numeric_limits<float>::infinity());
        touched_.assign(static_cast<std::size_t>(rows_ / OcclusionBuffer::kBlock), {});
    }
    for (const Patch& patch : patches_) addPatch(mesh, patch, buffer, work);
    return work;
}

void OccluderRasteriser::project(const OccluderMesh& mesh, const Placed& placed, const TileProjection& tile) {
    const std::span<const OccluderMesh::Point> source = mesh.points();
    points_.resize(source.size());
    fates_.resize(source.size());
    const Mat4d& m = placed.clip_T_mesh;
    double nearestVertex = 0;  // as inverse depth
    for (std::size_t i = 0; i < source.size(); ++i) {
        const double px = source[i][0];
        const double py = source[i][1];
        const double pz = source[i][2];
        const double w = m(3, 0) * px + m(3, 1) * py + m(3, 2) * pz + m(3, 3);
        if (!(w >= nearest_)) {
            fates_[i] = Fate::kTooNear;
            nearestVertex = 1 / nearest_;
            continue;
        }
        const double x = tile.xPx(m(0, 0) * px + m(0, 1) * py + m(0, 2) * pz + m(0, 3), w);
        const double y = tile.yPx(m(1, 0) * px + m(1, 1) * py + m(1, 2) * pz + m(1, 3), w);
        const bool usable = w <= farthest_ && std::abs(x) < kUtmostPx && std::abs(y) < kUtmostPx;
        fates_[i] = usable ? Fate::kUsable : Fate::kUnusable;
        points_[i] = {static_cast<float>(x), static_cast<float>(y), static_cast<float>(1 / w)};
        nearestVertex = std::max(nearestVertex, 1 / w);
    }
    // So high that a displacement of its corners changes neither a triangle's facing nor much of its slope.
    flattest_ = std::max(kFlattestPx, 8 * noise_ * tile.pixelsPerMetre() * nearestVertex);
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
    sides_.resize(triangles.size());
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
        const auto& v = triangles[t].vertex;
        const Fate fates[3] = {fates_[v[0]], fates_[v[1]], fates_[v[2]]};
        int tooNear = 0;
        bool unusable = false;
        for (const Fate fate : fates) {
            tooNear += fate == Fate::kTooNear;
            unusable = unusable || fate == Fate::kUnusable;
        }
        sides_[t] = Side::kOut;
        if (unusable || tooNear == 3) continue;
        if (tooNear > 0) {
            if (facesFront(polygonOf(mesh, t), placed.mirrored)) sides_[t] = Side::kFrontClipped;
            continue;
        }
        const Polygon polygon{.corners = {points_[v[0]], points_[v[1]], points_[v[2]]}, .size = 3};
        if (facesFront(polygon, placed.mirrored)) sides_[t] = Side::kFront;
    }
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
    const auto count = static_cast<std::uint32_t>(triangles.size());
    parents_.resize(count);
    for (std::uint32_t t = 0; t < count; ++t) parents_[t] = t;
    for (std::uint32_t t = 0; t < count; ++t) {
        if (sides_[t] == Side::kOut) continue;
        for (const std::uint32_t other : triangles[t].behind) {
            if (other == OccluderMesh::kNone || other > t || sides_[other] == Side::kOut) continue;
            const std::uint32_t a = rootOf(t);
            const std::uint32_t b = rootOf(other);
            parents_[std::max(a, b)] = std::min(a, b);
        }
    }
    // A root is the lowest triangle of its patch, so it is met first.
    patches_.clear();
    patchOf_.assign(count, OccluderMesh::kNone);
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    for (std::uint32_t t = 0; t < count; ++t) {
        if (sides_[t] == Side::kOut) continue;
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
    }
    std::uint32_t total = 0;
    for (Patch& patch : patches_) {
        patch.first = total;
        total += patch.count;
        patch.count = 0;
    }
    ordered_.resize(total);
    for (std::uint32_t t = 0; t < count; ++t) {
        if (patchOf_[t] == OccluderMesh::kNone) continue;
        Patch& patch = patches_[patchOf_[t]];
        ordered_[patch.first + patch.count++] = t;
    }
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

    const std::span<const std::uint32_t> members = std::span(ordered_).subspan(patch.first, patch.count);
    const std::span<const OccluderMesh::Triangle> triangles = mesh.triangles();
    for (const std::uint32_t t : members) mark(polygonOf(mesh, t));
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
            unmark(polygon.corners[i], polygon.corners[i + 1 == polygon.size ? 0 : i + 1]);
        }
    }
    for (int row = 0; row < static_cast<int>(touched_.size()); ++row) {
        Touched& touched = touched_[static_cast<std::size_t>(row)];
        if (touched.from > touched.to) continue;
        const int from = touched.from / OcclusionBuffer::kBlock;
        const int to = touched.to / OcclusionBuffer::kBlock;
        buffer.merge(row, from, to, values_);
        work.pixels += static_cast<std::uint64_t>(to - from + 1) * OcclusionBuffer::kBlock * OcclusionBuffer::kBlock;
        touched = Touched();
    }
}

void OccluderRasteriser::mark(const Polygon& polygon) {
    double lowerX = polygon.corners[0].x;
    double upperX = lowerX;
    for (int i = 1; i < polygon.size; ++i) {
        lowerX = std::min<double>(lowerX, polygon.corners[i].x);
        upperX = std::max<double>(upperX, polygon.corners[i].x);
    }
    if (upperX + 1 < 0 || lowerX - 1 > columns_) return;

    // Inverse depth as an affine function of the pixel, through the corners that span the greatest area: for a polygon
    // clipped from one triangle all of them lie on it.
    const ScreenPoint& a = polygon.corners[0];
    double gradientX = 0;
    double gradientY = 0;
    double greatest = 0;
    double least = a.depth;
    for (int i = 1; i + 1 < polygon.size; ++i) {
        const ScreenPoint& b = polygon.corners[i];
        const ScreenPoint& c = polygon.corners[i + 1];
        const double bx = double{b.x} - a.x;
        const double by = double{b.y} - a.y;
        const double cx = double{c.x} - a.x;
        const double cy = double{c.y} - a.y;
        const double area = bx * cy - by * cx;
        if (std::abs(area) <= greatest) continue;
        greatest = std::abs(area);
        const double bd = double{b.depth} - a.depth;
        const double cd = double{c.depth} - a.depth;
        gradientX = (bd * cy - cd * by) / area;
        gradientY = (cd * bx - bd * cx) / area;
    }
    for (int i = 1; i < polygon.size; ++i) least = std::min<double>(least, polygon.corners[i].depth);

    const double slope = std::abs(gradientX) + std::abs(gradientY);
    const double rounding = kPlaneRounding * slope * tile_->screenReachPx();
    // The least over the grown square; nowhere less than at the lowest corner, as far as a sample can be outside.
    const double drop = slope * (0.5 + kMarkMarginPx) + rounding;
    const double lowest = (least - slope * 2 * kSnapPx - rounding) * shrink_ + shift_;
    const auto floorDepth = static_cast<float>(std::max(0.0, lowest));
    const auto step = static_cast<float>(gradientX * shrink_);
    spans_.find({polygon.corners, static_cast<std::size_t>(polygon.size)}, kMarkMarginPx, columns_, rows_);
    const double first = a.depth + gradientX * (0.5 - a.x) + gradientY * (0.5 - a.y) - drop;
    forEachTouchedRow([&](float* row, int y, int from, int to) {
        const auto base = static_cast<float>((first + gradientY * y) * shrink_ + shift_);
        lowerRow(row, from, to, base, step, floorDepth);
    });
}

void OccluderRasteriser::unmark(const ScreenPoint& from, const ScreenPoint& to) {
    const ScreenPoint ends[2] = {from, to};
    spans_.find(ends, kUnmarkMarginPx, columns_, rows_);
    forEachTouchedRow([](float* row, int, int first, int last) { std::fill(row + first, row + last + 1, 0.0f); });
}

}  // namespace tessera
