// The walk down one tree, its boxes looked up in a field. Included once per instruction set (../FieldWalk*.cpp), with
// TESSERA_KERNELS naming its namespace. Loops over sixteen lanes are plain: the compiler makes vectors of them.

namespace tessera::kernel::TESSERA_KERNELS {
namespace {

/// Sixteen boxes in a part's coordinates: centres, half sides as vectors, extents along the axes.
struct alignas(64) LookedUp {
    float q[3][kWidth], a[3][3][kWidth], e[3][kWidth], distance[kWidth], reach[kWidth];
    std::uint32_t
        faces[kWidth];  ///< one bit for each face of the cube that a box may be seen through; 0: farther than all
};

inline float absolute(float x) {
    return __builtin_fabsf(x);
}
inline float larger(float a, float b) {
    return a > b ? a : b;
}

/// The texels of one face that a box may be seen through: level, and ranges along s and t.
struct TexelRange {
    unsigned level;
    int s0, s1, t0, t1;
};

/// Half the texels that a box is wide, at most. Finer ones are tighter and more.
constexpr float kTexelsPerHalf = 0.7f;
constexpr int kMostTexels = 16;  ///< that a triangle's lists are looked at in

inline int clampedTexel(float place, int last) {
    // Also where the place is far outside what an int can hold.
    const float inside = place < 0 ? 0 : (place > static_cast<float>(last) ? static_cast<float>(last) : place);
    return static_cast<int>(inside);
}

/// What of a box (centre q, extents e > 0) is in the pyramid of a face. False: nothing.
/// For any point p of the box and z = p_c > 0: |p_a / p_c - q_a / q_c| <= (e_a + |q_a / q_c| e_c) / (q_c - e_c).
/// `forced`: at that level, else at one where the range is a few texels.
inline bool rangeOn(unsigned face, const float* q, const float* e, unsigned finest, float perHalf, bool forced,
                    TexelRange& out) {
    const unsigned c = face >> 1, a = c == 2 ? 0 : c + 1, b = a == 2 ? 0 : a + 1;
    const float z = (face & 1u) != 0 ? -q[c] : q[c];
    const float most = z + e[c];
    if (most < 0 || absolute(q[a]) - e[a] > most || absolute(q[b]) - e[b] > most) return false;
    const float least = z - e[c];
    out = {0, 0, 0, 0, 0};
    if (!(least > 1e-6f * most)) {
        if (forced) {
            out.level = finest;
            out.s1 = out.t1 = (1 << finest) - 1;
        }
        return true;
    }
    const float s = q[a] / z, t = q[b] / z;
    const float widthS = (e[a] + absolute(s) * e[c]) / least * 1.00001f + 2e-6f * (1 + absolute(s));
    const float widthT = (e[b] + absolute(t) * e[c]) / least * 1.00001f + 2e-6f * (1 + absolute(t));
    if (s - widthS > 1 || s + widthS < -1 || t - widthT > 1 || t + widthT < -1) return false;
    unsigned level = finest;
    if (!forced) {
        // 2^level <= 2 / (width / perHalf)
        const float per = 2 * perHalf / larger(widthS, widthT);
        std::uint32_t bits;
        __builtin_memcpy(&bits, &per, 4);
        const int power = static_cast<int>(bits >> 23) - 127;
        level = power < 0 ? 0 : (static_cast<unsigned>(power) < finest ? static_cast<unsigned>(power) : finest);
    }
    const int last = (1 << level) - 1;
    const float half = 0.5f * static_cast<float>(1 << level);
    out.level = level;
    out.s0 = clampedTexel((s - widthS + 1) * half, last);
    out.s1 = clampedTexel((s + widthS + 1) * half, last);
    out.t0 = clampedTexel((t - widthT + 1) * half, last);
    out.t1 = clampedTexel((t + widthT + 1) * half, last);
    return true;
}

/// May one box meet what the part holds?
bool mayMeet(const LookedUp& at, unsigned lane, const FieldPart& part, float slack, FieldWalkSink& sink) {
    const float q[3] = {at.q[0][lane], at.q[1][lane], at.q[2][lane]};
    const float e[3] = {at.e[0][lane], at.e[1][lane], at.e[2][lane]};
    const float distance = at.distance[lane], reach = at.reach[lane];
    for (std::uint32_t faces = at.faces[lane]; faces != 0; faces &= faces - 1) {
        const unsigned face = static_cast<unsigned>(__builtin_ctz(faces));
        TexelRange range;
        if (!rangeOn(face, q, e, part.finest, kTexelsPerHalf, false, range)) continue;
        const FieldTexel* const texels = part.texels[range.level] + (std::size_t{face} << (2 * range.level));
        for (int t = range.t0; t <= range.t1; ++t)
            for (int s = range.s0; s <= range.s1; ++s) {
                const FieldTexel& texel =
                    texels[(static_cast<std::size_t>(t) << range.level) + static_cast<std::size_t>(s)];
                if (texel.lower > texel.upper) continue;
                ++sink.texelTests;
                const float n[3] = {static_cast<float>(texel.normal[0]) * part.normalUnit,
                                    static_cast<float>(texel.normal[1]) * part.normalUnit,
                                    static_cast<float>(texel.normal[2]) * part.normalUnit};
                const float d = n[0] * q[0] + n[1] * q[1] + n[2] * q[2];
                float extent = slack;
                for (unsigned k = 0; k < 3; ++k)
                    extent += absolute(n[0] * at.a[k][0][lane] + n[1] * at.a[k][1][lane] + n[2] * at.a[k][2][lane]);
                if (d - extent > static_cast<float>(texel.upper) * part.planeUnit) continue;
                if (d + extent < static_cast<float>(texel.lower) * part.planeUnit) continue;
                if (distance - reach > static_cast<float>(texel.outer) * part.radiusUnit) continue;
                if (distance + reach < static_cast<float>(texel.inner) * part.radiusUnit) continue;
                return true;
            }
    }
    return false;
}

using Bits = std::uint32_t;

/// Which of sixteen balls are within reach of a place.
inline Bits nearBalls(const std::int16_t* __restrict x, const std::int16_t* __restrict y,
                      const std::int16_t* __restrict z, const std::uint16_t* __restrict r, float unit,
                      const float* __restrict q, float reach) {
    float gap[kWidth];
    const float q0 = q[0], q1 = q[1], q2 = q[2];
    for (unsigned k = 0; k < kWidth; ++k) {
        const float dx = static_cast<float>(static_cast<std::int32_t>(x[k])) * unit - q0;
        const float dy = static_cast<float>(static_cast<std::int32_t>(y[k])) * unit - q1;
        const float dz = static_cast<float>(static_cast<std::int32_t>(z[k])) * unit - q2;
        const float far = static_cast<float>(static_cast<std::int32_t>(r[k])) * unit + reach;
        gap[k] = dx * dx + dy * dy + dz * dz - far * far;
    }
    Bits near = 0;
    for (unsigned k = 0; k < kWidth; ++k) near |= static_cast<Bits>(gap[k] <= 0) << k;
    return near;
}

struct Walking {
    const FieldWalkFrame& f;
    FieldWalkSink& sink;

    void place(std::uint32_t node, unsigned part, LookedUp& out) const {
        const float radius = f.parts[part].radius;
        const float* const rows = f.tree.volumes + std::size_t{node} * 15 * kWidth;
        const float* const m = f.linear;
        for (unsigned r = 0; r < 3; ++r) {
            const float x = m[3 * r], y = m[3 * r + 1], z = m[3 * r + 2], shift = f.translation[part][r];
            for (unsigned k = 0; k < kWidth; ++k)
                out.q[r][k] = x * rows[k] + y * rows[kWidth + k] + z * rows[2 * kWidth + k] + shift;
            for (unsigned i = 0; i < 3; ++i) {
                const float* const axis = rows + (3 + 3 * i) * kWidth;
                const float* const half = rows + (12 + i) * kWidth;
                for (unsigned k = 0; k < kWidth; ++k)
                    out.a[i][r][k] = (x * axis[k] + y * axis[kWidth + k] + z * axis[2 * kWidth + k]) * half[k];
            }
            for (unsigned k = 0; k < kWidth; ++k)
                out.e[r][k] = absolute(out.a[0][r][k]) + absolute(out.a[1][r][k]) + absolute(out.a[2][r][k]) + f.slack;
        }
        for (unsigned k = 0; k < kWidth; ++k) {
            // Half a diagonal, whether or not the box is still square: no corner is farther than the sum of the
            // vectors' lengths; where they are square to each other that is loose, so the extents' box bounds it too.
            const float box = out.e[0][k] * out.e[0][k] + out.e[1][k] * out.e[1][k] + out.e[2][k] * out.e[2][k];
            out.reach[k] = __builtin_sqrtf(box) * 1.00001f + f.slack;
            out.distance[k] =
                __builtin_sqrtf(out.q[0][k] * out.q[0][k] + out.q[1][k] * out.q[1][k] + out.q[2][k] * out.q[2][k]);
        }
        for (unsigned k = 0; k < kWidth; ++k) {
            const float x = absolute(out.q[0][k]) - out.e[0][k], y = absolute(out.q[1][k]) - out.e[1][k],
                        z = absolute(out.q[2][k]) - out.e[2][k];
            const float xy = larger(x, y), yz = larger(y, z), zx = larger(z, x);
            std::uint32_t seen = 0;
            seen |= out.q[0][k] + out.e[0][k] >= yz ? 1u : 0u;
            seen |= out.e[0][k] - out.q[0][k] >= yz ? 2u : 0u;
            seen |= out.q[1][k] + out.e[1][k] >= zx ? 4u : 0u;
            seen |= out.e[1][k] - out.q[1][k] >= zx ? 8u : 0u;
            seen |= out.q[2][k] + out.e[2][k] >= xy ? 16u : 0u;
            seen |= out.e[2][k] - out.q[2][k] >= xy ? 32u : 0u;
            out.faces[k] = out.distance[k] - out.reach[k] > radius ? 0u : seen;
        }
    }

    /// The face is for another search.
    bool leaveOpen(std::uint32_t face) {
        if (sink.openCount != 0 && sink.open[sink.openCount - 1] == face) return false;
        if (sink.openCount == sink.openCapacity && sink.flush(sink, sink.context)) return true;
        sink.open[sink.openCount++] = face;
        return false;
    }

    /// One triangle against the lists of the texels that it is seen through. True: that was the end.
    bool meetTriangle(std::uint32_t face, const float (*p)[3], const FieldPart& part) {
        float q[3], e[3], reach = 0;
        for (unsigned r = 0; r < 3; ++r) {
            const float low =
                p[0][r] < p[1][r] ? (p[0][r] < p[2][r] ? p[0][r] : p[2][r]) : (p[1][r] < p[2][r] ? p[1][r] : p[2][r]);
            const float high = larger(larger(p[0][r], p[1][r]), p[2][r]);
            q[r] = 0.5f * (low + high);
            e[r] = 0.5f * (high - low) + f.slack;
        }
        for (unsigned k = 0; k < 3; ++k) {
            float square = 0;
            for (unsigned r = 0; r < 3; ++r) square += (p[k][r] - q[r]) * (p[k][r] - q[r]);
            reach = larger(reach, square);
        }
        reach = __builtin_sqrtf(reach) * 1.00001f + f.slack;
        const float distance = __builtin_sqrtf(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]);
        if (distance - reach > part.radius) return false;
        TexelRange ranges[kCubeFaces];
        bool on[kCubeFaces];
        int texelsInAll = 0;
        for (unsigned side = 0; side < kCubeFaces; ++side) {
            on[side] = rangeOn(side, q, e, part.finest, 1, true, ranges[side]);
            if (on[side])
                texelsInAll += (ranges[side].s1 - ranges[side].s0 + 1) * (ranges[side].t1 - ranges[side].t0 + 1);
        }
        if (texelsInAll > kMostTexels) return leaveOpen(face);
        std::uint32_t firstOfFace = sink.count;
        for (unsigned side = 0; side < kCubeFaces; ++side) {
            if (!on[side]) continue;
            const TexelRange& range = ranges[side];
            const std::size_t first = std::size_t{side} << (2 * range.level);
            for (int t = range.t0; t <= range.t1; ++t)
                for (int s = range.s0; s <= range.s1; ++s) {
                    const std::size_t place =
                        first + (static_cast<std::size_t>(t) << range.level) + static_cast<std::size_t>(s);
                    const FieldTexel& texel = part.texels[range.level][place];
                    if (texel.lower > texel.upper) continue;
                    ++sink.texelTests;
                    if (distance - reach > static_cast<float>(texel.outer) * part.radiusUnit) continue;
                    if (distance + reach < static_cast<float>(texel.inner) * part.radiusUnit) continue;
                    float low = 3e38f, high = -3e38f;
                    for (unsigned k = 0; k < 3; ++k) {
                        const float d = (static_cast<float>(texel.normal[0]) * p[k][0] +
                                         static_cast<float>(texel.normal[1]) * p[k][1] +
                                         static_cast<float>(texel.normal[2]) * p[k][2]) *
                                        part.normalUnit;
                        low = d < low ? d : low;
                        high = d > high ? d : high;
                    }
                    if (low - f.slack > static_cast<float>(texel.upper) * part.planeUnit) continue;
                    if (high + f.slack < static_cast<float>(texel.lower) * part.planeUnit) continue;
                    if (meetList(face, q, reach, part, part.start[place], part.start[place + 1], firstOfFace))
                        return true;
                }
        }
        return false;
    }

    bool meetList(std::uint32_t face, const float* q, float reach, const FieldPart& part, std::uint32_t first,
                  std::uint32_t end, std::uint32_t& firstOfFace) {
        sink.triangleTests += end - first;
        for (; first < end; first += kWidth) {
            // Lists are padded: lanes beyond the end are some other list's.
            const Bits near = nearBalls(part.ballX + first, part.ballY + first, part.ballZ + first, part.ballR + first,
                                        part.ballUnit, q, reach);
            const unsigned count = end - first < kWidth ? end - first : kWidth;
            for (Bits left = near & ((1u << count) - 1); left != 0; left &= left - 1) {
                const std::uint32_t other = part.faces[first + static_cast<unsigned>(__builtin_ctz(left))];
                bool known = false;
                for (std::uint32_t i = firstOfFace; i < sink.count; ++i) known |= sink.met[i] == other;
                if (known) continue;
                sink.walked[sink.count] = face;
                sink.met[sink.count++] = other;
                if (sink.count < sink.enough) continue;
                if (sink.flush(sink, sink.context)) return true;
                firstOfFace = 0;
            }
        }
        return false;
    }

    /// True: that was the end.
    bool meetLeaf(ChildRef ref) {
        const std::size_t leaf = (ref & ~kLeafBit) >> 2;
        const unsigned count = (ref & 3) + 1;
        const float* const corners = f.tree.corners + leaf * kLeafRows * kLeafFaces;
        const float* const m = f.linear;
        for (unsigned i = 0; i < count; ++i) {
            float turned[3][3];
            for (unsigned k = 0; k < 3; ++k) {
                const float x = corners[(3 * k) * kLeafFaces + i], y = corners[(3 * k + 1) * kLeafFaces + i],
                            z = corners[(3 * k + 2) * kLeafFaces + i];
                for (unsigned r = 0; r < 3; ++r) turned[k][r] = m[3 * r] * x + m[3 * r + 1] * y + m[3 * r + 2] * z;
            }
            for (unsigned part = 0; part < f.partCount; ++part) {
                float p[3][3];
                for (unsigned k = 0; k < 3; ++k)
                    for (unsigned r = 0; r < 3; ++r) p[k][r] = turned[k][r] + f.translation[part][r];
                if (meetTriangle(f.tree.faces[leaf * kLeafFaces + i], p, f.parts[part])) return true;
            }
        }
        return false;
    }

    bool walk(std::uint32_t node) {
        if (sink.nodeTests + sink.triangleTests >= sink.limit) return sink.exhausted = true;
        const ChildRef* const children = f.tree.children + std::size_t{node} * kWidth;
        Bits alive = 0;
        for (unsigned k = 0; k < kWidth; ++k) alive |= static_cast<Bits>(children[k] != kNoChild) << k;
        Bits left = 0;
        LookedUp at;
        for (unsigned part = 0; part < f.partCount && left != alive; ++part) {
            ++sink.nodeTests;
            place(node, part, at);
            const FieldPart& field = f.parts[part];
            for (Bits lanes = alive & ~left; lanes != 0; lanes &= lanes - 1) {
                const unsigned lane = static_cast<unsigned>(__builtin_ctz(lanes));
                if (mayMeet(at, lane, field, f.slack, sink)) left |= 1u << lane;
            }
        }
        for (; left != 0; left &= left - 1) {
            const ChildRef ref = children[__builtin_ctz(left)];
            if ((ref & kLeafBit) != 0 ? meetLeaf(ref) : walk(ref)) return true;
        }
        return false;
    }
};

bool walkField(const FieldWalkFrame& frame, FieldWalkSink& sink) {
    Walking walking{frame, sink};
    return walking.walk(0);
}

}  // namespace

extern const FieldWalk kFieldWalk;
const FieldWalk kFieldWalk = &walkField;

}  // namespace tessera::kernel::TESSERA_KERNELS
