#include "server/collision/representation/PointSet.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>

namespace tessera {

namespace {}  // namespace

Expected<PointSet> PointSet::make(std::span<const Vec3d> points, double radius, const PointSetLimits& limits) {
    if (points.size() > limits.maxPoints)
        return fail(ErrorCode::kLimit,
                    std::to_string(points.size()) + " points, at most " + std::to_string(limits.maxPoints));
    if (!(radius >= 0 && radius <= limits.maxCoordinate))
        return fail(ErrorCode::kBadInput, "the radius is negative, not finite or too large");
    bool asFloats = true;
    for (std::size_t i = 0; i < points.size(); ++i)
        for (int k = 0; k < 3; ++k) {
            if (!(std::abs(points[i][k]) <= limits.maxCoordinate))
                return fail(ErrorCode::kBadInput,
                            "point " + std::to_string(i) + " has a coordinate that is not finite or too large");
            asFloats = asFloats && isFloat(points[i][k]);
        }
    PointSet out;
    out.radius_ = radius;
    if (asFloats) {
        out.floats_.reserve(points.size());
        for (const Vec3d& p : points) out.floats_.emplace_back(p.cast<float>());
    } else {
        out.doubles_.assign(points.begin(), points.end());
    }
    out.order_.resize(points.size());
    std::iota(out.order_.begin(), out.order_.end(), 0U);
    if (points.empty()) return out;
    std::size_t size = kLeafPoints;
    while (size < points.size()) size *= kFanOut;
    out.arrange(0, points.size(), size);
    out.fitBoxes();
    return out;
}

void PointSet::arrange(std::size_t first, std::size_t end, std::size_t size) {
    // What is no larger than a box of one level is divided into boxes of the next.
    while (end - first <= size) {
        if (size <= kLeafPoints) return;
        size /= kFanOut;
    }
    Box box;
    for (std::size_t i = first; i < end; ++i) box.extend(point(order_[i]));
    int axis = 0;
    box.size().maxCoeff(&axis);
    const std::size_t parts = (end - first + size - 1) / size, middle = first + parts / 2 * size;
    const auto at = [&](std::size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
    std::nth_element(at(first), at(middle), at(end), [&](std::uint32_t x, std::uint32_t y) {
        const double a = point(x)[axis], b = point(y)[axis];
        return a != b ? a < b : x < y;
    });
    arrange(first, middle, size);
    arrange(middle, end, size);
}

void PointSet::fitBoxes() {
    std::vector<std::uint32_t> counts{
        static_cast<std::uint32_t>((size() + kLeafPoints * kFanOut - 1) / (kLeafPoints * kFanOut))};
    while (counts.back() > 1) counts.push_back((counts.back() + kFanOut - 1) / kFanOut);
    std::ranges::reverse(counts);
    levelStart_ = {0};
    for (const std::uint32_t count : counts) levelStart_.push_back(levelStart_.back() + count);
    boxes_.resize(levelStart_.back());
    for (std::uint32_t node = levelStart_.back(); node-- > 0;) {
        const Children of = children(node);
        for (std::uint32_t child = of.first; child < of.end; ++child)
            if (child < firstLeaf())
                boxes_[node].extend(boxes_[child]);
            else
                for (const std::uint32_t number : pointsOf(child)) boxes_[node].extend(point(number));
    }
    centres_ = bounds_ = boxes_[0];
    bounds_.lower.array() -= radius_;
    bounds_.upper.array() += radius_;
}

PointSet::Children PointSet::children(std::uint32_t node) const {
    std::size_t level = levelStart_.size() - 2;
    while (levelStart_[level] > node) --level;
    const std::uint32_t first = (node - levelStart_[level]) * kFanOut;
    const bool last = level + 2 == levelStart_.size();
    const auto below = last ? static_cast<std::uint32_t>((size() + kLeafPoints - 1) / kLeafPoints)
                            : levelStart_[level + 2] - levelStart_[level + 1];
    const std::uint32_t start = levelStart_[level + 1];
    return {start + first, start + std::min(first + kFanOut, below)};
}

std::span<const std::uint32_t> PointSet::pointsOf(std::uint32_t leaf) const {
    const std::size_t first = std::size_t{leaf - firstLeaf()} * kLeafPoints;
    return std::span(order_).subspan(first, std::min<std::size_t>(kLeafPoints, order_.size() - first));
}

std::size_t PointSet::memoryBytes() const {
    return sizeof(PointSet) + floats_.capacity() * sizeof(Vec3f) + doubles_.capacity() * sizeof(Vec3d) +
           (order_.capacity() + levelStart_.capacity()) * sizeof(std::uint32_t) + boxes_.capacity() * sizeof(Box);
}

}  // namespace tessera
