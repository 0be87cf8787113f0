#include "server/collision/tree/LeafDivision.h"

#include <emmintrin.h>

#include <algorithm>

namespace tessera {
namespace {

using kernel::kLeafFaces;
using kernel::kWidth;

class LeafDivider {
public:
    LeafDivider(std::span<const DivisionItem> items, SplitRule rule) : items_(items), rule_(rule) {
        for (std::size_t i = 0; i < items.size(); ++i) {
            out_.order[i] = static_cast<std::uint8_t>(i);
            alignas(16) std::int32_t key[4];
            // Floats as integers of the same order; the last six bits tell equal ones apart.
            const __m128i bits = _mm_castps_si128(_mm_add_ps(items[i].low(), items[i].high()));
            const __m128i ordered = _mm_xor_si128(bits, _mm_srli_epi32(_mm_srai_epi32(bits, 31), 1));
            _mm_store_si128(reinterpret_cast<__m128i*>(key), _mm_or_si128(_mm_andnot_si128(_mm_set1_epi32(63), ordered),
                                                                          _mm_set1_epi32(static_cast<int>(i))));
            for (unsigned axis = 0; axis < 3; ++axis) keys_[axis][i] = key[axis];
        }
    }

    LeafDivision divide() {
        divide(0, static_cast<unsigned>(items_.size()));
        return out_;
    }

private:
    using Order = std::array<std::uint8_t, kNodeFaces>;

    std::span<const DivisionItem> items_;
    SplitRule rule_;
    LeafDivision out_;
    alignas(16) std::array<std::array<std::int32_t, kNodeFaces>, 3> keys_;

    struct Cut {
        unsigned left = 0;  ///< triangles
        float cost = std::numeric_limits<float>::max();
    };

    void divide(unsigned first, unsigned count) {
        if (count <= kLeafFaces) {
            out_.counts[out_.leaves++] = static_cast<std::uint8_t>(count);
            return;
        }
        Order best;
        Cut cut;
        if (rule_ == SplitRule::kSurfaceArea || rule_ == SplitRule::kMinimumVolume) {
            for (unsigned axis = 0; axis < 3; ++axis) {
                Order sorted;
                sort(axis, first, count, sorted);
                const Cut here = bestCut(sorted, count);
                if (here.cost < cut.cost) {
                    cut = here;
                    best = sorted;
                }
            }
        }
        if (cut.left == 0) cut.left = cutAlongLongest(first, count, best);
        std::copy_n(best.begin(), count, out_.order.begin() + first);
        divide(first, cut.left);
        divide(first + cut.left, count - cut.left);
    }

    /// The places of `order` from first on, by their centres: each one's rank is counted.
    void sort(unsigned axis, unsigned first, unsigned count, Order& sorted) const {
        alignas(16) std::array<std::int32_t, kNodeFaces> keys, ranks;
        for (unsigned i = 0; i < count; ++i) keys[i] = keys_[axis][out_.order[first + i]];
        for (unsigned i = count; i % 8 != 0; ++i) keys[i] = std::numeric_limits<std::int32_t>::max();
        for (unsigned begin = 0; begin < count; begin += 8) {
            const __m128i a = _mm_load_si128(reinterpret_cast<const __m128i*>(&keys[begin]));
            const __m128i b = _mm_load_si128(reinterpret_cast<const __m128i*>(&keys[begin + 4]));
            __m128i above = _mm_setzero_si128(), aboveB = above;
            for (unsigned j = 0; j < count; ++j) {
                const __m128i one = _mm_set1_epi32(keys[j]);
                above = _mm_sub_epi32(above, _mm_cmpgt_epi32(a, one));
                aboveB = _mm_sub_epi32(aboveB, _mm_cmpgt_epi32(b, one));
            }
            _mm_store_si128(reinterpret_cast<__m128i*>(&ranks[begin]), above);
            _mm_store_si128(reinterpret_cast<__m128i*>(&ranks[begin + 4]), aboveB);
        }
        for (unsigned i = 0; i < count; ++i) sorted[static_cast<unsigned>(ranks[i])] = out_.order[first + i];
    }

    /// The cut between whole leaves of least (size of the part's box) · (its leaves).
    Cut bestCut(const Order& sorted, unsigned count) const {
        const unsigned leaves = (count + kLeafFaces - 1) / kLeafFaces;
        std::array<DivisionBounds, kWidth> leaf;
        for (unsigned i = 0; i < count; ++i) leaf[i / kLeafFaces].extend(items_[sorted[i]].low(), items_[sorted[i]].high());
        std::array<float, kWidth> above{};
        DivisionBounds part;
        for (unsigned i = leaves - 1; i > 0; --i) {
            part.extend(leaf[i]);
            above[i] = part.measure(rule_) * static_cast<float>(leaves - i);
        }
        Cut best;
        part = {};
        for (unsigned i = 1; i < leaves; ++i) {
            part.extend(leaf[i - 1]);
            const float cost = part.measure(rule_) * static_cast<float>(i) + above[i];
            if (cost < best.cost) best = {i * kLeafFaces, cost};
        }
        return best;
    }

    /// Between whole leaves near the middle, by count or by the mean of the centres.
    unsigned cutAlongLongest(unsigned first, unsigned count, Order& sorted) const {
        DivisionBounds centres2;
        std::array<double, 3> sum{};
        for (unsigned i = 0; i < count; ++i) {
            const DivisionItem& item = items_[out_.order[first + i]];
            const __m128 centre2 = _mm_add_ps(item.low(), item.high());
            centres2.extend(centre2, centre2);
            for (unsigned axis = 0; axis < 3; ++axis) sum[axis] += static_cast<double>(item.centre2(axis));
        }
        const std::array<float, 4> spread = centres2.size();
        const auto axis = static_cast<unsigned>(std::max_element(spread.begin(), spread.begin() + 3) - spread.begin());
        sort(axis, first, count, sorted);
        unsigned left = count / 2;
        if (rule_ == SplitRule::kLongestSideMean)
            left = static_cast<unsigned>(std::count_if(sorted.begin(), sorted.begin() + count, [&](std::uint8_t i) {
                return static_cast<double>(items_[i].centre2(axis)) * count < sum[axis];
            }));
        const unsigned most = (count - 1) / kLeafFaces;  // leaves that the left can fill
        return std::clamp((left + kLeafFaces / 2) / kLeafFaces, 1u, most) * kLeafFaces;
    }
};

}  // namespace

LeafDivision divideIntoLeaves(std::span<const DivisionItem> items, SplitRule rule) { return LeafDivider(items, rule).divide(); }

}  // namespace tessera
