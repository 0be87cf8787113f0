// Spheres around the triangles below every slot (Fit.inl). Included by kernel/Kernels.inl only.

struct SphereFit {
    static constexpr unsigned kRows = 4;
    /// A distance of at most 2: its coordinates, of three positions' roundings, then squares, sum and root.
    static constexpr float kPad = 16 * kUnitRoundoff;
    static constexpr unsigned kSteps = 12;

    /// Badoiu and Clarkson 2003: the centre goes to the farthest point by ever shorter steps; the best place is kept.
    /// farthest(centre, place) says how far the farthest corner is (squared) and where.
    template <typename Farthest>
    TESSERA_INLINE static void around(P3 centre, const Farthest& farthest, P (&out)[4]) {
        P least = splatPart(3e38f);
        P3 best = centre;
        for (unsigned step = 0; step < kSteps; ++step) {
            P3 place = centre;
            const P away = farthest(centre, place);
            const P better = least - away;
            least = choose(better, away, least);
            best = {choose(better, centre.x, best.x), choose(better, centre.y, best.y),
                    choose(better, centre.z, best.z)};
            const float way = 1.0f / static_cast<float>(step + 2);
            centre = {centre.x + (place.x - centre.x) * way, centre.y + (place.y - centre.y) * way,
                      centre.z + (place.z - centre.z) * way};
        }
        out[0] = best.x;
        out[1] = best.y;
        out[2] = best.z;
        out[3] = sqrt(least) * (1 + 8 * kUnitRoundoff) + kPad;
    }

    struct Far {
        P3 centre;
        P away = splatPart(-1);
        P3 place;
        TESSERA_INLINE void look(const P3& p) {
            const P3 d = p - centre;
            const P square = dot(d, d), farther = square - away;
            away = max(away, square);
            place = {choose(farther, p.x, place.x), choose(farther, p.y, place.y), choose(farther, p.z, place.z)};
        }
    };

    static void fit(const FitJob& job, const SlotLanes& slots, std::uint32_t node, float* rows) {
        for (unsigned at = 0; at < kWidth; at += kLanes) {
            if (SlotLanes::ofPart(slots.leaves, at / kLanes) == 0) continue;
            LeafLanes leaves;
            leaves.gather(slots.leaf + at, slots.counts + at);
            P3 low = leaves.corner(0, 0), high = low;
            leaves.forCorners([&](const P3& p) {
                low = {min(low.x, p.x), min(low.y, p.y), min(low.z, p.z)};
                high = {max(high.x, p.x), max(high.y, p.y), max(high.z, p.z)};
            });
            P out[4];
            around(
                {(low.x + high.x) * 0.5f, (low.y + high.y) * 0.5f, (low.z + high.z) * 0.5f},
                [&](const P3& centre, P3& place) {
                    Far far{centre, splatPart(-1), centre};
                    leaves.forCorners([&](const P3& p) { far.look(p); });
                    place = far.place;
                    return far.away;
                },
                out);
            for (unsigned i = 0; i < 4; ++i) storePart(rows + i * kWidth + at, out[i]);
        }
        forLanes(slots.subtrees, [&](unsigned lane) {
            const FitNode& below = job.nodes[job.children[std::size_t{node} * kWidth + lane]];
            const float* const first = job.corners + std::size_t{below.firstLeaf} * kLeafSize;
            P3 low{splatPart(first[0]), splatPart(first[kLeafFaces]), splatPart(first[2 * kLeafFaces])}, high = low;
            forCornersOf(job.corners, below.firstLeaf, below.endLeaf, [&](const P3& p) {
                low = {min(low.x, p.x), min(low.y, p.y), min(low.z, p.z)};
                high = {max(high.x, p.x), max(high.y, p.y), max(high.z, p.z)};
            });
            const auto middle = [](P l, P h) { return splatPart((largestLane(h) - largestLane(-l)) * 0.5f); };
            P out[4];
            around(
                {middle(low.x, high.x), middle(low.y, high.y), middle(low.z, high.z)},
                [&](const P3& centre, P3& place) {
                    Far far{centre, splatPart(-1), centre};
                    forCornersOf(job.corners, below.firstLeaf, below.endLeaf, [&](const P3& p) { far.look(p); });
                    return farthestLane(far, place);
                },
                out);
            for (unsigned i = 0; i < 4; ++i) {
                alignas(64) float lanes[kLanes];
                storePart(lanes, out[i]);
                rows[i * kWidth + lane] = lanes[0];
            }
        });
        forLanes(~slots.used() & 0xffffu, [&](unsigned lane) {
            for (unsigned row = 0; row < kRows; ++row) rows[row * kWidth + lane] = row < 3 ? 0 : kNever;
        });
    }

    static P farthestLane(const Far& far, P3& place) {
        alignas(64) float away[kLanes], x[kLanes], y[kLanes], z[kLanes];
        storePart(away, far.away);
        storePart(x, far.place.x);
        storePart(y, far.place.y);
        storePart(z, far.place.z);
        unsigned best = 0;
        for (unsigned i = 1; i < kLanes; ++i)
            if (away[i] > away[best]) best = i;
        place = {splatPart(x[best]), splatPart(y[best]), splatPart(z[best])};
        return splatPart(away[best]);
    }

    TESSERA_INLINE static P size(const float* rows) {
        const P r = loadPart(rows + 3 * kWidth);
        return r * r * 12.566371f;
    }
};
