// One slot against a vector of others: who met and meets no more, or the other way about. Included by SlotKernels.inl only.

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

/// The least of the six sums: positive where boxes overlap, negative where they do not, zero where it is not known. A sum of
/// floats is exact in its sign.
inline F overlap(const Keys& a, const Keys& b) {
    const F x = min(a.bound[0] + b.bound[3], a.bound[3] + b.bound[0]);
    const F y = min(a.bound[1] + b.bound[4], a.bound[4] + b.bound[1]);
    const F z = min(a.bound[2] + b.bound[5], a.bound[5] + b.bound[2]);
    return min(min(x, y), z);
}

/// Slot s, with keys `cur` and `prev` in all lanes, against slots at … (those in `lanes`), to the sink, which has room.
inline void compare(const Keys& cur, const Keys& prev, const Keys& othersCur, const Keys& othersPrev, size_t s, size_t at,
                    Bits lanes, PairSink& sink) {
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
        compare(cur, prev, loadKeys(slots.cur, at), loadKeys(slots.prev, at), s, at, lanes & firstLanes(end - at), sink);
        lanes = ~Bits{0};
    }
    return true;
}
