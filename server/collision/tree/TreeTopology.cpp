#include "server/collision/tree/TreeTopology.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>

#include "server/collision/tree/LeafDivision.h"

namespace tessera {
namespace {

using kernel::kLeafFaces;
using kernel::kWidth;
using Item = DivisionItem;
using Bounds = DivisionBounds;

/// Below this many levels the division is by count alone, so that no input makes a tree deep.
constexpr std::size_t kLevelsOfChoice = 24;
constexpr unsigned kBins = 16;
/// How many times its children a node is meant to hold, at most.
constexpr double kMostGrowth = 13;
/// How full a lowest node is, about.
constexpr double kUsualFaces = 50;

/// Triangles whose centres are in one interval along a piece's axis.
struct Bin {
    Bounds box, centres2;  ///< of the triangles; of twice their centres
    void add(__m128 low, __m128 high) {
        const __m128 centre = _mm_add_ps(low, high);
        box.extend(low, high);
        centres2.extend(centre, centre);
    }
    void add(const Bin& b) {
        box.extend(b.box);
        centres2.extend(b.centres2);
    }
};

/// Triangles that are still to be divided, and their bins along the axis of their next division.
struct Piece {
    Item* items = nullptr;
    Item* room = nullptr;  ///< as much, for their order after it
    std::uint32_t count = 0;
    Bin all;
    unsigned axis = 0;
    float start = 0, scale = 0;
    std::array<Bin, kBins> bins;
    std::array<std::uint32_t, kBins> counts;

    [[nodiscard]] bool needsBins() const { return count > kNodeFaces; }
    [[nodiscard]] bool hasExtent() const { return scale > 0; }

    /// `all` is known; chooses the axis and empties the bins.
    void prepare() {
        const std::array<float, 4> spread = all.centres2.size();
        axis = static_cast<unsigned>(std::max_element(spread.begin(), spread.begin() + 3) - spread.begin());
        alignas(16) float low[4];
        _mm_store_ps(low, all.centres2.lower);
        start = low[axis];
        const float steps = static_cast<float>(kBins) * 0.999999f / spread[axis];
        scale = spread[axis] > 0 && steps < std::numeric_limits<float>::max() ? steps : 0;
        bins.fill({});
        counts.fill(0);
    }
    [[nodiscard]] unsigned binOf(const Item& item) const {
        return std::min(static_cast<unsigned>(static_cast<int>((item.centre2(axis) - start) * scale)), kBins - 1);
    }
    void addToBins(const Item& item, __m128 low, __m128 high) {
        const unsigned bin = binOf(item);
        bins[bin].add(low, high);
        ++counts[bin];
    }
};

class Divider {
public:
    Divider(std::span<const OwnPosition> positions, std::span<const std::uint32_t> indices, SplitRule rule)
        : rule_(rule), faces_(static_cast<std::uint32_t>(indices.size() / 3)), items_(new Item[2 * std::size_t{faces_}]) {
        for (std::uint32_t face = 0; face < faces_; ++face) {
            const std::uint32_t* const corner = &indices[3 * std::size_t{face}];
            const __m128 a = _mm_load_ps(positions[corner[0]].xyz0), b = _mm_load_ps(positions[corner[1]].xyz0),
                         c = _mm_load_ps(positions[corner[2]].xyz0);
            const __m128 low = _mm_min_ps(_mm_min_ps(a, b), c), high = _mm_max_ps(_mm_max_ps(a, b), c);
            whole_.add(low, high);
            Item& item = items_[face];
            _mm_store_ps(item.lower, low);
            _mm_store_ps(item.upper, high);
            item.lower[3] = __builtin_bit_cast(float, face + Item::kFaceBias);
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
    std::unique_ptr<Item[]> items_;  ///< and as much room
    Bin whole_;
    double growth_ = 1;
    TreeTopology out_;
    using Pieces = std::array<Piece, kWidth>;
    std::vector<std::unique_ptr<Pieces>> pieces_;  ///< of one node per level

    [[nodiscard]] bool byBins() const { return rule_ == SplitRule::kSurfaceArea || rule_ == SplitRule::kMinimumVolume; }

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
        for (std::uint32_t i = 0; i < piece.count; ++i) piece.addToBins(piece.items[i], piece.items[i].low(), piece.items[i].high());
    }

    kernel::ChildRef leaf(const Item* items, const std::uint8_t* order, unsigned count) {
        const std::uint32_t index = static_cast<std::uint32_t>(out_.leafFaces.size() / kLeafFaces);
        for (unsigned i = 0; i < kLeafFaces; ++i) out_.leafFaces.push_back(i < count ? items[order[i]].face() : TreeStorage::kNoFace);
        return kernel::kLeafBit | index << 2 | (count - 1);
    }

    std::uint32_t newNode() {
        const std::size_t node = out_.children.size() / kWidth;
        out_.children.resize(out_.children.size() + kWidth, kernel::kNoChild);
        return static_cast<std::uint32_t>(node);
    }

    kernel::ChildRef lowest(const Piece& piece, std::size_t level) {
        const LeafDivision division = divideIntoLeaves({piece.items, piece.count}, rule_);
        const std::uint8_t* order = division.order.data();
        if (division.leaves == 1) return leaf(piece.items, order, piece.count);
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
        std::array<float, kWidth> size{pieces[0].all.box.measure(SplitRule::kSurfaceArea)};
        for (std::uint8_t count = 1; count < kWidth; ++count) {
            std::size_t best = count;
            for (std::size_t i = 0; i < count; ++i)
                if (pieces[order[i]].count > enough && (best == count || size[order[i]] > size[order[best]])) best = i;
            if (best == count) {
                return node(pieces, order, count, level);
            }
            Piece& left = pieces[order[best]];
            split(left, pieces[count], level);
            size[order[best]] = left.all.box.measure(SplitRule::kSurfaceArea);
            size[count] = pieces[count].all.box.measure(SplitRule::kSurfaceArea);
            std::copy_backward(order.begin() + static_cast<std::ptrdiff_t>(best) + 1, order.begin() + count, order.begin() + count + 1);
            order[best + 1] = count;
        }
        return node(pieces, order, kWidth, level);
    }

    kernel::ChildRef node(Pieces& pieces, const std::array<std::uint8_t, kWidth>& order, std::size_t count, std::size_t level) {
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
            case SplitRule::kLongestSideMedian: return splitByCount(piece, right);
            case SplitRule::kLongestSideMean: return splitByMean(piece, right);
            case SplitRule::kSurfaceArea:
            case SplitRule::kMinimumVolume: break;
        }
        splitByBins(piece, right);
    }

    /// Half to each side, the first part a whole number of lowest nodes.
    void splitByCount(Piece& piece, Piece& right) {
        const unsigned axis = piece.axis;
        const auto half = static_cast<std::uint32_t>((piece.count / 2 + kNodeFaces - 1) / kNodeFaces * kNodeFaces);
        std::nth_element(piece.items, piece.items + half, piece.items + piece.count, [axis](const Item& a, const Item& b) {
            const float x = a.centre2(axis), y = b.centre2(axis);
            return x != y ? x < y : a.face() < b.face();
        });
        cut(piece, right, half);
    }

    void splitByMean(Piece& piece, Piece& right) {
        const unsigned axis = piece.axis;
        Item* const end = piece.items + piece.count;
        double sum = 0;
        for (const Item* i = piece.items; i != end; ++i) sum += static_cast<double>(i->centre2(axis));
        const float mean = static_cast<float>(sum / piece.count);
        Item* const middle = std::partition(piece.items, end, [&](const Item& item) { return item.centre2(axis) < mean; });
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
            for (std::uint32_t i = 0; i < part->count; ++i) part->all.add(part->items[i].low(), part->items[i].high());
            fillBins(*part);
        }
    }

    struct Choice {
        unsigned bin = 0;  ///< the first of the right part
        std::uint32_t left = 0;
    };

    /// Wald 2007: the cut between bins of least (size of the part's box) · (lowest nodes that it needs).
    Choice bestCut(const Piece& piece) const {
        const auto cost = [&](const Bounds& box, std::uint32_t count) {
            return box.measure(rule_) * static_cast<float>((count + kUnit - 1) / kUnit);
        };
        std::array<float, kBins> above{};
        Bounds box;
        std::uint32_t count = 0;
        for (unsigned i = kBins - 1; i > 0; --i) {
            box.extend(piece.bins[i].box);
            count += piece.counts[i];
            above[i] = count == 0 ? 0 : cost(box, count);
        }
        Choice best;
        float least = std::numeric_limits<float>::max();
        box = {};
        count = 0;
        for (unsigned i = 0; i + 1 < kBins; ++i) {
            if (piece.counts[i] == 0) continue;
            box.extend(piece.bins[i].box);
            count += piece.counts[i];
            if (count == piece.count) break;
            const float total = cost(box, count) + above[i + 1];
            if (total < least) {
                least = total;
                best = {i + 1, count};
            }
        }
        return best;
    }
    static constexpr std::uint32_t kUnit = kNodeFaces;

    void splitByBins(Piece& piece, Piece& right) {
        const Choice choice = bestCut(piece);
        if (choice.bin == 0) return splitByCount(piece, right);
        const unsigned axis = piece.axis;
        const float start = piece.start, scale = piece.scale;
        const auto isRight = [=](const Item& item) {
            return std::min(static_cast<unsigned>(static_cast<int>((item.centre2(axis) - start) * scale)), kBins - 1) >= choice.bin;
        };
        const std::uint32_t count = piece.count;
        const Item* const from = piece.items;
        right.items = piece.room + choice.left;
        right.room = piece.items + choice.left;
        right.count = count - choice.left;
        right.all = {};
        for (unsigned i = choice.bin; i < kBins; ++i) right.all.add(piece.bins[i]);
        Bin left;
        for (unsigned i = 0; i < choice.bin; ++i) left.add(piece.bins[i]);
        piece.all = left;
        piece.count = choice.left;
        std::swap(piece.items, piece.room);
        // One pass puts the triangles in order and into the bins of the parts.
        Item* to[2] = {piece.items, right.items};
        if (!piece.needsBins() && !right.needsBins()) {
            for (std::uint32_t i = 0; i < count; ++i) *to[isRight(from[i])]++ = from[i];
            return;
        }
        piece.prepare();
        right.prepare();
        Piece* const part[2] = {&piece, &right};
        for (std::uint32_t i = 0; i < count; ++i) {
            const bool side = isRight(from[i]);
            const __m128 low = from[i].low(), high = from[i].high();
            _mm_store_ps(to[side]->lower, low);
            _mm_store_ps(to[side]->upper, high);
            ++to[side];
            part[side]->addToBins(from[i], low, high);
        }
    }
};

}  // namespace

TreeTopology divide(std::span<const OwnPosition> positions, std::span<const std::uint32_t> indices, SplitRule rule) {
    return Divider(positions, indices, rule).divide();
}

}  // namespace tessera
