// Bounding volumes, sixteen at once. Each kind says how a node of B is placed in A's frame, and how far volumes in one
// frame are apart along the axes that it looks at. Included by kernel/Kernels.inl only.

/// One node's volumes, placed in the other body's frame: rows as in the tree.
template <unsigned Rows>
struct alignas(64) Placed {
    float row[Rows * kWidth];
};

struct Sphere {
    static constexpr unsigned kRows = 4;
    static constexpr bool kBothWays = false;

    TESSERA_INLINE static void place(const float* node, const PairFrame& f, const Realigned&, float* out) {
        const V3 c =
            offset(mapped(f.linear, V3{load(node), load(node + kWidth), load(node + 2 * kWidth)}), f.translation);
        store(out, c.x);
        store(out + kWidth, c.y);
        store(out + 2 * kWidth, c.z);
        store(out + 3 * kWidth, load(node + 3 * kWidth) * f.stretch);
    }

    TESSERA_INLINE static F gap(const float* one, const float* many, const PairFrame&) {
        const V3 d{load(many) - one[0], load(many + kWidth) - one[kWidth], load(many + 2 * kWidth) - one[2 * kWidth]};
        return sqrt(dot(d, d)) - (load(many + 3 * kWidth) + one[3 * kWidth]);
    }
};

/// Separating axes: the faces of both boxes (Gottschalk, Lin, Manocha 1996). Crossed edges are left out: they settle
/// few pairs and cost as much as all faces together.
struct Obb {
    static constexpr unsigned kRows = 15;
    static constexpr bool kBothWays = false;

    TESSERA_INLINE static void place(const float* node, const PairFrame& f, const Realigned&, float* out) {
        const V3 c =
            offset(mapped(f.linear, V3{load(node), load(node + kWidth), load(node + 2 * kWidth)}), f.translation);
        store(out, c.x);
        store(out + kWidth, c.y);
        store(out + 2 * kWidth, c.z);
        for (unsigned i = 3; i < 12; i += 3) {
            const float* const axis = node + i * kWidth;
            const V3 v = mapped(f.axes, V3{load(axis), load(axis + kWidth), load(axis + 2 * kWidth)});
            store(out + i * kWidth, v.x);
            store(out + (i + 1) * kWidth, v.y);
            store(out + (i + 2) * kWidth, v.z);
        }
        for (unsigned i = 12; i < 15; ++i) store(out + i * kWidth, load(node + i * kWidth) * f.scale);
    }

    /// The largest gap along an axis. Where the map is no similarity, the placed box is a parallelepiped; then only
    /// the axes of A's box bound it, and `placedIsOne` says which of the two A's box is.
    template <bool PlacedIsOne>
    TESSERA_INLINE static F gap(const float* one, const float* many, const PairFrame& f) {
        F widest = splat(-3e38f);
        gaps<PlacedIsOne>(one, many, f, [&](unsigned, F g, F) { widest = max(widest, g); });
        return widest;
    }

    /// No points of the two are nearer: gaps along the square axes of one box make the distance of two boxes that hold
    /// them; so does the gap along the line between the centres, which is the better bound for boxes small against
    /// their distance.
    template <bool PlacedIsOne>
    static F distance(const float* one, const float* many, const PairFrame& f) {
        F sum[2] = {}, reach = {};
        gaps<PlacedIsOne>(one, many, f, [&](unsigned box, F g, F along) {
            g = max(g, F{});
            sum[box] += g * g;
            reach += along;
        });
        const V3 t{load(many) - one[0], load(many + kWidth) - one[kWidth], load(many + 2 * kWidth) - one[2 * kWidth]};
        const F square = dot(t, t);
        return max(sqrt(max(sum[0], sum[1])), (square - reach) / sqrt(max(square, splat(1e-30f))));
    }

    /// take(0, gap, along) for each axis of `many`, take(1, gap, along) for each of `one`: the gap along it, or nothing
    /// to go by (far below 0), and how far the half side reaches along the line between the centres, times that line's
    /// length.
    template <bool PlacedIsOne, typename Take>
    TESSERA_INLINE static void gaps(const float* one, const float* many, const PairFrame& f, const Take& take) {
        const V3 t{load(many) - one[0], load(many + kWidth) - one[kWidth], load(many + 2 * kWidth) - one[2 * kWidth]};
        const F nothing = splat(-3e38f);
        F reach[3];  // of `many` along the axes of `one`
        for (unsigned j = 0; j < 3; ++j) reach[j] = splat(one[(12 + j) * kWidth]);
        for (unsigned i = 0; i < 3; ++i) {
            const float* const row = many + (3 + 3 * i) * kWidth;
            const V3 axis{load(row), load(row + kWidth), load(row + 2 * kWidth)};
            const F half = load(many + (12 + i) * kWidth);
            F sum = half;
            for (unsigned j = 0; j < 3; ++j) {
                const float* const other = one + (3 + 3 * j) * kWidth;
                const F cosine = abs(axis.x * other[0] + axis.y * other[kWidth] + axis.z * other[2 * kWidth]);
                sum += cosine * one[(12 + j) * kWidth];
                reach[j] += cosine * half;
            }
            const F way = abs(dot(t, axis));
            take(0, PlacedIsOne || f.similarity ? way - sum : nothing, way * half);
        }
        for (unsigned j = 0; j < 3; ++j) {
            const float* const other = one + (3 + 3 * j) * kWidth;
            const F way = abs(t.x * other[0] + t.y * other[kWidth] + t.z * other[2 * kWidth]);
            take(1, !PlacedIsOne || f.similarity ? way - reach[j] : nothing, way * one[(12 + j) * kWidth]);
        }
    }
};

/// k = 6 is the axis-aligned box; with both frames looked at these are the six face axes of two boxes.
template <unsigned K, bool BothWays>
struct Dop {
    static constexpr unsigned kRows = K;
    static constexpr bool kBothWays = BothWays;

    TESSERA_INLINE static void place(const float* node, const PairFrame&, const Realigned& to, float* out) {
#pragma GCC unroll 26
        for (unsigned i = 0; i < K; ++i)
            store(out + i * kWidth, load(node + to.row[i][0]) * to.weight[i][0] +
                                        load(node + to.row[i][1]) * to.weight[i][1] +
                                        (load(node + to.row[i][2]) * to.weight[i][2] + to.offset[i]));
    }

    /// In lengths of the directions.
    TESSERA_INLINE static F gap(const float* one, const float* many) {
        constexpr unsigned kHalf = K / 2;
        // Two chains, since each minimum waits for the one before it.
        F upper = load(many) + one[kHalf * kWidth], lower = load(many + kHalf * kWidth) + one[0];
        for (unsigned i = 1; i < kHalf; ++i) {
            upper = min(upper, load(many + i * kWidth) + one[(i + kHalf) * kWidth]);
            lower = min(lower, load(many + (i + kHalf) * kWidth) + one[i * kWidth]);
        }
        return -min(upper, lower);
    }

    /// No points of the two are nearer, in true lengths.
    static F distance(const float* one, const float* many) {
        constexpr unsigned kHalf = K / 2;
        F square = {}, widest = splat(-3e38f);
        for (unsigned i = 0; i < kHalf; ++i) {
            const F gap = -min(load(many + i * kWidth) + one[(i + kHalf) * kWidth],
                               load(many + (i + kHalf) * kWidth) + one[i * kWidth]);
            if (i < 3) {
                const F g = max(gap, F{});
                square += g * g;
            } else {
                widest = max(widest, gap * perLength(i));
            }
        }
        return max(sqrt(square), widest);
    }

    /// 1 / |d_i|, rounded down, of the directions that volume/KDop.h lists.
    static constexpr float perLength(unsigned i) {
        return i < 3 ? 1.0f : (K == 14 || i >= 9) ? 0.57735026f : 0.70710677f;
    }
};

/// k-DOPs whose placing looks up support profiles.
template <unsigned K>
struct DopByTable : Dop<K, false> {
    static void placeNode(const TreeView& tree, std::size_t node, const ProfileLookups& to, float* out) {
        const float* const rows = tree.profileRows + node * 4 * kWidth;
        const std::uint8_t* const tables = tree.profileTables + node * to.entries * kWidth;
        const V3 centre{load(rows), load(rows + kWidth), load(rows + 2 * kWidth)};
        const F step = load(rows + 3 * kWidth);
        for (unsigned i = 0; i < K; ++i)
            store(out + i * kWidth,
                  centre.x * to.vector[i][0] + centre.y * to.vector[i][1] + centre.z * to.vector[i][2] +
                      step * loadBytes(tables + to.entry[i] * std::size_t{kWidth}) * to.length[i] + to.offset[i]);
    }
};
