// Included once per instruction set, with TESSERA_KERNELS naming its namespace.
#include <immintrin.h>

#include <cstddef>
#include <cstdint>

#include "server/collision/query/ImpactKernels.h"

namespace tessera::kernel::TESSERA_KERNELS {
namespace {

#include "server/collision/tree/kernel/Simd.inl"

TESSERA_INLINE V3 at(const float* p) {
    return {splat(p[0]), splat(p[1]), splat(p[2])};
}

// How each kind of volume is a box: centre, half sides, and axes in the tree's own coordinates.

struct SphereBox {
    static constexpr unsigned kRows = 4;
    static constexpr bool kOwnAxes = false;
    static void get(const float* node, unsigned step, float* centre, float* half) {
        for (unsigned k = 0; k < 3; ++k) {
            centre[k] = node[k * step];
            half[k] = node[3 * step];
        }
    }
    static V3 centre(const float* node) { return {load(node), load(node + kWidth), load(node + 2 * kWidth)}; }
    static F half(const float* node, unsigned) { return load(node + 3 * kWidth); }
    static F radius(const float* node) { return load(node + 3 * kWidth); }
};

TESSERA_INLINE F diagonal(const F& x, const F& y, const F& z) {
    return sqrt(x * x + y * y + z * z);
}

struct ObbBox {
    static constexpr unsigned kRows = 15;
    static constexpr bool kOwnAxes = true;
    static void get(const float* node, unsigned step, float* centre, float* half) {
        for (unsigned k = 0; k < 3; ++k) {
            centre[k] = node[k * step];
            half[k] = node[(12 + k) * step];
        }
    }
    static V3 centre(const float* node) { return {load(node), load(node + kWidth), load(node + 2 * kWidth)}; }
    static F half(const float* node, unsigned i) { return load(node + (12 + i) * kWidth); }
    static F radius(const float* node) { return diagonal(half(node, 0), half(node, 1), half(node, 2)); }
};

/// The slabs of the axes, which come first in every set of directions; the others are not looked at.
template <unsigned K>
struct DopBox {
    static constexpr unsigned kRows = K;
    static constexpr bool kOwnAxes = false;
    static void get(const float* node, unsigned step, float* centre, float* half) {
        for (unsigned k = 0; k < 3; ++k) {
            const float upper = node[k * step], lower = -node[(k + K / 2) * step];
            centre[k] = 0.5f * (upper + lower);
            half[k] = 0.5f * (upper - lower);
        }
    }
    static F along(const float* node, unsigned k) {
        return 0.5f * (load(node + k * kWidth) - load(node + (k + K / 2) * kWidth));
    }
    static V3 centre(const float* node) { return {along(node, 0), along(node, 1), along(node, 2)}; }
    static F half(const float* node, unsigned k) {
        return 0.5f * (load(node + k * kWidth) + load(node + (k + K / 2) * kWidth));
    }
    static F radius(const float* node) { return diagonal(half(node, 0), half(node, 1), half(node, 2)); }
};

inline float root(float x) {
    return _mm_cvtss_f32(_mm_sqrt_ss(_mm_set_ss(x)));
}
inline float dot3(const float* a, const float* b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline float magnitude(float x) {
    return x < 0 ? -x : x;
}

inline float bendAlongOne(const float* n, const ImpactFrame& f) {
    const MovingFrame* const bodies[] = {&f.a, &f.b};
    float bend = 1e-6f * (f.a.acceleration + f.b.acceleration) + f.rest;
    for (const MovingFrame* const m : bodies) {
        const float* const k = m->axis;
        const float square[3] = {n[1] * k[2] - n[2] * k[1], n[2] * k[0] - n[0] * k[2], n[0] * k[1] - n[1] * k[0]};
        bend += root(dot3(square, square)) * m->acceleration;
    }
    return bend;
}

template <typename Box>
void place(const TreeView& tree, const ImpactFrame& f, const MovingFrame& m, Slot slot, PlacedBox& out) {
    const float* const node = tree.volumes + std::size_t{slot / kWidth} * Box::kRows * kWidth + slot % kWidth;
    float centre[3], half[3];
    Box::get(node, kWidth, centre, half);
    for (unsigned k = 0; k < 3; ++k) {
        out.centre[k] = dot3(m.linear + 3 * k, centre) + m.translation[k];
        out.velocity[k] = dot3(m.turning + 3 * k, centre) + m.drift[k];
    }
    for (unsigned i = 0; i < 3; ++i) {
        float* const axis = out.axis + 3 * i;
        for (unsigned k = 0; k < 3; ++k) {
            if constexpr (Box::kOwnAxes) {
                const float own[3] = {node[(3 + 3 * i) * kWidth], node[(4 + 3 * i) * kWidth],
                                      node[(5 + 3 * i) * kWidth]};
                axis[k] = dot3(m.axes + 3 * k, own);
            } else {
                axis[k] = m.axes[3 * k + i];
            }
        }
        // Of unit length already for a similarity; then this changes nothing that matters.
        const float length = root(dot3(axis, axis)), inverse = length > 1e-30f ? 1 / length : 0;
        for (unsigned k = 0; k < 3; ++k) axis[k] *= inverse;
        out.half[i] = half[i] * length * m.scale;
    }
    for (unsigned i = 0; i < 3; ++i) {
        out.own[i] = 0;
        for (unsigned j = 0; j < 3; ++j)
            out.own[i] += magnitude(dot3(out.axis + 3 * i, out.axis + 3 * j)) * out.half[j];
    }
    for (unsigned i = 0; i < 3; ++i) out.bend[i] = bendAlongOne(out.axis + 3 * i, f);
    const float radius = Box::kRows == SphereBox::kRows ? half[0] : root(dot3(half, half));
    out.growth = m.growth * radius;
    out.radius = m.stretch * radius;
    out.swelling = m.swelling * radius;
}

/// How much the rate along a direction can fall: all acceleration of a body that turns is square to its axis.
TESSERA_INLINE F bendAlong(const V3& n, const F& length, const ImpactFrame& f) {
    const MovingFrame* const bodies[] = {&f.a, &f.b};
    F bend = length * (1e-6f * (f.a.acceleration + f.b.acceleration) + f.rest);
    for (const MovingFrame* const m : bodies) {
        if (!(m->acceleration > 0)) continue;
        const V3 square = cross(n, at(m->axis));
        bend += sqrt(dot(square, square)) * m->acceleration;
    }
    return bend;
}

/// Of all directions looked at, the one that is likely to separate longest.
struct Longest {
    F gap = splat(0), rate = splat(0), bend = splat(0), haste = splat(1);

    /// A gap that changes at the rate r now, which itself falls by at most b per unit of time.
    TESSERA_INLINE void consider(const F& g, const F& r, const F& b, const ImpactFrame& f) {
        const F h = max(b * (0.5f * f.horizon) - r, splat(1e-20f));
        const F better = g * haste - gap * h;
        gap = choose(better, g, gap);
        rate = choose(better, r, rate);
        bend = choose(better, b, bend);
        haste = choose(better, h, haste);
    }

    /// The zero of gap + rate t - bend/2 t², rounded towards less.
    TESSERA_INLINE F time() const {
        const F root = sqrt(rate * rate + gap * bend * 2.0f);
        const F t = gap * (2 * (1 - 1e-5f)) / (root - rate + abs(rate) * 1e-6f + 1e-30f);
        return choose(gap, choose(t, min(t, splat(1e30f)), splat(0)), splat(0));
    }
};

template <typename Box, bool Similar>
void nodeTimes(const TreeView& tree, const MovingFrame& m, std::uint32_t index, const PlacedBox& one,
               const ImpactFrame& f, float* times) {
    const float* const node = tree.volumes + std::size_t{index} * Box::kRows * kWidth;
    const V3 c = Box::centre(node);
    const V3 way = offset(mapped(m.linear, c), m.translation) - at(one.centre);
    const V3 velocity = offset(mapped(m.turning, c), m.drift) - at(one.velocity);
    const F radius = Box::radius(node);
    const float near = f.slack + f.thickness, nearing = f.rateSlack + f.thickening;
    const F loss = radius * m.growth + (one.growth + nearing);
    const F unit = splat(1), anyBend = splat(f.a.acceleration + f.b.acceleration + f.rest);

    V3 axis[3];
    F half[3], own[3], reach[3];
    for (unsigned i = 0; i < 3; ++i) {
        half[i] = Box::half(node, i);
        if constexpr (Box::kOwnAxes) {
            const float* const row = node + (3 + 3 * i) * kWidth;
            axis[i] = mapped(m.axes, V3{load(row), load(row + kWidth), load(row + 2 * kWidth)});
        } else {
            axis[i] = {splat(m.axes[i]), splat(m.axes[3 + i]), splat(m.axes[6 + i])};
        }
        if constexpr (Similar) {
            half[i] = half[i] * m.scale;
        } else {
            const F length = sqrt(dot(axis[i], axis[i])), inverse = 1.0f / max(length, splat(1e-30f));
            axis[i] = {axis[i].x * inverse, axis[i].y * inverse, axis[i].z * inverse};
            half[i] = half[i] * length;
        }
        own[i] = half[i];
    }
    if constexpr (!Similar)
        for (unsigned i = 0; i < 3; ++i) {
            own[i] = splat(0);
            for (unsigned j = 0; j < 3; ++j) own[i] += abs(dot(axis[i], axis[j])) * half[j];
        }
    for (unsigned j = 0; j < 3; ++j) reach[j] = splat(one.own[j] + near);

    Longest longest;
    for (unsigned i = 0; i < 3; ++i) {
        F sum = own[i] + near;
        for (unsigned j = 0; j < 3; ++j) {
            const float* const other = one.axis + 3 * j;
            const F cosine = abs(axis[i].x * other[0] + axis[i].y * other[1] + axis[i].z * other[2]);
            sum += cosine * one.half[j];
            reach[j] += cosine * half[i];
        }
        const F apart = dot(way, axis[i]), rate = dot(velocity, axis[i]);
        longest.consider(abs(apart) - sum, choose(apart, rate, -rate) - loss, bendAlong(axis[i], unit, f), f);
    }
    for (unsigned j = 0; j < 3; ++j) {
        const float* const other = one.axis + 3 * j;
        const F apart = way.x * other[0] + way.y * other[1] + way.z * other[2];
        const F rate = velocity.x * other[0] + velocity.y * other[1] + velocity.z * other[2];
        longest.consider(abs(apart) - reach[j], choose(apart, rate, -rate) - loss, splat(one.bend[j]), f);
    }
    // The spheres around them: these do not turn.
    const F distance = sqrt(dot(way, way));
    longest.consider(
        distance - (radius * m.stretch + (one.radius + near)),
        dot(way, velocity) / max(distance, splat(1e-30f)) - (radius * m.swelling + (one.swelling + nearing)), anyBend,
        f);
    store(times, longest.time());
}

struct T3 {
    V3 corner[3], velocity[3];
};

TESSERA_INLINE void setCorner(T3& t, unsigned i, const V3& p, const MovingFrame& m) {
    t.corner[i] = offset(mapped(m.linear, p), m.translation);
    t.velocity[i] = offset(mapped(m.turning, p), m.drift);
}

struct Interval {
    F low, high;
};
TESSERA_INLINE Interval along(const V3& n, const V3* p) {
    const F x = dot(n, p[0]), y = dot(n, p[1]), z = dot(n, p[2]);
    return {min(min(x, y), z), max(max(x, y), z)};
}

TESSERA_INLINE void considerDirection(const V3& n, const T3& a, const T3& b, const ImpactFrame& f, Longest& longest) {
    const Interval pa = along(n, a.corner), pb = along(n, b.corner), va = along(n, a.velocity),
                   vb = along(n, b.velocity);
    const F size = taxicab(n), length = sqrt(dot(n, n));
    const F above = pb.low - pa.high, below = pa.low - pb.high;
    const F side = above - below;
    F gap = max(above, below) - size * (2 * f.slack);
    F rate = choose(side, vb.low - va.high, va.low - vb.high) - size * (2 * f.rateSlack);
    if (f.thickness > 0 || f.thickening > 0) {
        gap = gap - length * f.thickness;
        rate = rate - length * f.thickening;
    }
    longest.consider(gap, rate, bendAlong(n, length, f), f);
}

void leafTimes(const float* cornersA, const float* cornersB, const ImpactFrame& f, float* times) {
    T3 a, b;
    for (unsigned i = 0; i < 3; ++i) {
        const float *const ra = cornersA + 3 * i * kLeafFaces, *const rb = cornersB + 3 * i * kLeafFaces;
        setCorner(a, i, {spread(load4(ra)), spread(load4(ra + kLeafFaces)), spread(load4(ra + 2 * kLeafFaces))}, f.a);
        setCorner(b, i, {repeat(load4(rb)), repeat(load4(rb + kLeafFaces)), repeat(load4(rb + 2 * kLeafFaces))}, f.b);
    }
    Longest longest;
    considerDirection(cross(a.corner[1] - a.corner[0], a.corner[2] - a.corner[0]), a, b, f, longest);
    considerDirection(cross(b.corner[1] - b.corner[0], b.corner[2] - b.corner[0]), a, b, f, longest);
    const V3 middles = (b.corner[0] + b.corner[1] + b.corner[2]) - (a.corner[0] + a.corner[1] + a.corner[2]);
    considerDirection(middles, a, b, f, longest);
    store(times, longest.time());
}

// Triangles whose corners go straight, in double: eight pairs at once, two of A with four of B.

using W3 = Vector3<D>;

/// Eight pairs of triangles at one moment, seen from A's first corner.
struct EightPairs {
    W3 a1, a2, b0, b1, b2;

    TESSERA_INLINE EightPairs(const double* a, const double* b) {
        const auto ofA = [&](unsigned i) {
            const double* const row = a + 3 * i * kLeafFaces;
            return W3{spreadTwo(row), spreadTwo(row + kLeafFaces), spreadTwo(row + 2 * kLeafFaces)};
        };
        const auto ofB = [&](unsigned i) {
            const double* const row = b + 3 * i * kLeafFaces;
            return W3{repeatFour(row), repeatFour(row + kLeafFaces), repeatFour(row + 2 * kLeafFaces)};
        };
        const W3 origin = ofA(0);
        a1 = ofA(1) - origin;
        a2 = ofA(2) - origin;
        b0 = ofB(0) - origin;
        b1 = ofB(1) - origin;
        b2 = ofB(2) - origin;
    }
    /// Where B lies beyond A along a direction, and where before it, farther off than that.
    TESSERA_INLINE void sides(const W3& n, D wide, Bits& beyond, Bits& before) const {
        const D p = dot(n, a1), q = dot(n, a2), r0 = dot(n, b0), r1 = dot(n, b1), r2 = dot(n, b2),
                zero = splatDouble(0);
        beyond = greater(min(min(r0, r1), r2) - max(max(p, q), zero), wide);
        before = greater(min(min(p, q), zero) - max(max(r0, r1), r2), wide);
    }
};

template <bool kThroughout>
TESSERA_INLINE Bits eightMeeting(const double* startA, const double* startB, const double* endA, const double* endB,
                                 double margin) {
    const EightPairs start(startA, startB), end(kThroughout ? endA : startA, kThroughout ? endB : startB);
    Bits left = 0xffu;
    const auto look = [&](const W3& n) {
        // No smaller than the direction's length.
        const D wide = taxicab(n) * margin;
        Bits beyond, before;
        start.sides(n, wide, beyond, before);
        if constexpr (kThroughout) {
            Bits beyondThen, beforeThen;
            end.sides(n, wide, beyondThen, beforeThen);
            beyond &= beyondThen;
            before &= beforeThen;
        }
        left &= ~(beyond | before);
    };
    const W3 alongA[3] = {start.a1, start.a2 - start.a1, start.a2};
    const W3 alongB[3] = {start.b1 - start.b0, start.b2 - start.b1, start.b0 - start.b2};
    look(cross(alongA[0], alongA[1]));
    look(cross(alongB[0], alongB[1]));
    for (unsigned i = 0; i < 3 && left != 0; ++i)
        for (unsigned j = 0; j < 3; ++j) look(cross(alongA[i], alongB[j]));
    return left;
}

template <bool kThroughout>
std::uint32_t meeting(const StraightLeaf& a, const StraightLeaf& b, double margin) {
    const Bits low = eightMeeting<kThroughout>(a.start, b.start, a.end, b.end, margin);
    return low | eightMeeting<kThroughout>(a.start + 2, b.start, a.end + 2, b.end, margin) << 8;
}

bool besidePlanes(const LeafPlanes& planes, const StraightBox& box, bool throughout) {
    D middle = splatDouble(0), half = middle;
    for (unsigned i = 0; i < 3; ++i) {
        middle = middle + loadDouble(planes.normal[i]) * (spreadTwo(box.centre[i]) - loadDouble(planes.corner[i]));
        half = half + loadDouble(planes.size[i]) * spreadTwo(box.half[i]);
    }
    Bits beyond = greater(middle - half, loadDouble(planes.high)),
         before = greater(loadDouble(planes.low), middle + half);
    if (throughout) {
        beyond &= beyond >> kLeafFaces;
        before &= before >> kLeafFaces;
    }
    return ((beyond | before) & 0xfu) == 0xfu;
}

}  // namespace

extern const ImpactKernels kImpact;
const ImpactKernels kImpact = {
    {&place<SphereBox>, &place<ObbBox>, &place<DopBox<6>>, &place<DopBox<14>>, &place<DopBox<18>>, &place<DopBox<26>>},
    {{&nodeTimes<SphereBox, true>, &nodeTimes<ObbBox, true>, &nodeTimes<DopBox<6>, true>, &nodeTimes<DopBox<14>, true>,
      &nodeTimes<DopBox<18>, true>, &nodeTimes<DopBox<26>, true>},
     {&nodeTimes<SphereBox, false>, &nodeTimes<ObbBox, false>, &nodeTimes<DopBox<6>, false>,
      &nodeTimes<DopBox<14>, false>, &nodeTimes<DopBox<18>, false>, &nodeTimes<DopBox<26>, false>}},
    &leafTimes,
    &meeting<true>,
    &meeting<false>,
    &besidePlanes,
};

}  // namespace tessera::kernel::TESSERA_KERNELS
