// Branch and bound for the nearest triangles (Quinlan 1994; Larsen et al. 1999). Float distances, each with its error,
// only decide what to look at; `decide` measures what is left in double. Included by kernel/Kernels.inl only.

inline F clamped01(F x) {
    return min(max(x, F{}), splat(1.0f));
}
/// x / y, and 0 for y = 0.
inline F ratio(F x, F y) {
    return x / max(y, splat(1e-30f));
}

/// Edges that meet at less than some two degrees: sin² below this.
constexpr float kParallel = 1e-3f;

/// Squared distance of two segments a + s u and b + t v, s and t in [0, 1] (Ericson 2005, 5.1.9). s is known to
/// 8ε |b - a| / (|u| sin²), ε = 2^-24, so the way found is longer than the shortest by x²/2d at most, x = 8ε |b - a| /
/// sin, and by x where d is less; always by min(x, |u| sin) ≤ 1e-3 sqrt(|b - a| |u|). `parallel` becomes positive where
/// sin² is below kParallel.
inline F segments2(const V3& a, const V3& u, F uu, const V3& b, const V3& v, F vv, F& parallel) {
    const V3 r = a - b;
    const F uv = dot(u, v), ur = dot(u, r), vr = dot(v, r);
    const F across = uu * vv - uv * uv;
    parallel = max(parallel, uu * vv * kParallel - across);
    const F s0 = clamped01(ratio(uv * vr - ur * vv, across));
    const F t = clamped01(ratio(uv * s0 + vr, vv));
    const F s = clamped01(ratio(uv * t - ur, uu));
    const V3 way{r.x + s * u.x - t * v.x, r.y + s * u.y - t * v.y, r.z + s * u.z - t * v.z};
    return dot(way, way);
}

/// Makes of anything above 0 more than any distance.
constexpr float kForbid = 1e38f;

/// A triangle's edges and plane, each used many times.
struct Facet {
    T3 corner;
    V3 edge[3];  ///< from corner i to corner i + 1
    F edge2[3];
    V3 normal;
    F normal2;
    F sliver;  ///< above 0 where the plane is too badly known to measure from
    F height;  ///< of a sliver: no point is farther from an edge; else 0
    F size2;   ///< of the longest edge

    explicit Facet(const T3& t) : corner(t) {
        edge[0] = t.b - t.a;
        edge[1] = t.c - t.b;
        edge[2] = t.a - t.c;
        for (unsigned i = 0; i < 3; ++i) edge2[i] = dot(edge[i], edge[i]);
        normal = cross(edge[0], edge[1]);
        normal2 = dot(normal, normal);
        size2 = max(max(edge2[0], edge2[1]), edge2[2]);
        const F thin = size2 * size2 * 1e-3f - normal2;    // positive: |normal| < 0.03 size²
        sliver = choose(-thin, splat(0.0f), splat(1.0f));  // a point too, of which both are 0
        height = sqrt(normal2) / sqrt(max(size2, splat(1e-30f)));
    }
    const V3& at(unsigned i) const { return i == 0 ? corner.a : i == 1 ? corner.b : corner.c; }

    /// Squared distance to the plane where p is above the inside; else a large number.
    F above(const V3& p) const {
        const V3 fromA = p - corner.a;
        const F s0 = dot(cross(edge[0], fromA), normal), s1 = dot(cross(edge[1], p - corner.b), normal),
                s2 = dot(cross(edge[2], p - corner.c), normal);
        const F height0 = dot(normal, fromA);
        const F outside = max(max(-s0, -s1), max(-s2, sliver));
        return height0 * height0 / max(normal2, splat(1e-30f)) + max(outside, F{}) * kForbid;
    }
};

/// No points of the two are nearer: the gap between two slabs square to the line between the centres. For triangles
/// that are small against their distance it is nearly the distance itself, at a tenth of its cost.
inline F atLeastApart(const T3& a, const T3& b, F slack) {
    const V3 u = (b.a + b.b + b.c) - (a.a + a.b + a.c);
    const F low = min(min(dot(u, b.a), dot(u, b.b)), dot(u, b.c)),
            high = max(max(dot(u, a.a), dot(u, a.b)), dot(u, a.c));
    return (low - high) / sqrt(max(dot(u, u), splat(1e-30f))) - 4 * slack;
}

struct Apart {
    F distance;  ///< of edges and corners, in float
    F error;     ///< the true one is at most so far away from it
};

inline Apart apart(const T3& ta, const T3& tb, F slack) {
    const Facet a(ta), b(tb);
    F least = splat(3e38f), parallel = {};
    for (unsigned i = 0; i < 3; ++i)
        for (unsigned j = 0; j < 3; ++j)
            least = min(least, segments2(a.at(i), a.edge[i], a.edge2[i], b.at(j), b.edge[j], b.edge2[j], parallel));
    for (unsigned i = 0; i < 3; ++i) least = min(least, min(a.above(b.at(i)), b.above(a.at(i))));
    const F distance = sqrt(least);
    const F sizeA = sqrt(a.size2), sizeB = sqrt(b.size2), far = distance + sizeA + sizeB;
    const F x = far * 2e-5f;
    const F crossing = x * min(x / max(distance, splat(1e-30f)), splat(1.0f));
    const F along = min(sqrt(far * min(sizeA, sizeB)) * 1e-3f, parallel * kForbid);
    // Points above a face: its normal is known to 2e-5, they are above it by less than its size. Inside of slivers: not
    // looked at. Positions: each is wrong by a quarter of `slack`. The rest: rounding of the last lines.
    const F thin = max(min(a.height, max(a.sliver, F{}) * kForbid), min(b.height, max(b.sliver, F{}) * kForbid));
    return {distance, crossing + along + thin + max(sizeA, sizeB) * 2e-5f + 0.5f * slack + far * 1e-6f};
}

template <typename V>
struct Nearing {
    using Block = Placed<V::kRows>;
    static constexpr unsigned kRows = V::kRows;

    const TreeView& a;
    const TreeView& b;
    const PairFrame& f;
    DistanceSink& sink;

    const float* nodeA(Slot slot) const { return a.volumes + std::size_t{slot / kWidth} * kRows * kWidth; }
    const float* nodeB(Slot slot) const { return b.volumes + std::size_t{slot / kWidth} * kRows * kWidth; }

    /// Lower bounds of the distances, in A's lengths, rounding taken off.
    F boundA(const float* placedB, const float* ownA) const {
        if constexpr (std::is_same_v<V, Obb>)
            return V::template distance<true>(placedB, ownA, f) - f.slack;
        else if constexpr (std::is_same_v<V, Sphere>)
            return V::gap(placedB, ownA, f) - f.slack;
        else
            return V::distance(placedB, ownA) - f.slack;
    }
    F boundB(const float* ownA, const float* placedB) const {
        if constexpr (std::is_same_v<V, Obb>)
            return V::template distance<false>(ownA, placedB, f) - f.slack;
        else if constexpr (std::is_same_v<V, Sphere>)
            return V::gap(ownA, placedB, f) - f.slack;
        else
            return V::distance(ownA, placedB) - f.slack;
    }

    void leaves(ChildRef refA, ChildRef refB) {
        const std::size_t leafA = (refA & ~kLeafBit) >> 2, leafB = (refB & ~kLeafBit) >> 2;
        const unsigned countA = (refA & 3) + 1, countB = (refB & 3) + 1;
        sink.triangleTests += countA * countB;
        const Bits both = (((1u << countB) - 1) * 0x1111u) & ((1u << 4 * countA) - 1);
        const T3 ta = spreadLeaf(a.corners + leafA * kLeafRows * kLeafFaces),
                 tb = repeatLeaf(b.corners + leafB * kLeafRows * kLeafFaces, f);
        const Bits near = both & ~greater(atLeastApart(ta, tb, splat(f.slack)), splat(sink.bound));
        if (near == 0) return;
        const Apart found = apart(ta, tb, splat(f.slack));
        alignas(64) float least[16];
        const F lower = found.distance - found.error;
        store(least, lower);
        const Bits listed = near & ~greater(lower, splat(sink.bound));
        for (Bits left = listed; left != 0; left &= left - 1) {
            const unsigned bit = static_cast<unsigned>(__builtin_ctz(left));
            if (sink.count == sink.capacity) sink.decide(sink, sink.context);
            sink.facesA[sink.count] = a.faces[leafA * kLeafFaces + bit / 4];
            sink.facesB[sink.count] = b.faces[leafB * kLeafFaces + bit % 4];
            sink.atLeast[sink.count] = least[bit];
            ++sink.count;
        }
        store(least, found.distance + found.error);
        // Only what is listed may lower the bound: else nothing might be left that is as near as it says.
        for (Bits left = listed; left != 0; left &= left - 1) {
            const float most = least[__builtin_ctz(left)] - sink.tolerance;
            if (most < sink.bound) sink.bound = most;
        }
    }

    struct Next {
        float atLeast;
        std::uint16_t laneA, laneB;
    };

    /// Nearest first; few enough for the plainest way.
    static void sort(Next* first, unsigned count) {
        for (unsigned i = 1; i < count; ++i) {
            const Next next = first[i];
            unsigned j = i;
            for (; j > 0 && first[j - 1].atLeast > next.atLeast; --j) first[j] = first[j - 1];
            first[j] = next;
        }
    }

    void give(float atLeast) {
        if (atLeast < sink.unexplored) sink.unexplored = atLeast;
    }

    void descend(Slot slotA, Slot slotB, const Block& blockB) {
        const ChildRef refA = a.children[slotA], refB = b.children[slotB];
        if ((refA & refB & kLeafBit) != 0) return leaves(refA, refB);
        const unsigned laneA = slotA % kWidth, laneB = slotB % kWidth;
        Next next[kWidth * kWidth];
        unsigned count = 0;
        alignas(64) float least[kWidth];
        Block placedB;
        const Block* of = &blockB;
        Slot firstA = slotA - laneA, firstB = slotB - laneB;
        const auto lanesOfA = [&](unsigned lane) {
            ++sink.nodeTests;
            const F bound = boundA(of->row + lane, nodeA(firstA));
            store(least, bound);
            for (Bits left = ~greater(bound, splat(sink.bound)) & 0xffffu; left != 0; left &= left - 1) {
                const unsigned i = static_cast<unsigned>(__builtin_ctz(left));
                if (a.children[firstA + i] != kNoChild)
                    next[count++] = {least[i], static_cast<std::uint16_t>(i), static_cast<std::uint16_t>(lane)};
            }
        };
        if ((refB & kLeafBit) != 0) {
            firstA = refA * kWidth;
            lanesOfA(laneB);
        } else {
            firstB = refB * kWidth;
            V::place(nodeB(firstB), f, f.bInA, placedB.row);
            of = &placedB;
            ++sink.nodeTests;
            const F bound = boundB(nodeA(slotA) + laneA, placedB.row);
            store(least, bound);
            Next lanes[kWidth];
            unsigned lanesCount = 0;
            for (Bits left = ~greater(bound, splat(sink.bound)) & 0xffffu; left != 0; left &= left - 1) {
                const unsigned i = static_cast<unsigned>(__builtin_ctz(left));
                if (b.children[firstB + i] != kNoChild)
                    lanes[lanesCount++] = {least[i], static_cast<std::uint16_t>(laneA), static_cast<std::uint16_t>(i)};
            }
            if ((refA & kLeafBit) != 0) {
                for (; count < lanesCount; ++count) next[count] = lanes[count];
            } else {
                firstA = refA * kWidth;
                for (unsigned k = 0; k < lanesCount; ++k) lanesOfA(lanes[k].laneB);
            }
        }
        sort(next, count);
        for (unsigned k = 0; k < count; ++k) {
            if (next[k].atLeast > sink.bound) return;
            if (sink.nodeTests + sink.triangleTests >= sink.limit) {
                sink.exhausted = true;
                return give(next[k].atLeast);
            }
            descend(firstA + next[k].laneA, firstB + next[k].laneB, *of);
            if (sink.exhausted && k + 1 < count) return give(next[k + 1].atLeast);
        }
    }

    static void walk(const TreeView& a, const TreeView& b, const PairFrame& f, SlotPair start, DistanceSink& sink) {
        Nearing nearing{a, b, f, sink};
        Block blockB;
        V::place(nearing.nodeB(start.b), f, f.bInA, blockB.row);
        nearing.descend(start.a, start.b, blockB);
    }
};
