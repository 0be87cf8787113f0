// Four triangles against four: which of the sixteen pairs may meet? Float positions, each wrong by at most `slack`; a pair
// is dropped only where a plane of one triangle leaves the other wholly on one side by more than all rounding together.
// Included by kernel/Kernels.inl only.

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

/// The gap along one axis; negative where they overlap.
inline F between(F a, F b, F c, F p, F q, F r) {
    return max(min(min(a, b), c) - max(max(p, q), r), min(min(p, q), r) - max(max(a, b), c));
}
/// Their axis-aligned boxes are apart, for certain.
inline Bits boxesApart(const T3& a, const T3& b, F slack) {
    const F x = between(a.a.x, a.b.x, a.c.x, b.a.x, b.b.x, b.c.x), y = between(a.a.y, a.b.y, a.c.y, b.a.y, b.b.y, b.c.y),
            z = between(a.a.z, a.b.z, a.c.z, b.a.z, b.b.z, b.c.z);
    return greater(max(max(x, y), z), 2 * slack);
}

inline T3 spreadLeaf(const float* rows) {
    const auto row = [&](unsigned i) { return spread(load4(rows + i * kLeafFaces)); };
    return {{row(0), row(1), row(2)}, {row(3), row(4), row(5)}, {row(6), row(7), row(8)}};
}
inline T3 repeatLeaf(const float* rows, const PairFrame& f) {
    const auto row = [&](unsigned i) { return repeat(load4(rows + i * kLeafFaces)); };
    const auto corner = [&](unsigned i) { return offset(mapped(f.linear, V3{row(i), row(i + 1), row(i + 2)}), f.translation); };
    return {corner(0), corner(3), corner(6)};
}

/// Bit 4 i + j: triangle i of A's leaf may meet triangle j of B's.
inline Bits mayMeet(const float* rowsA, unsigned countA, const float* rowsB, unsigned countB, const PairFrame& f) {
    const Bits ofB = (1u << countB) - 1;
    const Bits both = (ofB * 0x1111u) & ((1u << 4 * countA) - 1);
    const T3 a = spreadLeaf(rowsA), b = repeatLeaf(rowsB, f);
    const F slack = splat(f.slack);
    Bits left = both & ~boxesApart(a, b, slack);
    if (left != 0) left &= ~beside(a, b, slack);
    if (left != 0) left &= ~beside(b, a, slack);
    return left;
}
