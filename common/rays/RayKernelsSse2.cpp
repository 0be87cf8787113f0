#include <immintrin.h>

namespace tessera::rays::sse2 {
namespace {

struct Floats8 {
    __m128 low, high;
    static Floats8 all(float value) { return {_mm_set1_ps(value), _mm_set1_ps(value)}; }
    static Floats8 load(const float* from) { return {_mm_load_ps(from), _mm_load_ps(from + 4)}; }
    void store(float* to) const {
        _mm_store_ps(to, low);
        _mm_store_ps(to + 4, high);
    }
};
inline Floats8 operator-(Floats8 a, Floats8 b) {
    return {_mm_sub_ps(a.low, b.low), _mm_sub_ps(a.high, b.high)};
}
inline Floats8 operator*(Floats8 a, Floats8 b) {
    return {_mm_mul_ps(a.low, b.low), _mm_mul_ps(a.high, b.high)};
}
inline Floats8 max(Floats8 a, Floats8 b) {
    return {_mm_max_ps(a.low, b.low), _mm_max_ps(a.high, b.high)};
}
inline Floats8 min(Floats8 a, Floats8 b) {
    return {_mm_min_ps(a.low, b.low), _mm_min_ps(a.high, b.high)};
}
inline unsigned lessOrEqual(Floats8 a, Floats8 b) {
    return static_cast<unsigned>(_mm_movemask_ps(_mm_cmple_ps(a.low, b.low)) |
                                 _mm_movemask_ps(_mm_cmple_ps(a.high, b.high)) << 4);
}

struct Doubles4 {
    __m128d low, high;
    static Doubles4 all(double value) { return {_mm_set1_pd(value), _mm_set1_pd(value)}; }
    static Doubles4 load(const float* from) {
        const __m128 four = _mm_load_ps(from);
        return {_mm_cvtps_pd(four), _mm_cvtps_pd(_mm_movehl_ps(four, four))};
    }
    void store(double* to) const {
        _mm_storeu_pd(to, low);
        _mm_storeu_pd(to + 2, high);
    }
};
inline Doubles4 operator+(Doubles4 a, Doubles4 b) {
    return {_mm_add_pd(a.low, b.low), _mm_add_pd(a.high, b.high)};
}
inline Doubles4 operator-(Doubles4 a, Doubles4 b) {
    return {_mm_sub_pd(a.low, b.low), _mm_sub_pd(a.high, b.high)};
}
inline Doubles4 operator*(Doubles4 a, Doubles4 b) {
    return {_mm_mul_pd(a.low, b.low), _mm_mul_pd(a.high, b.high)};
}
inline Doubles4 operator/(Doubles4 a, Doubles4 b) {
    return {_mm_div_pd(a.low, b.low), _mm_div_pd(a.high, b.high)};
}
inline unsigned lessOrEqual(Doubles4 a, Doubles4 b) {
    return static_cast<unsigned>(_mm_movemask_pd(_mm_cmple_pd(a.low, b.low)) |
                                 _mm_movemask_pd(_mm_cmple_pd(a.high, b.high)) << 2);
}

}  // namespace
}  // namespace tessera::rays::sse2

#define TESSERA_RAYS sse2
#include "common/rays/RayKernels.inl"
