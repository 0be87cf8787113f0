// Floats at once: as many as one register holds. Included by SlotKernels.inl only.

using Bits = std::uint32_t;
using std::size_t;
using std::uint32_t;

#if defined(__AVX512F__)
// The masked forms: g++ 12 warns of uninitialised values in its own plain ones (GCC bug 105593).
using F = __m512;
constexpr size_t kWidth = 16;
inline F load(const float* p) {
    return _mm512_loadu_ps(p);
}
inline void store(float* p, F x) {
    _mm512_storeu_ps(p, x);
}
inline F splat(float x) {
    return _mm512_set1_ps(x);
}
inline F min(F a, F b) {
    return _mm512_maskz_min_ps(0xffff, a, b);
}
inline F max(F a, F b) {
    return _mm512_maskz_max_ps(0xffff, a, b);
}
inline Bits atLeast(F a, F b) {
    return _mm512_cmp_ps_mask(a, b, _CMP_GE_OQ);
}
inline Bits greater(F a, F b) {
    return _mm512_cmp_ps_mask(a, b, _CMP_GT_OQ);
}
inline Bits equal(F a, F b) {
    return _mm512_cmp_ps_mask(a, b, _CMP_EQ_OQ);
}
inline F choose(Bits mask, F a, F b) {
    return _mm512_mask_blend_ps(static_cast<__mmask16>(mask), b, a);
}
/// Rounded towards zero; of numbers that an int can hold.
inline void storeInt(uint32_t* p, F x) {
    _mm512_storeu_si512(p, _mm512_maskz_cvttps_epi32(0xffff, x));
}
#elif defined(__AVX2__)
using F = __m256;
constexpr size_t kWidth = 8;
inline F load(const float* p) {
    return _mm256_loadu_ps(p);
}
inline void store(float* p, F x) {
    _mm256_storeu_ps(p, x);
}
inline F splat(float x) {
    return _mm256_set1_ps(x);
}
inline F min(F a, F b) {
    return _mm256_min_ps(a, b);
}
inline F max(F a, F b) {
    return _mm256_max_ps(a, b);
}
inline Bits atLeast(F a, F b) {
    return static_cast<Bits>(_mm256_movemask_ps(_mm256_cmp_ps(a, b, _CMP_GE_OQ)));
}
inline Bits greater(F a, F b) {
    return static_cast<Bits>(_mm256_movemask_ps(_mm256_cmp_ps(a, b, _CMP_GT_OQ)));
}
inline Bits equal(F a, F b) {
    return static_cast<Bits>(_mm256_movemask_ps(_mm256_cmp_ps(a, b, _CMP_EQ_OQ)));
}
inline F choose(Bits mask, F a, F b) {
    const __m256i lanes = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
    const __m256i set = _mm256_and_si256(_mm256_set1_epi32(static_cast<int>(mask)), lanes);
    return _mm256_blendv_ps(b, a, _mm256_castsi256_ps(_mm256_cmpeq_epi32(set, lanes)));
}
inline void storeInt(uint32_t* p, F x) {
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(p), _mm256_cvttps_epi32(x));
}
#else
using F = __m128;
constexpr size_t kWidth = 4;
inline F load(const float* p) {
    return _mm_loadu_ps(p);
}
inline void store(float* p, F x) {
    _mm_storeu_ps(p, x);
}
inline F splat(float x) {
    return _mm_set1_ps(x);
}
inline F min(F a, F b) {
    return _mm_min_ps(a, b);
}
inline F max(F a, F b) {
    return _mm_max_ps(a, b);
}
inline Bits atLeast(F a, F b) {
    return static_cast<Bits>(_mm_movemask_ps(_mm_cmpge_ps(a, b)));
}
inline Bits greater(F a, F b) {
    return static_cast<Bits>(_mm_movemask_ps(_mm_cmpgt_ps(a, b)));
}
inline Bits equal(F a, F b) {
    return static_cast<Bits>(_mm_movemask_ps(_mm_cmpeq_ps(a, b)));
}
inline F choose(Bits mask, F a, F b) {
    const __m128i lanes = _mm_setr_epi32(1, 2, 4, 8);
    const __m128i set = _mm_and_si128(_mm_set1_epi32(static_cast<int>(mask)), lanes);
    return _mm_blendv_ps(b, a, _mm_castsi128_ps(_mm_cmpeq_epi32(set, lanes)));
}
inline void storeInt(uint32_t* p, F x) {
    _mm_storeu_si128(reinterpret_cast<__m128i*>(p), _mm_cvttps_epi32(x));
}
#endif

constexpr Bits kAllLanes = (1u << kWidth) - 1;
/// The first `count` lanes, or all.
inline Bits firstLanes(size_t count) {
    return count >= kWidth ? kAllLanes : (1u << count) - 1;
}

inline float most(F x) {
    float lane[kWidth];
    store(lane, x);
    for (size_t n = kWidth / 2; n > 0; n /= 2)
        for (size_t i = 0; i < n; ++i) lane[i] = lane[i] > lane[i + n] ? lane[i] : lane[i + n];
    return lane[0];
}
