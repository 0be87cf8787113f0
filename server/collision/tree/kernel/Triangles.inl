// Four triangles against four: which of the sixteen pairs may meet? Float positions, each wrong by at most `slack`; a
// pair is dropped only where a plane of one triangle leaves the other wholly on one side by more than all rounding
// together. Included by kernel/Kernels.inl only.

struct T3 {
    V3 a, b, c;
};

/// Triangles of `other` that lie on one side of the plane of `plane`, for certain.
inline Bits beside(const T3& plane, const T3& other, F slack) {
    const V3 e = plane.b - plane.a, g = plane.c - plane.a;
    const V3 n = cross(e, g);
    const V3 p = other.a - plane.a, q = other.b - plane.a, r = other.c - plane.a;
    // An error of `slack` per corner moves e and g by 2 slack, n by 2 slack (|e| + |g|), p by 2 slack; all with the
    // rounding of these lines, which is below slack itself.
    const F edges = (taxicab(e) + taxicab(g)) * (4 * slack), way = taxicab(n) * (4 * slack);
    const F dp = dot(n, p), dq = dot(n, q), dr = dot(n, r);
    const F far = max(max(taxicab(p), taxicab(q)), taxicab(r));
    const F bound = edges * far + way;
    return greater(min(min(dp, dq), dr), bound) | greater(-max(max(dp, dq), dr), bound);
}

inline T3 spreadLeaf(const float* rows) {
    const auto row = [&](unsigned i) { return spread(load4(rows + i * kLeafFaces)); };
    return {{row(0), row(1), row(2)}, {row(3), row(4), row(5)}, {row(6), row(7), row(8)}};
}
inline T3 repeatLeaf(const float* rows, const PairFrame& f) {
    const auto row = [&](unsigned i) { return repeat(load4(rows + i * kLeafFaces)); };
    const auto corner = [&](unsigned i) {
        return offset(mapped(f.linear, V3{row(i), row(i + 1), row(i + 2)}), f.translation);
    };
    return {corner(0), corner(3), corner(6)};
}

/// The axis-aligned boxes of a leaf's triangles.
struct Boxes4 {
    F4 low[3], high[3];
};
TESSERA_INLINE void boxAlong(unsigned axis, F4 a, F4 b, F4 c, Boxes4& boxes) {
    boxes.low[axis] = min(min(a, b), c);
    boxes.high[axis] = max(max(a, b), c);
}

/// Between two planes across the mean normal of a leaf of B, in A's frame. Leaves are flat mostly, and of two that lie
/// close to each other this parts most that k-DOPs along other directions do not, before their triangles are looked at.
struct LeafSlab {
    F4 normal[3], low, high;

    LeafSlab() = default;
    /// `at(i)`: row i of the leaf's corners. Positions are wrong by at most `slack`, dot products by less than that;
    /// what is added is for products that underflow.
    template <typename Row>
    TESSERA_INLINE LeafSlab(const Row& at, float slack) {
        const auto edge = [&](unsigned corner, unsigned axis) { return at(corner + axis) - at(axis); };
        float size = 0;
        for (unsigned axis = 0; axis < 3; ++axis) {
            const unsigned y = (axis + 1) % 3, z = (axis + 2) % 3;
            const F4 square = edge(3, y) * edge(6, z) - edge(3, z) * edge(6, y);
            const float mean = (square[0] + square[2]) + (square[1] + square[3]);
            normal[axis] = F4{} + mean;
            size += mean < 0 ? -mean : mean;
        }
        const F4 p = along(at, 0), q = along(at, 3), r = along(at, 6);
        F4 least = min(min(p, q), r), most = max(max(p, q), r);
        least = min(least, __builtin_shufflevector(least, least, 2, 3, 0, 1));
        most = max(most, __builtin_shufflevector(most, most, 2, 3, 0, 1));
        const float wide = size * (4 * slack) + 1e-30f;
        low = min(least, __builtin_shufflevector(least, least, 1, 0, 3, 2)) - wide;
        high = max(most, __builtin_shufflevector(most, most, 1, 0, 3, 2)) + wide;
    }
    template <typename Row>
    TESSERA_INLINE F4 along(const Row& at, unsigned corner) const {
        return normal[0] * at(corner) + normal[1] * at(corner + 1) + normal[2] * at(corner + 2);
    }
    /// A leaf of A is on one side of it.
    TESSERA_INLINE bool apartFrom(const float* leafA) const {
        const auto row = [&](unsigned i) { return load4(leafA + i * kLeafFaces); };
        const F4 p = along(row, 0), q = along(row, 3), r = along(row, 6);
        return allGreater(min(min(p, q), r), high) || allGreater(low, max(max(p, q), r));
    }
    TESSERA_INLINE static bool allGreater(F4 a, F4 b) { return _mm_movemask_ps(_mm_cmpgt_ps(a, b)) == 0xf; }
};

/// A leaf of B in A's frame: its corners and their boxes, repeated for the four triangles of a leaf of A.
struct PlacedLeaf {
    alignas(16) float rows[kLeafRows * kLeafFaces];
    V3 low, high;
    LeafSlab slab;

    void place(const float* leaf, const PairFrame& f, F slack) {
        const auto row = [&](unsigned i) { return load4(leaf + i * kLeafFaces); };
        Boxes4 boxes;
        for (unsigned axis = 0; axis < 3; ++axis) {
            const float* const m = f.linear + 3 * axis;
            const auto place = [&](unsigned corner) {
                const F4 p =
                    m[0] * row(corner) + m[1] * row(corner + 1) + (m[2] * row(corner + 2) + f.translation[axis]);
                *reinterpret_cast<F4*>(rows + (corner + axis) * kLeafFaces) = p;
                return p;
            };
            boxAlong(axis, place(0), place(3), place(6), boxes);
        }
        low = V3{repeat(boxes.low[0]), repeat(boxes.low[1]), repeat(boxes.low[2])};
        high = V3{repeat(boxes.high[0]), repeat(boxes.high[1]), repeat(boxes.high[2])};
        low = {low.x - slack, low.y - slack, low.z - slack};
        high = {high.x + slack, high.y + slack, high.z + slack};
        slab = LeafSlab([&](unsigned i) { return load4(rows + i * kLeafFaces); }, f.slack);
    }
    T3 corners() const {
        const auto row = [&](unsigned i) { return repeat(load4(rows + i * kLeafFaces)); };
        return {{row(0), row(1), row(2)}, {row(3), row(4), row(5)}, {row(6), row(7), row(8)}};
    }
};

/// Bit 4 i + j: triangle i of A's leaf may meet triangle j of B's.
inline Bits mayMeet(const float* leafA, unsigned countA, const PlacedLeaf& b, unsigned countB, F slack) {
    if (b.slab.apartFrom(leafA)) return 0;
    const auto row = [&](unsigned i) { return load4(leafA + i * kLeafFaces); };
    Boxes4 boxes;
    for (unsigned axis = 0; axis < 3; ++axis) boxAlong(axis, row(axis), row(axis + 3), row(axis + 6), boxes);
    const V3 low{spread(boxes.low[0]), spread(boxes.low[1]), spread(boxes.low[2])};
    const V3 high{spread(boxes.high[0]), spread(boxes.high[1]), spread(boxes.high[2])};
    const V3 above = low - b.high, below = b.low - high;
    const F gap = max(max(max(above.x, above.y), above.z), max(max(below.x, below.y), below.z));
    const Bits ofB = (1u << countB) - 1;
    Bits left = (ofB * 0x1111u) & ((1u << 4 * countA) - 1) & ~greater(gap, slack);
    if (left == 0) return 0;
    const T3 ta = spreadLeaf(leafA), tb = b.corners();
    left &= ~beside(ta, tb, slack);
    if (left != 0) left &= ~beside(tb, ta, slack);
    return left;
}
