// Boxes around boxes, sixteen at a time. Included by SlotKernels.inl only.

void treeLeaves(const TreeView& tree, size_t begin, size_t end) {
    for (size_t leaf = begin; leaf < end; ++leaf)
        for (int a = 0; a < 3; ++a) {
            const size_t s0 = leaf * kLeafSlots;
            F lower = splat(kNowhere), upper = splat(-kNowhere);
            for (size_t k = 0; k < kLeafSlots; k += kWidth) {
                lower = min(lower, min(load(tree.slots.cur[a] + s0 + k), load(tree.slots.prev[a] + s0 + k)));
                upper = max(upper, max(load(tree.slots.cur[3 + a] + s0 + k), load(tree.slots.prev[3 + a] + s0 + k)));
            }
            tree.box[0][a][leaf] = least(lower);
            tree.box[0][3 + a][leaf] = most(upper);
        }
}

void treeUpper(const TreeView& tree) {
    for (int level = 1; level < tree.levels; ++level)
        for (size_t node = 0; node < tree.nodes[level]; ++node)
            for (int a = 0; a < 3; ++a) {
                F lower = splat(kNowhere), upper = splat(-kNowhere);
                for (size_t k = 0; k < kLeafSlots; k += kWidth) {
                    lower = min(lower, load(tree.box[level - 1][a] + node * kLeafSlots + k));
                    upper = max(upper, load(tree.box[level - 1][3 + a] + node * kLeafSlots + k));
                }
                tree.box[level][a][node] = least(lower);
                tree.box[level][3 + a][node] = most(upper);
            }
}

/// Which of 16 boxes overlap one?
inline Bits meeting(const F* box, const float* const* arrays, size_t at) {
    Bits bits = 0;
    for (size_t k = 0; k < kLeafSlots; k += kWidth)
        bits |= atLeast(overlap(box, arrays, at + k), splat(0.0F)) << k;
    return bits;
}

/// Calls visit(leaf) for the leaves from `first` on whose boxes overlap this one, until it returns false.
template <typename Visit>
inline bool forLeaves(const TreeView& tree, const F* box, size_t first, PairSink& sink, const Visit& visit) {
    struct Entry {
        uint32_t level, node;
    };
    Entry stack[kLeafSlots * TreeView::kMaxLevels];
    size_t top = 0;
    stack[top++] = {static_cast<uint32_t>(tree.levels - 1), 0};
    while (top > 0) {
        const Entry e = stack[--top];
        if (e.level == 0) {
            if (e.node >= first && !visit(e.node)) return false;
            continue;
        }
        ++sink.steps;
        // Children that end before the first leaf are left out; those beyond the last node are empty.
        Bits hits = meeting(box, tree.box[e.level - 1], size_t{e.node} * kLeafSlots);
        const size_t span = size_t{1} << 4 * (e.level - 1);
        while (hits != 0) {
            const auto k = static_cast<uint32_t>(31 - __builtin_clz(hits));
            hits ^= 1u << k;
            const uint32_t child = e.node * static_cast<uint32_t>(kLeafSlots) + k;
            if ((child + 1) * span > first) stack[top++] = {e.level - 1, child};
        }
    }
    return true;
}

size_t treeAll(const TreeView& tree, size_t begin, size_t end, PairSink& sink) {
    for (size_t leaf = begin; leaf < end; ++leaf) {
        const size_t mark = sink.count;
        const size_t s0 = leaf * kLeafSlots;
        F box[6];
        for (int k = 0; k < 6; ++k) box[k] = splat(tree.box[0][k] + leaf);
        const bool done = forLeaves(tree, box, leaf, sink, [&](size_t other) {
            F otherBox[6];
            for (int k = 0; k < 6; ++k) otherBox[k] = splat(tree.box[0][k] + other);
            const size_t last = (other + 1) * kLeafSlots < tree.slotCount ? (other + 1) * kLeafSlots : tree.slotCount;
            Bits mine = other == leaf ? 0xffffu
                                      : meeting(otherBox, tree.slots.cur, s0) | meeting(otherBox, tree.slots.prev, s0);
            for (; mine != 0; mine &= mine - 1) {
                const size_t s = s0 + static_cast<size_t>(__builtin_ctz(mine));
                if (s >= tree.slotCount) break;
                const size_t from = other == leaf ? s + 1 : other * kLeafSlots;
                if (!compareRange(tree.slots, probe(tree.slots, s), s, from, last, sink)) return false;
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
        const Probe p = probe(tree.slots, s);
        F box[6];
        for (int a = 0; a < 3; ++a) {
            box[a] = min(p.cur[a], p.prev[a]);
            box[3 + a] = max(p.cur[3 + a], p.prev[3 + a]);
        }
        const bool done = forLeaves(tree, box, 0, sink, [&](size_t leaf) {
            const size_t last = (leaf + 1) * kLeafSlots < tree.slotCount ? (leaf + 1) * kLeafSlots : tree.slotCount;
            return compareRange(tree.slots, p, s, leaf * kLeafSlots, last, sink);
        });
        if (!done) {
            sink.count = mark;
            return i;
        }
    }
    return end;
}
