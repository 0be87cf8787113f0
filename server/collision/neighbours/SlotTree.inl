// Boxes around boxes, sixteen at a time. Included by SlotKernels.inl only.

/// The box around sixteen: node `block` of the level above.
inline void around(const float* keys, const float* keysBefore, size_t block, float* level) {
    for (size_t k = 0; k < 6; ++k) {
        F outermost = splat(-kNowhere);
        for (size_t i = 0; i < kBlockSlots; i += kWidth) {
            const size_t at = block * kBlockFloats + k * kBlockSlots + i;
            outermost = max(outermost, max(load(keys + at), load(keysBefore + at)));
        }
        level[keyIndex(k, block)] = most(outermost);
    }
}

void treeLeaves(const TreeView& tree, size_t begin, size_t end) {
    for (size_t leaf = begin; leaf < end; ++leaf) around(tree.slots.cur, tree.slots.prev, leaf, tree.box[0]);
}

void treeUpper(const TreeView& tree) {
    for (int level = 1; level < tree.levels; ++level)
        for (size_t node = 0; node < tree.nodes[level]; ++node)
            around(tree.box[level - 1], tree.box[level - 1], node, tree.box[level]);
}

/// Which of the sixteen boxes of a block overlap one?
inline Bits meeting(const Keys& box, const float* keys, size_t block) {
    Bits bits = 0;
    for (size_t k = 0; k < kBlockSlots; k += kWidth)
        bits |= atLeast(overlap(box, loadKeys(keys, block * kBlockSlots + k)), splat(0.0F)) << k;
    return bits;
}

/// Calls visit(leaf) for the leaves from `first` on whose boxes overlap this one, until it returns false.
template <typename Visit>
inline bool forLeaves(const TreeView& tree, const Keys& box, size_t first, const Visit& visit) {
    struct Entry {
        uint32_t level, node;
    };
    Entry stack[kBlockSlots * TreeView::kMaxLevels];
    size_t top = 0;
    if (tree.levels == 1) return first > 0 || visit(0);
    stack[top++] = {static_cast<uint32_t>(tree.levels - 1), 0};
    while (top > 0) {
        const Entry e = stack[--top];
        Bits hits = meeting(box, tree.box[e.level - 1], e.node);
        const size_t child = size_t{e.node} * kBlockSlots;
        if (e.level == 1) {
            if (first > child) hits &= ~Bits{0} << (first - child < kBlockSlots ? first - child : kBlockSlots);
            for (; hits != 0; hits &= hits - 1)
                if (!visit(child + static_cast<size_t>(__builtin_ctz(hits)))) return false;
            continue;
        }
        // Children that end before the first leaf are left out.
        const size_t span = size_t{1} << 4 * (e.level - 1);
        while (hits != 0) {
            const auto k = static_cast<uint32_t>(31 - __builtin_clz(hits));
            hits ^= 1u << k;
            if ((child + k + 1) * span > first) stack[top++] = {e.level - 1, static_cast<uint32_t>(child) + k};
        }
    }
    return true;
}

size_t treeAll(const TreeView& tree, size_t begin, size_t end, PairSink& sink) {
    for (size_t leaf = begin; leaf < end; ++leaf) {
        const size_t mark = sink.count;
        const size_t s0 = leaf * kBlockSlots;
        const float* const cur = tree.slots.cur + leaf * kBlockFloats;
        const float* const prev = tree.slots.prev + leaf * kBlockFloats;
        alignas(64) float mine[kBlockFloats];
        for (size_t i = 0; i < kBlockFloats; i += kWidth) store(mine + i, max(load(cur + i), load(prev + i)));
        const bool done = forLeaves(tree, splatKeys(tree.box[0], leaf), leaf, [&](size_t other) {
            if (sink.capacity - sink.count < kBlockSlots * kBlockSlots) return false;
            const Bits searching = other == leaf ? 0xffffu : meeting(splatKeys(tree.box[0], other), mine, 0);
            for (size_t k = 0; k < kBlockSlots; k += kWidth) {
                const size_t at = other * kBlockSlots + k;
                const Keys othersCur = loadKeys(tree.slots.cur, at), othersPrev = loadKeys(tree.slots.prev, at);
                for (Bits left = searching; left != 0; left &= left - 1) {
                    const auto i = static_cast<size_t>(__builtin_ctz(left));
                    // In one leaf, only those that come after.
                    const Bits lanes = other == leaf ? ~Bits{1} << i >> k : ~Bits{0};
                    compare(splatKeys(cur, i), splatKeys(prev, i), othersCur, othersPrev, s0 + i, at, lanes & kAllLanes,
                            sink);
                }
            }
            return true;
        });
        if (!done) {
            sink.count = mark;
            return leaf;
        }
    }
    return end;
}

size_t treeSome(const TreeView& tree, const uint32_t* slots, size_t begin, size_t end, PairSink& sink) {
    for (size_t i = begin; i < end; ++i) {
        const uint32_t s = slots[i];
        const size_t mark = sink.count;
        const Keys cur = splatKeys(tree.slots.cur, s), prev = splatKeys(tree.slots.prev, s);
        const bool done = forLeaves(tree, swept(cur, prev), 0, [&](size_t leaf) {
            return compareRange(tree.slots, cur, prev, s, leaf * kBlockSlots, (leaf + 1) * kBlockSlots, sink);
        });
        if (!done) {
            sink.count = mark;
            return i;
        }
    }
    return end;
}
