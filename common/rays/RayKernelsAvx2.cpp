#include <immintrin.h>

namespace tessera::rays::avx2 {
namespace {

struct Floats8 {
    __m256 lanes;
    static Floats8 all(float value) { return {_mm256_set1_ps(value)}; }
    static Floats8 load(const float* from) { return {_mm256_load_ps(from)}; }
    void store(float* to) const { _mm256_store_ps(to, lanes); }
};
inline Floats8 operator-(Floats8 a, Floats8 b) {
    return {_mm256_sub_ps(a.lanes, b.lanes)};
}
inline Floats8 operator*(Floats8 a, Floats8 b) {
    return {_mm256_mul_ps(a.lanes, b.lanes)};
}
inline Floats8 max(Floats8 a, Floats8 b) {
    return {_mm256_max_ps(a.lanes, b.lanes)};
}
inline Floats8 min(Floats8 a, Floats8 b) {
    return {_mm256_min_ps(a.lanes, b.lanes)};
}
inline unsigned lessOrEqual(Floats8 a, Floats8 b) {
    return static_cast<unsigned>(_mm256_movemask_ps(_mm256_cmp_ps(a.lanes, b.lanes, _CMP_LE_OQ)));
}

struct Doubles4 {
    __m256d lanes;
    static Doubles4 all(double value) { return {_mm256_set1_pd(value)}; }
    static Doubles4 load(const float* from) { return {_mm256_cvtps_pd(_mm_load_ps(from))}; }
    void store(double* to) const { _mm256_storeu_pd(to, lanes); }
};
inline Doubles4 operator+(Doubles4 a, Doubles4 b) {
    return {_mm256_add_pd(a.lanes, b.lanes)};
}
inline Doubles4 operator-(Doubles4 a, Doubles4 b) {
    return {_mm256_sub_pd(a.lanes, b.lanes)};
}
inline Doubles4 operator*(Doubles4 a, Doubles4 b) {
    return {_mm256_mul_pd(a.lanes, b.lanes)};
}
inline Doubles4 operator/(Doubles4 a, Doubles4 b) {
    return {_mm256_div_pd(a.lanes, b.lanes)};
}
inline unsigned lessOrEqual(Doubles4 a, Doubles4 b) {
    return static_cast<unsigned>(_mm256_movemask_pd(_mm256_cmp_pd(a.lanes, b.lanes, _CMP_LE_OQ)));
}

}  // namespace
}  // namespace tessera::rays::avx2

#define TESSERA_RAYS avx2
#include "common/rays/RayKernels.inl"
