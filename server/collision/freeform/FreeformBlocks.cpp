// Parts of parts some halvings down, many at once: their boxes, and those that are looked at.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "server/collision/freeform/FreeformParts.h"
#include "server/collision/freeform/PartChoice.h"

namespace tessera {
namespace {

/// Of the largest coordinate: directions are of length 1 and at right angles but for some units, so are the hull's
/// extents along them.
constexpr double kBoxRounding = 16 * std::numeric_limits<double>::epsilon();

}  // namespace

/// Along the part's normal and the way across its hull: as thin as it is.
/// Groups keep to the shape's directions: along others the boxes of faces are more than what turning gains.
PartBox FreeformParts::boxAround(const FreeformPart& part) const {
    PartBox box;
    const double *x = coordinates_.data() + part.at, *y = x + part.points, *z = y + part.points;
    if (part.kind != FreeformPart::Kind::kGroup) {
        // Across: from the first of the hull's points to the last of its first row; of boxes that is a side.
        const Vec3d n = part.normal.normalized();
        const std::size_t end = hasParameters(part) ? part.degreeU : 1;
        const Vec3d row(x[end] - x[0], y[end] - y[0], z[end] - z[0]);
        const Vec3d across = row - n * n.dot(row);
        const double length = across.norm();
        // Of a row along the normal rounding alone is left.
        const Vec3d side =
            length > 1e-6 * row.norm() && std::isfinite(length) ? Vec3d(across / length) : n.unitOrthogonal();
        box.axes.col(2) = n;
        box.axes.col(0) = (side - n * n.dot(side)).normalized();
        box.axes.col(1) = n.cross(box.axes.col(0));
    }
    double far = 0;
    for (std::uint32_t i = 0; i < 3 * part.points; ++i) far = std::max(far, std::abs(x[i]));
    Vec3d middle;
    for (Eigen::Index k = 0; k < 3; ++k) {
        const Extent extent = extentAlong(part, box.axes.col(k));
        middle[k] = 0.5 * (extent.least + extent.most);
        box.half[k] = 0.5 * (extent.most - extent.least) + kBoxRounding * far;
    }
    box.middle = box.axes * middle;
    return box;
}

std::uint32_t FreeformParts::blockOf(std::uint32_t which) {
    if (parts_[which].block != kNoIndex) return parts_[which].block;
    // What is made on the way lies above all that is kept, and goes again.
    const std::size_t partsBefore = parts_.size(), coordinatesBefore = coordinates_.size();
    struct Open {
        std::uint32_t part, way;
    };
    std::array<Open, kernel::kBoxLanes> open{};
    std::size_t count = 0;
    const auto openUp = [&](Open at) {
        divide(at.part);
        for (std::uint32_t c = 0; c < parts_[at.part].children; ++c)
            open[count++] = {parts_[at.part].firstChild + c, 4 * at.way + c};
    };
    FreeformPart whole = parts_[which];
    whole.divided = false;
    parts_.push_back(whole);
    openUp({static_cast<std::uint32_t>(partsBefore), 1});
    // The largest of those that there is room for: of patches and groups come two, of neighbourhoods four.
    for (;;) {
        std::size_t largest = count;
        for (std::size_t i = 0; i < count; ++i) {
            const FreeformPart& part = parts_[open[i].part];
            const std::size_t more = part.kind == FreeformPart::Kind::kNeighbourhood ? 3 : 1;
            if (count + more > kernel::kBoxLanes || isSmallest(part)) continue;
            if (largest == count || part.radius > parts_[open[largest].part].radius) largest = i;
        }
        if (largest == count) break;
        const Open next = open[largest];
        open[largest] = open[--count];
        openUp(next);
    }
    const auto at = static_cast<std::uint32_t>(blocks_.size());
    PartBlock& block = blocks_.emplace_back();
    block.of = which;
    block.count = static_cast<std::uint32_t>(count);
    block.parts.fill(PartBlock::kNone);
    for (std::size_t lane = 0; lane < count; ++lane) {
        block.ways[lane] = open[lane].way;
        block.set(lane, boxAround(parts_[open[lane].part]));
    }
    parts_.resize(partsBefore);
    coordinates_.resize(coordinatesBefore);
    parts_[which].block = at;
    return at;
}

std::uint32_t FreeformParts::makePart(std::uint32_t block, std::uint32_t lane) {
    // What is made on the way lies above the coordinates that are kept, where the part's own come in the end.
    const std::size_t before = coordinates_.size();
    const std::uint32_t way = blocks_[block].ways[lane];
    FreeformPart part = parts_[blocks_[block].of];
    for (int shift = static_cast<int>(std::bit_width(way)) - 3; shift >= 0; shift -= 2)
        part = childOf(part, (way >> shift) & 3, shift == 0);
    const std::size_t size = coordinatesOf(part);
    std::copy_n(coordinates_.begin() + static_cast<std::ptrdiff_t>(part.at), size,
                coordinates_.begin() + static_cast<std::ptrdiff_t>(before));
    coordinates_.resize(before + size);
    part.at = before;
    part.lane = static_cast<std::uint32_t>(kernel::kBoxLanes) * block + lane;
    parts_.push_back(part);
    return blocks_[block].parts[lane] = static_cast<std::uint32_t>(parts_.size() - 1);
}

/// Of the hull and what else lies behind it.
std::size_t FreeformParts::coordinatesOf(const FreeformPart& part) const {
    return std::size_t{part.rational ? 7U : 3U} * part.points +
           (part.kind == FreeformPart::Kind::kNeighbourhood ? 3 * std::size_t{part.controls} : 0);
}

/// What `divide` makes its child `c`. Where not the whole of it is asked for, only what its own children are made of.
FreeformPart FreeformParts::childOf(const FreeformPart& part, std::uint32_t c, bool whole) {
    if (part.kind == FreeformPart::Kind::kGroup) return makeGroup(shape_.nodes()[part.face].first + c, whole);
    if (part.kind == FreeformPart::Kind::kNeighbourhood)
        return quarterOf(part, pointsAt(controlsAt(part), part.controls), c, whole);
    FreeformPart child;
    for (FreeformPart& half : part.kind == FreeformPart::Kind::kPatch ? halve(part) : halveTriangle(part)) {
        if (!settleTrim(half)) continue;
        child = half;
        if (c-- == 0) break;
    }
    if (whole) project(child);
    return child;
}

}  // namespace tessera
