#include "common/geometry/EarClipping.h"

#include <algorithm>
#include <array>
#include <deque>
#include <numeric>
#include <utility>

namespace tessera {
namespace {

/// Twice the area: above 0 where `c` is left of the way from `a` to `b`.
std::int64_t turnOf(const GridPoint& a, const GridPoint& b, const GridPoint& c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

struct GridBox {
    std::int64_t lowerX = GridPoint::kMost + 1, lowerY = GridPoint::kMost + 1, upperX = -1, upperY = -1;
    void extend(const GridPoint& p) {
        lowerX = std::min(lowerX, p.x);
        lowerY = std::min(lowerY, p.y);
        upperX = std::max(upperX, p.x);
        upperY = std::max(upperY, p.y);
    }
    void extend(const GridBox& other) {
        lowerX = std::min(lowerX, other.lowerX);
        lowerY = std::min(lowerY, other.lowerY);
        upperX = std::max(upperX, other.upperX);
        upperY = std::max(upperY, other.upperY);
    }
};

/// A triangle whose corners go around to the left.
struct Ear {
    GridPoint a, b, c;
    GridBox box;
    Ear(const GridPoint& first, const GridPoint& tip, const GridPoint& last) : a(first), b(tip), c(last) {
        for (const GridPoint& p : {a, b, c}) box.extend(p);
    }
    /// Inside or on its rim, but no corner.
    [[nodiscard]] bool isBlockedBy(const GridPoint& p) const {
        return turnOf(a, b, p) >= 0 && turnOf(b, c, p) >= 0 && turnOf(c, a, p) >= 0 && p != a && p != b && p != c;
    }
    [[nodiscard]] bool isApartFrom(const GridBox& other) const {
        if (other.lowerX > box.upperX || other.upperX < box.lowerX || other.lowerY > box.upperY ||
            other.upperY < box.lowerY)
            return true;
        // Right of a side as a whole: its corner that is farthest left is.
        const auto isRightOf = [&](const GridPoint& from, const GridPoint& to) {
            return turnOf(from, to,
                          {to.y > from.y ? other.lowerX : other.upperX, to.x > from.x ? other.upperY : other.lowerY}) <
                   0;
        };
        return isRightOf(a, b) || isRightOf(b, c) || isRightOf(c, a);
    }
};

/// Bits of the two numbers by turns: what is near each other is mostly beside each other in this order (G. M. Morton,
/// 1966).
std::uint64_t mortonOf(const GridPoint& p) {
    const auto spread = [](std::uint64_t v) {
        v = (v | (v << 16)) & 0x0000FFFF0000FFFFull;
        v = (v | (v << 8)) & 0x00FF00FF00FF00FFull;
        v = (v | (v << 4)) & 0x0F0F0F0F0F0F0F0Full;
        v = (v | (v << 2)) & 0x3333333333333333ull;
        return (v | (v << 1)) & 0x5555555555555555ull;
    };
    return spread(static_cast<std::uint64_t>(p.x)) | (spread(static_cast<std::uint64_t>(p.y)) << 1);
}

/// The corners that may lie in an ear: those that turn inwards. A heap of boxes, the leaves kLeaf corners each.
class InwardCorners {
public:
    InwardCorners(std::span<const GridPoint> corners, std::vector<std::uint32_t> inward)
        : corners_(corners), order_(std::move(inward)), place_(corners.size(), kNowhere) {
        std::vector<std::pair<std::uint64_t, std::uint32_t>> sorted;
        sorted.reserve(order_.size());
        for (const std::uint32_t corner : order_) sorted.emplace_back(mortonOf(corners[corner]), corner);
        std::sort(sorted.begin(), sorted.end());
        while (kLeaf * leaves_ < order_.size()) leaves_ *= 2;
        boxes_.resize(2 * leaves_);
        count_.resize(2 * leaves_, 0);
        for (std::size_t i = 0; i < sorted.size(); ++i) {
            order_[i] = sorted[i].second;
            place_[order_[i]] = static_cast<std::uint32_t>(i);
            boxes_[leaves_ + i / kLeaf].extend(corners[order_[i]]);
            ++count_[leaves_ + i / kLeaf];
        }
        for (std::size_t node = leaves_ - 1; node > 0; --node) {
            boxes_[node] = boxes_[2 * node];
            boxes_[node].extend(boxes_[2 * node + 1]);
            count_[node] = count_[2 * node] + count_[2 * node + 1];
        }
    }

    /// It is clipped, or turns outwards by now.
    void remove(std::uint32_t corner) {
        if (place_[corner] == kNowhere) return;
        for (std::size_t node = leaves_ + place_[corner] / kLeaf; node > 0; node /= 2) --count_[node];
        place_[corner] = kNowhere;
    }

    /// Whether one lies in the ear; counts what it looks at. True where no steps are left.
    [[nodiscard]] bool block(const Ear& ear, std::uint64_t& steps) const {
        std::array<std::size_t, 64> open;
        std::size_t many = 0;
        open[many++] = 1;
        while (many > 0) {
            const std::size_t node = open[--many];
            if (steps == 0) return true;
            --steps;
            if (count_[node] == 0 || ear.isApartFrom(boxes_[node])) continue;
            if (node < leaves_) {
                open[many++] = 2 * node + 1;
                open[many++] = 2 * node;
                continue;
            }
            const std::size_t first = kLeaf * (node - leaves_), end = std::min(first + kLeaf, order_.size());
            for (std::size_t i = first; i < end; ++i)
                if (place_[order_[i]] != kNowhere && ear.isBlockedBy(corners_[order_[i]])) return true;
        }
        return false;
    }

private:
    static constexpr std::size_t kLeaf = 4;
    static constexpr std::uint32_t kNowhere = ~std::uint32_t{0};
    std::span<const GridPoint> corners_;
    std::vector<std::uint32_t> order_, place_;
    std::size_t leaves_ = 1;
    std::vector<GridBox> boxes_;
    std::vector<std::uint32_t> count_;
};

/// What is left of the outline, taken so that it goes around to the left.
class Clipping {
public:
    Clipping(std::span<const GridPoint> corners, bool turned, std::uint64_t& steps)
        : corners_(corners),
          turned_(turned),
          steps_(steps),
          next_(corners.size()),
          before_(corners.size()),
          turn_(corners.size(), 0),
          left_(corners.size()) {
        for (std::uint32_t i = 0; i < corners.size(); ++i) {
            const auto many = static_cast<std::uint32_t>(corners.size());
            next_[i] = turned ? (i + many - 1) % many : (i + 1) % many;
            before_[next_[i]] = i;
        }
        triangles_.reserve(3 * (corners.size() - 2));
    }

    Expected<std::vector<std::uint32_t>> triangles() {
        clipIdle();
        std::vector<std::uint32_t> inward;
        std::uint32_t corner = start_;
        for (std::size_t i = 0; i < left_; ++i, corner = next_[corner]) {
            turn_[corner] = side(corner);
            if (turn_[corner] > 0)
                enqueue(corner);
            else
                inward.push_back(corner);
        }
        InwardCorners blocking(corners_, std::move(inward));
        const auto clip = [&](std::uint32_t tip) {
            const std::uint32_t a = before_[tip], c = next_[tip];
            take(tip);
            blocking.remove(tip);
            for (const std::uint32_t neighbour : {a, c}) {
                turn_[neighbour] = side(neighbour);
                if (turn_[neighbour] <= 0) continue;
                blocking.remove(neighbour);
                enqueue(neighbour);
            }
        };
        while (left_ > 2) {
            if (steps_ == 0)
                return fail(ErrorCode::kLimit, "the outline takes too long to be cut into triangles: fewer corners do");
            if (queue_.empty()) {
                clip(cornerWithoutEar());
                continue;
            }
            const auto [tip, stamp] = queue_.front();
            queue_.pop_front();
            if (stamp != stamps_[tip]) continue;
            if (!blocking.block(Ear(corners_[before_[tip]], corners_[tip], corners_[next_[tip]]), steps_)) clip(tip);
        }
        return std::move(triangles_);
    }

private:
    [[nodiscard]] std::int64_t side(std::uint32_t corner) const {
        return turnOf(corners_[before_[corner]], corners_[corner], corners_[next_[corner]]);
    }

    /// Neighbours of what is clipped go to the end: so triangles are fat rather than fans of slivers.
    void enqueue(std::uint32_t corner) {
        if (stamps_.empty()) stamps_.resize(corners_.size(), 0);
        queue_.emplace_back(corner, ++stamps_[corner]);
    }

    void take(std::uint32_t tip) {
        const std::uint32_t a = before_[tip], c = next_[tip];
        triangles_.insert(triangles_.end(), {turned_ ? c : a, tip, turned_ ? a : c});
        next_[a] = c;
        before_[c] = a;
        start_ = c;
        cursor_ = c;
        if (!stamps_.empty()) ++stamps_[tip];
        --left_;
    }

    /// Corners that are where the next one is, and tips of spikes, which lead out and back on one line: what is inside
    /// does not change.
    void clipIdle() {
        std::uint32_t corner = 0;
        for (std::size_t passed = 0; passed < left_ && left_ > 2;) {
            const std::uint32_t before = before_[corner], next = next_[corner];
            if (!isIdle(corners_[before], corners_[corner], corners_[next])) {
                ++passed;
                corner = next;
                continue;
            }
            take(corner);
            passed -= std::min<std::size_t>(passed, 2);  // its neighbours are other corners now
            corner = before;
        }
    }
    [[nodiscard]] static bool isIdle(const GridPoint& a, const GridPoint& b, const GridPoint& c) {
        return b == c || (turnOf(a, b, c) == 0 && (a.x - b.x) * (c.x - b.x) + (a.y - b.y) * (c.y - b.y) > 0);
    }

    /// Of an outline without ears, as it touches or crosses itself, or is flat: what has no area first, then what turns
    /// outwards, then any.
    [[nodiscard]] std::uint32_t cornerWithoutEar() {
        std::uint32_t corner = cursor_, outward = corner;
        bool found = false;
        for (std::size_t i = 0; i < left_; ++i, corner = next_[corner]) {
            steps_ -= std::min<std::uint64_t>(steps_, 1);
            if (turn_[corner] == 0) return corner;
            if (turn_[corner] > 0 && !found) {
                outward = corner;
                found = true;
            }
        }
        return outward;
    }

    std::span<const GridPoint> corners_;
    bool turned_;
    std::uint64_t& steps_;
    std::vector<std::uint32_t> next_, before_;
    std::vector<std::int64_t> turn_;
    std::size_t left_;
    std::uint32_t start_ = 0, cursor_ = 0;
    std::deque<std::pair<std::uint32_t, std::uint32_t>> queue_;
    std::vector<std::uint32_t> stamps_;  ///< of each corner: what it was queued as last
    std::vector<std::uint32_t> triangles_;
};

/// Twice the area is below 2^62 for each of fewer than 2^32 corners.
bool goesRight(std::span<const GridPoint> corners) {
    __extension__ using Wide = __int128;
    Wide area = 0;
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const GridPoint &a = corners[i], &b = corners[(i + 1) % corners.size()];
        area += static_cast<Wide>(a.x) * b.y - static_cast<Wide>(a.y) * b.x;
    }
    return area < 0;
}

}  // namespace

Expected<std::vector<std::uint32_t>> clipEars(std::span<const GridPoint> corners, std::uint64_t& steps) {
    if (corners.size() < 3) return std::vector<std::uint32_t>();
    if (corners.size() == 3) return std::vector<std::uint32_t>{0, 1, 2};
    return Clipping(corners, goesRight(corners), steps).triangles();
}

}  // namespace tessera
