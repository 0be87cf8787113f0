// Bounding volumes around the triangles below every slot, from the leaves up. A node's slots that are leaves are fitted
// side by side, a leaf per lane; of a slot with a subtree either the volumes of the children are joined (k-DOPs), or all
// corners below are looked at again, four to a leaf and some leaves side by side. Included by kernel/Kernels.inl only.
//
// Positions are floats of at most 1 in size, each coordinate wrong by half a unit in the last place; with u = 2^-24 what
// is computed from them is wrong by some u, and volumes are widened by that.

using P = FloatPart;
using P3 = Vector3<P>;
constexpr unsigned kLanes = Lanes<P>::kCount;
constexpr unsigned kLeafSize = kLeafRows * kLeafFaces;
constexpr float kUnitRoundoff = 0x1p-24f;
/// Where there is no child: overlaps nothing.
constexpr float kNever = -1e30f;

TESSERA_INLINE P splatPart(float x) { return Lanes<P>::splat(x); }
TESSERA_INLINE P loadPart(const float* p) { return Lanes<P>::load(p); }
TESSERA_INLINE void storePart(float* p, P x) { Lanes<P>::store(p, x); }

/// Four floats from each of some places, and 4 x 4 blocks turned over.
#if defined(__AVX512F__)
TESSERA_INLINE P join(const float* const* at) {
    const __m512 one = _mm512_castps128_ps512(_mm_load_ps(at[0]));
    const __m512 two = _mm512_maskz_insertf32x4(0xffff, one, _mm_load_ps(at[1]), 1);
    const __m512 three = _mm512_maskz_insertf32x4(0xffff, two, _mm_load_ps(at[2]), 2);
    return reinterpret_cast<P>(_mm512_maskz_insertf32x4(0xffff, three, _mm_load_ps(at[3]), 3));
}
TESSERA_INLINE void transpose(P (&v)[4]) {
    const __m512 a = reinterpret_cast<__m512>(v[0]), b = reinterpret_cast<__m512>(v[1]), c = reinterpret_cast<__m512>(v[2]),
                 d = reinterpret_cast<__m512>(v[3]);
    const __m512 ab = _mm512_maskz_unpacklo_ps(0xffff, a, b), AB = _mm512_maskz_unpackhi_ps(0xffff, a, b),
                 cd = _mm512_maskz_unpacklo_ps(0xffff, c, d), CD = _mm512_maskz_unpackhi_ps(0xffff, c, d);
    v[0] = reinterpret_cast<P>(_mm512_maskz_shuffle_ps(0xffff, ab, cd, 0x44));
    v[1] = reinterpret_cast<P>(_mm512_maskz_shuffle_ps(0xffff, ab, cd, 0xee));
    v[2] = reinterpret_cast<P>(_mm512_maskz_shuffle_ps(0xffff, AB, CD, 0x44));
    v[3] = reinterpret_cast<P>(_mm512_maskz_shuffle_ps(0xffff, AB, CD, 0xee));
}
#elif defined(__AVX2__)
TESSERA_INLINE P join(const float* const* at) {
    return _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_load_ps(at[0])), _mm_load_ps(at[1]), 1);
}
TESSERA_INLINE void transpose(P (&v)[4]) {
    const __m256 ab = _mm256_unpacklo_ps(v[0], v[1]), AB = _mm256_unpackhi_ps(v[0], v[1]), cd = _mm256_unpacklo_ps(v[2], v[3]),
                 CD = _mm256_unpackhi_ps(v[2], v[3]);
    v[0] = _mm256_shuffle_ps(ab, cd, 0x44);
    v[1] = _mm256_shuffle_ps(ab, cd, 0xee);
    v[2] = _mm256_shuffle_ps(AB, CD, 0x44);
    v[3] = _mm256_shuffle_ps(AB, CD, 0xee);
}
#else
TESSERA_INLINE P join(const float* const* at) { return _mm_load_ps(at[0]); }
TESSERA_INLINE void transpose(P (&v)[4]) {
    const __m128 ab = _mm_unpacklo_ps(v[0], v[1]), AB = _mm_unpackhi_ps(v[0], v[1]), cd = _mm_unpacklo_ps(v[2], v[3]),
                 CD = _mm_unpackhi_ps(v[2], v[3]);
    v[0] = _mm_movelh_ps(ab, cd);
    v[1] = _mm_movehl_ps(cd, ab);
    v[2] = _mm_movelh_ps(AB, CD);
    v[3] = _mm_movehl_ps(CD, AB);
}
#endif

/// The corners of as many leaves as there are lanes.
struct LeafLanes {
    P row[kLeafFaces][kLeafRows];
    P count;  ///< triangles of each; what is behind them repeats the first

    void gather(const float* const* leaf, const float* counts) {
        for (unsigned r = 0; r < kLeafRows; ++r) {
            P v[4];
            for (unsigned k = 0; k < 4; ++k) {
                const float* at[kLanes / 4];
                for (unsigned g = 0; g < kLanes / 4; ++g) at[g] = leaf[4 * g + k] + r * kLeafFaces;
                v[k] = join(at);
            }
            transpose(v);
            for (unsigned i = 0; i < kLeafFaces; ++i) row[i][r] = v[i];
        }
        count = loadPart(counts);
    }
    [[nodiscard]] TESSERA_INLINE P3 corner(unsigned face, unsigned i) const {
        const P* const p = row[face] + 3 * i;
        return {p[0], p[1], p[2]};
    }
    template <typename Use>
    TESSERA_INLINE void forCorners(const Use& use) const {
        for (unsigned face = 0; face < kLeafFaces; ++face)
            for (unsigned i = 0; i < 3; ++i) use(corner(face, i));
    }
};

/// All corners of some leaves one after another, lanes of them at a time; the last leaf may be seen twice.
template <typename Use>
TESSERA_INLINE void forCornersOf(const float* corners, std::uint32_t firstLeaf, std::uint32_t endLeaf, const Use& use) {
    for (std::uint32_t leaf = firstLeaf; leaf < endLeaf; leaf += kLanes / 4) {
        const float* at[kLanes / 4];
        for (std::uint32_t g = 0; g < kLanes / 4; ++g)
            at[g] = corners + std::size_t{leaf + g < endLeaf ? leaf + g : endLeaf - 1} * kLeafSize;
        for (unsigned i = 0; i < 3; ++i) {
            P x[3];
            for (P& coordinate : x) {
                coordinate = join(at);
                for (const float*& p : at) p += kLeafFaces;
            }
            use(P3{x[0], x[1], x[2]});
        }
    }
}

TESSERA_INLINE float largestLane(P x) {
    alignas(64) float lane[kLanes];
    storePart(lane, x);
    float most = lane[0];
    for (unsigned i = 1; i < kLanes; ++i) most = lane[i] > most ? lane[i] : most;
    return most;
}
TESSERA_INLINE float sumOfLanes(P x) {
    alignas(64) float lane[kLanes];
    storePart(lane, x);
    float sum = 0;
    for (unsigned i = 0; i < kLanes; ++i) sum += lane[i];
    return sum;
}
TESSERA_INLINE P halfArea(const P3& size) { return size.x * size.y + size.y * size.z + size.z * size.x; }

/// What the slots of one node are: which lanes are leaves, and where.
struct SlotLanes {
    const float* leaf[kWidth];  ///< corners; of lanes that are none the last leaf's
    alignas(64) float counts[kWidth];
    Bits leaves = 0, subtrees = 0;
    std::uint32_t firstLeaf = ~0u, endLeaf = 0;

    SlotLanes(const FitJob& job, std::uint32_t node) {
        const ChildRef* const refs = job.children + std::size_t{node} * kWidth;
        const float* some = job.corners;
        for (unsigned lane = 0; lane < kWidth; ++lane) {
            const ChildRef ref = refs[lane];
            counts[lane] = 0;
            if (ref == kNoChild) {
                leaf[lane] = some;
                continue;
            }
            std::uint32_t first, end;
            if ((ref & kLeafBit) != 0) {
                first = (ref & ~kLeafBit) >> 2;
                end = first + 1;
                some = job.corners + std::size_t{first} * kLeafSize;
                counts[lane] = static_cast<float>((ref & 3) + 1);
                leaves |= 1u << lane;
            } else {
                first = job.nodes[ref].firstLeaf;
                end = job.nodes[ref].endLeaf;
                subtrees |= 1u << lane;
            }
            leaf[lane] = some;
            firstLeaf = first < firstLeaf ? first : firstLeaf;
            endLeaf = end > endLeaf ? end : endLeaf;
        }
    }
    [[nodiscard]] Bits used() const { return leaves | subtrees; }
    [[nodiscard]] static Bits ofPart(Bits lanes, unsigned part) { return lanes >> part * kLanes & ((1u << kLanes) - 1); }
};

template <typename Use>
TESSERA_INLINE void forLanes(Bits lanes, const Use& use) {
    for (; lanes != 0; lanes &= lanes - 1) use(static_cast<unsigned>(__builtin_ctz(lanes)));
}

template <unsigned K>
struct DopFit {
    static constexpr unsigned kRows = K, kHalf = K / 2;
    /// Three coordinates, each wrong by u, and two sums of at most 3 of them: less than 7 u with this one's own rounding.
    static constexpr float kPad = 8 * kUnitRoundoff;

    TESSERA_INLINE static void project(const P3& p, P (&out)[kHalf]) {
        const P x = p.x, y = p.y, z = p.z;
        out[0] = x;
        out[1] = y;
        out[2] = z;
        if constexpr (K == 18 || K == 26) {
            out[3] = x + y;
            out[4] = x - y;
            out[5] = x + z;
            out[6] = x - z;
            out[7] = y + z;
            out[8] = y - z;
        }
        if constexpr (K == 14 || K == 26) {
            const P plus = x + y, minus = x - y;
            out[kHalf - 4] = plus + z;
            out[kHalf - 3] = plus - z;
            out[kHalf - 2] = minus + z;
            out[kHalf - 1] = minus - z;
        }
    }

    static void leafLanes(const LeafLanes& leaves, float* rows) {
        P low[kHalf], high[kHalf];
        project(leaves.corner(0, 0), low);
        for (unsigned i = 0; i < kHalf; ++i) high[i] = low[i];
        leaves.forCorners([&](const P3& p) {
            P at[kHalf];
            project(p, at);
            for (unsigned i = 0; i < kHalf; ++i) {
                low[i] = min(low[i], at[i]);
                high[i] = max(high[i], at[i]);
            }
        });
        for (unsigned i = 0; i < kHalf; ++i) {
            storePart(rows + i * kWidth, high[i] + kPad);
            storePart(rows + (i + kHalf) * kWidth, kPad - low[i]);
        }
    }

    /// The largest of each of four rows; empty slots are far below the others.
    TESSERA_INLINE static __m128 fourLargest(const float* const* rows) {
        __m128 v[4];
        for (unsigned i = 0; i < 4; ++i)
            v[i] = _mm_max_ps(_mm_max_ps(_mm_load_ps(rows[i]), _mm_load_ps(rows[i] + 4)),
                              _mm_max_ps(_mm_load_ps(rows[i] + 8), _mm_load_ps(rows[i] + 12)));
        const __m128 ab = _mm_max_ps(_mm_unpacklo_ps(v[0], v[1]), _mm_unpackhi_ps(v[0], v[1])),
                     cd = _mm_max_ps(_mm_unpacklo_ps(v[2], v[3]), _mm_unpackhi_ps(v[2], v[3]));
        return _mm_max_ps(_mm_movelh_ps(ab, cd), _mm_movehl_ps(cd, ab));
    }

    static void fit(const FitJob& job, const SlotLanes& slots, std::uint32_t node, float* rows) {
        for (unsigned part = 0; part < kWidth / kLanes; ++part) {
            const Bits lanes = SlotLanes::ofPart(slots.leaves, part);
            if (lanes == 0) continue;
            LeafLanes leaves;
            leaves.gather(slots.leaf + part * kLanes, slots.counts + part * kLanes);
            leafLanes(leaves, rows + part * kLanes);
        }
        forLanes(slots.subtrees, [&](unsigned lane) {
            const float* const below = job.volumes + std::size_t{job.children[std::size_t{node} * kWidth + lane]} * kRows * kWidth;
            for (unsigned row = 0; row < kRows; row += 4) {
                const float* four[4];
                for (unsigned i = 0; i < 4; ++i) four[i] = below + (row + i < kRows ? row + i : kRows - 1) * kWidth;
                alignas(16) float most[4];
                _mm_store_ps(most, fourLargest(four));
                for (unsigned i = 0; i < 4 && row + i < kRows; ++i) rows[(row + i) * kWidth + lane] = most[i];
            }
        });
        forLanes(~slots.used() & 0xffffu, [&](unsigned lane) {
            for (unsigned row = 0; row < kRows; ++row) rows[row * kWidth + lane] = kNever;
        });
    }

    /// The surface of its axis-aligned box.
    TESSERA_INLINE static P size(const float* rows) {
        const auto side = [&](unsigned i) { return loadPart(rows + i * kWidth) + loadPart(rows + (i + kHalf) * kWidth); };
        return halfArea({side(0), side(1), side(2)}) * 2.0f;
    }
};

/// The surface below a slot: area, centre and second moments about the centre (xx yy zz xy xz yz) over the area.
struct Moments {
    P area;
    P3 mean;
    P spread[6];

    void ofLeaves(const LeafLanes& leaves) {
        const P3 origin = leaves.corner(0, 0);
        area = splatPart(0);
        P3 sum{area, area, area};
        for (P& s : spread) s = area;
        for (unsigned face = 0; face < kLeafFaces; ++face) {
            const P3 a = leaves.corner(face, 0) - origin, b = leaves.corner(face, 1) - origin, c = leaves.corner(face, 2) - origin;
            const P3 e = b - a, g = c - a, n = cross(e, g), s = a + b + c;
            // A little for the edges, so that triangles without area count.
            P weight = sqrt(dot(n, n)) + (dot(e, e) + dot(g, g)) * 1e-4f;
            weight = choose(leaves.count - static_cast<float>(face), weight, splatPart(0));
            area += weight;
            const P third = weight * (1.0f / 3), twelfth = weight * (1.0f / 12);
            sum = {sum.x + third * s.x, sum.y + third * s.y, sum.z + third * s.z};
            spread[0] += twelfth * (s.x * s.x + a.x * a.x + b.x * b.x + c.x * c.x);
            spread[1] += twelfth * (s.y * s.y + a.y * a.y + b.y * b.y + c.y * c.y);
            spread[2] += twelfth * (s.z * s.z + a.z * a.z + b.z * b.z + c.z * c.z);
            spread[3] += twelfth * (s.x * s.y + a.x * a.y + b.x * b.y + c.x * c.y);
            spread[4] += twelfth * (s.x * s.z + a.x * a.z + b.x * b.z + c.x * c.z);
            spread[5] += twelfth * (s.y * s.z + a.y * a.z + b.y * b.z + c.y * c.z);
        }
        const P over = 1.0f / max(area, splatPart(1e-37f));
        mean = {sum.x * over, sum.y * over, sum.z * over};
        const P square[6] = {mean.x * mean.x, mean.y * mean.y, mean.z * mean.z, mean.x * mean.y, mean.x * mean.z, mean.y * mean.z};
        for (unsigned i = 0; i < 6; ++i) spread[i] = spread[i] * over - square[i];
        mean = mean + origin;
    }

    /// Of all lanes together; `part` of them per register.
    static void together(const float (*lanes)[kWidth], float* out) {
        P area = splatPart(0), x = area, y = area, z = area;
        for (unsigned at = 0; at < kWidth; at += kLanes) {
            const P weight = loadPart(lanes[0] + at);
            area += weight;
            x += weight * loadPart(lanes[1] + at);
            y += weight * loadPart(lanes[2] + at);
            z += weight * loadPart(lanes[3] + at);
        }
        out[0] = sumOfLanes(area);
        const float over = 1 / (out[0] > 1e-37f ? out[0] : 1e-37f);
        out[1] = sumOfLanes(x) * over;
        out[2] = sumOfLanes(y) * over;
        out[3] = sumOfLanes(z) * over;
        P spread[6] = {splatPart(0), splatPart(0), splatPart(0), splatPart(0), splatPart(0), splatPart(0)};
        for (unsigned at = 0; at < kWidth; at += kLanes) {
            const P weight = loadPart(lanes[0] + at);
            const P3 d{loadPart(lanes[1] + at) - out[1], loadPart(lanes[2] + at) - out[2], loadPart(lanes[3] + at) - out[3]};
            const P square[6] = {d.x * d.x, d.y * d.y, d.z * d.z, d.x * d.y, d.x * d.z, d.y * d.z};
            for (unsigned i = 0; i < 6; ++i) spread[i] += weight * (loadPart(lanes[4 + i] + at) + square[i]);
        }
        for (unsigned i = 0; i < 6; ++i) out[4 + i] = sumOfLanes(spread[i]) * over;
    }
};

/// One Jacobi rotation of a symmetric matrix: makes `pq` vanish. `pr`, `qr` are the other two beside it; p, q are rows of
/// the transposed eigenvectors.
TESSERA_INLINE void rotate(P& pp, P& qq, P& pq, P& pr, P& qr, P3& p, P3& q) {
    const P half = (qq - pp) * 0.5f;
    const P root = sqrt(half * half + pq * pq) + 1e-30f;
    const P t = choose(half, pq, -pq) / (abs(half) + root);  // the smaller of both angles' tangents
    const P c = 1.0f / sqrt(t * t + 1.0f), s = t * c;
    pp -= t * pq;
    qq += t * pq;
    pq = splatPart(0);
    const P r = pr;
    pr = c * r - s * qr;
    qr = s * r + c * qr;
    const P3 v = p;
    p = {c * v.x - s * q.x, c * v.y - s * q.y, c * v.z - s * q.z};
    q = {s * v.x + c * q.x, s * v.y + c * q.y, s * v.z + c * q.z};
}

struct ObbFit {
    static constexpr unsigned kRows = 15;
    /// A projection of a position of length 1 and of the box's centre, of length √3: 3 (1 + √3) u; their difference, of at
    /// most 2.8; the position itself: all below 13 u.
    static constexpr float kPad = 16 * kUnitRoundoff;
    /// Of the box's own size: its axes are unit and orthogonal to some u.
    static constexpr float kPadOfSize = 8 * kUnitRoundoff;

    /// Principal axes (Gottschalk, Lin, Manocha 1996), by so many Jacobi sweeps as float needs; orthonormal to rounding.
    static void axesOf(const Moments& moments, P3 (&axes)[3]) {
        const P scale = 1.0f / (moments.spread[0] + moments.spread[1] + moments.spread[2] + 1e-37f);
        P m[6];
        for (unsigned i = 0; i < 6; ++i) m[i] = moments.spread[i] * scale;
        const P one = splatPart(1), none = splatPart(0);
        P3 x{one, none, none}, y{none, one, none}, z{none, none, one};
        for (unsigned sweep = 0; sweep < 4; ++sweep) {
            rotate(m[0], m[1], m[3], m[4], m[5], x, y);
            rotate(m[0], m[2], m[4], m[3], m[5], x, z);
            rotate(m[1], m[2], m[5], m[3], m[4], y, z);
        }
        const P ofX = 1.0f / sqrt(dot(x, x));
        x = {x.x * ofX, x.y * ofX, x.z * ofX};
        const P along = dot(x, y);
        y = {y.x - along * x.x, y.y - along * x.y, y.z - along * x.z};
        const P ofY = 1.0f / sqrt(dot(y, y));
        y = {y.x * ofY, y.y * ofY, y.z * ofY};
        axes[0] = x;
        axes[1] = y;
        axes[2] = cross(x, y);
    }

    /// Extents along principal axes (0 to 2) and the model's own (3 to 5).
    struct Extents {
        P low[6], high[6];
        TESSERA_INLINE explicit Extents(const P3& p, const P3 (&axes)[3]) {
            at(p, axes, low);
            for (unsigned i = 0; i < 6; ++i) high[i] = low[i];
        }
        TESSERA_INLINE static void at(const P3& p, const P3 (&axes)[3], P (&out)[6]) {
            for (unsigned i = 0; i < 3; ++i) out[i] = dot(axes[i], p);
            out[3] = p.x;
            out[4] = p.y;
            out[5] = p.z;
        }
        TESSERA_INLINE void extend(const P3& p, const P3 (&axes)[3]) {
            P x[6];
            at(p, axes, x);
            for (unsigned i = 0; i < 6; ++i) {
                low[i] = min(low[i], x[i]);
                high[i] = max(high[i], x[i]);
            }
        }
    };

    /// Rows for all slots of a part, before the box of smaller surface is chosen.
    struct Table {
        alignas(64) float axes[9][kWidth];
        alignas(64) float low[6][kWidth], high[6][kWidth];
    };

    static void fit(const FitJob& job, const SlotLanes& slots, std::uint32_t node, float* rows) {
        alignas(64) float moments[10][kWidth];
        Table table;
        for (unsigned at = 0; at < kWidth; at += kLanes) {
            const unsigned part = at / kLanes;
            LeafLanes leaves;
            const bool anyLeaf = SlotLanes::ofPart(slots.leaves, part) != 0, anySubtree = SlotLanes::ofPart(slots.subtrees, part) != 0;
            if (!anyLeaf && !anySubtree) {
                for (float(&row)[kWidth] : moments) storePart(row + at, splatPart(0));
                continue;
            }
            Moments m{};
            if (anyLeaf) {
                leaves.gather(slots.leaf + at, slots.counts + at);
                m.ofLeaves(leaves);
            }
            storePart(moments[0] + at, m.area);
            storePart(moments[1] + at, m.mean.x);
            storePart(moments[2] + at, m.mean.y);
            storePart(moments[3] + at, m.mean.z);
            for (unsigned i = 0; i < 6; ++i) storePart(moments[4 + i] + at, m.spread[i]);
            if (anySubtree) {
                forLanes(SlotLanes::ofPart(slots.subtrees, part), [&](unsigned lane) {
                    const FitNode& below = job.nodes[job.children[std::size_t{node} * kWidth + at + lane]];
                    for (unsigned i = 0; i < 10; ++i) moments[i][at + lane] = below.moments[i];
                });
                for (unsigned i = 0; i < 6; ++i) m.spread[i] = loadPart(moments[4 + i] + at);
            }
            P3 axes[3];
            axesOf(m, axes);
            for (unsigned i = 0; i < 3; ++i) {
                storePart(table.axes[3 * i] + at, axes[i].x);
                storePart(table.axes[3 * i + 1] + at, axes[i].y);
                storePart(table.axes[3 * i + 2] + at, axes[i].z);
            }
            if (anyLeaf) {
                Extents extents(leaves.corner(0, 0), axes);
                leaves.forCorners([&](const P3& p) { extents.extend(p, axes); });
                for (unsigned i = 0; i < 6; ++i) {
                    storePart(table.low[i] + at, extents.low[i]);
                    storePart(table.high[i] + at, extents.high[i]);
                }
            }
            forLanes(SlotLanes::ofPart(slots.subtrees, part), [&](unsigned lane) { around(job, node, at + lane, table); });
            finish(table, at, rows);
        }
        Moments::together(moments, job.nodes[node].moments);
        forLanes(~slots.used() & 0xffffu, [&](unsigned lane) {
            for (unsigned row = 0; row < kRows; ++row) rows[row * kWidth + lane] = row < 12 ? 0 : kNever;
        });
    }

    /// The extents of one slot's subtree.
    static void around(const FitJob& job, std::uint32_t node, unsigned lane, Table& table) {
        const FitNode& below = job.nodes[job.children[std::size_t{node} * kWidth + lane]];
        P3 axes[3];
        for (unsigned i = 0; i < 3; ++i)
            axes[i] = {splatPart(table.axes[3 * i][lane]), splatPart(table.axes[3 * i + 1][lane]), splatPart(table.axes[3 * i + 2][lane])};
        const float* const first = job.corners + std::size_t{below.firstLeaf} * kLeafSize;
        Extents extents({splatPart(first[0]), splatPart(first[kLeafFaces]), splatPart(first[2 * kLeafFaces])}, axes);
        forCornersOf(job.corners, below.firstLeaf, below.endLeaf, [&](const P3& p) { extents.extend(p, axes); });
        for (unsigned i = 0; i < 6; ++i) {
            table.low[i][lane] = -largestLane(-extents.low[i]);
            table.high[i][lane] = largestLane(extents.high[i]);
        }
    }

    static void finish(const Table& table, unsigned at, float* rows) {
        P low[6], high[6], axes[9];
        for (unsigned i = 0; i < 6; ++i) {
            low[i] = loadPart(table.low[i] + at);
            high[i] = loadPart(table.high[i] + at);
        }
        const P principal = halfArea({high[0] - low[0], high[1] - low[1], high[2] - low[2]}),
                own = halfArea({high[3] - low[3], high[4] - low[4], high[5] - low[5]});
        const P better = own - principal;  // no number where there are no principal axes
        for (unsigned i = 0; i < 9; ++i)
            axes[i] = choose(better, loadPart(table.axes[i] + at), splatPart(i % 4 == 0 ? 1 : 0));
        P3 centre{splatPart(0), splatPart(0), splatPart(0)};
        for (unsigned i = 0; i < 3; ++i) {
            low[i] = choose(better, low[i], low[i + 3]);
            high[i] = choose(better, high[i], high[i + 3]);
            const P middle = (low[i] + high[i]) * 0.5f;
            centre = {centre.x + middle * axes[3 * i], centre.y + middle * axes[3 * i + 1], centre.z + middle * axes[3 * i + 2]};
        }
        storePart(rows + at, centre.x);
        storePart(rows + kWidth + at, centre.y);
        storePart(rows + 2 * kWidth + at, centre.z);
        P half[3];
        for (unsigned i = 0; i < 3; ++i) {
            const P3 axis{axes[3 * i], axes[3 * i + 1], axes[3 * i + 2]};
            const P middle = dot(axis, centre);
            half[i] = max(high[i] - middle, middle - low[i]);
            storePart(rows + (3 + 3 * i) * kWidth + at, axis.x);
            storePart(rows + (4 + 3 * i) * kWidth + at, axis.y);
            storePart(rows + (5 + 3 * i) * kWidth + at, axis.z);
        }
        const P pad = (half[0] + half[1] + half[2]) * kPadOfSize + kPad;
        for (unsigned i = 0; i < 3; ++i) storePart(rows + (12 + i) * kWidth + at, half[i] + pad);
    }

    TESSERA_INLINE static P size(const float* rows) {
        return halfArea({loadPart(rows + 12 * kWidth), loadPart(rows + 13 * kWidth), loadPart(rows + 14 * kWidth)}) * 8.0f;
    }
};

struct SphereFit {
    static constexpr unsigned kRows = 4;
    /// A distance of at most 2: its coordinates, of three positions' roundings, then squares, sum and root.
    static constexpr float kPad = 16 * kUnitRoundoff;
    static constexpr unsigned kSteps = 12;

    /// Badoiu and Clarkson 2003: the centre goes to the farthest point by ever shorter steps; the best place is kept.
    /// farthest(centre, place) says how far the farthest corner is (squared) and where.
    template <typename Farthest>
    TESSERA_INLINE static void around(P3 centre, const Farthest& farthest, P (&out)[4]) {
        P least = splatPart(3e38f);
        P3 best = centre;
        for (unsigned step = 0; step < kSteps; ++step) {
            P3 place = centre;
            const P away = farthest(centre, place);
            const P better = least - away;
            least = choose(better, away, least);
            best = {choose(better, centre.x, best.x), choose(better, centre.y, best.y), choose(better, centre.z, best.z)};
            const float way = 1.0f / static_cast<float>(step + 2);
            centre = {centre.x + (place.x - centre.x) * way, centre.y + (place.y - centre.y) * way, centre.z + (place.z - centre.z) * way};
        }
        out[0] = best.x;
        out[1] = best.y;
        out[2] = best.z;
        out[3] = sqrt(least) * (1 + 8 * kUnitRoundoff) + kPad;
    }

    struct Far {
        P3 centre;
        P away = splatPart(-1);
        P3 place;
        TESSERA_INLINE void look(const P3& p) {
            const P3 d = p - centre;
            const P square = dot(d, d), farther = square - away;
            away = max(away, square);
            place = {choose(farther, p.x, place.x), choose(farther, p.y, place.y), choose(farther, p.z, place.z)};
        }
    };

    static void fit(const FitJob& job, const SlotLanes& slots, std::uint32_t node, float* rows) {
        for (unsigned at = 0; at < kWidth; at += kLanes) {
            if (SlotLanes::ofPart(slots.leaves, at / kLanes) == 0) continue;
            LeafLanes leaves;
            leaves.gather(slots.leaf + at, slots.counts + at);
            P3 low = leaves.corner(0, 0), high = low;
            leaves.forCorners([&](const P3& p) {
                low = {min(low.x, p.x), min(low.y, p.y), min(low.z, p.z)};
                high = {max(high.x, p.x), max(high.y, p.y), max(high.z, p.z)};
            });
            P out[4];
            around({(low.x + high.x) * 0.5f, (low.y + high.y) * 0.5f, (low.z + high.z) * 0.5f},
                   [&](const P3& centre, P3& place) {
                       Far far{centre, splatPart(-1), centre};
                       leaves.forCorners([&](const P3& p) { far.look(p); });
                       place = far.place;
                       return far.away;
                   },
                   out);
            for (unsigned i = 0; i < 4; ++i) storePart(rows + i * kWidth + at, out[i]);
        }
        forLanes(slots.subtrees, [&](unsigned lane) {
            const FitNode& below = job.nodes[job.children[std::size_t{node} * kWidth + lane]];
            const float* const first = job.corners + std::size_t{below.firstLeaf} * kLeafSize;
            P3 low{splatPart(first[0]), splatPart(first[kLeafFaces]), splatPart(first[2 * kLeafFaces])}, high = low;
            forCornersOf(job.corners, below.firstLeaf, below.endLeaf, [&](const P3& p) {
                low = {min(low.x, p.x), min(low.y, p.y), min(low.z, p.z)};
                high = {max(high.x, p.x), max(high.y, p.y), max(high.z, p.z)};
            });
            const auto middle = [](P l, P h) { return splatPart((largestLane(h) - largestLane(-l)) * 0.5f); };
            P out[4];
            around({middle(low.x, high.x), middle(low.y, high.y), middle(low.z, high.z)},
                   [&](const P3& centre, P3& place) {
                       Far far{centre, splatPart(-1), centre};
                       forCornersOf(job.corners, below.firstLeaf, below.endLeaf, [&](const P3& p) { far.look(p); });
                       return farthestLane(far, place);
                   },
                   out);
            for (unsigned i = 0; i < 4; ++i) {
                alignas(64) float lanes[kLanes];
                storePart(lanes, out[i]);
                rows[i * kWidth + lane] = lanes[0];
            }
        });
        forLanes(~slots.used() & 0xffffu, [&](unsigned lane) {
            for (unsigned row = 0; row < kRows; ++row) rows[row * kWidth + lane] = row < 3 ? 0 : kNever;
        });
    }

    static P farthestLane(const Far& far, P3& place) {
        alignas(64) float away[kLanes], x[kLanes], y[kLanes], z[kLanes];
        storePart(away, far.away);
        storePart(x, far.place.x);
        storePart(y, far.place.y);
        storePart(z, far.place.z);
        unsigned best = 0;
        for (unsigned i = 1; i < kLanes; ++i)
            if (away[i] > away[best]) best = i;
        place = {splatPart(x[best]), splatPart(y[best]), splatPart(z[best])};
        return splatPart(away[best]);
    }

    TESSERA_INLINE static P size(const float* rows) {
        const P r = loadPart(rows + 3 * kWidth);
        return r * r * 12.566371f;
    }
};

/// Fits every node, children before their nodes, and adds up the sizes.
template <typename Fit>
void fitAll(FitJob& job) {
    job.cost = 0;
    for (std::uint32_t node = job.nodeCount; node-- > 0;) {
        const SlotLanes slots(job, node);
        float* const rows = job.volumes + std::size_t{node} * Fit::kRows * kWidth;
        job.nodes[node].firstLeaf = slots.firstLeaf;
        job.nodes[node].endLeaf = slots.endLeaf;
        Fit::fit(job, slots, node, rows);
        alignas(64) float size[kWidth];
        for (unsigned at = 0; at < kWidth; at += kLanes) storePart(size + at, Fit::size(rows + at));
        forLanes(slots.used(), [&](unsigned lane) { job.cost += static_cast<double>(size[lane]); });
    }
}
