// Bounding volumes around the triangles below every slot, from the leaves up. A node's slots that are leaves are fitted
// side by side, a leaf per lane; of a slot with a subtree either the volumes of the children are joined (k-DOPs), or
// all corners below are looked at again, four to a leaf and some leaves side by side. Included by kernel/Kernels.inl
// only.
//
// Positions are floats of at most 1 in size, each coordinate wrong by half a unit in the last place; with u = 2^-24
// what is computed from them is wrong by some u, and volumes are widened by that.

using P = FloatPart;
using P3 = Vector3<P>;
constexpr unsigned kLanes = Lanes<P>::kCount;
constexpr unsigned kLeafSize = kLeafRows * kLeafFaces;
constexpr float kUnitRoundoff = 0x1p-24f;
/// Where there is no child: overlaps nothing.
constexpr float kNever = -1e30f;

TESSERA_INLINE P splatPart(float x) {
    return Lanes<P>::splat(x);
}
TESSERA_INLINE P loadPart(const float* p) {
    return Lanes<P>::load(p);
}
TESSERA_INLINE void storePart(float* p, P x) {
    Lanes<P>::store(p, x);
}

/// Four floats from each of some places, and 4 x 4 blocks turned over.
#if defined(__AVX512F__)
TESSERA_INLINE P join(const float* const* at) {
    const __m512 one = _mm512_castps128_ps512(_mm_load_ps(at[0]));
    const __m512 two = _mm512_maskz_insertf32x4(0xffff, one, _mm_load_ps(at[1]), 1);
    const __m512 three = _mm512_maskz_insertf32x4(0xffff, two, _mm_load_ps(at[2]), 2);
    return reinterpret_cast<P>(_mm512_maskz_insertf32x4(0xffff, three, _mm_load_ps(at[3]), 3));
}
TESSERA_INLINE void transpose(P (&v)[4]) {
    const __m512 a = reinterpret_cast<__m512>(v[0]), b = reinterpret_cast<__m512>(v[1]),
                 c = reinterpret_cast<__m512>(v[2]), d = reinterpret_cast<__m512>(v[3]);
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
    const __m256 ab = _mm256_unpacklo_ps(v[0], v[1]), AB = _mm256_unpackhi_ps(v[0], v[1]),
                 cd = _mm256_unpacklo_ps(v[2], v[3]), CD = _mm256_unpackhi_ps(v[2], v[3]);
    v[0] = _mm256_shuffle_ps(ab, cd, 0x44);
    v[1] = _mm256_shuffle_ps(ab, cd, 0xee);
    v[2] = _mm256_shuffle_ps(AB, CD, 0x44);
    v[3] = _mm256_shuffle_ps(AB, CD, 0xee);
}
#else
TESSERA_INLINE P join(const float* const* at) {
    return _mm_load_ps(at[0]);
}
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
TESSERA_INLINE P halfArea(const P3& size) {
    return size.x * size.y + size.y * size.z + size.z * size.x;
}

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
    [[nodiscard]] static Bits ofPart(Bits lanes, unsigned part) {
        return lanes >> part * kLanes & ((1u << kLanes) - 1);
    }
};

template <typename Use>
TESSERA_INLINE void forLanes(Bits lanes, const Use& use) {
    for (; lanes != 0; lanes &= lanes - 1) use(static_cast<unsigned>(__builtin_ctz(lanes)));
}

template <typename Fit>
TESSERA_INLINE double sizesOf(const float* rows, Bits lanes) {
    alignas(64) float size[kWidth];
    for (unsigned at = 0; at < kWidth; at += kLanes) storePart(size + at, Fit::size(rows + at));
    double sum = 0;
    forLanes(lanes, [&](unsigned lane) { sum += static_cast<double>(size[lane]); });
    return sum;
}

/// Fits every node, or some, children before their nodes, and adds up the sizes.
template <typename Fit>
void fitAll(FitJob& job) {
    const bool all = job.some == nullptr;
    if (all) job.cost = 0;
    for (std::uint32_t k = all ? job.nodeCount : job.someCount; k-- > 0;) {
        const std::uint32_t node = all ? k : job.some[k];
        const SlotLanes slots(job, node);
        float* const rows = job.volumes + std::size_t{node} * Fit::kRows * kWidth;
        if (!all) job.cost -= sizesOf<Fit>(rows, slots.used());
        job.nodes[node].firstLeaf = slots.firstLeaf;
        job.nodes[node].endLeaf = slots.endLeaf;
        Fit::fit(job, slots, node, rows);
        job.cost += sizesOf<Fit>(rows, slots.used());
        if (node == 0) job.whole = sizesOf<Fit>(rows, 1);
    }
}
