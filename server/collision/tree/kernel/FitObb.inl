// Oriented boxes around the triangles below every slot (Fit.inl). Included by kernel/Kernels.inl only.

/// The surface below a slot: area, centre and second moments about the centre (xx yy zz xy xz yz) over the area.
struct Moments {
    P area;
    P3 mean;
    P spread[6];

    void ofLeaves(const LeafLanes& leaves) {
        const P3 origin = leaves.corner(0, 0);
        area = splatPart(0);
        P3 sum{area, area, area};
        for (P& s : spread) s = area;
        for (unsigned face = 0; face < kLeafFaces; ++face) {
            const P3 a = leaves.corner(face, 0) - origin, b = leaves.corner(face, 1) - origin,
                     c = leaves.corner(face, 2) - origin;
            const P3 e = b - a, g = c - a, n = cross(e, g), s = a + b + c;
            // A little for the edges, so that triangles without area count.
            P weight = sqrt(dot(n, n)) + (dot(e, e) + dot(g, g)) * 1e-4f;
            weight = choose(leaves.count - static_cast<float>(face), weight, splatPart(0));
            area += weight;
            const P third = weight * (1.0f / 3), twelfth = weight * (1.0f / 12);
            sum = {sum.x + third * s.x, sum.y + third * s.y, sum.z + third * s.z};
            spread[0] += twelfth * (s.x * s.x + a.x * a.x + b.x * b.x + c.x * c.x);
            spread[1] += twelfth * (s.y * s.y + a.y * a.y + b.y * b.y + c.y * c.y);
            spread[2] += twelfth * (s.z * s.z + a.z * a.z + b.z * b.z + c.z * c.z);
            spread[3] += twelfth * (s.x * s.y + a.x * a.y + b.x * b.y + c.x * c.y);
            spread[4] += twelfth * (s.x * s.z + a.x * a.z + b.x * b.z + c.x * c.z);
            spread[5] += twelfth * (s.y * s.z + a.y * a.z + b.y * b.z + c.y * c.z);
        }
        const P over = 1.0f / max(area, splatPart(1e-37f));
        mean = {sum.x * over, sum.y * over, sum.z * over};
        const P square[6] = {mean.x * mean.x, mean.y * mean.y, mean.z * mean.z,
                             mean.x * mean.y, mean.x * mean.z, mean.y * mean.z};
        for (unsigned i = 0; i < 6; ++i) spread[i] = spread[i] * over - square[i];
        mean = mean + origin;
    }

    /// Of all lanes together; `part` of them per register.
    static void together(const float (*lanes)[kWidth], float* out) {
        P area = splatPart(0), x = area, y = area, z = area;
        for (unsigned at = 0; at < kWidth; at += kLanes) {
            const P weight = loadPart(lanes[0] + at);
            area += weight;
            x += weight * loadPart(lanes[1] + at);
            y += weight * loadPart(lanes[2] + at);
            z += weight * loadPart(lanes[3] + at);
        }
        out[0] = sumOfLanes(area);
        const float over = 1 / (out[0] > 1e-37f ? out[0] : 1e-37f);
        out[1] = sumOfLanes(x) * over;
        out[2] = sumOfLanes(y) * over;
        out[3] = sumOfLanes(z) * over;
        P spread[6] = {splatPart(0), splatPart(0), splatPart(0), splatPart(0), splatPart(0), splatPart(0)};
        for (unsigned at = 0; at < kWidth; at += kLanes) {
            const P weight = loadPart(lanes[0] + at);
            const P3 d{loadPart(lanes[1] + at) - out[1], loadPart(lanes[2] + at) - out[2],
                       loadPart(lanes[3] + at) - out[3]};
            const P square[6] = {d.x * d.x, d.y * d.y, d.z * d.z, d.x * d.y, d.x * d.z, d.y * d.z};
            for (unsigned i = 0; i < 6; ++i) spread[i] += weight * (loadPart(lanes[4 + i] + at) + square[i]);
        }
        for (unsigned i = 0; i < 6; ++i) out[4 + i] = sumOfLanes(spread[i]) * over;
    }
};

/// One Jacobi rotation of a symmetric matrix: makes `pq` vanish. `pr`, `qr` are the other two beside it; p, q are rows
/// of the transposed eigenvectors.
TESSERA_INLINE void rotate(P& pp, P& qq, P& pq, P& pr, P& qr, P3& p, P3& q) {
    const P half = (qq - pp) * 0.5f;
    const P root = sqrt(half * half + pq * pq) + 1e-30f;
    const P t = choose(half, pq, -pq) / (abs(half) + root);  // the smaller of both angles' tangents
    const P c = 1.0f / sqrt(t * t + 1.0f), s = t * c;
    pp -= t * pq;
    qq += t * pq;
    pq = splatPart(0);
    const P r = pr;
    pr = c * r - s * qr;
    qr = s * r + c * qr;
    const P3 v = p;
    p = {c * v.x - s * q.x, c * v.y - s * q.y, c * v.z - s * q.z};
    q = {s * v.x + c * q.x, s * v.y + c * q.y, s * v.z + c * q.z};
}

struct ObbFit {
    static constexpr unsigned kRows = 15;
    /// A projection of a position of length 1 and of the box's centre, of length √3: 3 (1 + √3) u; their difference, of
    /// at most 2.8; the position itself: all below 13 u.
    static constexpr float kPad = 16 * kUnitRoundoff;
    /// Of the box's own size: its axes are unit and orthogonal to some u.
    static constexpr float kPadOfSize = 8 * kUnitRoundoff;

    /// Principal axes (Gottschalk, Lin, Manocha 1996), by so many Jacobi sweeps as float needs; orthonormal to
    /// rounding.
    static void axesOf(const Moments& moments, P3 (&axes)[3]) {
        const P scale = 1.0f / (moments.spread[0] + moments.spread[1] + moments.spread[2] + 1e-37f);
        P m[6];
        for (unsigned i = 0; i < 6; ++i) m[i] = moments.spread[i] * scale;
        const P one = splatPart(1), none = splatPart(0);
        P3 x{one, none, none}, y{none, one, none}, z{none, none, one};
        for (unsigned sweep = 0; sweep < 4; ++sweep) {
            rotate(m[0], m[1], m[3], m[4], m[5], x, y);
            rotate(m[0], m[2], m[4], m[3], m[5], x, z);
            rotate(m[1], m[2], m[5], m[3], m[4], y, z);
        }
        const P ofX = 1.0f / sqrt(dot(x, x));
        x = {x.x * ofX, x.y * ofX, x.z * ofX};
        const P along = dot(x, y);
        y = {y.x - along * x.x, y.y - along * x.y, y.z - along * x.z};
        const P ofY = 1.0f / sqrt(dot(y, y));
        y = {y.x * ofY, y.y * ofY, y.z * ofY};
        axes[0] = x;
        axes[1] = y;
        axes[2] = cross(x, y);
    }

    /// Extents along principal axes (0 to 2) and the model's own (3 to 5).
    struct Extents {
        P low[6], high[6];
        TESSERA_INLINE explicit Extents(const P3& p, const P3 (&axes)[3]) {
            at(p, axes, low);
            for (unsigned i = 0; i < 6; ++i) high[i] = low[i];
        }
        TESSERA_INLINE static void at(const P3& p, const P3 (&axes)[3], P (&out)[6]) {
            for (unsigned i = 0; i < 3; ++i) out[i] = dot(axes[i], p);
            out[3] = p.x;
            out[4] = p.y;
            out[5] = p.z;
        }
        TESSERA_INLINE void extend(const P3& p, const P3 (&axes)[3]) {
            P x[6];
            at(p, axes, x);
            for (unsigned i = 0; i < 6; ++i) {
                low[i] = min(low[i], x[i]);
                high[i] = max(high[i], x[i]);
            }
        }
    };

    /// Rows for all slots of a part, before the box of smaller surface is chosen.
    struct Table {
        alignas(64) float axes[9][kWidth];
        alignas(64) float low[6][kWidth], high[6][kWidth];
    };

    static void fit(const FitJob& job, const SlotLanes& slots, std::uint32_t node, float* rows) {
        alignas(64) float moments[10][kWidth];
        Table table;
        for (unsigned at = 0; at < kWidth; at += kLanes) {
            const unsigned part = at / kLanes;
            LeafLanes leaves;
            const bool anyLeaf = SlotLanes::ofPart(slots.leaves, part) != 0,
                       anySubtree = SlotLanes::ofPart(slots.subtrees, part) != 0;
            if (!anyLeaf && !anySubtree) {
                for (float(&row)[kWidth] : moments) storePart(row + at, splatPart(0));
                continue;
            }
            Moments m{};
            if (anyLeaf) {
                leaves.gather(slots.leaf + at, slots.counts + at);
                m.ofLeaves(leaves);
            }
            storePart(moments[0] + at, m.area);
            storePart(moments[1] + at, m.mean.x);
            storePart(moments[2] + at, m.mean.y);
            storePart(moments[3] + at, m.mean.z);
            for (unsigned i = 0; i < 6; ++i) storePart(moments[4 + i] + at, m.spread[i]);
            if (anySubtree) {
                forLanes(SlotLanes::ofPart(slots.subtrees, part), [&](unsigned lane) {
                    const FitNode& below = job.nodes[job.children[std::size_t{node} * kWidth + at + lane]];
                    for (unsigned i = 0; i < 10; ++i) moments[i][at + lane] = below.moments[i];
                });
                for (unsigned i = 0; i < 6; ++i) m.spread[i] = loadPart(moments[4 + i] + at);
            }
            P3 axes[3];
            axesOf(m, axes);
            for (unsigned i = 0; i < 3; ++i) {
                storePart(table.axes[3 * i] + at, axes[i].x);
                storePart(table.axes[3 * i + 1] + at, axes[i].y);
                storePart(table.axes[3 * i + 2] + at, axes[i].z);
            }
            if (anyLeaf) {
                Extents extents(leaves.corner(0, 0), axes);
                leaves.forCorners([&](const P3& p) { extents.extend(p, axes); });
                for (unsigned i = 0; i < 6; ++i) {
                    storePart(table.low[i] + at, extents.low[i]);
                    storePart(table.high[i] + at, extents.high[i]);
                }
            }
            forLanes(SlotLanes::ofPart(slots.subtrees, part),
                     [&](unsigned lane) { around(job, node, at + lane, table); });
            finish(table, at, rows);
        }
        Moments::together(moments, job.nodes[node].moments);
        forLanes(~slots.used() & 0xffffu, [&](unsigned lane) {
            for (unsigned row = 0; row < kRows; ++row) rows[row * kWidth + lane] = row < 12 ? 0 : kNever;
        });
    }

    /// The extents of one slot's subtree.
    static void around(const FitJob& job, std::uint32_t node, unsigned lane, Table& table) {
        const FitNode& below = job.nodes[job.children[std::size_t{node} * kWidth + lane]];
        P3 axes[3];
        for (unsigned i = 0; i < 3; ++i)
            axes[i] = {splatPart(table.axes[3 * i][lane]), splatPart(table.axes[3 * i + 1][lane]),
                       splatPart(table.axes[3 * i + 2][lane])};
        const float* const first = job.corners + std::size_t{below.firstLeaf} * kLeafSize;
        Extents extents({splatPart(first[0]), splatPart(first[kLeafFaces]), splatPart(first[2 * kLeafFaces])}, axes);
        forCornersOf(job.corners, below.firstLeaf, below.endLeaf, [&](const P3& p) { extents.extend(p, axes); });
        for (unsigned i = 0; i < 6; ++i) {
            table.low[i][lane] = -largestLane(-extents.low[i]);
            table.high[i][lane] = largestLane(extents.high[i]);
        }
    }

    static void finish(const Table& table, unsigned at, float* rows) {
        P low[6], high[6], axes[9];
        for (unsigned i = 0; i < 6; ++i) {
            low[i] = loadPart(table.low[i] + at);
            high[i] = loadPart(table.high[i] + at);
        }
        const P principal = halfArea({high[0] - low[0], high[1] - low[1], high[2] - low[2]}),
                own = halfArea({high[3] - low[3], high[4] - low[4], high[5] - low[5]});
        const P better = own - principal;  // no number where there are no principal axes
        for (unsigned i = 0; i < 9; ++i)
            axes[i] = choose(better, loadPart(table.axes[i] + at), splatPart(i % 4 == 0 ? 1 : 0));
        P3 centre{splatPart(0), splatPart(0), splatPart(0)};
        for (unsigned i = 0; i < 3; ++i) {
            low[i] = choose(better, low[i], low[i + 3]);
            high[i] = choose(better, high[i], high[i + 3]);
            const P middle = (low[i] + high[i]) * 0.5f;
            centre = {centre.x + middle * axes[3 * i], centre.y + middle * axes[3 * i + 1],
                      centre.z + middle * axes[3 * i + 2]};
        }
        storePart(rows + at, centre.x);
        storePart(rows + kWidth + at, centre.y);
        storePart(rows + 2 * kWidth + at, centre.z);
        P half[3];
        for (unsigned i = 0; i < 3; ++i) {
            const P3 axis{axes[3 * i], axes[3 * i + 1], axes[3 * i + 2]};
            const P middle = dot(axis, centre);
            half[i] = max(high[i] - middle, middle - low[i]);
            storePart(rows + (3 + 3 * i) * kWidth + at, axis.x);
            storePart(rows + (4 + 3 * i) * kWidth + at, axis.y);
            storePart(rows + (5 + 3 * i) * kWidth + at, axis.z);
        }
        const P pad = (half[0] + half[1] + half[2]) * kPadOfSize + kPad;
        for (unsigned i = 0; i < 3; ++i) storePart(rows + (12 + i) * kWidth + at, half[i] + pad);
    }

    TESSERA_INLINE static P size(const float* rows) {
        return halfArea({loadPart(rows + 12 * kWidth), loadPart(rows + 13 * kWidth), loadPart(rows + 14 * kWidth)}) *
               8.0f;
    }
};
