// k-DOPs around the triangles below every slot (Fit.inl). Included by kernel/Kernels.inl only.

template <unsigned K>
struct DopFit {
    static constexpr unsigned kRows = K, kHalf = K / 2;
    /// Three coordinates, each wrong by u, and two sums of at most 3 of them: less than 7 u with this one's own
    /// rounding.
    static constexpr float kPad = 8 * kUnitRoundoff;

    TESSERA_INLINE static void project(const P3& p, P (&out)[kHalf]) {
        const P x = p.x, y = p.y, z = p.z;
        out[0] = x;
        out[1] = y;
        out[2] = z;
        if constexpr (K == 18 || K == 26) {
            out[3] = x + y;
            out[4] = x - y;
            out[5] = x + z;
            out[6] = x - z;
            out[7] = y + z;
            out[8] = y - z;
        }
        if constexpr (K == 14 || K == 26) {
            const P plus = x + y, minus = x - y;
            out[kHalf - 4] = plus + z;
            out[kHalf - 3] = plus - z;
            out[kHalf - 2] = minus + z;
            out[kHalf - 1] = minus - z;
        }
    }

    static void leafLanes(const LeafLanes& leaves, float* rows) {
        P low[kHalf], high[kHalf];
        project(leaves.corner(0, 0), low);
        for (unsigned i = 0; i < kHalf; ++i) high[i] = low[i];
        leaves.forCorners([&](const P3& p) {
            P at[kHalf];
            project(p, at);
            for (unsigned i = 0; i < kHalf; ++i) {
                low[i] = min(low[i], at[i]);
                high[i] = max(high[i], at[i]);
            }
        });
        for (unsigned i = 0; i < kHalf; ++i) {
            storePart(rows + i * kWidth, high[i] + kPad);
            storePart(rows + (i + kHalf) * kWidth, kPad - low[i]);
        }
    }

    /// The largest of each of four rows; empty slots are far below the others.
    TESSERA_INLINE static __m128 fourLargest(const float* const* rows) {
        __m128 v[4];
        for (unsigned i = 0; i < 4; ++i)
            v[i] = _mm_max_ps(_mm_max_ps(_mm_load_ps(rows[i]), _mm_load_ps(rows[i] + 4)),
                              _mm_max_ps(_mm_load_ps(rows[i] + 8), _mm_load_ps(rows[i] + 12)));
        const __m128 ab = _mm_max_ps(_mm_unpacklo_ps(v[0], v[1]), _mm_unpackhi_ps(v[0], v[1])),
                     cd = _mm_max_ps(_mm_unpacklo_ps(v[2], v[3]), _mm_unpackhi_ps(v[2], v[3]));
        return _mm_max_ps(_mm_movelh_ps(ab, cd), _mm_movehl_ps(cd, ab));
    }

    static void fit(const FitJob& job, const SlotLanes& slots, std::uint32_t node, float* rows) {
        for (unsigned part = 0; part < kWidth / kLanes; ++part) {
            const Bits lanes = SlotLanes::ofPart(slots.leaves, part);
            if (lanes == 0) continue;
            LeafLanes leaves;
            leaves.gather(slots.leaf + part * kLanes, slots.counts + part * kLanes);
            leafLanes(leaves, rows + part * kLanes);
        }
        forLanes(slots.subtrees, [&](unsigned lane) {
            const float* const below =
                job.volumes + std::size_t{job.children[std::size_t{node} * kWidth + lane]} * kRows * kWidth;
            for (unsigned row = 0; row < kRows; row += 4) {
                const float* four[4];
                for (unsigned i = 0; i < 4; ++i) four[i] = below + (row + i < kRows ? row + i : kRows - 1) * kWidth;
                alignas(16) float most[4];
                _mm_store_ps(most, fourLargest(four));
                for (unsigned i = 0; i < 4 && row + i < kRows; ++i) rows[(row + i) * kWidth + lane] = most[i];
            }
        });
        forLanes(~slots.used() & 0xffffu, [&](unsigned lane) {
            for (unsigned row = 0; row < kRows; ++row) rows[row * kWidth + lane] = kNever;
        });
    }

    /// The surface of its axis-aligned box.
    TESSERA_INLINE static P size(const float* rows) {
        const auto side = [&](unsigned i) {
            return loadPart(rows + i * kWidth) + loadPart(rows + (i + kHalf) * kWidth);
        };
        return halfArea({side(0), side(1), side(2)}) * 2.0f;
    }
};
