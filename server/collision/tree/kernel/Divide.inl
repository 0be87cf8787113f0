// What dividing a mesh costs most of its time in: one pass over the triangles of a part per cut, and the cuts among the
// few of a lowest node. Every instruction set gives the same division, to the bit: there are only sums, differences,
// products that are rounded on their own, and comparisons. Included by kernel/Kernels.inl only.

/// Eight floats: the six sides of a box.
#if defined(__AVX2__)
struct Sides8 {
    __m256 all;
    TESSERA_INLINE static Sides8 load(const float* p) { return {_mm256_load_ps(p)}; }
    TESSERA_INLINE void store(float* p) const { _mm256_store_ps(p, all); }
    TESSERA_INLINE static Sides8 join(__m128 low, __m128 high) {
        return {_mm256_insertf128_ps(_mm256_castps128_ps256(low), high, 1)};
    }
    [[nodiscard]] TESSERA_INLINE __m128 low() const { return _mm256_castps256_ps128(all); }
    [[nodiscard]] TESSERA_INLINE __m128 high() const { return _mm256_extractf128_ps(all, 1); }
};
TESSERA_INLINE Sides8 max(const Sides8& a, const Sides8& b) {
    return {_mm256_max_ps(a.all, b.all)};
}
#else
struct Sides8 {
    __m128 a, b;
    TESSERA_INLINE static Sides8 load(const float* p) { return {_mm_load_ps(p), _mm_load_ps(p + 4)}; }
    TESSERA_INLINE void store(float* p) const {
        _mm_store_ps(p, a);
        _mm_store_ps(p + 4, b);
    }
    TESSERA_INLINE static Sides8 join(__m128 low, __m128 high) { return {low, high}; }
    [[nodiscard]] TESSERA_INLINE __m128 low() const { return a; }
    [[nodiscard]] TESSERA_INLINE __m128 high() const { return b; }
};
TESSERA_INLINE Sides8 max(const Sides8& a, const Sides8& b) {
    return {_mm_max_ps(a.a, b.a), _mm_max_ps(a.b, b.b)};
}
#endif

TESSERA_INLINE void addToBin(BoxBin& bin, const Sides8& item) {
    const __m128 below = item.low(), above = item.high();
    const Sides8 centre = Sides8::join(_mm_sub_ps(above, below), _mm_sub_ps(below, above));
    max(Sides8::load(bin.side), item).store(bin.side);
    max(Sides8::load(bin.side + 8), centre).store(bin.side + 8);
}

TESSERA_INLINE unsigned binOf(const BoxItem& item, unsigned axis, float start, float scale) {
    const int bin = static_cast<int>((item.side[4 + axis] - item.side[axis] - start) * scale);
    return bin < static_cast<int>(kBins) ? static_cast<unsigned>(bin) : kBins - 1;
}
/// Neighbours in the mesh often go to one bin; into two of each in turns, they need not wait for each other.
template <unsigned Turn>
TESSERA_INLINE void addToBins(Bins& bins, const BoxItem& item, const Sides8& sides) {
    const unsigned bin = binOf(item, bins.axis, bins.start, bins.scale);
    addToBin(bins.box[Turn][bin], sides);
    ++bins.counts[Turn][bin];
}

inline void fillBins(const BoxItem* items, std::uint32_t count, Bins& bins) {
    for (std::uint32_t i = 0; i + 1 < count; i += 2) {
        addToBins<0>(bins, items[i], Sides8::load(items[i].side));
        addToBins<1>(bins, items[i + 1], Sides8::load(items[i + 1].side));
    }
    if (count % 2 != 0) addToBins<0>(bins, items[count - 1], Sides8::load(items[count - 1].side));
}

struct Parting {
    const Cut cut;
    BoxItem* const to[2];  ///< left, right
    Bins* const bins[2];

    /// Item `i` of all; so many went to the left before.
    template <bool WithBins, unsigned Turn>
    TESSERA_INLINE void take(const BoxItem& item, std::size_t i, std::size_t& toLeft) const {
        std::size_t side = binOf(item, cut.axis, cut.start, cut.scale) >= cut.firstRight ? 1 : 0;
        asm("" : "+r"(side));  // a number: a branch here would be guessed wrong half of the time
        const Sides8 sides = Sides8::load(item.side);
        sides.store(to[side][toLeft + (i - 2 * toLeft) * side].side);
        toLeft += 1 - side;
        if constexpr (WithBins) addToBins<Turn>(*bins[side], item, sides);
    }
    template <bool WithBins>
    TESSERA_INLINE void takeAll(const BoxItem* from, std::size_t count) const {
        std::size_t toLeft = 0, i = 0;
        for (; i + 1 < count; i += 2) {
            take<WithBins, 0>(from[i], i, toLeft);
            take<WithBins, 1>(from[i + 1], i + 1, toLeft);
        }
        if (i < count) take<WithBins, 0>(from[i], i, toLeft);
    }
};

/// Puts the items of bins before `firstRight` to `left` and the others to `right`, in their order, and all into the
/// bins of their new parts where these have some.
inline void partItems(const BoxItem* from, std::uint32_t count, const Cut& cut, BoxItem* left, BoxItem* right,
                      Bins* binsLeft, Bins* binsRight) {
    if (binsLeft == nullptr && binsRight == nullptr) {
        Parting{cut, {left, right}, {}}.takeAll<false>(from, count);
        return;
    }
    Bins unused;
    unused.axis = 0;
    unused.start = unused.scale = 0;
    if (binsLeft == nullptr || binsRight == nullptr)
        for (unsigned turn = 0; turn < 2; ++turn) {
            unused.counts[turn][0] = 0;
            for (float& side : unused.box[turn][0].side) side = 0;
        }
    Parting{cut, {left, right}, {binsLeft != nullptr ? binsLeft : &unused, binsRight != nullptr ? binsRight : &unused}}
        .takeAll<true>(from, count);
}

/// Divides the triangles of one lowest node into leaves.
class LeafDivider {
public:
    LeafDivider(const BoxItem* items, unsigned count, CutRule rule, LeafDivision& out)
        : items_(items), rule_(rule), out_(out) {
        out.leaves = 0;
        Sides8 all = Sides8::load(items[0].side);
        for (unsigned i = 0; i < count; ++i) {
            const Sides8 sides = Sides8::load(items[i].side);
            all = max(all, sides);
            // Floats as integers of the same order; the last six bits tell equal ones apart.
            const __m128i bits = _mm_castps_si128(_mm_sub_ps(sides.high(), sides.low()));
            const __m128i ordered = _mm_xor_si128(bits, _mm_srli_epi32(_mm_srai_epi32(bits, 31), 1));
            alignas(16) std::int32_t key[4];
            _mm_store_si128(reinterpret_cast<__m128i*>(key), _mm_or_si128(_mm_andnot_si128(_mm_set1_epi32(63), ordered),
                                                                          _mm_set1_epi32(static_cast<int>(i))));
            for (unsigned axis = 0; axis < 3; ++axis) keys_[axis][i] = key[axis];
        }
        for (unsigned axis = 0; axis < 3; ++axis) sort(axis, count);
        divide(0, count, _mm_add_ps(all.low(), all.high()));
    }

private:
    const BoxItem* items_;
    CutRule rule_;
    LeafDivision& out_;
    alignas(64) std::int32_t keys_[3][kNodeFaces];
    std::uint8_t sorted_[3][kNodeFaces];  ///< the triangles of every part along each axis
    std::uint8_t toRight_[kNodeFaces];    ///< by triangle, in the cut at hand

    struct Found {
        unsigned axis = 0;
        unsigned left = 0;  ///< triangles
        float cost = 3e38f;
        __m128 sizeLeft = _mm_setzero_ps(), sizeRight = _mm_setzero_ps();
    };

    /// `size` of the part's box.
    void divide(unsigned first, unsigned count, __m128 size) {
        Found cut;
        if (rule_ == CutRule::kMedian || rule_ == CutRule::kMean) {
            cutLongest(first, count, cut);
        } else {
            alignas(16) float along[4];
            _mm_store_ps(along, size);
            const float enough = kWorthCutting * (along[0] > along[1] ? (along[0] > along[2] ? along[0] : along[2])
                                                                      : (along[1] > along[2] ? along[1] : along[2]));
            for (unsigned axis = 0; axis < 3; ++axis)
                if (along[axis] >= enough) bestCut(axis, first, count, cut);
        }
        const std::uint8_t* const at = sorted_[cut.axis] + first;
        const unsigned right = count - cut.left;
        if (cut.left > kLeafFaces || right > kLeafFaces) {
            for (unsigned i = 0; i < count; ++i) toRight_[at[i]] = i >= cut.left ? 1 : 0;
            for (unsigned axis = 0; axis < 3; ++axis)
                if (axis != cut.axis) part(sorted_[axis] + first, count, cut.left);
        }
        if (cut.left > kLeafFaces)
            divide(first, cut.left, cut.sizeLeft);
        else
            leaf(at, cut.left);
        if (right > kLeafFaces)
            divide(first + cut.left, right, cut.sizeRight);
        else
            leaf(at + cut.left, right);
    }
    /// Of the longest side: cuts across shorter ones are not tried.
    static constexpr float kWorthCutting = 0.4f;

    void leaf(const std::uint8_t* at, unsigned count) {
        for (unsigned i = 0; i < count; ++i) out_.order[placed_++] = at[i];
        out_.counts[out_.leaves++] = static_cast<std::uint8_t>(count);
    }
    unsigned placed_ = 0;

    /// Those of the left part first, else in their order.
    void part(std::uint8_t* list, unsigned count, unsigned left) const {
        std::uint8_t parted[kNodeFaces];
        unsigned toLeft = 0;
        for (unsigned i = 0; i < count; ++i) {
            const unsigned side = toRight_[list[i]];
            parted[toLeft + (left + i - 2 * toLeft) * side] = list[i];
            toLeft += 1 - side;
        }
        for (unsigned i = 0; i < count; ++i) list[i] = parted[i];
    }

    /// By the centres: each one's rank is counted.
    void sort(unsigned axis, unsigned count) {
        constexpr unsigned kInts = sizeof(IntPart) / sizeof(std::int32_t);
        alignas(64) std::int32_t ranks[kNodeFaces];
        std::int32_t* const keys = keys_[axis];
        for (unsigned i = count; i % kInts != 0; ++i) keys[i] = 0x7fffffff;
        unsigned begin = 0;
        for (; begin + kInts < count; begin += 2 * kInts) rank<2>(keys, begin, count, ranks);
        if (begin < count) rank<1>(keys, begin, count, ranks);
        for (unsigned i = 0; i < count; ++i) sorted_[axis][ranks[i]] = static_cast<std::uint8_t>(i);
    }
    template <unsigned Registers>
    TESSERA_INLINE static void rank(const std::int32_t* keys, unsigned begin, unsigned count, std::int32_t* ranks) {
        constexpr unsigned kInts = sizeof(IntPart) / sizeof(std::int32_t);
        IntPart own[Registers], above[Registers];
        for (unsigned r = 0; r < Registers; ++r) {
            own[r] = *reinterpret_cast<const IntPart*>(keys + begin + r * kInts);
            above[r] = IntPart{};
        }
        for (unsigned j = 0; j < count; ++j)
            for (unsigned r = 0; r < Registers; ++r) {
#if defined(__AVX512F__)
                const __m512i rank = reinterpret_cast<__m512i>(above[r]);
                above[r] = reinterpret_cast<IntPart>(_mm512_mask_add_epi32(
                    rank, _mm512_cmpgt_epi32_mask(reinterpret_cast<__m512i>(own[r]), _mm512_set1_epi32(keys[j])), rank,
                    _mm512_set1_epi32(1)));
#else
                above[r] -= own[r] > IntPart{} + keys[j];
#endif
            }
        for (unsigned r = 0; r < Registers; ++r) *reinterpret_cast<IntPart*>(ranks + begin + r * kInts) = above[r];
    }

    /// Takes the cut between whole leaves of least (size of the part's box) · (its leaves), if it is better than
    /// `best`.
    void bestCut(unsigned axis, unsigned first, unsigned count, Found& best) const {
        const std::uint8_t* const sorted = sorted_[axis] + first;
        const unsigned leaves = (count + kLeafFaces - 1) / kLeafFaces;
        if (leaves == 2) {
            const __m128 left = sizeOf(leafBox(sorted, kLeafFaces)),
                         right = sizeOf(leafBox(sorted + kLeafFaces, count - kLeafFaces));
            const float cost = measure(left) + measure(right);
            if (cost < best.cost) best = {axis, kLeafFaces, cost, left, right};
            return;
        }
        // What is right of cut i, before leaf i; then what is left of it.
        Sides8 leaf[kWidth];
        __m128 left[kWidth], right[kWidth];
        Sides8 box = leafBox(sorted + (leaves - 1) * kLeafFaces, count - (leaves - 1) * kLeafFaces);
        right[leaves - 1] = sizeOf(box);
        for (unsigned i = leaves - 2; i > 0; --i) {
            leaf[i] = leafBox(sorted + i * kLeafFaces, kLeafFaces);
            box = max(box, leaf[i]);
            right[i] = sizeOf(box);
        }
        box = leafBox(sorted, kLeafFaces);
        left[1] = sizeOf(box);
        for (unsigned i = 2; i < leaves; ++i) {
            box = max(box, leaf[i - 1]);
            left[i] = sizeOf(box);
        }
        unsigned found = 0;
        for (unsigned i = 1; i < leaves; i += 4) {
            alignas(16) float cost[4];
            _mm_store_ps(cost, _mm_add_ps(rounded(_mm_mul_ps(measure(left, i, leaves), leafCounts(i, 0, 1))),
                                          rounded(_mm_mul_ps(measure(right, i, leaves), leafCounts(i, leaves, -1)))));
            for (unsigned j = 0; j < 4 && i + j < leaves; ++j)
                if (cost[j] < best.cost) {
                    best.cost = cost[j];
                    found = i + j;
                }
        }
        if (found != 0) best = {axis, found * kLeafFaces, best.cost, left[found], right[found]};
    }
    TESSERA_INLINE Sides8 leafBox(const std::uint8_t* at, unsigned count) const {
        Sides8 box = Sides8::load(items_[at[0]].side);
        for (unsigned j = 1; j < kLeafFaces; ++j) box = max(box, Sides8::load(items_[at[j < count ? j : 0]].side));
        return box;
    }
    TESSERA_INLINE static __m128 sizeOf(const Sides8& box) {
        return _mm_add_ps(box.low(), box.high());
    }
    /// The value as it is, rounded: no product melts into the sum that follows.
    TESSERA_INLINE static __m128 rounded(__m128 x) {
        asm("" : "+x"(x));
        return x;
    }
    /// from + sign · (i, i + 1, i + 2, i + 3)
    TESSERA_INLINE static __m128 leafCounts(unsigned i, unsigned from, int sign) {
        const int at = static_cast<int>(i);
        const __m128i places = _mm_add_epi32(_mm_set1_epi32(at), _mm_set_epi32(3, 2, 1, 0));
        const __m128i base = _mm_set1_epi32(static_cast<int>(from));
        return _mm_cvtepi32_ps(sign > 0 ? _mm_add_epi32(base, places) : _mm_sub_epi32(base, places));
    }
    /// Half of the surface of four boxes, or their volume.
    TESSERA_INLINE __m128 measure(const __m128* sizes, unsigned i, unsigned end) const {
        const auto at = [&](unsigned j) { return sizes[i + j < end ? i + j : i]; };
        __m128 x = at(0), y = at(1), z = at(2), rest = at(3);
        _MM_TRANSPOSE4_PS(x, y, z, rest);
        if (rule_ == CutRule::kVolume) return _mm_mul_ps(_mm_mul_ps(x, y), z);
        return _mm_add_ps(_mm_add_ps(rounded(_mm_mul_ps(x, y)), rounded(_mm_mul_ps(y, z))), rounded(_mm_mul_ps(z, x)));
    }
    TESSERA_INLINE float measure(__m128 s) const {
        const __m128 products = rounded(_mm_mul_ps(s, _mm_shuffle_ps(s, s, _MM_SHUFFLE(3, 0, 2, 1))));  // xy yz zx
        if (rule_ == CutRule::kVolume) return _mm_cvtss_f32(_mm_mul_ss(products, _mm_movehl_ps(s, s)));
        return _mm_cvtss_f32(
            _mm_add_ss(_mm_add_ss(products, _mm_shuffle_ps(products, products, _MM_SHUFFLE(1, 1, 1, 1))),
                       _mm_movehl_ps(products, products)));
    }

    /// Between whole leaves near the middle, by count or by the mean of the centres.
    void cutLongest(unsigned first, unsigned count, Found& cut) const {
        float longest = -1, mean = 0;
        for (unsigned axis = 0; axis < 3; ++axis) {
            double sum = 0;
            for (unsigned i = 0; i < count; ++i) sum += static_cast<double>(centre2(axis, first + i));
            const float spread = centre2(axis, first + count - 1) - centre2(axis, first);
            if (spread > longest) {
                longest = spread;
                mean = static_cast<float>(sum / count);
                cut.axis = axis;
            }
        }
        unsigned left = count / 2;
        if (rule_ == CutRule::kMean)
            for (left = 0; left < count && centre2(cut.axis, first + left) < mean;) ++left;
        const unsigned most = (count - 1) / kLeafFaces;  // leaves that the left can fill
        const unsigned leaves = (left + kLeafFaces / 2) / kLeafFaces;
        cut.left = kLeafFaces * (leaves < 1 ? 1 : leaves > most ? most : leaves);
    }
    TESSERA_INLINE float centre2(unsigned axis, unsigned place) const {
        const BoxItem& item = items_[sorted_[axis][place]];
        return item.side[4 + axis] - item.side[axis];
    }
};

/// More than a leaf's.
inline void divideIntoLeaves(const BoxItem* items, unsigned count, CutRule rule, LeafDivision& out) {
    LeafDivider(items, count, rule, out);
}
