#include "server/collision/tree/TreeTopology.h"

#include <immintrin.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>

namespace tessera {
namespace {

using kernel::Bins;
using kernel::BoxBin;
using kernel::CutRule;
using kernel::kBins;
using kernel::kLeafFaces;
using kernel::kNodeFaces;
using kernel::kWidth;
using TreeItem = kernel::BoxItem;

/// Below this many levels the division is by count alone, so that no input makes a tree deep.
constexpr std::size_t kLevelsOfChoice = 24;
/// How many times its children a node is meant to hold, at most.
constexpr double kMostGrowth = 13;
/// How full a lowest node is, about.
constexpr double kUsualFaces = 50;

std::uint32_t faceOf(const TreeItem& item) {
    return __builtin_bit_cast(std::uint32_t, item.side[3]) - TreeItem::kFaceBias;
}
float centre2(const TreeItem& item, unsigned axis) {
    return item.side[4 + axis] - item.side[axis];
}

/// What holds some triangles, and twice their centres.
struct Bounds {
    __m128 below = _mm_set1_ps(-std::numeric_limits<float>::max()), above = below, centre = below, opposite = below;

    void add(const TreeItem& item) {
        const __m128 low = _mm_load_ps(item.side), high = _mm_load_ps(item.side + 4);
        below = _mm_max_ps(below, low);
        above = _mm_max_ps(above, high);
        centre = _mm_max_ps(centre, _mm_sub_ps(high, low));
        opposite = _mm_max_ps(opposite, _mm_sub_ps(low, high));
    }
    void add(const BoxBin& bin) {
        below = _mm_max_ps(below, _mm_load_ps(bin.side));
        above = _mm_max_ps(above, _mm_load_ps(bin.side + 4));
        centre = _mm_max_ps(centre, _mm_load_ps(bin.side + 8));
        opposite = _mm_max_ps(opposite, _mm_load_ps(bin.side + 12));
    }
    void add(const Bounds& b) {
        below = _mm_max_ps(below, b.below);
        above = _mm_max_ps(above, b.above);
        centre = _mm_max_ps(centre, b.centre);
        opposite = _mm_max_ps(opposite, b.opposite);
    }
    /// Half of the surface, or the volume: what makes a box dear.
    [[nodiscard]] float measure(SplitRule rule) const {
        const __m128 s = _mm_add_ps(below, above), y = _mm_shuffle_ps(s, s, _MM_SHUFFLE(3, 0, 2, 1));
        const __m128 products = _mm_mul_ps(s, y);  // xy yz zx
        if (rule == SplitRule::kMinimumVolume) return _mm_cvtss_f32(_mm_mul_ss(products, _mm_movehl_ps(s, s)));
        return _mm_cvtss_f32(
            _mm_add_ss(_mm_add_ss(products, _mm_shuffle_ps(products, products, _MM_SHUFFLE(1, 1, 1, 1))),
                       _mm_movehl_ps(products, products)));
    }
};

/// Triangles that are still to be divided, and their bins along the axis of their next division.
struct Piece {
    TreeItem* items = nullptr;
    TreeItem* room = nullptr;  ///< as much, for their order after it
    std::uint32_t count = 0;
    Bounds all;
    Bins bins;

    [[nodiscard]] bool needsBins() const { return count > kNodeFaces; }
    [[nodiscard]] bool hasExtent() const { return bins.scale > 0; }
    [[nodiscard]] kernel::Cut cutBefore(unsigned bin) const { return {bins.axis, bins.start, bins.scale, bin}; }

    /// `all` is known; chooses the axis and empties the bins.
    void prepare() {
        alignas(16) float spread[4], opposite[4];
        _mm_store_ps(spread, _mm_add_ps(all.centre, all.opposite));
        _mm_store_ps(opposite, all.opposite);
        bins.axis = static_cast<unsigned>(std::max_element(spread, spread + 3) - spread);
        bins.start = -opposite[bins.axis];
        const float steps = static_cast<float>(kBins) * 0.999999f / spread[bins.axis];
        bins.scale = spread[bins.axis] > 0 && steps < std::numeric_limits<float>::max() ? steps : 0;
        std::fill_n(bins.counts[0], 2 * kBins, 0);
        std::fill_n(bins.box[0][0].side, sizeof bins.box / sizeof(float), -std::numeric_limits<float>::max());
    }
    [[nodiscard]] std::uint32_t countOf(unsigned i) const { return bins.counts[0][i] + bins.counts[1][i]; }
    [[nodiscard]] Bounds bin(unsigned i) const {
        Bounds bounds;
        bounds.add(bins.box[0][i]);
        bounds.add(bins.box[1][i]);
        return bounds;
    }
};

class Divider {
public:
    Divider(std::span<const OwnPosition> positions, std::span<const std::uint32_t> indices, SplitRule rule,
            InstructionSet set)
        : rule_(rule),
          faces_(static_cast<std::uint32_t>(indices.size() / 3)),
          items_(new TreeItem[2 * std::size_t{faces_}]),
          kernels_(kernel::treeKernels(set).division) {
        for (std::uint32_t face = 0; face < faces_; ++face) {
            const std::uint32_t* const corner = &indices[3 * std::size_t{face}];
            const __m128 a = _mm_load_ps(positions[corner[0]].xyz0), b = _mm_load_ps(positions[corner[1]].xyz0),
                         c = _mm_load_ps(positions[corner[2]].xyz0);
            TreeItem& item = items_[face];
            _mm_store_ps(item.side, _mm_sub_ps(_mm_setzero_ps(), _mm_min_ps(_mm_min_ps(a, b), c)));
            _mm_store_ps(item.side + 4, _mm_max_ps(_mm_max_ps(a, b), c));
            item.side[3] = __builtin_bit_cast(float, face + TreeItem::kFaceBias);
            whole_.add(item);
        }
    }

    TreeTopology divide() {
        if (faces_ == 0) return {};
        out_.leafFaces.reserve(faces_ + faces_ / 8 + kLeafFaces);
        out_.children.assign(kWidth, kernel::kNoChild);
        chooseGrowth();
        std::vector<Piece> whole(1);
        Piece& piece = whole[0];
        piece.items = items_.get();
        piece.room = items_.get() + faces_;
        piece.count = faces_;
        piece.all = whole_;
        fillBins(piece);
        const kernel::ChildRef ref = subtree(piece, 1);
        out_.children[0] = ref;
        return std::move(out_);
    }

private:
    SplitRule rule_;
    std::uint32_t faces_;
    std::unique_ptr<TreeItem[]> items_;  ///< and as much room
    const kernel::DivisionKernels& kernels_;
    Bounds whole_;
    double growth_ = 1;
    TreeTopology out_;
    using Pieces = std::array<Piece, kWidth>;
    std::vector<std::unique_ptr<Pieces>> pieces_;  ///< of one node per level

    [[nodiscard]] CutRule cutRule() const {
        switch (rule_) {
            case SplitRule::kMinimumVolume:
                return CutRule::kVolume;
            case SplitRule::kLongestSideMedian:
                return CutRule::kMedian;
            case SplitRule::kLongestSideMean:
                return CutRule::kMean;
            case SplitRule::kSurfaceArea:
                break;
        }
        return CutRule::kSurface;
    }

    /// Equal steps from the lowest nodes up to the whole.
    void chooseGrowth() {
        const double lowest = static_cast<double>(faces_) / kUsualFaces;
        if (lowest <= kMostGrowth) {
            growth_ = kMostGrowth;
            return;
        }
        const double levels = std::ceil(std::log(lowest) / std::log(kMostGrowth));
        growth_ = std::pow(lowest, 1 / levels);
    }

    void fillBins(Piece& piece) const {
        if (!piece.needsBins()) return;
        piece.prepare();
        kernels_.fillBins(piece.items, piece.count, piece.bins);
    }

    static constexpr std::array<std::uint8_t, kLeafFaces> kAsTheyAre{0, 1, 2, 3};

    kernel::ChildRef leaf(const TreeItem* items, const std::uint8_t* order, unsigned count) {
        const std::uint32_t index = static_cast<std::uint32_t>(out_.leafFaces.size() / kLeafFaces);
        for (unsigned i = 0; i < kLeafFaces; ++i)
            out_.leafFaces.push_back(i < count ? faceOf(items[order[i]]) : TreeStorage::kNoFace);
        return kernel::kLeafBit | index << 2 | (count - 1);
    }

    std::uint32_t newNode() {
        const std::size_t node = out_.children.size() / kWidth;
        out_.children.resize(out_.children.size() + kWidth, kernel::kNoChild);
        return static_cast<std::uint32_t>(node);
    }

    kernel::ChildRef lowest(const Piece& piece, std::size_t level) {
        if (piece.count <= kLeafFaces) return leaf(piece.items, kAsTheyAre.data(), piece.count);
        kernel::LeafDivision division;
        kernels_.intoLeaves(piece.items, piece.count, cutRule(), division);
        const std::uint8_t* order = division.order;
        out_.depth = std::max(out_.depth, level + 1);
        const std::uint32_t node = newNode();
        for (std::size_t i = 0; i < division.leaves; ++i) {
            out_.children[node * kWidth + i] = leaf(piece.items, order, division.counts[i]);
            order += division.counts[i];
        }
        return node;
    }

    kernel::ChildRef subtree(Piece& piece, std::size_t level) {
        out_.depth = std::max(out_.depth, level);
        if (piece.count <= kNodeFaces) return lowest(piece, level);
        double enough = kNodeFaces;  // a child of this many triangles needs no division here
        while (enough * growth_ < piece.count) enough *= growth_;

        while (pieces_.size() <= level) pieces_.push_back(nullptr);
        if (!pieces_[level]) pieces_[level] = std::make_unique<Pieces>();
        Pieces& pieces = *pieces_[level];
        pieces[0] = piece;
        std::array<std::uint8_t, kWidth> order{};  // neighbours side by side
        std::array<float, kWidth> size{pieces[0].all.measure(SplitRule::kSurfaceArea)};
        for (std::uint8_t count = 1; count < kWidth; ++count) {
            std::size_t best = count;
            for (std::size_t i = 0; i < count; ++i)
                if (pieces[order[i]].count > enough && (best == count || size[order[i]] > size[order[best]])) best = i;
            if (best == count) {
                return node(pieces, order, count, level);
            }
            Piece& left = pieces[order[best]];
            split(left, pieces[count], level);
            size[order[best]] = left.all.measure(SplitRule::kSurfaceArea);
            size[count] = pieces[count].all.measure(SplitRule::kSurfaceArea);
            std::copy_backward(order.begin() + static_cast<std::ptrdiff_t>(best) + 1, order.begin() + count,
                               order.begin() + count + 1);
            order[best + 1] = count;
        }
        return node(pieces, order, kWidth, level);
    }

    kernel::ChildRef node(Pieces& pieces, const std::array<std::uint8_t, kWidth>& order, std::size_t count,
                          std::size_t level) {
        const std::uint32_t node = newNode();
        for (std::size_t i = 0; i < count; ++i) {
            const kernel::ChildRef ref = subtree(pieces[order[i]], level + 1);
            out_.children[node * kWidth + i] = ref;
        }
        return node;
    }

    /// Cuts `piece` in two; what is left of it is the first part.
    void split(Piece& piece, Piece& right, std::size_t level) {
        if (!piece.hasExtent() || level > kLevelsOfChoice) return splitByCount(piece, right);
        switch (rule_) {
            case SplitRule::kLongestSideMedian:
                return splitByCount(piece, right);
            case SplitRule::kLongestSideMean:
                return splitByMean(piece, right);
            case SplitRule::kSurfaceArea:
            case SplitRule::kMinimumVolume:
                break;
        }
        splitByBins(piece, right);
    }

    /// Half to each side, the first part a whole number of lowest nodes.
    void splitByCount(Piece& piece, Piece& right) {
        const unsigned axis = piece.bins.axis;
        const auto half = static_cast<std::uint32_t>((piece.count / 2 + kNodeFaces - 1) / kNodeFaces * kNodeFaces);
        std::nth_element(piece.items, piece.items + half, piece.items + piece.count,
                         [axis](const TreeItem& a, const TreeItem& b) {
                             const float x = centre2(a, axis), y = centre2(b, axis);
                             return x != y ? x < y : faceOf(a) < faceOf(b);
                         });
        cut(piece, right, half);
    }

    void splitByMean(Piece& piece, Piece& right) {
        const unsigned axis = piece.bins.axis;
        TreeItem* const end = piece.items + piece.count;
        double sum = 0;
        for (const TreeItem* i = piece.items; i != end; ++i) sum += static_cast<double>(centre2(*i, axis));
        const float mean = static_cast<float>(sum / piece.count);
        TreeItem* const middle =
            std::partition(piece.items, end, [&](const TreeItem& item) { return centre2(item, axis) < mean; });
        if (middle == piece.items || middle == end) return splitByCount(piece, right);
        cut(piece, right, static_cast<std::uint32_t>(middle - piece.items));
    }

    void cut(Piece& piece, Piece& right, std::uint32_t left) const {
        right.items = piece.items + left;
        right.room = piece.room + left;
        right.count = piece.count - left;
        piece.count = left;
        for (Piece* const part : {&piece, &right}) {
            part->all = {};
            for (std::uint32_t i = 0; i < part->count; ++i) part->all.add(part->items[i]);
            fillBins(*part);
        }
    }

    struct Choice {
        unsigned bin = 0;  ///< the first of the right part
        std::uint32_t left = 0;
    };

    /// Wald 2007: the cut between bins of least (size of the part's box) · (lowest nodes that it needs).
    Choice bestCut(const std::array<Bounds, kBins>& bins, const Piece& piece) const {
        const auto cost = [&](const Bounds& box, std::uint32_t count) {
            return box.measure(rule_) * static_cast<float>((count + kNodeFaces - 1) / kNodeFaces);
        };
        std::array<float, kBins> above{};
        Bounds box;
        std::uint32_t count = 0;
        for (unsigned i = kBins - 1; i > 0; --i) {
            box.add(bins[i]);
            count += piece.countOf(i);
            above[i] = count == 0 ? 0 : cost(box, count);
        }
        Choice best;
        float least = std::numeric_limits<float>::max();
        box = {};
        count = 0;
        for (unsigned i = 0; i + 1 < kBins; ++i) {
            if (piece.countOf(i) == 0) continue;
            box.add(bins[i]);
            count += piece.countOf(i);
            if (count == piece.count) break;
            const float total = cost(box, count) + above[i + 1];
            if (total < least) {
                least = total;
                best = {i + 1, count};
            }
        }
        return best;
    }

    void splitByBins(Piece& piece, Piece& right) {
        std::array<Bounds, kBins> bins;
        for (unsigned i = 0; i < kBins; ++i) bins[i] = piece.bin(i);
        const Choice choice = bestCut(bins, piece);
        if (choice.bin == 0) return splitByCount(piece, right);
        const kernel::Cut cut = piece.cutBefore(choice.bin);
        const std::uint32_t count = piece.count;
        const TreeItem* const from = piece.items;
        right.items = piece.room + choice.left;
        right.room = piece.items + choice.left;
        right.count = count - choice.left;
        right.all = piece.all = {};
        for (unsigned i = 0; i < choice.bin; ++i) piece.all.add(bins[i]);
        for (unsigned i = choice.bin; i < kBins; ++i) right.all.add(bins[i]);
        piece.count = choice.left;
        std::swap(piece.items, piece.room);
        for (Piece* const part : {&piece, &right})
            if (part->needsBins()) part->prepare();
        // One pass puts the triangles in order and into the bins of the parts.
        kernels_.part(from, count, cut, piece.items, right.items, piece.needsBins() ? &piece.bins : nullptr,
                      right.needsBins() ? &right.bins : nullptr);
    }
};

}  // namespace

TreeTopology divide(std::span<const OwnPosition> positions, std::span<const std::uint32_t> indices, SplitRule rule,
                    InstructionSet set) {
    return Divider(positions, indices, rule, set).divide();
}

}  // namespace tessera
