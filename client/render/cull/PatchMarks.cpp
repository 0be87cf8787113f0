#include "client/render/cull/PatchMarks.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace tessera {

namespace {

/// Half a step of the grid that a rasteriser snaps vertices to, diagonally.
constexpr double kSnapPx = 0.003;
/// Rounding of an interpolated attribute, relative to what it would be at the far corner of the screen.
constexpr double kPlaneRounding = 1.0 / (1 << 21);

/// Four pixels at a time, in what g++ and clang make of it on any processor.
using Floats4 = float __attribute__((vector_size(16)));
using Ints4 = std::int32_t __attribute__((vector_size(16)));

Floats4 loadFloats(const float* from) {
    Floats4 value;
    std::memcpy(&value, from, sizeof value);
    return value;
}

/// Lowers values[from..to] to max(base + step * x, least). `values` is a row of whole blocks.
void lowerRow(float* values, int from, int to, float base, float step, float least) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    const Floats4 leasts = {least, least, least, least};
    const Ints4 lanes = {0, 1, 2, 3};
    const auto depthAt = [&](int x) {
        const Floats4 depth = __builtin_convertvector(lanes + x, Floats4) * step + base;
        return depth < leasts ? leasts : depth;
    };
    const auto lower = [&](int x, Floats4 depth) {
        const Floats4 value = loadFloats(values + x);
        depth = depth < value ? depth : value;
        std::memcpy(values + x, &depth, sizeof depth);
    };
    const auto lowerWithin = [&](int x) {
        const Floats4 infinities = {kInfinity, kInfinity, kInfinity, kInfinity};
        const Ints4 pixel = lanes + x;
        lower(x, ((pixel >= from) & (pixel <= to)) ? depthAt(x) : infinities);
    };
    int x = from & ~3;
    if (x < from || x + 3 > to) {
        lowerWithin(x);
        x += 4;
    }
    for (; x + 3 <= to; x += 4) lower(x, depthAt(x));
    if (x <= to) lowerWithin(x);
}

}  // namespace

bool PatchMarks::begin(const TileProjection& tile, double noise, const OcclusionBuffer& buffer) {
    shift_ = tile.farther(0, noise);
    shrink_ = tile.farther(1, noise) - shift_;
    planeRounding_ = kPlaneRounding * tile.screenReachPx();
    if (columns_ != buffer.stridePx() || rows_ != buffer.rows()) {
        columns_ = buffer.stridePx();
        rows_ = buffer.rows();
        values_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_),
                       std::numeric_limits<float>::infinity());
        touched_.assign(static_cast<std::size_t>(rows_ / OcclusionBuffer::kBlock), {});
        open_.assign(touched_.size(), {});
    }
    return shrink_ > 0.5;
}

// A block whose weakest pixel hides what is as near as the patch's nearest point learns nothing from the patch.
void PatchMarks::beginPatch(float lowerY, float upperY, float nearest, const OcclusionBuffer& buffer) {
    const int last = static_cast<int>(open_.size()) - 1;
    const auto blockRow = [&](float y) {
        return static_cast<int>(std::clamp<double>(y / OcclusionBuffer::kBlock, 0, last));
    };
    const int columns = columns_ / OcclusionBuffer::kBlock;
    for (int row = blockRow(lowerY - 1); row <= blockRow(upperY + 1); ++row) {
        const std::span<const float> weakest = buffer.blocksOf(row);
        int from = 0, to = columns - 1;
        while (from <= to && weakest[static_cast<std::size_t>(from)] >= nearest) ++from;
        while (to > from && weakest[static_cast<std::size_t>(to)] >= nearest) --to;
        open_[static_cast<std::size_t>(row)] = {from * OcclusionBuffer::kBlock,
                                                to * OcclusionBuffer::kBlock + OcclusionBuffer::kBlock - 1};
    }
}

/// Over the spans found last.
template <typename F>
void PatchMarks::forEachTouchedRow(F&& f) {
    float* row = values_.data() + static_cast<std::ptrdiff_t>(spans_.firstRow()) * columns_;
    for (int y = spans_.firstRow(); y < spans_.endRow(); ++y, row += columns_) {
        const Touched& open = open_[static_cast<std::size_t>(y / OcclusionBuffer::kBlock)];
        const int from = std::max(spans_.from(y), open.from);
        const int to = std::min(spans_.to(y), open.to);
        if (from > to) continue;
        Touched& touched = touched_[static_cast<std::size_t>(y / OcclusionBuffer::kBlock)];
        touched.from = std::min(touched.from, from);
        touched.to = std::max(touched.to, to);
        f(row, y, from, to);
    }
}

void PatchMarks::mark(std::span<const ScreenPoint> corners) {
    double lowerX = corners[0].x;
    double upperX = lowerX;
    for (const ScreenPoint& corner : corners) {
        lowerX = std::min<double>(lowerX, corner.x);
        upperX = std::max<double>(upperX, corner.x);
    }
    if (upperX + 1 < 0 || lowerX - 1 > columns_) return;

    // Inverse depth as an affine function of the pixel, through the corners that span the greatest area: for a polygon
    // clipped from one triangle all of them lie on it.
    const ScreenPoint& a = corners[0];
    double gradientX = 0;
    double gradientY = 0;
    double greatest = 0;
    double least = a.depth;
    for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
        const ScreenPoint& b = corners[i];
        const ScreenPoint& c = corners[i + 1];
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
    for (const ScreenPoint& corner : corners) least = std::min<double>(least, corner.depth);

    const double slope = std::abs(gradientX) + std::abs(gradientY);
    const double rounding = slope * planeRounding_;
    // The least over the grown square; nowhere less than at the lowest corner, as far as a sample can be outside.
    const double drop = slope * (0.5 + kMarkMarginPx) + rounding;
    const double lowest = (least - slope * 2 * kSnapPx - rounding) * shrink_ + shift_;
    const auto floorDepth = static_cast<float>(std::max(0.0, lowest));
    const auto step = static_cast<float>(gradientX * shrink_);
    spans_.find(corners, kMarkMarginPx, columns_, rows_);
    const double first = a.depth + gradientX * (0.5 - a.x) + gradientY * (0.5 - a.y) - drop;
    forEachTouchedRow([&](float* row, int y, int from, int to) {
        const auto base = static_cast<float>((first + gradientY * y) * shrink_ + shift_);
        lowerRow(row, from, to, base, step, floorDepth);
    });
}

void PatchMarks::unmark(const ScreenPoint& from, const ScreenPoint& to) {
    const ScreenPoint ends[2] = {from, to};
    spans_.find(ends, kUnmarkMarginPx, columns_, rows_);
    forEachTouchedRow([](float* row, int, int first, int last) { std::fill(row + first, row + last + 1, 0.0f); });
}

std::uint64_t PatchMarks::mergeInto(OcclusionBuffer& buffer) {
    std::uint64_t blocks = 0;
    for (int row = 0; row < static_cast<int>(touched_.size()); ++row) {
        Touched& touched = touched_[static_cast<std::size_t>(row)];
        if (touched.from > touched.to) continue;
        const int from = touched.from / OcclusionBuffer::kBlock;
        const int to = touched.to / OcclusionBuffer::kBlock;
        buffer.merge(row, from, to, values_);
        blocks += static_cast<std::uint64_t>(to - from + 1);
        touched = Touched();
    }
    return blocks * OcclusionBuffer::kBlock * OcclusionBuffer::kBlock;
}

}  // namespace tessera
