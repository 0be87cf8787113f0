// Sixteen floats or eight doubles at once: one register, two or four. Included by kernel/Kernels.inl only.

#define TESSERA_INLINE __attribute__((always_inline)) inline

typedef float F4 __attribute__((vector_size(16)));
using Bits = std::uint32_t;

/// Two registers, or two pairs of them, that do everything together. (The compilers' own vectors of 64 bytes come out
/// element by element where registers are shorter.)
template <typename Half>
struct Twice {
    Half low, high;
};

#if defined(__AVX512F__)
typedef float FloatPart __attribute__((vector_size(64)));
typedef double DoublePart __attribute__((vector_size(64)));
typedef std::int32_t IntPart __attribute__((vector_size(64)));
typedef std::int64_t LongPart __attribute__((vector_size(64)));
using F = FloatPart;
using D = DoublePart;
// The masked forms: g++ 12 warns of uninitialised values in its own plain ones (GCC bug 105593).
TESSERA_INLINE F max(F a, F b) {
    return reinterpret_cast<F>(_mm512_maskz_max_ps(0xffff, reinterpret_cast<__m512>(a), reinterpret_cast<__m512>(b)));
}
TESSERA_INLINE F min(F a, F b) {
    return reinterpret_cast<F>(_mm512_maskz_min_ps(0xffff, reinterpret_cast<__m512>(a), reinterpret_cast<__m512>(b)));
}
TESSERA_INLINE F sqrt(F a) {
    return reinterpret_cast<F>(_mm512_maskz_sqrt_ps(0xffff, reinterpret_cast<__m512>(a)));
}
TESSERA_INLINE D max(D a, D b) {
    return reinterpret_cast<D>(_mm512_maskz_max_pd(0xff, reinterpret_cast<__m512d>(a), reinterpret_cast<__m512d>(b)));
}
TESSERA_INLINE D min(D a, D b) {
    return reinterpret_cast<D>(_mm512_maskz_min_pd(0xff, reinterpret_cast<__m512d>(a), reinterpret_cast<__m512d>(b)));
}
TESSERA_INLINE Bits greater(F a, F b) {
    return _mm512_cmp_ps_mask(reinterpret_cast<__m512>(a), reinterpret_cast<__m512>(b), _CMP_GT_OQ);
}
TESSERA_INLINE Bits greater(D a, D b) {
    return _mm512_cmp_pd_mask(reinterpret_cast<__m512d>(a), reinterpret_cast<__m512d>(b), _CMP_GT_OQ);
}
TESSERA_INLINE D pick(D test, D whereNegative, D otherwise) {
    return reinterpret_cast<D>(_mm512_mask_blend_pd(_mm512_movepi64_mask(reinterpret_cast<__m512i>(test)),
                                                    reinterpret_cast<__m512d>(otherwise),
                                                    reinterpret_cast<__m512d>(whereNegative)));
}
TESSERA_INLINE F4 max(F4 a, F4 b) {
    return _mm_max_ps(a, b);
}
TESSERA_INLINE F4 min(F4 a, F4 b) {
    return _mm_min_ps(a, b);
}
/// One bit for each of sixteen numbers whose highest bit is set.
TESSERA_INLINE Bits highest(const std::uint32_t* p) {
    return _mm512_movepi32_mask(_mm512_loadu_si512(p));
}
/// Writes those of sixteen numbers that are asked for, and as many times `other`; room for sixteen is needed. Their
/// count.
TESSERA_INLINE unsigned keep(std::uint32_t* to, std::uint32_t* toOther, const std::uint32_t* from, Bits lanes,
                             std::uint32_t other) {
    _mm512_storeu_si512(to, _mm512_maskz_compress_epi32(static_cast<__mmask16>(lanes), _mm512_loadu_si512(from)));
    _mm512_storeu_si512(toOther, _mm512_set1_epi32(static_cast<int>(other)));
    return static_cast<unsigned>(__builtin_popcount(lanes));
}
/// abcd -> aaaabbbbccccdddd
TESSERA_INLINE F spread(F4 x) {
    // Not __builtin_shufflevector: g++ 12 sends it through memory.
    const __m512i lanes = _mm512_set_epi32(3, 3, 3, 3, 2, 2, 2, 2, 1, 1, 1, 1, 0, 0, 0, 0);
    return reinterpret_cast<F>(
        _mm512_maskz_permutexvar_ps(0xffff, lanes, _mm512_castps128_ps512(reinterpret_cast<__m128>(x))));
}
/// Sixteen bytes as numbers.
TESSERA_INLINE F loadBytes(const std::uint8_t* p) {
    return reinterpret_cast<F>(_mm512_maskz_cvtepi32_ps(
        0xffff, _mm512_maskz_cvtepu8_epi32(0xffff, _mm_load_si128(reinterpret_cast<const __m128i*>(p)))));
}
/// abcd -> abcdabcdabcdabcd
TESSERA_INLINE F repeat(F4 x) {
    return reinterpret_cast<F>(_mm512_maskz_broadcast_f32x4(0xffff, reinterpret_cast<__m128>(x)));
}
/// ab -> aaaabbbb
TESSERA_INLINE D spreadTwo(const double* p) {
    return reinterpret_cast<D>(
        _mm512_maskz_insertf64x4(0xff, _mm512_castpd256_pd512(_mm256_set1_pd(p[0])), _mm256_set1_pd(p[1]), 1));
}
/// abcd -> abcdabcd
TESSERA_INLINE D repeatFour(const double* p) {
    return reinterpret_cast<D>(_mm512_maskz_broadcast_f64x4(0xff, _mm256_loadu_pd(p)));
}

#elif defined(__AVX2__)
typedef float FloatPart __attribute__((vector_size(32)));
typedef double DoublePart __attribute__((vector_size(32)));
typedef std::int32_t IntPart __attribute__((vector_size(32)));
typedef std::int64_t LongPart __attribute__((vector_size(32)));
using F = Twice<FloatPart>;
using D = Twice<DoublePart>;
TESSERA_INLINE FloatPart max(FloatPart a, FloatPart b) {
    return _mm256_max_ps(a, b);
}
TESSERA_INLINE FloatPart min(FloatPart a, FloatPart b) {
    return _mm256_min_ps(a, b);
}
TESSERA_INLINE FloatPart sqrt(FloatPart a) {
    return _mm256_sqrt_ps(a);
}
TESSERA_INLINE DoublePart max(DoublePart a, DoublePart b) {
    return _mm256_max_pd(a, b);
}
TESSERA_INLINE DoublePart min(DoublePart a, DoublePart b) {
    return _mm256_min_pd(a, b);
}
TESSERA_INLINE Bits greater(FloatPart a, FloatPart b) {
    return static_cast<Bits>(_mm256_movemask_ps(_mm256_cmp_ps(a, b, _CMP_GT_OQ)));
}
TESSERA_INLINE Bits greater(DoublePart a, DoublePart b) {
    return static_cast<Bits>(_mm256_movemask_pd(_mm256_cmp_pd(a, b, _CMP_GT_OQ)));
}
TESSERA_INLINE DoublePart pick(DoublePart test, DoublePart whereNegative, DoublePart otherwise) {
    return _mm256_blendv_pd(otherwise, whereNegative, test);
}
TESSERA_INLINE F4 max(F4 a, F4 b) {
    return _mm_max_ps(a, b);
}
TESSERA_INLINE F4 min(F4 a, F4 b) {
    return _mm_min_ps(a, b);
}
TESSERA_INLINE F spread(F4 x) {
    return {__builtin_shufflevector(x, x, 0, 0, 0, 0, 1, 1, 1, 1),
            __builtin_shufflevector(x, x, 2, 2, 2, 2, 3, 3, 3, 3)};
}
TESSERA_INLINE F loadBytes(const std::uint8_t* p) {
    const __m128i bytes = _mm_load_si128(reinterpret_cast<const __m128i*>(p));
    return {_mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(bytes)),
            _mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(_mm_srli_si128(bytes, 8)))};
}
TESSERA_INLINE F repeat(F4 x) {
    const FloatPart both = __builtin_shufflevector(x, x, 0, 1, 2, 3, 0, 1, 2, 3);
    return {both, both};
}
TESSERA_INLINE D spreadTwo(const double* p) {
    return {_mm256_set1_pd(p[0]), _mm256_set1_pd(p[1])};
}
TESSERA_INLINE D repeatFour(const double* p) {
    const DoublePart all = _mm256_loadu_pd(p);
    return {all, all};
}

#else
typedef F4 FloatPart;
typedef double DoublePart __attribute__((vector_size(16)));
typedef std::int32_t IntPart __attribute__((vector_size(16)));
typedef std::int64_t LongPart __attribute__((vector_size(16)));
using F = Twice<Twice<FloatPart>>;
using D = Twice<Twice<DoublePart>>;
TESSERA_INLINE FloatPart max(FloatPart a, FloatPart b) {
    return _mm_max_ps(a, b);
}
TESSERA_INLINE FloatPart min(FloatPart a, FloatPart b) {
    return _mm_min_ps(a, b);
}
TESSERA_INLINE FloatPart sqrt(FloatPart a) {
    return _mm_sqrt_ps(a);
}
TESSERA_INLINE DoublePart max(DoublePart a, DoublePart b) {
    return _mm_max_pd(a, b);
}
TESSERA_INLINE DoublePart min(DoublePart a, DoublePart b) {
    return _mm_min_pd(a, b);
}
TESSERA_INLINE Bits greater(FloatPart a, FloatPart b) {
    return static_cast<Bits>(_mm_movemask_ps(_mm_cmpgt_ps(a, b)));
}
TESSERA_INLINE Bits greater(DoublePart a, DoublePart b) {
    return static_cast<Bits>(_mm_movemask_pd(_mm_cmpgt_pd(a, b)));
}
TESSERA_INLINE DoublePart pick(DoublePart test, DoublePart whereNegative, DoublePart otherwise) {
    return _mm_blendv_pd(otherwise, whereNegative, test);
}
TESSERA_INLINE F spread(F4 x) {
    return {{__builtin_shufflevector(x, x, 0, 0, 0, 0), __builtin_shufflevector(x, x, 1, 1, 1, 1)},
            {__builtin_shufflevector(x, x, 2, 2, 2, 2), __builtin_shufflevector(x, x, 3, 3, 3, 3)}};
}
TESSERA_INLINE F loadBytes(const std::uint8_t* p) {
    const __m128i bytes = _mm_load_si128(reinterpret_cast<const __m128i*>(p));
    const auto part = [](__m128i x) { return _mm_cvtepi32_ps(_mm_cvtepu8_epi32(x)); };
    return {{part(bytes), part(_mm_srli_si128(bytes, 4))},
            {part(_mm_srli_si128(bytes, 8)), part(_mm_srli_si128(bytes, 12))}};
}
TESSERA_INLINE F repeat(F4 x) {
    return {{x, x}, {x, x}};
}
TESSERA_INLINE D spreadTwo(const double* p) {
    const DoublePart a = _mm_set1_pd(p[0]), b = _mm_set1_pd(p[1]);
    return {{a, a}, {b, b}};
}
TESSERA_INLINE D repeatFour(const double* p) {
    const DoublePart ab = _mm_loadu_pd(p), cd = _mm_loadu_pd(p + 2);
    return {{ab, cd}, {ab, cd}};
}
#endif

#if !defined(__AVX512F__)
TESSERA_INLINE Bits highest(const std::uint32_t* p) {
    Bits bits = 0;
    for (unsigned i = 0; i < 16; i += 4)
        bits |= static_cast<Bits>(
                    _mm_movemask_ps(_mm_castsi128_ps(_mm_loadu_si128(reinterpret_cast<const __m128i*>(p + i)))))
                << i;
    return bits;
}
TESSERA_INLINE unsigned keep(std::uint32_t* to, std::uint32_t* toOther, const std::uint32_t* from, Bits lanes,
                             std::uint32_t other) {
    unsigned count = 0;
    for (; lanes != 0; lanes &= lanes - 1, ++count) {
        to[count] = from[__builtin_ctz(lanes)];
        toOther[count] = other;
    }
    return count;
}
#endif

TESSERA_INLINE FloatPart abs(FloatPart x) {
    return reinterpret_cast<FloatPart>(reinterpret_cast<IntPart>(x) & 0x7fffffff);
}
TESSERA_INLINE DoublePart abs(DoublePart x) {
    return reinterpret_cast<DoublePart>(reinterpret_cast<LongPart>(x) & 0x7fffffffffffffff);
}
TESSERA_INLINE FloatPart choose(FloatPart test, FloatPart wherePositive, FloatPart otherwise) {
    return test > 0 ? wherePositive : otherwise;
}
/// Negative where the signs differ; else of no meaning.
TESSERA_INLINE DoublePart differ(DoublePart a, DoublePart b) {
    return reinterpret_cast<DoublePart>(reinterpret_cast<LongPart>(a) ^ reinterpret_cast<LongPart>(b));
}

/// What a register or a pair of them holds: its number of lanes.
template <typename T>
struct Lanes;
template <>
struct Lanes<FloatPart> {
    using Scalar = float;
    static constexpr unsigned kCount = sizeof(FloatPart) / sizeof(float);
    TESSERA_INLINE static FloatPart splat(float x) { return FloatPart{} + x; }
    TESSERA_INLINE static FloatPart load(const float* p) { return *reinterpret_cast<const FloatPart*>(p); }
    TESSERA_INLINE static void store(float* p, FloatPart x) { *reinterpret_cast<FloatPart*>(p) = x; }
};
template <>
struct Lanes<DoublePart> {
    using Scalar = double;
    static constexpr unsigned kCount = sizeof(DoublePart) / sizeof(double);
    TESSERA_INLINE static DoublePart splat(double x) { return DoublePart{} + x; }
    TESSERA_INLINE static DoublePart load(const double* p) { return *reinterpret_cast<const DoublePart*>(p); }
    TESSERA_INLINE static void store(double* p, DoublePart x) { *reinterpret_cast<DoublePart*>(p) = x; }
};
template <typename Half>
struct Lanes<Twice<Half>> {
    using Scalar = typename Lanes<Half>::Scalar;
    static constexpr unsigned kHalf = Lanes<Half>::kCount, kCount = 2 * kHalf;
    TESSERA_INLINE static Twice<Half> splat(Scalar x) {
        const Half half = Lanes<Half>::splat(x);
        return {half, half};
    }
    TESSERA_INLINE static Twice<Half> load(const Scalar* p) {
        return {Lanes<Half>::load(p), Lanes<Half>::load(p + kHalf)};
    }
    TESSERA_INLINE static void store(Scalar* p, const Twice<Half>& x) {
        Lanes<Half>::store(p, x.low);
        Lanes<Half>::store(p + kHalf, x.high);
    }
};
template <typename Half>
using ScalarOf = typename Lanes<Half>::Scalar;

#define TESSERA_TWICE(op)                                                       \
    template <typename H>                                                       \
    TESSERA_INLINE Twice<H> operator op(const Twice<H>& a, const Twice<H>& b) { \
        return {a.low op b.low, a.high op b.high};                              \
    }                                                                           \
    template <typename H>                                                       \
    TESSERA_INLINE Twice<H> operator op(const Twice<H>& a, ScalarOf<H> b) {     \
        return {a.low op b, a.high op b};                                       \
    }                                                                           \
    template <typename H>                                                       \
    TESSERA_INLINE Twice<H> operator op(ScalarOf<H> a, const Twice<H>& b) {     \
        return {a op b.low, a op b.high};                                       \
    }                                                                           \
    template <typename H, typename Other>                                       \
    TESSERA_INLINE Twice<H>& operator op##=(Twice<H>& a, const Other& b) {      \
        return a = a op b;                                                      \
    }
TESSERA_TWICE(+)
TESSERA_TWICE(-)
TESSERA_TWICE(*)
TESSERA_TWICE(/)
#undef TESSERA_TWICE
template <typename H>
TESSERA_INLINE Twice<H> operator-(const Twice<H>& a) {
    return {-a.low, -a.high};
}
template <typename H>
TESSERA_INLINE Twice<H> max(const Twice<H>& a, const Twice<H>& b) {
    return {max(a.low, b.low), max(a.high, b.high)};
}
template <typename H>
TESSERA_INLINE Twice<H> min(const Twice<H>& a, const Twice<H>& b) {
    return {min(a.low, b.low), min(a.high, b.high)};
}
template <typename H>
TESSERA_INLINE Twice<H> sqrt(const Twice<H>& a) {
    return {sqrt(a.low), sqrt(a.high)};
}
template <typename H>
TESSERA_INLINE Twice<H> abs(const Twice<H>& a) {
    return {abs(a.low), abs(a.high)};
}
template <typename H>
TESSERA_INLINE Twice<H> differ(const Twice<H>& a, const Twice<H>& b) {
    return {differ(a.low, b.low), differ(a.high, b.high)};
}
/// wherePositive where test > 0; otherwise for a NaN.
template <typename H>
TESSERA_INLINE Twice<H> choose(const Twice<H>& test, const Twice<H>& wherePositive, const Twice<H>& otherwise) {
    return {choose(test.low, wherePositive.low, otherwise.low), choose(test.high, wherePositive.high, otherwise.high)};
}
/// By the sign bit of `test`.
template <typename H>
TESSERA_INLINE Twice<H> pick(const Twice<H>& test, const Twice<H>& whereNegative, const Twice<H>& otherwise) {
    return {pick(test.low, whereNegative.low, otherwise.low), pick(test.high, whereNegative.high, otherwise.high)};
}
/// One bit per lane with a > b; none for a NaN.
template <typename H>
TESSERA_INLINE Bits greater(const Twice<H>& a, const Twice<H>& b) {
    return greater(a.low, b.low) | greater(a.high, b.high) << Lanes<H>::kCount;
}

TESSERA_INLINE F splat(float x) {
    return Lanes<F>::splat(x);
}
TESSERA_INLINE F load(const float* p) {
    return Lanes<F>::load(p);
}
TESSERA_INLINE void store(float* p, const F& x) {
    Lanes<F>::store(p, x);
}
TESSERA_INLINE F4 load4(const float* p) {
    return *reinterpret_cast<const F4*>(p);
}
TESSERA_INLINE D splatDouble(double x) {
    return Lanes<D>::splat(x);
}
TESSERA_INLINE D loadDouble(const double* p) {
    return Lanes<D>::load(p);
}
TESSERA_INLINE void store(double* p, const D& x) {
    Lanes<D>::store(p, x);
}

template <typename T>
struct Vector3 {
    T x, y, z;
};
using V3 = Vector3<F>;
template <typename T>
TESSERA_INLINE Vector3<T> operator+(const Vector3<T>& a, const Vector3<T>& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <typename T>
TESSERA_INLINE Vector3<T> operator-(const Vector3<T>& a, const Vector3<T>& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <typename T>
TESSERA_INLINE T dot(const Vector3<T>& a, const Vector3<T>& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <typename T>
TESSERA_INLINE Vector3<T> cross(const Vector3<T>& a, const Vector3<T>& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
/// |x| + |y| + |z|, an upper bound of the length.
template <typename T>
TESSERA_INLINE T taxicab(const Vector3<T>& a) {
    return abs(a.x) + abs(a.y) + abs(a.z);
}
/// The largest of |x|, |y|, |z|.
template <typename T>
TESSERA_INLINE T largest(const Vector3<T>& a) {
    return max(max(abs(a.x), abs(a.y)), abs(a.z));
}
/// m row by row.
template <typename T>
TESSERA_INLINE Vector3<T> mapped(const ScalarOf<T>* m, const Vector3<T>& v) {
    return {m[0] * v.x + m[1] * v.y + m[2] * v.z, m[3] * v.x + m[4] * v.y + m[5] * v.z,
            m[6] * v.x + m[7] * v.y + m[8] * v.z};
}
template <typename T>
TESSERA_INLINE Vector3<T> offset(const Vector3<T>& v, const ScalarOf<T>* t) {
    return {v.x + t[0], v.y + t[1], v.z + t[2]};
}
