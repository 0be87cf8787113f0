// Distances of points from triangles, and the walk down one tree with its boxes looked up in a lattice of distances.
// Included after FieldWalk.inl, once per instruction set.

namespace tessera::kernel::TESSERA_KERNELS {
namespace {

inline float dot3(const float* a, const float* b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// Squared distance of a point from a triangle (C. Ericson, "Real-Time Collision Detection", 2005, 5.1.5: by the
/// regions of the triangle's corners and sides). Of a triangle without area: of its sides.
inline float squareToTriangle(const float* p, const float* a, const float* b, const float* c) {
    float ab[3], ac[3], bc[3], ap[3], bp[3];
    for (unsigned r = 0; r < 3; ++r) {
        ab[r] = b[r] - a[r];
        ac[r] = c[r] - a[r];
        bc[r] = c[r] - b[r];
        ap[r] = p[r] - a[r];
        bp[r] = p[r] - b[r];
    }
    // The three sides, always: no region has to be told from another, and rounding cannot lead into a wrong one.
    const auto toSide = [](const float* from, const float* side) {
        const float length = dot3(side, side);
        float t = length > 0 ? dot3(from, side) / length : 0;
        t = t < 0 ? 0 : (t > 1 ? 1 : t);
        float square = 0;
        for (unsigned r = 0; r < 3; ++r) square += (from[r] - t * side[r]) * (from[r] - t * side[r]);
        return square;
    };
    float least = toSide(ap, ab);
    const float other = toSide(ap, ac), third = toSide(bp, bc);
    least = other < least ? other : least;
    least = third < least ? third : least;
    const float n[3] = {ab[1] * ac[2] - ab[2] * ac[1], ab[2] * ac[0] - ab[0] * ac[2], ab[0] * ac[1] - ab[1] * ac[0]};
    const float square = dot3(n, n);
    if (!(square > 0)) return least;
    // Above the inside: the foot is left of every side.
    const auto left = [&](const float* from, const float* side) {
        return (side[1] * from[2] - side[2] * from[1]) * n[0] + (side[2] * from[0] - side[0] * from[2]) * n[1] +
                   (side[0] * from[1] - side[1] * from[0]) * n[2] >=
               0;
    };
    float ca[3], cp[3];
    for (unsigned r = 0; r < 3; ++r) {
        ca[r] = -ac[r];
        cp[r] = p[r] - c[r];
    }
    if (!left(ap, ab) || !left(bp, bc) || !left(cp, ca)) return least;
    const float height = dot3(ap, n);
    const float above = height * height / square;
    return above < least ? above : least;
}

struct PointSearch {
    const TreeView& tree;
    const float* p;
    float tolerance;
    float best;  ///< distance so far

    void walk(std::uint32_t node) {
        const float* const rows = tree.volumes + std::size_t{node} * 15 * kWidth;
        const ChildRef* const children = tree.children + std::size_t{node} * kWidth;
        alignas(64) float square[kWidth] = {};
        for (unsigned i = 0; i < 3; ++i) {
            const float* const axis = rows + (3 + 3 * i) * kWidth;
            const float* const half = rows + (12 + i) * kWidth;
            for (unsigned k = 0; k < kWidth; ++k) {
                const float along = (p[0] - rows[k]) * axis[k] + (p[1] - rows[kWidth + k]) * axis[kWidth + k] +
                                    (p[2] - rows[2 * kWidth + k]) * axis[2 * kWidth + k];
                const float out = absolute(along) - half[k];
                const float outside = out > 0 ? out : 0;
                square[k] += outside * outside;
            }
        }
        for (;;) {
            const float enough = best - tolerance;
            const float bound = enough > 0 ? enough * enough : -1;
            unsigned nearest = kWidth;
            float least = bound;
            for (unsigned k = 0; k < kWidth; ++k)
                if (square[k] < least && children[k] != kNoChild) {
                    least = square[k];
                    nearest = k;
                }
            if (nearest == kWidth) return;
            square[nearest] = 3e38f;
            const ChildRef ref = children[nearest];
            if ((ref & kLeafBit) == 0) {
                walk(ref);
                continue;
            }
            const std::size_t leaf = (ref & ~kLeafBit) >> 2;
            const float* const corners = tree.corners + leaf * kLeafRows * kLeafFaces;
            for (unsigned i = 0; i <= (ref & 3); ++i) {
                float c[3][3];
                for (unsigned k = 0; k < 3; ++k)
                    for (unsigned r = 0; r < 3; ++r) c[k][r] = corners[(3 * k + r) * kLeafFaces + i];
                const float found = squareToTriangle(p, c[0], c[1], c[2]);
                if (found < best * best) best = __builtin_sqrtf(found);
            }
        }
    }
};

float pointDistance(const TreeView& tree, const float* point, float most, float tolerance) {
    PointSearch search{tree, point, tolerance, most};
    search.walk(0);
    return search.best;
}

/// Bounds of the signed distance at a place: it changes by no more than the way to a place where it is known.
struct DistanceBounds {
    float lower, upper;
};
inline DistanceBounds boundsAt(const LatticeView& v, const float* q) {
    float inside[3], away = 0, box = 0;
    std::int32_t cell[3];
    for (unsigned r = 0; r < 3; ++r) {
        const float last = static_cast<float>(v.size[r] - 1);
        const float place = (q[r] - v.origin[r]) / v.spacing;
        const float kept = place < 0 ? 0 : (place > last ? last : place);
        cell[r] = static_cast<std::int32_t>(kept);
        cell[r] = cell[r] > v.size[r] - 2 ? v.size[r] - 2 : cell[r];
        inside[r] = (kept - static_cast<float>(cell[r])) * v.spacing;
        away += (place - kept) * (place - kept) * v.spacing * v.spacing;
        const float below = v.boxLower[r] - q[r], above = q[r] - v.boxUpper[r];
        const float out = below > above ? below : above;
        box += out > 0 ? out * out : 0;
    }
    away = __builtin_sqrtf(away);
    const std::int16_t* const base =
        v.values +
        (static_cast<std::size_t>(cell[2]) * static_cast<std::size_t>(v.size[1]) + static_cast<std::size_t>(cell[1])) *
            static_cast<std::size_t>(v.size[0]) +
        static_cast<std::size_t>(cell[0]);
    const std::size_t row = static_cast<std::size_t>(v.size[0]), plane = row * static_cast<std::size_t>(v.size[1]);
    float x[2], y[2], z[2];
    x[0] = inside[0] * inside[0];
    x[1] = (v.spacing - inside[0]) * (v.spacing - inside[0]);
    y[0] = inside[1] * inside[1];
    y[1] = (v.spacing - inside[1]) * (v.spacing - inside[1]);
    z[0] = inside[2] * inside[2];
    z[1] = (v.spacing - inside[2]) * (v.spacing - inside[2]);
    DistanceBounds out{-3e38f, 3e38f};
    for (unsigned corner = 0; corner < 8; ++corner) {
        const float signedly =
            static_cast<float>(base[(corner & 1) + ((corner >> 1) & 1) * row + (corner >> 2) * plane]) * v.unit;
        const float known = v.isSigned ? signedly : absolute(signedly);
        const float way = __builtin_sqrtf(x[corner & 1] + y[(corner >> 1) & 1] + z[corner >> 2]);
        out.lower = larger(out.lower, known - way);
        out.upper = out.upper < known + way ? out.upper : known + way;
    }
    const float doubt = v.doubt + 1e-5f * away;
    out.lower -= doubt + away;
    out.upper += doubt + away;
    // What is outside the surface's box is that far away at least.
    if (box > 0) out.lower = larger(out.lower, __builtin_sqrtf(box) * 0.99999f - v.doubt);
    if (!v.isSigned) out.lower = larger(out.lower, 0);
    return out;
}

/// The same for sixteen places at once.
inline void boundsOfMany(const LatticeView& v, const float (*__restrict q)[kWidth], float* __restrict lower,
                         float* __restrict upper) {
    alignas(64) float square[3][2][kWidth], away[kWidth], box[kWidth];
    alignas(64) std::int32_t base[kWidth];
    for (unsigned k = 0; k < kWidth; ++k) {
        away[k] = box[k] = 0;
        base[k] = 0;
    }
    const std::int32_t step[3] = {1, v.size[0], v.size[0] * v.size[1]};
    const float per = 1 / v.spacing;
    for (unsigned r = 0; r < 3; ++r) {
        const float last = static_cast<float>(v.size[r] - 1), origin = v.origin[r], spacing = v.spacing,
                    low = v.boxLower[r], high = v.boxUpper[r];
        const std::int32_t most = v.size[r] - 2, stride = step[r];
        for (unsigned k = 0; k < kWidth; ++k) {
            const float place = (q[r][k] - origin) * per;
            float kept = place < 0 ? 0 : place;
            kept = kept > last ? last : kept;
            std::int32_t cell = static_cast<std::int32_t>(kept);
            cell = cell > most ? most : cell;
            const float inside = (kept - static_cast<float>(cell)) * spacing, rest = spacing - inside;
            square[r][0][k] = inside * inside;
            square[r][1][k] = rest * rest;
            const float off = (place - kept) * spacing;
            away[k] += off * off;
            const float below = low - q[r][k], above = q[r][k] - high;
            float out = below > above ? below : above;
            out = out > 0 ? out : 0;
            box[k] += out * out;
            base[k] += cell * stride;
        }
    }
    for (unsigned k = 0; k < kWidth; ++k) {
        lower[k] = -3e38f;
        upper[k] = 3e38f;
    }
    for (unsigned corner = 0; corner < 8; ++corner) {
        const std::int16_t* const values =
            v.values + (corner & 1) * step[0] + ((corner >> 1) & 1) * step[1] + (corner >> 2) * step[2];
        const float *const x = square[0][corner & 1], *const y = square[1][(corner >> 1) & 1],
                           *const z = square[2][corner >> 2];
        alignas(64) std::int32_t found[kWidth];
        for (unsigned k = 0; k < kWidth; ++k) found[k] = values[base[k]];
        if (!v.isSigned)  // of a closed surface, too, where its sides are of no interest
            for (unsigned k = 0; k < kWidth; ++k) found[k] = found[k] < 0 ? -found[k] : found[k];
        const float unit = v.unit;
        for (unsigned k = 0; k < kWidth; ++k) {
            const float known = static_cast<float>(found[k]) * unit, way = __builtin_sqrtf(x[k] + y[k] + z[k]);
            const float least = known - way, most = known + way;
            lower[k] = lower[k] > least ? lower[k] : least;
            upper[k] = upper[k] < most ? upper[k] : most;
        }
    }
    const float nothing = v.isSigned ? -3e38f : 0, known = v.doubt;
    for (unsigned k = 0; k < kWidth; ++k) {
        const float way = __builtin_sqrtf(away[k]), doubt = known + way * 1.00001f;
        upper[k] += doubt;
        const float outside = box[k] > 0 ? __builtin_sqrtf(box[k]) * 0.99999f - known : -3e38f;
        float least = lower[k] - doubt;
        least = least > outside ? least : outside;
        lower[k] = least > nothing ? least : nothing;
    }
}

struct LatticeWalking {
    const LatticeFrame& f;
    LatticeSink& sink;

    void map(const float* p, float* out) const {
        for (unsigned r = 0; r < 3; ++r)
            out[r] =
                f.linear[3 * r] * p[0] + f.linear[3 * r + 1] * p[1] + f.linear[3 * r + 2] * p[2] + f.translation[r];
    }
    void takeUpper(float upper, const float* q) {
        if (upper >= sink.upper) return;
        sink.upper = upper;
        for (unsigned r = 0; r < 3; ++r) sink.point[r] = q[r];
    }
    [[nodiscard]] bool dull(float lower) const { return lower >= sink.upper - sink.width; }
    void leave(float lower) { sink.lower = lower < sink.lower ? lower : sink.lower; }
    /// No distance without a sign is below 0.
    [[nodiscard]] float least(float lower) const { return f.lattice.isSigned ? lower : larger(lower, 0); }

    /// A triangle in the surface's coordinates; halved where it is large.
    void triangle(const float (*p)[3], unsigned halvings) {
        float q[3], reach = 0;
        for (unsigned r = 0; r < 3; ++r) q[r] = (p[0][r] + p[1][r] + p[2][r]) * (1.0f / 3);
        for (unsigned k = 0; k < 3; ++k) {
            const float d[3] = {p[k][0] - q[0], p[k][1] - q[1], p[k][2] - q[2]};
            reach = larger(reach, dot3(d, d));
        }
        reach = __builtin_sqrtf(reach) * 1.00001f + f.slack;
        const DistanceBounds at = boundsAt(f.lattice, q);
        takeUpper(at.upper + f.slack, q);
        ++sink.triangleTests;
        const float lowest = least(at.lower - reach);
        if (dull(lowest)) return leave(lowest);
        if (reach > 0.5f * sink.width && halvings < 40) {
            unsigned longest = 0;
            float most = -1;
            for (unsigned k = 0; k < 3; ++k) {
                const unsigned next = k == 2 ? 0 : k + 1;
                const float d[3] = {p[next][0] - p[k][0], p[next][1] - p[k][1], p[next][2] - p[k][2]};
                if (dot3(d, d) > most) {
                    most = dot3(d, d);
                    longest = k;
                }
            }
            const unsigned next = longest == 2 ? 0 : longest + 1;
            float half[3][3];
            for (unsigned end = 0; end < 2; ++end) {
                for (unsigned k = 0; k < 3; ++k)
                    for (unsigned r = 0; r < 3; ++r) half[k][r] = p[k][r];
                for (unsigned r = 0; r < 3; ++r)
                    half[end == 0 ? next : longest][r] = 0.5f * (p[longest][r] + p[next][r]);
                if (sink.nodeTests + sink.triangleTests >= sink.limit) {
                    sink.exhausted = true;
                    return leave(lowest);
                }
                triangle(half, halvings + 1);
            }
            return;
        }
        // The lattice cannot tell: the surface itself.
        const float known = at.upper > -at.lower ? at.upper : -at.lower;
        const float distance = pointDistance(f.surface, q, known + f.slack, 0);
        const float doubt = f.slack + 1e-5f * distance;
        // On which side the lattice says, where it can.
        const bool mayBeInside = f.lattice.isSigned && -distance >= at.lower - doubt,
                   mayBeOutside = distance <= at.upper + doubt;
        const float lower = (mayBeInside ? -distance : distance) - doubt,
                    upper = (mayBeOutside ? distance : -distance) + doubt;
        takeUpper(upper, q);
        leave(least(lower - reach));
    }

    void walk(std::uint32_t node) {
        const float* const rows = f.tree.volumes + std::size_t{node} * 15 * kWidth;
        const ChildRef* const children = f.tree.children + std::size_t{node} * kWidth;
        alignas(64) float q[3][kWidth], reach[kWidth], lower[kWidth], upper[kWidth];
        for (unsigned r = 0; r < 3; ++r)
            for (unsigned k = 0; k < kWidth; ++k)
                q[r][k] = f.linear[3 * r] * rows[k] + f.linear[3 * r + 1] * rows[kWidth + k] +
                          f.linear[3 * r + 2] * rows[2 * kWidth + k] + f.translation[r];
        for (unsigned k = 0; k < kWidth; ++k) {
            const float a = rows[12 * kWidth + k], b = rows[13 * kWidth + k], c = rows[14 * kWidth + k];
            reach[k] = __builtin_sqrtf(a * a + b * b + c * c) * f.scale * 1.00001f + f.slack;
        }
        ++sink.nodeTests;
        boundsOfMany(f.lattice, q, lower, upper);
        unsigned order[kWidth], count = 0;
        for (unsigned k = 0; k < kWidth; ++k) {
            if (children[k] == kNoChild) continue;
            lower[k] = least(lower[k] - reach[k]);
            // Some of the surface is in the box.
            if (upper[k] + reach[k] < sink.upper) {
                const float at[3] = {q[0][k], q[1][k], q[2][k]};
                takeUpper(upper[k] + reach[k], at);
            }
            if (dull(lower[k])) {
                leave(lower[k]);
                continue;
            }
            unsigned place = count++;
            for (; place > 0 && lower[order[place - 1]] > lower[k]; --place) order[place] = order[place - 1];
            order[place] = k;
        }
        for (unsigned i = 0; i < count; ++i) {
            const unsigned k = order[i];
            if (dull(lower[k])) {
                leave(lower[k]);
                continue;
            }
            if (sink.nodeTests + sink.triangleTests >= sink.limit) {
                sink.exhausted = true;
                leave(lower[k]);
                continue;
            }
            const ChildRef ref = children[k];
            if ((ref & kLeafBit) == 0) {
                walk(ref);
                continue;
            }
            const float* const corners =
                f.tree.corners + ((ref & ~kLeafBit) >> 2) * std::size_t{kLeafRows * kLeafFaces};
            for (unsigned t = 0; t <= (ref & 3); ++t) {
                float p[3][3];
                for (unsigned c = 0; c < 3; ++c) {
                    const float own[3] = {corners[(3 * c) * kLeafFaces + t], corners[(3 * c + 1) * kLeafFaces + t],
                                          corners[(3 * c + 2) * kLeafFaces + t]};
                    map(own, p[c]);
                }
                triangle(p, 0);
            }
        }
    }
};

void walkLattice(const LatticeFrame& frame, LatticeSink& sink) {
    LatticeWalking walking{frame, sink};
    walking.walk(0);
}

}  // namespace

extern const LatticeWalk kLatticeWalk;
const LatticeWalk kLatticeWalk = &walkLattice;
extern const PointDistance kPointDistance;
const PointDistance kPointDistance = &pointDistance;

}  // namespace tessera::kernel::TESSERA_KERNELS
