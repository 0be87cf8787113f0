// One slot against a vector of others: who met and meets no more, or the other way about. Included by SlotKernels.inl only.

/// The bounds of one slot, for comparison with many.
struct Probe {
    F cur[6], prev[6];
};

inline Probe probe(const SlotArrays& slots, size_t s) {
    Probe p;
    for (int k = 0; k < 6; ++k) {
        p.cur[k] = splat(slots.cur[k] + s);
        p.prev[k] = splat(slots.prev[k] + s);
    }
    return p;
}

/// The least of the six differences "upper of one less lower of the other": positive where the keys overlap, negative where
/// they do not, zero where it is not known. Subtraction of floats is exact in its sign.
inline F overlap(const F* p, const float* const* arrays, size_t at) {
    F least6 = min(p[3] - load(arrays[0] + at), load(arrays[3] + at) - p[0]);
    least6 = min(least6, min(p[4] - load(arrays[1] + at), load(arrays[4] + at) - p[1]));
    return min(least6, min(p[5] - load(arrays[2] + at), load(arrays[5] + at) - p[2]));
}

/// Slot s against slots at … (those in `lanes`), to the sink, which has room for them.
inline void compare(const SlotArrays& slots, const Probe& p, size_t s, size_t at, Bits lanes, PairSink& sink) {
    const F now = overlap(p.cur, slots.cur, at);
    const F then = overlap(p.prev, slots.prev, at);
    const F none = splat(0.0F);
    Bits differ = atLeast(max(now, then), none) & atLeast(none, min(now, then)) & lanes;
    ++sink.steps;
    if (differ == 0) return;
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
inline bool compareRange(const SlotArrays& slots, const Probe& p, size_t s, size_t begin, size_t end, PairSink& sink) {
    if (begin >= end) return true;
    if (sink.capacity - sink.count < end - begin) return false;
    for (size_t at = begin; at < end; at += kWidth) compare(slots, p, s, at, firstLanes(end - at), sink);
    return true;
}
