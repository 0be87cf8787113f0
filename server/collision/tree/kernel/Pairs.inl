// Do eight pairs of triangles meet? In double, with a bound of every error: what is decided here is what the exact
// predicate would say. Guigue and Devillers 2003, as in mesh/TriangleTriangle.cpp, where no orientation is near 0;
// other pairs are left undecided. Included by kernel/Kernels.inl only.

using W3 = Vector3<D>;

inline W3 pick(D test, const W3& whereNegative, const W3& otherwise) {
    return {pick(test, whereNegative.x, otherwise.x), pick(test, whereNegative.y, otherwise.y),
            pick(test, whereNegative.z, otherwise.z)};
}

constexpr unsigned kPairs = 8;  ///< at once

/// Corners of eight faces, rows as in a leaf.
struct alignas(64) Corners {
    double row[9 * kPairs];
    W3 corner(unsigned i) const {
        const double* const p = row + 3 * i * kPairs;
        return {loadDouble(p), loadDouble(p + kPairs), loadDouble(p + 2 * kPairs)};
    }
    void gather(const MeshView& mesh, const std::uint32_t* faces, unsigned count) {
        if (mesh.positions != nullptr)
            gatherFrom(mesh.positions, mesh.indices, faces, count);
        else
            gatherFrom(mesh.floats, mesh.indices, faces, count);
    }
    template <typename Scalar>
    TESSERA_INLINE void gatherFrom(const Scalar* positions, const std::uint32_t* indices, const std::uint32_t* faces,
                                   unsigned count) {
        for (unsigned lane = 0; lane < kPairs; ++lane) {
            const std::uint32_t* const index = indices + std::size_t{3} * faces[lane < count ? lane : 0];
            for (unsigned i = 0; i < 3; ++i) {
                const Scalar* const from = positions + std::size_t{3} * index[i];
                double* const to = row + 3 * i * kPairs + lane;
                to[0] = from[0];
                to[kPairs] = from[1];
                to[2 * kPairs] = from[2];
            }
        }
    }
};

/// Signs of three numbers that are certain: all on one side, or else which one is alone, and below.
struct Sides {
    Bits known, together;
    D zeroWithOne, zeroWithTwo;  ///< negative where they differ
    D alone;                     ///< the value of the one that is alone

    Sides(D d0, D d1, D d2, D doubt) {
        const Bits up0 = greater(d0, doubt), up1 = greater(d1, doubt), up2 = greater(d2, doubt);
        const Bits down0 = greater(-d0, doubt), down1 = greater(-d1, doubt), down2 = greater(-d2, doubt);
        known = (up0 | down0) & (up1 | down1) & (up2 | down2);
        together = (up0 & up1 & up2) | (down0 & down1 & down2);
        zeroWithOne = differ(d0, d1);
        zeroWithTwo = differ(d0, d2);
        alone = pick(zeroWithOne, pick(zeroWithTwo, d0, d1), d2);
    }
    /// The corners, the one that is alone first.
    void turn(W3& p, W3& q, W3& r) const {
        const W3 a = p, b = q, c = r;
        p = pick(zeroWithOne, pick(zeroWithTwo, a, b), c);
        q = pick(zeroWithOne, pick(zeroWithTwo, b, c), a);
        r = pick(zeroWithOne, pick(zeroWithTwo, c, a), b);
    }
};

/// (d - a) · ((b - a) × (c - a))
inline D orientation(const W3& a, const W3& b, const W3& c, const W3& d) {
    return dot(d - a, cross(b - a, c - a));
}

inline void decideEight(const Corners& ofA, const Corners& ofB, const PairMap& map, Bits& meeting, Bits& open) {
    const W3 origin = ofA.corner(0);
    const auto fromB = [&](unsigned i) {
        return offset(mapped<D>(map.linear, ofB.corner(i)), map.translation) - origin;
    };
    W3 a0{}, a1 = ofA.corner(1) - origin, a2 = ofA.corner(2) - origin;
    W3 b0 = fromB(0), b1 = fromB(1), b2 = fromB(2);
    const D far = max(max(max(largest(a1), largest(a2)), max(largest(b0), largest(b1))), largest(b2));
    const D doubt = far * far * map.doubt + 1e-270;

    const W3 normalA = cross(a1, a2);
    const Sides sidesB(dot(normalA, b0), dot(normalA, b1), dot(normalA, b2), doubt);
    const W3 normalB = cross(b1 - b0, b2 - b0);
    const Sides sidesA(-dot(normalB, b0), dot(normalB, a1 - b0), dot(normalB, a2 - b0), doubt);
    const Bits apart = sidesA.together | sidesB.together;
    const Bits crossing = sidesA.known & sidesB.known & ~apart;
    open = 0xffu & ~(crossing | apart);
    meeting = 0;
    if (crossing == 0) return;

    sidesA.turn(a0, a1, a2);
    sidesB.turn(b0, b1, b2);
    const W3 q2 = pick(sidesA.alone, b2, b1), r2 = pick(sidesA.alone, b1, b2);
    const W3 q1 = pick(sidesB.alone, a2, a1), r1 = pick(sidesB.alone, a1, a2);
    const D first = orientation(a0, q1, b0, q2), second = orientation(a0, r1, r2, b0);
    meeting = crossing & greater(-first, doubt) & greater(-second, doubt);
    open |= crossing & ~meeting & ~(greater(first, doubt) | greater(second, doubt));
}

/// Bit i of meeting[j], open[j]: pair 8 j + i.
inline void decidePairs(const MeshView& a, const MeshView& b, const PairMap& map, const std::uint32_t* facesA,
                        const std::uint32_t* facesB, std::uint32_t count, std::uint8_t* meeting, std::uint8_t* open) {
    Corners ofA, ofB;
    for (std::uint32_t first = 0; first < count; first += kPairs) {
        const unsigned here = count - first < kPairs ? count - first : kPairs;
        ofA.gather(a, facesA + first, here);
        ofB.gather(b, facesB + first, here);
        Bits meet, left;
        decideEight(ofA, ofB, map, meet, left);
        const Bits used = (1u << here) - 1;
        *meeting++ = static_cast<std::uint8_t>(meet & used);
        *open++ = static_cast<std::uint8_t>(left & used);
    }
}
