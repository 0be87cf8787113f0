/// What the division of a mesh works on: boxes of triangles, and boxes around them.
#pragma once

#include <xmmintrin.h>

#include <array>
#include <cstdint>
#include <limits>

#include "server/collision/tree/TriangleTree.h"

namespace tessera {

/// A triangle's box; only the quality of the division depends on its rounding.
struct alignas(16) DivisionItem {
    /// The fourth of `lower` carries the face. As a number it is a normal one: sums of denormal numbers would be slow.
    static constexpr std::uint32_t kFaceBias = 0x40000000u;
    float lower[4];
    float upper[4];

    [[nodiscard]] std::uint32_t face() const { return __builtin_bit_cast(std::uint32_t, lower[3]) - kFaceBias; }
    [[nodiscard]] __m128 low() const { return _mm_load_ps(lower); }
    [[nodiscard]] __m128 high() const { return _mm_load_ps(upper); }
    /// Twice the centre.
    [[nodiscard]] float centre2(unsigned axis) const { return lower[axis] + upper[axis]; }
};

struct DivisionBounds {
    __m128 lower = _mm_set1_ps(std::numeric_limits<float>::max());
    __m128 upper = _mm_set1_ps(-std::numeric_limits<float>::max());

    void extend(__m128 low, __m128 high) {
        lower = _mm_min_ps(lower, low);
        upper = _mm_max_ps(upper, high);
    }
    void extend(const DivisionBounds& b) { extend(b.lower, b.upper); }
    [[nodiscard]] std::array<float, 4> size() const {
        std::array<float, 4> s;
        _mm_storeu_ps(s.data(), _mm_sub_ps(upper, lower));
        return s;
    }
    /// Half of the surface, or the volume: what makes a box dear.
    [[nodiscard]] float measure(SplitRule rule) const {
        const __m128 s = _mm_sub_ps(upper, lower);
        const __m128 y = _mm_shuffle_ps(s, s, _MM_SHUFFLE(3, 0, 2, 1));
        if (rule == SplitRule::kMinimumVolume)
            return _mm_cvtss_f32(_mm_mul_ss(_mm_mul_ss(s, y), _mm_shuffle_ps(s, s, _MM_SHUFFLE(2, 2, 2, 2))));
        const __m128 products = _mm_mul_ps(s, y);  // xy yz zx
        return _mm_cvtss_f32(_mm_add_ss(_mm_add_ss(products, _mm_shuffle_ps(products, products, _MM_SHUFFLE(1, 1, 1, 1))),
                                        _mm_movehl_ps(products, products)));
    }
};

}  // namespace tessera
