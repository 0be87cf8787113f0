// The sweep over a grid. Included by SlotKernels.inl only.
//
// A pair of slots is found by the one whose cell comes first in its column (then by column, then by slot). Another box
// that meets mine, now or before, and comes after me has its cell, in x, between mine and that of my upper bound; in y
// and z between those of my lower bound less the reach and of my upper bound.

/// Cells that those who meet a box may lie in.
struct CellRange {
    uint32_t x0[kBlockSlots], x1[kBlockSlots], y0[kBlockSlots], y1[kBlockSlots], z0[kBlockSlots], z1[kBlockSlots];
};

inline void cellRanges(const GridView& g, size_t at, size_t to, CellRange& range) {
    uint32_t* const low[3] = {range.x0 + to, range.y0 + to, range.z0 + to};
    uint32_t* const high[3] = {range.x1 + to, range.y1 + to, range.z1 + to};
    const F none = splat(0.0F), grain = splat(4e-7F);  // more than what rounding does to the sums
    for (int a = 0; a < 3; ++a) {
        const auto axis = static_cast<size_t>(g.frame.axis[a]);
        const F lower = none - max(load(g.slots.cur + keyIndex(axis, at)), load(g.slots.prev + keyIndex(axis, at)));
        const F upper = max(load(g.slots.cur + keyIndex(3 + axis, at)), load(g.slots.prev + keyIndex(3 + axis, at)));
        const F below = lower - splat(g.reach[a]) - max(lower, none - lower) * grain;
        const F above = upper + splat(g.drift[a]) + max(upper, none - upper) * grain;
        storeInt(low[a], cellOf(below, g.frame, a));
        storeInt(high[a], cellOf(above, g.frame, a));
    }
}

/// A stretch of slots to compare a slot with.
struct Stretch {
    uint32_t slot, begin, end;
};

size_t gridAll(const GridView& g, size_t begin, size_t end, PairSink& sink) {
    const uint32_t xBits = g.frame.xBits, xMask = (1u << xBits) - 1;
    for (size_t s0 = begin & ~(kBlockSlots - 1); s0 < end; s0 += kBlockSlots) {
        const size_t first = s0 < begin ? begin - s0 : 0;
        const size_t n = end - s0 < kBlockSlots ? end - s0 : kBlockSlots;
        const size_t mark = sink.count;
        CellRange range;
        for (size_t k = 0; k < kBlockSlots; k += kWidth) cellRanges(g, s0 + k, k, range);
        // First all stretches, then all comparisons: the branches of the former are few and those of the latter rarely
        // taken. Most boxes reach two columns or one in each direction.
        Stretch queue[4 * kBlockSlots + 1];
        uint32_t queued = 0;
        for (size_t k = first; k < n; ++k) {
            const auto s = static_cast<uint32_t>(s0 + k);
            const uint32_t column = g.cell[s] >> xBits, x = g.cell[s] & xMask, xEnd = range.x1[k] + 1;
            const auto stretch = [&](uint32_t y, uint32_t z) {
                const uint32_t other = z * g.frame.ny + y;
                const uint32_t* const row = g.start + (size_t{other} << xBits);
                const uint32_t from = row[x + (other < column)];
                return Stretch{s, other == column ? s + 1 : from, row[xEnd]};
            };
            const uint32_t ny = range.y1[k] - range.y0[k], nz = range.z1[k] - range.z0[k];
            if (ny <= 1 && nz <= 1) {
                for (uint32_t z = 0; z <= 1; ++z)
                    for (uint32_t y = 0; y <= 1; ++y) {
                        const Stretch st = stretch(range.y0[k] + (y & ny), range.z0[k] + (z & nz));
                        queue[queued] = st;
                        queued += static_cast<uint32_t>(st.begin < st.end) & static_cast<uint32_t>(y <= ny) &
                                  static_cast<uint32_t>(z <= nz);
                    }
            } else {
                // Boxes that are empty now and were before have their bounds the other way about: no cells.
                const Keys cur = splatKeys(g.slots.cur, s), prev = splatKeys(g.slots.prev, s);
                for (uint32_t z = range.z0[k]; z <= range.z1[k]; ++z)
                    for (uint32_t y = range.y0[k]; y <= range.y1[k]; ++y) {
                        const Stretch st = stretch(y, z);
                        if (!compareRange(g.slots, cur, prev, s, st.begin, st.end, sink)) {
                            sink.count = mark;
                            return s0 + first;
                        }
                    }
            }
        }
        for (uint32_t q = 0; q < queued; ++q) {
            const Stretch& st = queue[q];
            const Keys cur = splatKeys(g.slots.cur, st.slot), prev = splatKeys(g.slots.prev, st.slot);
            if (!compareRange(g.slots, cur, prev, st.slot, st.begin, st.end, sink)) {
                sink.count = mark;
                return s0 + first;
            }
        }
    }
    return end;
}

size_t gridSome(const GridView& g, const uint32_t* slots, size_t begin, size_t end, bool loose, PairSink& sink) {
    for (size_t i = begin; i < end; ++i) {
        const uint32_t s = slots[i];
        const size_t mark = sink.count;
        const Keys cur = splatKeys(g.slots.cur, s), prev = splatKeys(g.slots.prev, s);
        CellRange range;
        const size_t k = s % kWidth;
        cellRanges(g, s - k, 0, range);
        bool room = true;
        for (uint32_t z = range.z0[k]; z <= range.z1[k] && room; ++z)
            for (uint32_t y = range.y0[k]; y <= range.y1[k] && room; ++y) {
                const uint32_t* const row = g.start + (size_t{z * g.frame.ny + y} << g.frame.xBits);
                room = compareRange(g.slots, cur, prev, s, row[range.x0[k]], row[range.x1[k] + 1], sink);
            }
        room = room && compareRange(g.slots, cur, prev, s, loose ? g.looseBegin : s + 1, g.looseEnd, sink);
        if (!room) {
            sink.count = mark;
            return i;
        }
    }
    return end;
}
