// The walk down two trees at once. Included by kernel/Kernels.inl only.

template <typename V>
struct Touching {
    using Block = Placed<V::kRows>;
    static constexpr unsigned kRows = V::kRows;

    const TreeView& a;
    const TreeView& b;
    const PairFrame& f;
    TouchSink& sink;
    /// Pairs of leaves to look at. They come a few at a time, from anywhere in memory; done in one go, their corners
    /// have arrived, and the walk has gone on meanwhile.
    static constexpr unsigned kMostLeaves = 16;
    unsigned waiting;
    ChildRef waitingA[kMostLeaves + kWidth], waitingB[kMostLeaves + kWidth];

    Touching(const TreeView& treeA, const TreeView& treeB, const PairFrame& frame, TouchSink& to)
        : a(treeA), b(treeB), f(frame), sink(to), waiting(0) {}

    const float* nodeA(Slot slot) const { return a.volumes + std::size_t{slot / kWidth} * kRows * kWidth; }
    const float* nodeB(Slot slot) const { return b.volumes + std::size_t{slot / kWidth} * kRows * kWidth; }
    const float* cornersA(ChildRef leaf) const {
        return a.corners + ((leaf & ~kLeafBit) >> 2) * std::size_t{kLeafRows * kLeafFaces};
    }
    const float* cornersB(ChildRef leaf) const {
        return b.corners + ((leaf & ~kLeafBit) >> 2) * std::size_t{kLeafRows * kLeafFaces};
    }
    void placeB(const float* node, Block& out) const {
        const auto number = [&] { return static_cast<std::size_t>(node - b.volumes) / (kRows * kWidth); };
        if constexpr (requires { &V::placeNode; })
            V::placeNode(b, number(), *f.lookups, out.row);
        else
            V::place(node, f, f.bInA, out.row);
        if (sink.placed != nullptr) sink.placed(out.row, b.children + number() * kWidth, sink.placedContext);
    }
    void placeA(const float* node, Block& out) const { V::place(node, f, f.aInB, out.row); }
    bool bothWays() const { return V::kBothWays && f.bothWays; }

    /// Gaps between A's node and one volume of B, placed in A's frame.
    F gapsA(const float* placedB, const float* ownA) const {
        if constexpr (std::is_same_v<V, Obb>)
            return V::template gap<true>(placedB, ownA, f);
        else if constexpr (std::is_same_v<V, Sphere>)
            return V::gap(placedB, ownA, f);
        else
            return V::gap(placedB, ownA);
    }
    /// Gaps between B's node, placed in A's frame, and one volume of A.
    F gapsB(const float* ownA, const float* placedB) const {
        if constexpr (std::is_same_v<V, Obb>)
            return V::template gap<false>(ownA, placedB, f);
        else
            return gapsA(ownA, placedB);
    }
    Bits overlaps(F gaps) const { return 0xffffu & ~greater(gaps, splat(f.slack)); }

    /// The lane that overlaps most deeply. Where one pair is enough, something is met soonest there.
    static unsigned deepest(Bits lanes, F gaps) {
        alignas(64) float gap[kWidth];
        store(gap, gaps);
        unsigned lane = static_cast<unsigned>(__builtin_ctz(lanes));
        for (Bits more = lanes & (lanes - 1); more != 0; more &= more - 1) {
            const unsigned other = static_cast<unsigned>(__builtin_ctz(more));
            if (gap[other] < gap[lane]) lane = other;
        }
        return lane;
    }

    /// Lanes where one volume and many overlap in B's frame too.
    Bits overlapInB(const float* one, const float* many) const {
        if constexpr (V::kBothWays)
            return ~greater(V::gap(one, many), splat(f.slackB));
        else
            return ~0u;
    }

    static void prefetchLeaf(const float* corners) {
        __builtin_prefetch(corners);
        __builtin_prefetch(corners + 16);
        __builtin_prefetch(corners + 32);
    }
    /// Some leaves of one of A's nodes against a leaf of B. True: that was the end.
    bool queueLeaves(Slot firstA, Bits lanesA, ChildRef refB) {
        if (lanesA != 0) prefetchLeaf(cornersB(refB));
        for (Bits lanes = lanesA; lanes != 0; lanes &= lanes - 1)
            prefetchLeaf(cornersA(a.children[firstA + static_cast<unsigned>(__builtin_ctz(lanes))]));
        waiting += keep(waitingA + waiting, waitingB + waiting, a.children + firstA, lanesA, refB);
        return waiting >= sink.enoughLeaves && testLeaves();
    }

    bool testLeaves() {
        PlacedLeaf placed;
        ChildRef last = kNoChild;
        for (unsigned i = 0; i < waiting; ++i) {
            const ChildRef refA = waitingA[i], refB = waitingB[i];
            if (refA == kNoChild) continue;
            if (refB != last) placed.place(cornersB(refB), f, splat(f.slack));
            last = refB;
            const unsigned countA = (refA & 3) + 1, countB = (refB & 3) + 1;
            sink.triangleTests += countA * countB;
            Bits left = mayMeet(cornersA(refA), countA, placed, countB, splat(f.slack));
            if (left == 0) continue;
            const std::size_t leafA = (refA & ~kLeafBit) >> 2, leafB = (refB & ~kLeafBit) >> 2;
            for (; left != 0; left &= left - 1) {
                const unsigned bit = static_cast<unsigned>(__builtin_ctz(left));
                sink.facesA[sink.count] = a.faces[leafA * kLeafFaces + bit / 4];
                sink.facesB[sink.count] = b.faces[leafB * kLeafFaces + bit % 4];
                ++sink.count;
            }
            if (sink.count >= sink.enough && sink.flush(sink, sink.context)) return true;
        }
        waiting = 0;
        return false;
    }

    /// The pair is for later, if there is room.
    bool putOff(Slot slotA, Slot slotB, unsigned levels) {
        if (levels != 0 || sink.laterCount == sink.laterCapacity) return false;
        sink.later[sink.laterCount++] = {slotA, slotB};
        return true;
    }

    /// Some slots of one of A's nodes overlap a slot of B. blockB: the node of slotB placed in A's frame; blockA: that
    /// of A's slots in B's, where both frames are looked at. What is B's is placed once for all of them.
    bool descend(Slot firstA, Bits lanesA, Slot slotB, const Block& blockA, const Block& blockB, unsigned levels) {
        // Where a map fits no float (PairFrame.cpp) empty lanes overlap too.
        const ChildRef refB = b.children[slotB];
        if (refB == kNoChild) return false;
        if (sink.nodeTests + sink.triangleTests >= sink.limit) return sink.exhausted = true;
        if ((refB & kLeafBit) != 0) {
            const Bits leaves = highest(a.children + firstA);
            if (queueLeaves(firstA, lanesA & leaves, refB)) return true;
            for (lanesA &= ~leaves; lanesA != 0; lanesA &= lanesA - 1) {
                const Slot slotA = firstA + static_cast<unsigned>(__builtin_ctz(lanesA));
                if (descendA(a.children[slotA] * kWidth, slotA, slotB, blockB, levels)) return true;
            }
            return false;
        }
        Block below;
        bool placed = false;
        for (; lanesA != 0; lanesA &= lanesA - 1) {
            const Slot slotA = firstA + static_cast<unsigned>(__builtin_ctz(lanesA));
            if (a.children[slotA] == kNoChild) continue;
            if (putOff(slotA, slotB, levels)) continue;
            if (!placed) placeB(nodeB(refB * kWidth), below);
            placed = true;
            sink.place = {slotA, slotB};
            if (descendBoth(slotA, refB * kWidth, blockA, below, levels - 1)) return true;
        }
        return false;
    }

    /// B has a leaf, A a node: only A goes down.
    bool descendA(Slot firstA, Slot slotA, Slot slotB, const Block& blockB, unsigned levels) {
        if (putOff(slotA, slotB, levels)) return false;
        const unsigned laneB = slotB % kWidth;
        const float* const ownA = nodeA(firstA);
        ++sink.nodeTests;
        Bits lanes = overlaps(gapsA(blockB.row + laneB, ownA));
        if (lanes == 0) return false;
        Block placedA;
        if (bothWays()) {
            placeA(ownA, placedA);
            lanes &= overlapInB(nodeB(slotB) + laneB, placedA.row);
        }
        return descend(firstA, lanes, slotB, placedA, blockB, levels - 1);
    }

    /// The slots of B's node at firstB, placed in A's frame, against a slot of A and then what is below it.
    bool descendBoth(Slot slotA, Slot firstB, const Block& blockA, const Block& placedB, unsigned levels) {
        const unsigned laneA = slotA % kWidth;
        const ChildRef refA = a.children[slotA];
        const float* const ownB = nodeB(firstB);
        ++sink.nodeTests;
        const F gaps = gapsB(nodeA(slotA) + laneA, placedB.row);
        Bits lanesB = overlaps(gaps);
        if (bothWays() && lanesB != 0) lanesB &= overlapInB(blockA.row + laneA, ownB);
        if ((refA & kLeafBit) != 0) {
            for (; lanesB != 0; lanesB &= lanesB - 1)
                if (descend(slotA - laneA, 1u << laneA, firstB + static_cast<unsigned>(__builtin_ctz(lanesB)), blockA,
                            placedB, levels))
                    return true;
            return false;
        }
        Block placedA;
        bool placed = false;
        const Slot firstA = refA * kWidth;
        const float* const ownA = nodeA(firstA);
        bool first = sink.deepestFirst && (lanesB & (lanesB - 1)) != 0;
        while (lanesB != 0) {
            const unsigned laneB = first ? deepest(lanesB, gaps) : static_cast<unsigned>(__builtin_ctz(lanesB));
            first = false;
            lanesB &= ~(1u << laneB);
            ++sink.nodeTests;
            Bits lanesA = overlaps(gapsA(placedB.row + laneB, ownA));
            if (lanesA == 0) continue;
            if (bothWays()) {
                if (!placed) placeA(ownA, placedA);
                placed = true;
                lanesA &= overlapInB(ownB + laneB, placedA.row);
            }
            if (descend(firstA, lanesA, firstB + laneB, placedA, placedB, levels)) return true;
        }
        return false;
    }

    static bool walk(const TreeView& a, const TreeView& b, const PairFrame& f, SlotPair start, unsigned levels,
                     TouchSink& sink) {
        Touching touching(a, b, f, sink);
        Block blockA, blockB;
        if (touching.bothWays()) touching.placeA(touching.nodeA(start.a), blockA);
        touching.placeB(touching.nodeB(start.b), blockB);
        const unsigned lane = start.a % kWidth;
        const bool over = touching.descend(start.a - lane, 1u << lane, start.b, blockA, blockB, levels);
        if (over && !sink.exhausted) return true;
        return touching.testLeaves() || over;
    }

    static bool overlap(const TreeView& a, const TreeView& b, const PairFrame& f, SlotPair pair) {
        TouchSink unused{};
        const Touching touching(a, b, f, unused);
        Block block;
        touching.placeB(touching.nodeB(pair.b), block);
        const unsigned laneA = pair.a % kWidth, laneB = pair.b % kWidth;
        if ((touching.overlaps(touching.gapsA(block.row + laneB, touching.nodeA(pair.a))) >> laneA & 1u) == 0)
            return false;
        if (!touching.bothWays()) return true;
        touching.placeA(touching.nodeA(pair.a), block);
        return (touching.overlapInB(touching.nodeB(pair.b) + laneB, block.row) >> laneA & 1u) != 0;
    }
};
