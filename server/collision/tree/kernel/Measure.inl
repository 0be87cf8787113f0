// Between which bounds are the distances of eight pairs of triangles? In double: nearly always one pair alone is left
// to be measured. As the float version (Distance.inl), each edge with each and each corner with the other's plane, but
// with an error so small that it is taken as a millionth of all that takes part. Included by kernel/Kernels.inl only.

inline D least(D a, D b) {
    return -max(-a, -b);
}
inline D within01(D x) {
    return least(max(x, D{}), splatDouble(1.0));
}
/// x / y, and 0 for 0 / 0.
inline D quotient(D x, D y) {
    return x / max(y, splatDouble(1e-300));
}

/// As segments2. The way found is longer than the shortest by sqrt(8ε |b - a| |u|) at most, ε = 2^-53: 3e-8 of both.
inline D squareBetween(const W3& a, const W3& u, D uu, const W3& b, const W3& v, D vv) {
    const W3 r = a - b;
    const D uv = dot(u, v), ur = dot(u, r), vr = dot(v, r);
    const D s0 = within01(quotient(uv * vr - ur * vv, uu * vv - uv * uv));
    const D t = within01(quotient(uv * s0 + vr, vv));
    const D s = within01(quotient(uv * t - ur, uu));
    const W3 way{r.x + s * u.x - t * v.x, r.y + s * u.y - t * v.y, r.z + s * u.z - t * v.z};
    return dot(way, way);
}

struct MeasuredFace {
    W3 corner[3], edge[3];
    D edge2[3];
    W3 normal;
    D normal2;
    D sliver;  ///< 1 where the height is below a millionth of the size: then the plane is not looked at

    MeasuredFace(const W3& a, const W3& b, const W3& c) : corner{a, b, c}, edge{b - a, c - b, a - c} {
        for (unsigned i = 0; i < 3; ++i) edge2[i] = dot(edge[i], edge[i]);
        normal = cross(edge[0], edge[1]);
        normal2 = dot(normal, normal);
        const D size2 = max(max(edge2[0], edge2[1]), edge2[2]);
        // So small a normal has no square.
        sliver = pick(max(size2 * size2 * 1e-12, splatDouble(1e-280)) - normal2, D{}, splatDouble(1.0));
    }
    /// Squared distance to the plane where p is above the inside; else a large number.
    D above(const W3& p) const {
        const D s0 = dot(cross(edge[0], p - corner[0]), normal), s1 = dot(cross(edge[1], p - corner[1]), normal),
                s2 = dot(cross(edge[2], p - corner[2]), normal);
        const D height = dot(normal, p - corner[0]);
        const D outside = max(max(-s0, -s1), max(-s2, sliver));
        constexpr double kForbidden = 1e100;
        return height * height / max(normal2, splatDouble(1e-300)) + max(outside, D{}) * kForbidden;
    }
};

inline void measureEight(const Corners& ofA, const Corners& ofB, const PairMap& map, double* atLeast, double* atMost) {
    const W3 origin = ofA.corner(0);
    const auto fromB = [&](unsigned i) {
        return offset(mapped<D>(map.linear, ofB.corner(i)), map.translation) - origin;
    };
    const MeasuredFace a(W3{}, ofA.corner(1) - origin, ofA.corner(2) - origin), b(fromB(0), fromB(1), fromB(2));
    D square = max(a.above(b.corner[0]), D{});
    for (unsigned i = 0; i < 3; ++i) {
        square = least(square, least(a.above(b.corner[i]), b.above(a.corner[i])));
        for (unsigned j = 0; j < 3; ++j)
            square =
                least(square, squareBetween(a.corner[i], a.edge[i], a.edge2[i], b.corner[j], b.edge[j], b.edge2[j]));
    }
    D far = max(largest(a.corner[1]), largest(a.corner[2]));
    for (const W3& p : b.corner) far = max(far, largest(p));
    // Coordinates of B are as good as what they are computed from.
    const D moved = largest(offset(W3{}, map.translation));
    const D error = far * 1e-5 + max(largest(origin), moved) * 1e-14;
    alignas(64) double squares[kPairs], errors[kPairs];
    store(squares, square);
    store(errors, error);
    for (unsigned i = 0; i < kPairs; ++i) {
        // Of larger and of smaller numbers the sixth powers are none: nothing is known.
        const bool known = errors[i] > 1e-50 && errors[i] < 1e45;
        const double distance = __builtin_sqrt(squares[i]);
        atLeast[i] = known ? distance - errors[i] : -__builtin_inf();
        atMost[i] = known ? distance + errors[i] : __builtin_inf();
    }
}

inline void measurePairs(const MeshView& a, const MeshView& b, const PairMap& map, const std::uint32_t* facesA,
                         const std::uint32_t* facesB, std::uint32_t count, double* atLeast, double* atMost) {
    Corners ofA, ofB;
    for (std::uint32_t first = 0; first < count; first += kPairs) {
        const unsigned here = count - first < kPairs ? count - first : kPairs;
        ofA.gather(a, facesA + first, here);
        ofB.gather(b, facesB + first, here);
        measureEight(ofA, ofB, map, atLeast + first, atMost + first);
    }
}
