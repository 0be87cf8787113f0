// Included once per instruction set, with TESSERA_KERNELS naming its namespace.
#include <immintrin.h>

#include "server/collision/freeform/BoxGaps.h"

namespace tessera::kernel::TESSERA_KERNELS {
namespace {

#define TESSERA_INLINE __attribute__((always_inline)) inline

#if defined(__AVX512F__)
typedef double Doubles __attribute__((vector_size(64)));
// The masked form: g++ 12 warns of uninitialised values in its own plain one (GCC bug 105593).
TESSERA_INLINE Doubles root(Doubles x) {
    return _mm512_maskz_sqrt_pd(0xff, x);
}
#elif defined(__AVX2__)
typedef double Doubles __attribute__((vector_size(32)));
TESSERA_INLINE Doubles root(Doubles x) {
    return _mm256_sqrt_pd(x);
}
#else
typedef double Doubles __attribute__((vector_size(16)));
TESSERA_INLINE Doubles root(Doubles x) {
    return _mm_sqrt_pd(x);
}
#endif

constexpr unsigned kAtOnce = sizeof(Doubles) / sizeof(double);

TESSERA_INLINE Doubles load(const double* from) {
    Doubles x;
    __builtin_memcpy(&x, from, sizeof x);
    return x;
}
TESSERA_INLINE Doubles larger(Doubles a, Doubles b) {
    return a > b ? a : b;
}
TESSERA_INLINE Doubles positive(Doubles x) {
    return larger(x, -x);
}

struct Direction {
    Doubles x, y, z;
};
TESSERA_INLINE Doubles along(const Direction& d, const double* n) {
    return (d.x * n[0] + d.y * n[1]) + d.z * n[2];
}

void gaps(const double* eight, unsigned count, const BoxOfOne& one, double* least) {
    const double *n0 = one.axes, *n1 = one.axes + 3, *n2 = one.axes + 6, *f = one.half, *h = one.hint;
    const auto reachOfOne = [&](const double* n) {
        const double d = (n[0] * h[0] + n[1] * h[1]) + n[2] * h[2];
        return d < 0 ? -d : d;
    };
    const double reach = (f[0] * reachOfOne(n0) + f[1] * reachOfOne(n1)) + f[2] * reachOfOne(n2);
    for (unsigned lane = 0; lane < count; lane += kAtOnce) {
        const double* const p = eight + lane;
        const Direction d{load(p) - one.middle[0], load(p + kBoxLanes) - one.middle[1],
                          load(p + 2 * kBoxLanes) - one.middle[2]};
        const Doubles b0 = positive(along(d, n0)), b1 = positive(along(d, n1)), b2 = positive(along(d, n2));
        Doubles along0 = b0 - f[0], along1 = b1 - f[1], along2 = b2 - f[2], alongHint = positive(along(d, h)) - reach;
        const Doubles square = (d.x * d.x + d.y * d.y) + d.z * d.z;
        Doubles between = square - ((b0 * f[0] + b1 * f[1]) + b2 * f[2]), best = along0;
        for (unsigned k = 0; k < 3; ++k) {
            const double* const axis = p + (3 + 3 * k) * kBoxLanes;
            const Direction u{load(axis), load(axis + kBoxLanes), load(axis + 2 * kBoxLanes)};
            const Doubles half = load(p + (12 + k) * kBoxLanes);
            const Doubles r0 = positive(along(u, n0)), r1 = positive(along(u, n1)), r2 = positive(along(u, n2));
            const Doubles a = positive((d.x * u.x + d.y * u.y) + d.z * u.z);
            along0 -= half * r0;
            along1 -= half * r1;
            along2 -= half * r2;
            alongHint -= half * positive(along(u, h));
            between -= half * a;
            const Doubles ofLane = (a - half) - ((f[0] * r0 + f[1] * r1) + f[2] * r2);
            best = k == 0 ? ofLane : larger(ofLane, best);
        }
        best = larger(larger(along0, along1), larger(best, larger(along2, alongHint)));
        // Of middles that are one there is no way between, and none is told: the smallest number will do for its
        // length.
        best = larger(between / root(larger(square, Doubles{} + 1e-300)), best);
        __builtin_memcpy(least + lane, &best, sizeof best);
    }
}

}  // namespace

extern const GapsOfBoxes kGapsOfBoxes;
const GapsOfBoxes kGapsOfBoxes = &gaps;

}  // namespace tessera::kernel::TESSERA_KERNELS
