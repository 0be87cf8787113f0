/// Many boxes, each side in an array of its own, and the test of all of them against one: the bounds of what deforms
/// are made anew in each frame, so they are kept as flat as can be. SSE2, which every x86-64 has. For this folder only.
#pragma once

#include <immintrin.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace tessera::lanes {

inline constexpr float kFar = std::numeric_limits<float>::max();

/// x y z and a fourth number that nobody looks at.
struct alignas(16) Point4 {
    float xyz0[4];
    [[nodiscard]] __m128 load() const { return _mm_load_ps(xyz0); }
    void store(__m128 p) { _mm_store_ps(xyz0, p); }
};

/// Empty until something is added. Touching counts as overlapping.
struct Box4 {
    __m128 lower = _mm_set1_ps(kFar), upper = _mm_set1_ps(-kFar);
    void extend(__m128 p) {
        lower = _mm_min_ps(lower, p);
        upper = _mm_max_ps(upper, p);
    }
    void extend(const Box4& other) {
        lower = _mm_min_ps(lower, other.lower);
        upper = _mm_max_ps(upper, other.upper);
    }
    [[nodiscard]] Box4 grown(__m128 by) const { return {_mm_sub_ps(lower, by), _mm_add_ps(upper, by)}; }
    [[nodiscard]] bool overlaps(const Box4& other) const {
        const __m128 both = _mm_and_ps(_mm_cmple_ps(lower, other.upper), _mm_cmple_ps(other.lower, upper));
        return (_mm_movemask_ps(both) & 7) == 7;
    }
};
[[nodiscard]] inline Box4 intersection(const Box4& a, const Box4& b) {
    return {_mm_max_ps(a.lower, b.lower), _mm_min_ps(a.upper, b.upper)};
}
/// The least of x, y and z.
[[nodiscard]] inline float leastSide(__m128 sides) {
    alignas(16) float s[4];
    _mm_store_ps(s, sides);
    const float xy = s[0] < s[1] ? s[0] : s[1];
    return xy < s[2] ? xy : s[2];
}

/// Sides 0 to 2: lower x y z, 3 to 5: upper. `stride` floats from one side to the next; a whole number of fours, those
/// that are not used empty.
struct BoxRows {
    const float* sides;
    std::size_t stride;

    /// Bit i: box first + i overlaps, of four.
    [[nodiscard]] unsigned overlapping(std::size_t first, const Box4& box) const {
        const auto side = [&](std::size_t k) { return _mm_load_ps(sides + k * stride + first); };
        const __m128 x = _mm_and_ps(_mm_cmple_ps(side(0), _mm_shuffle_ps(box.upper, box.upper, 0x00)),
                                    _mm_cmpge_ps(side(3), _mm_shuffle_ps(box.lower, box.lower, 0x00)));
        const __m128 y = _mm_and_ps(_mm_cmple_ps(side(1), _mm_shuffle_ps(box.upper, box.upper, 0x55)),
                                    _mm_cmpge_ps(side(4), _mm_shuffle_ps(box.lower, box.lower, 0x55)));
        const __m128 z = _mm_and_ps(_mm_cmple_ps(side(2), _mm_shuffle_ps(box.upper, box.upper, 0xaa)),
                                    _mm_cmpge_ps(side(5), _mm_shuffle_ps(box.lower, box.lower, 0xaa)));
        return static_cast<unsigned>(_mm_movemask_ps(_mm_and_ps(x, _mm_and_ps(y, z))));
    }
    /// Of sixteen.
    [[nodiscard]] unsigned overlapping16(std::size_t first, const Box4& box) const {
        return overlapping(first, box) | overlapping(first + 4, box) << 4 | overlapping(first + 8, box) << 8 |
               overlapping(first + 12, box) << 12;
    }
    [[nodiscard]] Box4 box(std::size_t i) const {
        const auto side = [&](std::size_t k) { return sides[k * stride + i]; };
        return {_mm_setr_ps(side(0), side(1), side(2), 0), _mm_setr_ps(side(3), side(4), side(5), 0)};
    }
};

inline void setBox(float* sides, std::size_t stride, std::size_t i, const Box4& box) {
    alignas(16) float lower[4], upper[4];
    _mm_store_ps(lower, box.lower);
    _mm_store_ps(upper, box.upper);
    for (std::size_t k = 0; k < 3; ++k) {
        sides[k * stride + i] = lower[k];
        sides[(3 + k) * stride + i] = upper[k];
    }
}

/// Such rows with their memory; empty boxes at first, filled up to a multiple of sixteen.
class BoxArray {
public:
    BoxArray() = default;
    explicit BoxArray(std::size_t count) : stride_((count + 15) / 16 * 16), store_(6 * stride_ / 4) {
        for (std::size_t i = 0; i < stride_; ++i) set(i, {});
    }
    void set(std::size_t i, const Box4& box) { setBox(sides(), stride_, i, box); }
    [[nodiscard]] BoxRows rows() const { return {store_.empty() ? nullptr : store_.data()->xyz0, stride_}; }
    [[nodiscard]] std::size_t memoryBytes() const { return store_.capacity() * sizeof(Point4); }

private:
    [[nodiscard]] float* sides() { return store_.empty() ? nullptr : store_.data()->xyz0; }
    std::size_t stride_ = 0;
    std::vector<Point4> store_;  ///< of fours, for their alignment
};

}  // namespace tessera::lanes
