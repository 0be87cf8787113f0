#include "server/collision/tree/TreeTopology.h"

#include <xmmintrin.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "server/collision/tree/TreeStorage.h"

namespace tessera {
namespace {

using kernel::kLeafFaces;
using kernel::kWidth;

/// A triangle's box; only the quality of the division depends on its rounding.
struct alignas(16) Item {
    float lower[4];
    float upper[4];
    [[nodiscard]] std::uint32_t face() const { return __builtin_bit_cast(std::uint32_t, lower[3]); }
    [[nodiscard]] float centre2(unsigned axis) const { return lower[axis] + upper[axis]; }
};

struct Bounds {
    __m128 lower = _mm_set1_ps(std::numeric_limits<float>::max());
    __m128 upper = _mm_set1_ps(-std::numeric_limits<float>::max());

    void extend(__m128 low, __m128 high) {
        lower = _mm_min_ps(lower, low);
        upper = _mm_max_ps(upper, high);
    }
    void extend(const Bounds& b) { extend(b.lower, b.upper); }
    [[nodiscard]] std::array<float, 4> size() const {
        std::array<float, 4> s;
        _mm_storeu_ps(s.data(), _mm_sub_ps(upper, lower));
        return s;
    }
    [[nodiscard]] float halfArea() const {
        const std::array<float, 4> s = size();
        return s[0] * s[1] + s[1] * s[2] + s[2] * s[0];
    }
    [[nodiscard]] float volume() const {
        const std::array<float, 4> s = size();
        return s[0] * s[1] * s[2];
    }
};

struct Piece {
    std::uint32_t first = 0, count = 0;
    Bounds box, centres2;  ///< of the triangles; of twice their centres
    void add(const Item& item) {
        const __m128 low = _mm_load_ps(item.lower), high = _mm_load_ps(item.upper);
        const __m128 centre = _mm_add_ps(low, high);
        box.extend(low, high);
        centres2.extend(centre, centre);
        ++count;
    }
    void add(const Piece& p) {
        box.extend(p.box);
        centres2.extend(p.centres2);
        count += p.count;
    }
};

/// Subtrees of so many triangles fill a node of their level well: a leaf, a node of leaves, a node of those, …
constexpr std::uint32_t kNodeOfLeaves = 40;
constexpr std::uint32_t kGrowth = 12;
/// Below this many levels the division is by count alone, so that no input makes a tree deep.
constexpr std::size_t kLevelsOfChoice = 24;

class Divider {
public:
    Divider(const TriangleMesh& mesh, const Vec3d& centre, double unit, SplitRule rule) : rule_(rule), items_(mesh.faceCount()) {
        for (std::uint32_t face = 0; face < items_.size(); ++face) {
            const Vec3f a = ((mesh.corner(face, 0) - centre) * unit).cast<float>(), b = ((mesh.corner(face, 1) - centre) * unit).cast<float>(),
                        c = ((mesh.corner(face, 2) - centre) * unit).cast<float>();
            Item& item = items_[face];
            for (int axis = 0; axis < 3; ++axis) {
                item.lower[axis] = std::min({a[axis], b[axis], c[axis]});
                item.upper[axis] = std::max({a[axis], b[axis], c[axis]});
            }
            item.lower[3] = __builtin_bit_cast(float, face);
            item.upper[3] = 0;
        }
    }

    TreeTopology divide() {
        if (items_.empty()) return {};
        out_.leafFaces.reserve(items_.size() * 5 / 4 + kLeafFaces);
        Piece whole = pieceOf(0, static_cast<std::uint32_t>(items_.size()));
        out_.children.assign(kWidth, kernel::kNoChild);
        const kernel::ChildRef ref = subtree(whole, 1);
        out_.children[0] = ref;
        return std::move(out_);
    }

private:
    SplitRule rule_;
    std::vector<Item> items_;
    TreeTopology out_;

    [[nodiscard]] Piece pieceOf(std::uint32_t first, std::uint32_t count) const {
        Piece piece;
        piece.first = first;
        for (std::uint32_t i = first; i < first + count; ++i) piece.add(items_[i]);
        return piece;
    }

    kernel::ChildRef leaf(const Piece& piece) {
        const std::uint32_t index = static_cast<std::uint32_t>(out_.leafFaces.size() / kLeafFaces);
        for (std::uint32_t i = 0; i < kLeafFaces; ++i)
            out_.leafFaces.push_back(i < piece.count ? items_[piece.first + i].face() : TreeStorage::kNoFace);
        return kernel::kLeafBit | index << 2 | (piece.count - 1);
    }

    kernel::ChildRef subtree(const Piece& piece, std::size_t level) {
        out_.depth = std::max(out_.depth, level);
        if (piece.count <= kLeafFaces) return leaf(piece);
        std::uint32_t enough = kLeafFaces;  // a child of this many triangles needs no division here
        for (std::uint32_t capacity = kNodeOfLeaves; capacity < piece.count; capacity *= kGrowth) {
            enough = capacity;
            if (capacity > std::numeric_limits<std::uint32_t>::max() / kGrowth) break;
        }
        std::array<Piece, kWidth> pieces;
        std::size_t count = 1;
        pieces[0] = piece;
        while (count < kWidth) {
            std::size_t best = count;
            float most = -1;
            for (std::size_t i = 0; i < count; ++i) {
                const float weight = pieces[i].box.halfArea();
                if (pieces[i].count > enough && weight > most) {
                    most = weight;
                    best = i;
                }
            }
            if (best == count) break;
            const Piece right = split(pieces[best], level);
            std::move_backward(pieces.begin() + static_cast<std::ptrdiff_t>(best) + 1, pieces.begin() + static_cast<std::ptrdiff_t>(count),
                               pieces.begin() + static_cast<std::ptrdiff_t>(count) + 1);
            pieces[best + 1] = right;
            ++count;
        }
        const std::uint32_t node = static_cast<std::uint32_t>(out_.children.size() / kWidth);
        out_.children.resize(out_.children.size() + kWidth, kernel::kNoChild);
        for (std::size_t i = 0; i < count; ++i) {
            const kernel::ChildRef ref = subtree(pieces[i], level + 1);
            out_.children[node * kWidth + i] = ref;
        }
        return node;
    }

    /// Cuts the piece in two; what is left of it is the first part, the second is returned.
    Piece split(Piece& piece, std::size_t level) {
        const std::array<float, 4> spread = piece.centres2.size();
        const auto axis = static_cast<unsigned>(std::max_element(spread.begin(), spread.begin() + 3) - spread.begin());
        if (!(spread[axis] > 0) || level > kLevelsOfChoice) return splitByCount(piece, axis);
        switch (rule_) {
            case SplitRule::kLongestSideMedian: return splitByCount(piece, axis);
            case SplitRule::kLongestSideMean: return splitByMean(piece, axis);
            case SplitRule::kSurfaceArea:
            case SplitRule::kMinimumVolume: break;
        }
        return splitByBins(piece, axis, spread[axis]);
    }

    /// Half to each side, the first part a whole number of leaves.
    Piece splitByCount(Piece& piece, unsigned axis) {
        const std::uint32_t half = (piece.count / 2 + kLeafFaces - 1) / kLeafFaces * kLeafFaces;
        const auto begin = items_.begin() + piece.first;
        std::nth_element(begin, begin + half, begin + piece.count, [axis](const Item& a, const Item& b) {
            const float x = a.centre2(axis), y = b.centre2(axis);
            return x != y ? x < y : a.face() < b.face();
        });
        return cut(piece, half);
    }

    Piece splitByMean(Piece& piece, unsigned axis) {
        const auto begin = items_.begin() + piece.first, end = begin + piece.count;
        double sum = 0;
        for (auto i = begin; i != end; ++i) sum += static_cast<double>(i->centre2(axis));
        const float mean = static_cast<float>(sum / piece.count);
        const auto middle = std::partition(begin, end, [&](const Item& item) { return item.centre2(axis) < mean; });
        if (middle == begin || middle == end) return splitByCount(piece, axis);
        return cut(piece, static_cast<std::uint32_t>(middle - begin));
    }

    Piece cut(Piece& piece, std::uint32_t left) {
        const Piece right = pieceOf(piece.first + left, piece.count - left);
        piece = pieceOf(piece.first, left);
        return right;
    }

    static constexpr unsigned kBins = 16;

    /// Wald 2007: the cut between bins of least (size of the part's box) · (leaves that it needs).
    Piece splitByBins(Piece& piece, unsigned axis, float spread) {
        const unsigned bins = piece.count >= 32 ? kBins : 8;
        alignas(16) float low[4];
        _mm_store_ps(low, piece.centres2.lower);
        const float scale = static_cast<float>(bins) * 0.999999f / spread, start = low[axis];
        const auto binOf = [=](const Item& item) {
            return std::min(static_cast<unsigned>((item.centre2(axis) - start) * scale), bins - 1);
        };
        std::array<Piece, kBins> bin;
        for (std::uint32_t i = piece.first; i < piece.first + piece.count; ++i) bin[binOf(items_[i])].add(items_[i]);
        const bool byVolume = rule_ == SplitRule::kMinimumVolume;
        const auto cost = [&](const Piece& p) {
            const float size = byVolume ? p.box.volume() : p.box.halfArea();
            return size * static_cast<float>((p.count + kLeafFaces - 1) / kLeafFaces);
        };
        std::array<float, kBins> above{};
        Piece right;
        for (unsigned i = bins - 1; i > 0; --i) {
            right.add(bin[i]);
            above[i] = right.count == 0 ? 0 : cost(right);
        }
        Piece left, bestLeft;
        unsigned best = 0;
        float least = std::numeric_limits<float>::max();
        for (unsigned i = 0; i + 1 < bins; ++i) {
            left.add(bin[i]);
            if (left.count == 0 || left.count == piece.count) continue;
            const float total = cost(left) + above[i + 1];
            if (total < least) {
                least = total;
                best = i + 1;
                bestLeft = left;
            }
        }
        if (best == 0) return splitByCount(piece, axis);
        right = {};
        for (unsigned i = best; i < bins; ++i) right.add(bin[i]);
        const auto begin = items_.begin() + piece.first;
        std::partition(begin, begin + piece.count, [&](const Item& item) { return binOf(item) < best; });
        bestLeft.first = piece.first;
        right.first = piece.first + bestLeft.count;
        piece = bestLeft;
        return right;
    }
};

}  // namespace

TreeTopology divide(const TriangleMesh& mesh, const Vec3d& centre, double unit, SplitRule rule) {
    return Divider(mesh, centre, unit, rule).divide();
}

}  // namespace tessera
