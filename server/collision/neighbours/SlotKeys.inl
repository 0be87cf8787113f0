// From boxes to keys, records and arrays; and one slot against a vector of others: who met and meets no more, or the
// other way about. Included by SlotKernels.inl only.

/// Lower and upper bounds (three of four lanes count), as double; and as keys.
#if defined(__AVX2__)
using D4 = __m256d;
inline D4 loadLower(const double* box) {
    return _mm256_loadu_pd(box);
}
inline D4 loadUpper(const double* box) {
    return _mm256_permute4x64_pd(_mm256_loadu_pd(box + 2), 0x39);
}
inline bool ordered(D4 lower, D4 upper) {
    return (_mm256_movemask_pd(_mm256_cmp_pd(lower, upper, _CMP_LE_OQ)) & 7) == 7;
}
inline __m128 key(D4 x, D4 origin) {
    return _mm256_cvtpd_ps(_mm256_sub_pd(x, origin));
}
inline D4 loadOrigin(const double* origin) {
    return _mm256_setr_pd(origin[0], origin[1], origin[2], 0);
}
#else
struct D4 {
    __m128d xy, z;
};
inline D4 loadLower(const double* box) {
    return {_mm_loadu_pd(box), _mm_load_sd(box + 2)};
}
inline D4 loadUpper(const double* box) {
    return {_mm_loadu_pd(box + 3), _mm_load_sd(box + 5)};
}
inline bool ordered(D4 lower, D4 upper) {
    return (_mm_movemask_pd(_mm_cmple_pd(lower.xy, upper.xy)) & _mm_movemask_pd(_mm_cmple_pd(lower.z, upper.z))) == 3;
}
inline __m128 key(D4 x, D4 origin) {
    return _mm_movelh_ps(_mm_cvtpd_ps(_mm_sub_pd(x.xy, origin.xy)), _mm_cvtpd_ps(_mm_sub_pd(x.z, origin.z)));
}
inline D4 loadOrigin(const double* origin) {
    return {_mm_loadu_pd(origin), _mm_load_sd(origin + 2)};
}
#endif

void convert(const double* boxes, const uint32_t* slotOf, size_t n, const double* origin, float* records) {
    const D4 o = loadOrigin(origin);
    const __m128 sign = _mm_set1_ps(-0.0F);
    const __m128 least4 = _mm_set1_ps(-kFar), most4 = _mm_set1_ps(kFar);
    for (size_t i = 0; i < n; ++i) {
        const D4 lower = loadLower(boxes + 6 * i);
        const D4 upper = loadUpper(boxes + 6 * i);
        if (slotOf[i] == ~0u) continue;
        __m128 l = _mm_min_ps(most4, _mm_max_ps(least4, _mm_xor_ps(key(lower, o), sign)));
        __m128 u = _mm_min_ps(most4, _mm_max_ps(least4, key(upper, o)));
        if (!ordered(lower, upper)) l = u = _mm_set1_ps(-kNowhere);
        float* const record = records + size_t{8} * slotOf[i];
        _mm_storeu_ps(record, l);
        _mm_storeu_ps(record + 4, u);
    }
}

void spread(const float* records, size_t begin, size_t end, float* cur) {
    for (size_t s = begin; s < end; s += 4)
        for (size_t half = 0; half < 2; ++half) {
            const float* const r = records + 8 * s + 4 * half;
            float* const to = cur + keyIndex(3 * half, s);
            __m128 x = _mm_loadu_ps(r), y = _mm_loadu_ps(r + 8), z = _mm_loadu_ps(r + 16), w = _mm_loadu_ps(r + 24);
            _MM_TRANSPOSE4_PS(x, y, z, w);
            _mm_storeu_ps(to, x);
            _mm_storeu_ps(to + kBlockSlots, y);
            _mm_storeu_ps(to + 2 * kBlockSlots, z);
        }
}

size_t settle(const float* cur, const float* placed, size_t begin, size_t end, Settlement& settlement,
              uint32_t* leavers) {
    size_t count = 0;
    F most3[3] = {splat(0.0F), splat(0.0F), splat(0.0F)};
    const F none = splat(0.0F);
    for (size_t s = begin; s < end; s += kWidth) {
        Bits leaves = 0;
        F drift[3];
        for (size_t a = 0; a < 3; ++a) {
            const F lower = load(cur + keyIndex(a, s)), place = load(placed + placeIndex(a, s));
            drift[a] = max(lower - place, place - lower);
            leaves |= greater(drift[a], splat(settlement.maxDrift[a]));
            leaves |= greater(load(cur + keyIndex(3 + a, s)) + lower, splat(settlement.maxExtent[a]));
        }
        const Bits here = firstLanes(end - s);
        leaves &= here;
        for (int a = 0; a < 3; ++a) most3[a] = max(most3[a], choose(here & ~leaves, drift[a], none));
        for (; leaves != 0; leaves &= leaves - 1)
            leavers[count++] = static_cast<uint32_t>(s) + static_cast<uint32_t>(__builtin_ctz(leaves));
    }
    for (int a = 0; a < 3; ++a) settlement.maxDrift[a] = most(most3[a]);
    return count;
}

inline F cellOf(F v, const CellFrame& frame, int axis) {
    return min(splat(frame.last[axis]), max(splat(0.0F), (v - splat(frame.origin[axis])) * splat(frame.scale[axis])));
}

void cells(const CellFrame& frame, const float* cur, size_t n, uint32_t* cell) {
    for (size_t s = 0; s < n; s += kWidth) {
        uint32_t place[3][kWidth];
        for (int a = 0; a < 3; ++a)
            storeInt(place[a],
                     cellOf(splat(0.0F) - load(cur + keyIndex(static_cast<size_t>(frame.axis[a]), s)), frame, a));
        for (size_t k = 0; k < kWidth && s + k < n; ++k)
            cell[s + k] = (place[2][k] * frame.ny + place[1][k]) << frame.xBits | place[0][k];
    }
}

/// The keys of kWidth slots, or one slot's in all lanes.
struct Keys {
    F bound[6];
};

inline Keys loadKeys(const float* keys, size_t slot) {
    const float* const p = keys + keyIndex(0, slot);
    return {load(p), load(p + 16), load(p + 32), load(p + 48), load(p + 64), load(p + 80)};
}
inline Keys splatKeys(const float* keys, size_t slot) {
    const float* const p = keys + keyIndex(0, slot);
    return {splat(p[0]), splat(p[16]), splat(p[32]), splat(p[48]), splat(p[64]), splat(p[80])};
}
inline Keys swept(const Keys& a, const Keys& b) {
    Keys both;
    for (int k = 0; k < 6; ++k) both.bound[k] = max(a.bound[k], b.bound[k]);
    return both;
}

/// The least of the six sums: positive where boxes overlap, negative where they do not, zero where it is not known. A
/// sum of floats is exact in its sign.
inline F overlap(const Keys& a, const Keys& b) {
    const F x = min(a.bound[0] + b.bound[3], a.bound[3] + b.bound[0]);
    const F y = min(a.bound[1] + b.bound[4], a.bound[4] + b.bound[1]);
    const F z = min(a.bound[2] + b.bound[5], a.bound[5] + b.bound[2]);
    return min(min(x, y), z);
}

/// Slot s, with keys `cur` and `prev` in all lanes, against slots at … (those in `lanes`), to the sink, which has room.
inline void compare(const Keys& cur, const Keys& prev, const Keys& othersCur, const Keys& othersPrev, size_t s,
                    size_t at, Bits lanes, PairSink& sink) {
    const F now = overlap(cur, othersCur);
    const F then = overlap(prev, othersPrev);
    const F none = splat(0.0F);
    Bits differ = atLeast(max(now, then), none) & atLeast(none, min(now, then)) & lanes;
    if (__builtin_expect(differ == 0, 1)) return;
    const Bits unsure = equal(now, none) | equal(then, none);
    const Bits begins = greater(now, then);
    do {
        const int k = __builtin_ctz(differ);
        sink.out[sink.count++] = {static_cast<uint32_t>(s), (static_cast<uint32_t>(at) + static_cast<uint32_t>(k)) |
                                                                (unsure >> k & 1u) << 31 | (begins >> k & 1u) << 30};
        differ &= differ - 1;
    } while (differ != 0);
}

/// Slot s against slots begin … end - 1; false where the sink may have no room for them.
inline bool compareRange(const SlotArrays& slots, const Keys& cur, const Keys& prev, size_t s, size_t begin, size_t end,
                         PairSink& sink) {
    if (begin >= end) return true;
    if (sink.capacity - sink.count < end - begin) return false;
    Bits lanes = ~Bits{0} << begin % kWidth;
    for (size_t at = begin & ~(kWidth - 1); at < end; at += kWidth) {
        compare(cur, prev, loadKeys(slots.cur, at), loadKeys(slots.prev, at), s, at, lanes & firstLanes(end - at),
                sink);
        lanes = ~Bits{0};
    }
    return true;
}
