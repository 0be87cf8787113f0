#include "common/rays/TreeDivision.h"

#include <algorithm>
#include <array>
#include <cfloat>
#include <cmath>
#include <limits>

#include "common/cores/Node.h"

namespace tessera::rays {

namespace {

constexpr std::size_t kBins = 16;
/// Deeper nodes are divided in halves, whatever their surfaces: no mesh makes the tree deeper than a walk can follow.
constexpr std::size_t kDepthOfHalves = 28;

struct Extent {
    float lower[3] = {FLT_MAX, FLT_MAX, FLT_MAX}, upper[3] = {-FLT_MAX, -FLT_MAX, -FLT_MAX};

    void add(const float* low, const float* high) {
        for (int k = 0; k < 3; ++k) {
            lower[k] = std::min(lower[k], low[k]);
            upper[k] = std::max(upper[k], high[k]);
        }
    }
    void add(const Extent& other) { add(other.lower, other.upper); }
    /// Half the surface; in double, where no product of floats overflows.
    [[nodiscard]] double area() const {
        const double x = double{upper[0]} - lower[0], y = double{upper[1]} - lower[1], z = double{upper[2]} - lower[2];
        return x < 0 ? 0 : x * y + y * z + z * x;
    }
};

/// A triangle on its way: its box.
struct Item {
    float lower[3];
    std::uint32_t face;
    float upper[3];
    float centre(int k) const { return 0.5f * lower[k] + 0.5f * upper[k]; }
};

struct Range {
    std::size_t begin = 0, end = 0;
    Extent box, centres;

    [[nodiscard]] std::size_t size() const { return end - begin; }
    void add(const Item& item) {
        box.add(item.lower, item.upper);
        const float centre[3] = {item.centre(0), item.centre(1), item.centre(2)};
        centres.add(centre, centre);
    }
};

double fours(std::size_t count) {
    return static_cast<double>((count + kLeafFaces - 1) / kLeafFaces);
}

class Division {
public:
    Division(std::span<const float> positions, std::span<const std::uint32_t> indices)
        : positions_(positions), indices_(indices) {}

    Divided make() {
        const std::size_t faces = (indices_.empty() ? positions_.size() / 3 : indices_.size()) / 3;
        items_.reserve(faces);
        Range whole;
        for (std::size_t face = 0; face < faces; ++face) {
            const float* corners[3] = {corner(face, 0), corner(face, 1), corner(face, 2)};
            Item item{{}, static_cast<std::uint32_t>(face), {}};
            bool finite = true;
            for (int k = 0; k < 3; ++k) {
                for (const float* c : corners) finite = finite && std::isfinite(c[k]);
                item.lower[k] = std::min({corners[0][k], corners[1][k], corners[2][k]});
                item.upper[k] = std::max({corners[0][k], corners[1][k], corners[2][k]});
            }
            if (!finite) continue;
            items_.push_back(item);
            whole.add(item);
        }
        out_.faces = items_.size();
        if (items_.empty()) return std::move(out_);
        whole.end = items_.size();
        for (int k = 0; k < 3; ++k)
            out_.reach = std::max({out_.reach, std::abs(whole.box.lower[k]), std::abs(whole.box.upper[k])});
        // So that boxes hold what lies in their sides, and a ray along one of them meets it.
        pad_ = std::max(out_.reach * 0x1p-22f, FLT_MIN);
        out_.leaves.reserve(items_.size() * 2 / 5);
        out_.root = whole.size() <= kLeafFaces ? addLeaf(whole) : addNode();
        if (whole.size() > kLeafFaces) open_.push_back({whole, out_.root, 0});
        while (!open_.empty()) {
            const Open next = open_.back();
            open_.pop_back();
            divideNode(next);
        }
        return std::move(out_);
    }

private:
    struct Open {
        Range range;
        std::uint32_t node = 0;
        std::size_t depth = 0;
    };

    [[nodiscard]] const float* corner(std::size_t face, std::size_t which) const {
        const std::size_t vertex = indices_.empty() ? 3 * face + which : indices_[3 * face + which];
        return positions_.data() + 3 * vertex;
    }

    std::uint32_t addNode() {
        Node& node = out_.nodes.emplace_back();
        for (std::size_t i = 0; i < kWidth; ++i) {
            for (int k = 0; k < 3; ++k) {
                node.box[k][i] = std::numeric_limits<float>::infinity();
                node.box[3 + k][i] = -std::numeric_limits<float>::infinity();
            }
            node.child[i] = kNoChild;
            node.padding[i] = 0;
        }
        return static_cast<std::uint32_t>(out_.nodes.size() - 1);
    }

    std::uint32_t addLeaf(const Range& range) {
        Leaf& leaf = out_.leaves.emplace_back();
        std::fill_n(&leaf.corner[0][0], 9 * kLeafFaces, std::numeric_limits<float>::quiet_NaN());
        std::fill_n(leaf.face, kLeafFaces, kNoChild);
        for (std::size_t i = 0; i < range.size(); ++i) {
            const std::uint32_t face = items_[range.begin + i].face;
            leaf.face[i] = face;
            for (std::size_t c = 0; c < 3; ++c)
                for (std::size_t k = 0; k < 3; ++k) leaf.corner[3 * c + k][i] = corner(face, c)[k];
        }
        return static_cast<std::uint32_t>(out_.leaves.size() - 1) | kLeafBit;
    }

    void divideNode(const Open& open) {
        std::array<Range, kWidth> ranges;
        ranges[0] = open.range;
        std::size_t count = 1;
        const bool halves = open.depth >= kDepthOfHalves;
        while (count < kWidth) {
            std::size_t largest = kWidth;
            double most = -1;
            for (std::size_t i = 0; i < count; ++i) {
                if (ranges[i].size() <= kLeafFaces) continue;
                const double measure = halves ? static_cast<double>(ranges[i].size()) : ranges[i].box.area();
                if (measure > most) {
                    most = measure;
                    largest = i;
                }
            }
            if (largest == kWidth) break;
            const Range range = ranges[largest];
            split(range, halves, ranges[largest], ranges[count]);
            ++count;
        }
        for (std::size_t i = 0; i < count; ++i) {
            const Range& range = ranges[i];
            const std::uint32_t child = range.size() <= kLeafFaces ? addLeaf(range) : addNode();
            Node& node = out_.nodes[open.node];
            node.child[i] = child;
            for (int k = 0; k < 3; ++k) {
                // Infinite where padding leads beyond floats: that holds everything.
                node.box[k][i] = range.box.lower[k] - pad_;
                node.box[3 + k][i] = range.box.upper[k] + pad_;
            }
        }
        // The first child's subtree comes first in memory.
        for (std::size_t i = count; i-- > 0;)
            if (const std::uint32_t child = out_.nodes[open.node].child[i]; (child & kLeafBit) == 0)
                open_.push_back({ranges[i], child, open.depth + 1});
    }

    void split(const Range& range, bool halves, Range& left, Range& right) {
        const Item* const items = items_.data();
        std::size_t bestBin = 0;
        int bestAxis = -1;
        std::array<double, 3> scale{};
        for (int k = 0; k < 3; ++k) {
            const double width = double{range.centres.upper[k]} - range.centres.lower[k];
            // Less than one bin: all of them are in the last.
            scale[static_cast<std::size_t>(k)] = width > 0 ? kBins * (1 - 1e-6) / width : 0;
        }
        const auto binOf = [&](const Item& item, int k) {
            const double at = (double{item.centre(k)} - range.centres.lower[k]) * scale[static_cast<std::size_t>(k)];
            return std::min(static_cast<std::size_t>(std::max(at, 0.0)), kBins - 1);
        };
        if (!halves) {
            Extent boxes[3][kBins];
            std::size_t counts[3][kBins] = {};
            for (std::size_t i = range.begin; i < range.end; ++i)
                for (int k = 0; k < 3; ++k) {
                    const std::size_t bin = binOf(items[i], k);
                    boxes[k][bin].add(items[i].lower, items[i].upper);
                    ++counts[k][bin];
                }
            double bestCost = std::numeric_limits<double>::infinity();
            for (int k = 0; k < 3; ++k) {
                if (!(scale[static_cast<std::size_t>(k)] > 0)) continue;
                std::array<double, kBins> fromRight{};
                Extent box;
                std::size_t count = 0;
                for (std::size_t bin = kBins; bin-- > 1;) {
                    box.add(boxes[k][bin]);
                    count += counts[k][bin];
                    fromRight[bin] = count == 0 ? std::numeric_limits<double>::infinity() : box.area() * fours(count);
                }
                box = {};
                count = 0;
                for (std::size_t bin = 0; bin + 1 < kBins; ++bin) {
                    box.add(boxes[k][bin]);
                    count += counts[k][bin];
                    if (count == 0) continue;
                    const double cost = box.area() * fours(count) + fromRight[bin + 1];
                    if (cost < bestCost) {
                        bestCost = cost;
                        bestBin = bin;
                        bestAxis = k;
                    }
                }
            }
        }
        const auto begin = items_.begin() + static_cast<std::ptrdiff_t>(range.begin),
                   end = items_.begin() + static_cast<std::ptrdiff_t>(range.end);
        auto middle = begin + (end - begin) / 2;
        if (bestAxis >= 0)
            middle = std::partition(begin, end, [&](const Item& item) { return binOf(item, bestAxis) <= bestBin; });
        else if (halves)
            halve(range, begin, middle, end);
        left = {range.begin, static_cast<std::size_t>(middle - items_.begin()), {}, {}};
        right = {left.end, range.end, {}, {}};
        for (auto at = begin; at != middle; ++at) left.add(*at);
        for (auto at = middle; at != end; ++at) right.add(*at);
    }

    using Place = std::vector<Item>::iterator;
    /// By the widest axis.
    static void halve(const Range& range, Place begin, Place middle, Place end) {
        int axis = 0;
        for (int k = 1; k < 3; ++k)
            if (double{range.centres.upper[k]} - range.centres.lower[k] >
                double{range.centres.upper[axis]} - range.centres.lower[axis])
                axis = k;
        std::nth_element(begin, middle, end, [&](const Item& a, const Item& b) {
            return a.centre(axis) < b.centre(axis) || (a.centre(axis) == b.centre(axis) && a.face < b.face);
        });
    }

    std::span<const float> positions_;
    std::span<const std::uint32_t> indices_;
    std::vector<Item> items_;
    std::vector<Open> open_;
    Divided out_;
    float pad_ = 0;
};

}  // namespace

Divided divide(std::span<const float> positions, std::span<const std::uint32_t> indices) {
    return Division(positions, indices).make();
}

}  // namespace tessera::rays
