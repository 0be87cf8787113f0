// What of a height field lies in a box, or before a ray.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "server/collision/query/RayTriangle.h"
#include "server/collision/representation/FieldTouch.h"
#include "server/collision/representation/HeightFieldQueries.h"

namespace tessera {

namespace {

/// The faces of some cells whose heights meet [low, high].
class FacesBetween {
public:
    FacesBetween(const HeightField& field, double low, double high, QueryWork& work, std::vector<std::uint32_t>& faces)
        : field_(field), low_(low), high_(high), work_(work), faces_(faces) {}

    /// False: the work was exhausted.
    bool walk(std::size_t level, const HeightField::Cells& cells) {
        ++work_.boxTests;
        bool complete = !work_.exhausted();
        if (!complete) return false;
        eachBlock(field_, level, cells, [&](const HeightRange& range, const HeightField::Cells& below) {
            if (apart(range)) return true;
            complete = level + 1 < field_.levels().size() ? walk(level + 1, below) : eachCell(below);
            return complete;
        });
        return complete;
    }
    bool eachCell(const HeightField::Cells& cells) {
        for (std::uint32_t row = cells.rows.first; row < cells.rows.end; ++row)
            for (std::uint32_t column = cells.columns.first; column < cells.columns.end; ++column) {
                const std::array<double, 4> heights = field_.heightsOf(column, row);
                for (unsigned half = 0; half < 2; ++half) {
                    if (!field_.has(column, row, half)) continue;
                    ++work_.triangleTests;
                    HeightRange range;
                    for (const std::uint8_t corner : field_.cornersOf(column, row, half)) range.extend(heights[corner]);
                    if (!apart(range)) faces_.push_back(field_.faceOf(column, row, half));
                }
            }
        return !work_.exhausted();
    }

private:
    [[nodiscard]] bool apart(const HeightRange& range) const { return !(range.low <= high_ && range.high >= low_); }

    const HeightField& field_;
    double low_, high_;
    QueryWork& work_;
    std::vector<std::uint32_t>& faces_;
};

/// Down the pyramid, nearest first; boxes grown by all that rounding can do, as RayQuery's.
class RayDescent {
public:
    RayDescent(const HeightField& field, const Ray& ray, double maxT)
        : numbers_(field),
          ray_(ray),
          slack_(8e-6 * 0.5 * field.bounds().size().norm() + 1e-13 * (ray.origin - field.bounds().center()).norm()),
          limit_(maxT) {}

    std::optional<RayHit> nearest() {
        std::vector<std::pair<double, std::uint32_t>> open{{0, 0}};
        while (!open.empty()) {
            const auto [from, part] = open.back();
            open.pop_back();
            if (from > limit_) continue;
            if (numbers_.isLeaf(part)) {
                numbers_.eachTriangle(
                    part, [&](std::uint32_t column, std::uint32_t row, unsigned half) { meet(column, row, half); });
                continue;
            }
            const auto first = static_cast<std::ptrdiff_t>(open.size());
            numbers_.open(part, [&](std::uint32_t number, bool, const Box& box) {
                if (const double t = entry(box); t <= limit_) open.emplace_back(t, number);
            });
            std::sort(open.begin() + first, open.end(), std::greater<>());
        }
        return best_;
    }

private:
    void meet(std::uint32_t column, std::uint32_t row, unsigned half) {
        const std::optional<double> t = whereRayMeets(numbers_.field.triangleAt(column, row, half), ray_);
        if (!t || *t > limit_) return;
        const std::uint32_t face = numbers_.field.faceOf(column, row, half);
        if (best_ && *t == best_->t && face > best_->face) return;
        best_ = RayHit{face, *t};
        limit_ = *t;
    }

    /// Where the ray enters a box at the earliest, or infinity.
    [[nodiscard]] double entry(const Box& box) const {
        double near = 0, far = limit_;
        for (int k = 0; k < 3; ++k) {
            const double low = box.lower[k] - slack_ - ray_.origin[k], high = box.upper[k] + slack_ - ray_.origin[k];
            if (ray_.direction[k] == 0) {
                if (low > 0 || high < 0) return std::numeric_limits<double>::infinity();
                continue;
            }
            double t0 = low / ray_.direction[k], t1 = high / ray_.direction[k];
            if (t0 > t1) std::swap(t0, t1);
            near = std::max(near, t0 - 1e-14 * std::abs(t0));
            far = std::min(far, t1 + 1e-14 * std::abs(t1));
        }
        return near <= far ? near : std::numeric_limits<double>::infinity();
    }

    FieldPartNumbers numbers_;
    const Ray& ray_;
    double slack_, limit_;
    std::optional<RayHit> best_;
};

}  // namespace

bool facesNear(const HeightField& field, const Box& box, QueryWork& work, std::vector<std::uint32_t>& faces) {
    if (box.empty()) return true;
    const HeightField::Cells cells = field.over(box);
    if (cells.empty()) return true;
    const std::size_t first = faces.size();
    const double low = box.lower[field.heightAxis()], high = box.upper[field.heightAxis()];
    FacesBetween search(field, low, high, work, faces);
    constexpr std::size_t kFewCells = 16;
    if (!(cells.count() <= kFewCells ? search.eachCell(cells) : search.walk(levelFor(field, cells), cells))) {
        faces.resize(first);
        return false;
    }
    std::sort(faces.begin() + static_cast<std::ptrdiff_t>(first), faces.end());
    return true;
}

std::optional<RayHit> castRay(const HeightField& field, const Ray& ray, double maxT) {
    if (!(maxT >= 0) || !ray.origin.allFinite() || !ray.direction.allFinite() || ray.direction.isZero(0))
        return std::nullopt;
    // The power of two that a tree of the same faces takes: both say the same t.
    const double radius = std::ldexp(1.0, std::ilogb(0.5 * field.bounds().size().norm()) + 1);
    const std::optional<NearRay> near = begunNear(ray, field.bounds().center(), radius);
    if (!near) return std::nullopt;
    std::optional<RayHit> hit = RayDescent(field, near->ray, limitOf(*near, maxT)).nearest();
    if (hit) hit->t += near->before;
    return hit && hit->t <= maxT ? hit : std::nullopt;
}

}  // namespace tessera
