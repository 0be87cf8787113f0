// The walk down two trees at once. Included by kernel/Kernels.inl only.

template <typename V>
struct Touching {
    using Block = Placed<V::kRows>;
    static constexpr unsigned kRows = V::kRows;

    const TreeView& a;
    const TreeView& b;
    const PairFrame& f;
    TouchSink& sink;

    const float* nodeA(Slot slot) const { return a.volumes + std::size_t{slot / kWidth} * kRows * kWidth; }
    const float* nodeB(Slot slot) const { return b.volumes + std::size_t{slot / kWidth} * kRows * kWidth; }
    void placeB(const float* node, Block& out) const { V::place(node, f, f.bInA, out.row); }
    void placeA(const float* node, Block& out) const { V::place(node, f, f.aInB, out.row); }
    bool bothWays() const { return V::kBothWays && f.bothWays; }

    /// Lanes of A's node that one volume of B, placed in A's frame, overlaps.
    Bits overlapA(const float* placedB, const float* ownA) const {
        if constexpr (std::is_same_v<V, Obb>) return 0xffffu & ~greater(V::template gap<true>(placedB, ownA, f), splat(f.slack));
        else if constexpr (std::is_same_v<V, Sphere>) return 0xffffu & ~greater(V::gap(placedB, ownA, f), splat(f.slack));
        else return 0xffffu & ~greater(V::gap(placedB, ownA), splat(f.slack));
    }
    /// Lanes of B's node, placed in A's frame, that one volume of A overlaps.
    Bits overlapB(const float* ownA, const float* placedB) const {
        if constexpr (std::is_same_v<V, Obb>) return 0xffffu & ~greater(V::template gap<false>(ownA, placedB, f), splat(f.slack));
        else return overlapA(ownA, placedB);
    }
    /// Lanes where one volume and many overlap in B's frame too.
    Bits overlapInB(const float* one, const float* many) const {
        if constexpr (V::kBothWays) return ~greater(V::gap(one, many), splat(f.slackB));
        else return ~0u;
    }

    bool leaves(ChildRef refA, ChildRef refB) {
        const std::size_t leafA = (refA & ~kLeafBit) >> 2, leafB = (refB & ~kLeafBit) >> 2;
        const unsigned countA = (refA & 3) + 1, countB = (refB & 3) + 1;
        sink.triangleTests += countA * countB;
        Bits left = mayMeet(a.corners + leafA * kLeafRows * kLeafFaces, countA, b.corners + leafB * kLeafRows * kLeafFaces,
                            countB, f);
        if (left == 0) return false;
        while (left != 0) {
            const unsigned bit = static_cast<unsigned>(__builtin_ctz(left));
            left &= left - 1;
            sink.facesA[sink.count] = a.faces[leafA * kLeafFaces + bit / 4];
            sink.facesB[sink.count] = b.faces[leafB * kLeafFaces + bit % 4];
            ++sink.count;
        }
        if (sink.eager || sink.count + kLeafPairs > sink.capacity) return sink.flush(sink, sink.context);
        return false;
    }

    /// Both slots' volumes overlap. blockB: the node of slotB placed in A's frame; blockA: that of slotA in B's, where both
    /// frames are looked at. Only what overlaps in A's frame is compared in B's.
    bool descend(Slot slotA, Slot slotB, const Block& blockA, const Block& blockB, unsigned levels) {
        const ChildRef refA = a.children[slotA], refB = b.children[slotB];
        if ((refA & refB & kLeafBit) != 0) return leaves(refA, refB);
        if (levels == 0) {
            sink.later[sink.laterCount++] = {slotA, slotB};
            return false;
        }
        if (sink.nodeTests + sink.triangleTests >= sink.limit) {
            sink.exhausted = true;
            return true;
        }
        const unsigned laneA = slotA % kWidth, laneB = slotB % kWidth;
        if ((refB & kLeafBit) != 0) {  // only A goes down
            const Slot firstA = refA * kWidth;
            const float* const ownA = nodeA(firstA);
            ++sink.nodeTests;
            Bits lanes = overlapA(blockB.row + laneB, ownA);
            if (lanes == 0) return false;
            Block placedA;
            if (bothWays()) {
                placeA(ownA, placedA);
                lanes &= overlapInB(nodeB(slotB) + laneB, placedA.row);
            }
            for (; lanes != 0; lanes &= lanes - 1)
                if (descend(firstA + static_cast<unsigned>(__builtin_ctz(lanes)), slotB, placedA, blockB, levels - 1)) return true;
            return false;
        }
        Block placedB;
        const Slot firstB = refB * kWidth;
        const float* const ownB = nodeB(firstB);
        placeB(ownB, placedB);
        ++sink.nodeTests;
        Bits lanesB = overlapB(nodeA(slotA) + laneA, placedB.row);
        if (bothWays() && lanesB != 0) lanesB &= overlapInB(blockA.row + laneA, ownB);
        if ((refA & kLeafBit) != 0) {  // only B goes down
            for (; lanesB != 0; lanesB &= lanesB - 1)
                if (descend(slotA, firstB + static_cast<unsigned>(__builtin_ctz(lanesB)), blockA, placedB, levels - 1)) return true;
            return false;
        }
        Block placedA;
        bool placed = false;
        const Slot firstA = refA * kWidth;
        const float* const ownA = nodeA(firstA);
        for (; lanesB != 0; lanesB &= lanesB - 1) {
            const unsigned laneOfB = static_cast<unsigned>(__builtin_ctz(lanesB));
            ++sink.nodeTests;
            Bits lanesA = overlapA(placedB.row + laneOfB, ownA);
            if (lanesA == 0) continue;
            if (bothWays()) {
                if (!placed) placeA(ownA, placedA);
                placed = true;
                lanesA &= overlapInB(ownB + laneOfB, placedA.row);
            }
            for (; lanesA != 0; lanesA &= lanesA - 1)
                if (descend(firstA + static_cast<unsigned>(__builtin_ctz(lanesA)), firstB + laneOfB, placedA, placedB, levels - 1))
                    return true;
        }
        return false;
    }

    static bool walk(const TreeView& a, const TreeView& b, const PairFrame& f, SlotPair start, unsigned levels, TouchSink& sink) {
        Touching touching{a, b, f, sink};
        Block blockA, blockB;
        if (touching.bothWays()) touching.placeA(touching.nodeA(start.a), blockA);
        touching.placeB(touching.nodeB(start.b), blockB);
        return touching.descend(start.a, start.b, blockA, blockB, levels);
    }

    static bool overlap(const TreeView& a, const TreeView& b, const PairFrame& f, SlotPair pair) {
        TouchSink unused{};
        const Touching touching{a, b, f, unused};
        Block block;
        touching.placeB(touching.nodeB(pair.b), block);
        const unsigned laneA = pair.a % kWidth, laneB = pair.b % kWidth;
        if ((touching.overlapA(block.row + laneB, touching.nodeA(pair.a)) >> laneA & 1u) == 0) return false;
        if (!touching.bothWays()) return true;
        touching.placeA(touching.nodeA(pair.a), block);
        return (touching.overlapInB(touching.nodeB(pair.b) + laneB, block.row) >> laneA & 1u) != 0;
    }
};
