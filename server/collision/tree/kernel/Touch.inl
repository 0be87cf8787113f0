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
    void placeA(const float* node, Block& out) const {
        if constexpr (V::kBothWays)
            if (f.bothWays) V::place(node, f, f.aInB, out.row);
    }

    /// Lanes of A's node that overlap one volume of B (placed, and as it is); `many` likewise.
    Bits overlapA(const float* placedB, const float* ownB, const float* ownA, const float* placedA) const {
        Bits apart;
        if constexpr (std::is_same_v<V, Obb>) apart = greater(V::template gap<true>(placedB, ownA, f), splat(f.slack));
        else if constexpr (std::is_same_v<V, Sphere>) apart = greater(V::gap(placedB, ownA, f), splat(f.slack));
        else apart = greater(V::gap(placedB, ownA), splat(f.slack));
        if constexpr (V::kBothWays)
            if (f.bothWays) apart |= greater(V::gap(ownB, placedA), splat(f.slackB));
        return ~apart & 0xffffu;
    }
    /// Lanes of B's node that overlap one volume of A.
    Bits overlapB(const float* ownA, const float* placedA, const float* placedB, const float* ownB) const {
        Bits apart;
        if constexpr (std::is_same_v<V, Obb>) apart = greater(V::template gap<false>(ownA, placedB, f), splat(f.slack));
        else if constexpr (std::is_same_v<V, Sphere>) apart = greater(V::gap(ownA, placedB, f), splat(f.slack));
        else apart = greater(V::gap(ownA, placedB), splat(f.slack));
        if constexpr (V::kBothWays)
            if (f.bothWays) apart |= greater(V::gap(placedA, ownB), splat(f.slackB));
        return ~apart & 0xffffu;
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

    /// Both slots' volumes overlap. blockB: the node of slotB placed in A's frame; blockA likewise.
    bool descend(Slot slotA, Slot slotB, const Block& blockA, const Block& blockB, unsigned levels) {
        const ChildRef refA = a.children[slotA], refB = b.children[slotB];
        // Lanes without a child pass where a map shrinks everything to nothing or the slack is without bound.
        if (refA == kNoChild || refB == kNoChild) return false;
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
            Block placedA;
            const Slot firstA = refA * kWidth;
            const float* const ownA = nodeA(firstA);
            placeA(ownA, placedA);
            ++sink.nodeTests;
            Bits lanes = overlapA(blockB.row + laneB, nodeB(slotB) + laneB, ownA, placedA.row);
            for (; lanes != 0; lanes &= lanes - 1)
                if (descend(firstA + static_cast<unsigned>(__builtin_ctz(lanes)), slotB, placedA, blockB, levels - 1)) return true;
            return false;
        }
        Block placedB;
        const Slot firstB = refB * kWidth;
        const float* const ownB = nodeB(firstB);
        placeB(ownB, placedB);
        ++sink.nodeTests;
        Bits lanesB = overlapB(nodeA(slotA) + laneA, blockA.row + laneA, placedB.row, ownB);
        if ((refA & kLeafBit) != 0) {  // only B goes down
            for (; lanesB != 0; lanesB &= lanesB - 1)
                if (descend(slotA, firstB + static_cast<unsigned>(__builtin_ctz(lanesB)), blockA, placedB, levels - 1)) return true;
            return false;
        }
        if (lanesB == 0) return false;
        Block placedA;
        const Slot firstA = refA * kWidth;
        const float* const ownA = nodeA(firstA);
        placeA(ownA, placedA);
        for (; lanesB != 0; lanesB &= lanesB - 1) {
            const unsigned laneOfB = static_cast<unsigned>(__builtin_ctz(lanesB));
            ++sink.nodeTests;
            Bits lanesA = overlapA(placedB.row + laneOfB, ownB + laneOfB, ownA, placedA.row);
            for (; lanesA != 0; lanesA &= lanesA - 1)
                if (descend(firstA + static_cast<unsigned>(__builtin_ctz(lanesA)), firstB + laneOfB, placedA, placedB, levels - 1))
                    return true;
        }
        return false;
    }

    static bool walk(const TreeView& a, const TreeView& b, const PairFrame& f, SlotPair start, unsigned levels, TouchSink& sink) {
        Touching touching{a, b, f, sink};
        Block blockA, blockB;
        touching.placeA(touching.nodeA(start.a), blockA);
        touching.placeB(touching.nodeB(start.b), blockB);
        return touching.descend(start.a, start.b, blockA, blockB, levels);
    }

    static bool overlap(const TreeView& a, const TreeView& b, const PairFrame& f, SlotPair pair) {
        TouchSink unused{};
        const Touching touching{a, b, f, unused};
        Block blockA, blockB;
        touching.placeA(touching.nodeA(pair.a), blockA);
        touching.placeB(touching.nodeB(pair.b), blockB);
        const unsigned laneA = pair.a % kWidth, laneB = pair.b % kWidth;
        return (touching.overlapA(blockB.row + laneB, touching.nodeB(pair.b) + laneB, touching.nodeA(pair.a), blockA.row) >> laneA &
                1u) != 0;
    }
};
