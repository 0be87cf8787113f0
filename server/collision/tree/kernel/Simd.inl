// Sixteen floats at once, in the vector extensions that g++ and clang share. Included by kernel/Kernels.inl only.

typedef float F __attribute__((vector_size(64)));
typedef std::int32_t I __attribute__((vector_size(64)));
typedef float F4 __attribute__((vector_size(16)));
using Bits = std::uint32_t;

inline F splat(float x) { return F{} + x; }
inline F load(const float* p) { return *reinterpret_cast<const F*>(p); }
inline void store(float* p, F x) { *reinterpret_cast<F*>(p) = x; }
inline F abs(F x) { return reinterpret_cast<F>(reinterpret_cast<I>(x) & 0x7fffffff); }

#if defined(__AVX512F__)
// The masked forms: g++ 12 warns of uninitialised values in its own plain ones (GCC bug 105593).
inline F max(F a, F b) { return reinterpret_cast<F>(_mm512_maskz_max_ps(0xffff, reinterpret_cast<__m512>(a), reinterpret_cast<__m512>(b))); }
inline F min(F a, F b) { return reinterpret_cast<F>(_mm512_maskz_min_ps(0xffff, reinterpret_cast<__m512>(a), reinterpret_cast<__m512>(b))); }
inline F sqrt(F a) { return reinterpret_cast<F>(_mm512_maskz_sqrt_ps(0xffff, reinterpret_cast<__m512>(a))); }
/// One bit per lane with a > b; none for a NaN.
inline Bits greater(F a, F b) {
    return _mm512_cmp_ps_mask(reinterpret_cast<__m512>(a), reinterpret_cast<__m512>(b), _CMP_GT_OQ);
}
#else
inline F max(F a, F b) { return a > b ? a : b; }
inline F min(F a, F b) { return a < b ? a : b; }
#if defined(__AVX2__)
typedef float Part __attribute__((vector_size(32)));
union Parts { F whole; Part part[2]; };
inline Bits greater(F a, F b) {
    const Parts x{a}, y{b};
    return static_cast<Bits>(_mm256_movemask_ps(_mm256_cmp_ps(x.part[0], y.part[0], _CMP_GT_OQ))) |
           static_cast<Bits>(_mm256_movemask_ps(_mm256_cmp_ps(x.part[1], y.part[1], _CMP_GT_OQ))) << 8;
}
inline F sqrt(F a) {
    Parts x{a};
    for (Part& p : x.part) p = _mm256_sqrt_ps(p);
    return x.whole;
}
#else
typedef float Part __attribute__((vector_size(16)));
union Parts { F whole; Part part[4]; };
inline Bits greater(F a, F b) {
    const Parts x{a}, y{b};
    Bits bits = 0;
    for (unsigned i = 0; i < 4; ++i) bits |= static_cast<Bits>(_mm_movemask_ps(_mm_cmpgt_ps(x.part[i], y.part[i]))) << 4 * i;
    return bits;
}
inline F sqrt(F a) {
    Parts x{a};
    for (Part& p : x.part) p = _mm_sqrt_ps(p);
    return x.whole;
}
#endif
#endif

/// abcd -> aaaabbbbccccdddd
inline F spread(F4 x) { return __builtin_shufflevector(x, x, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3); }
/// abcd -> abcdabcdabcdabcd
inline F repeat(F4 x) { return __builtin_shufflevector(x, x, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3); }
inline F4 load4(const float* p) { return *reinterpret_cast<const F4*>(p); }

struct V3 {
    F x, y, z;
};
inline V3 operator+(const V3& a, const V3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline V3 operator-(const V3& a, const V3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline F dot(const V3& a, const V3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline V3 cross(const V3& a, const V3& b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
/// |x| + |y| + |z|, an upper bound of the length.
inline F taxicab(const V3& a) { return abs(a.x) + abs(a.y) + abs(a.z); }
inline V3 mapped(const float* m, const V3& v) {
    return {m[0] * v.x + m[1] * v.y + m[2] * v.z, m[3] * v.x + m[4] * v.y + m[5] * v.z, m[6] * v.x + m[7] * v.y + m[8] * v.z};
}
inline V3 offset(const V3& v, const float* t) { return {v.x + t[0], v.y + t[1], v.z + t[2]}; }
