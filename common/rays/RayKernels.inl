// One source for two instruction sets: TESSERA_RAYS names the one that this is compiled for, and Floats8, Doubles4 are
// its lanes.
//
// Boxes: slabs, nearest side and farthest side by the direction's signs (T. Ize, "Robust BVH Ray Traversal", 2013, for
// what rounding may cost). Triangles: sheared into the ray's own coordinates, four at once, in double (S. Woop, C.
// Benthin, I. Wald, "Watertight Ray/Triangle Intersection", 2013). Edge functions are differences of two rounded
// products, so rounding, being monotonous, may make one of them 0 but never change its sign; 0 belongs to both
// triangles at an edge. So no ray passes between two triangles that share an edge.

#include "common/rays/RayKernels.h"

namespace tessera::rays::TESSERA_RAYS {

namespace {

/// More than roundings of floats can do to where a ray enters a box and where it leaves it: of the direction, its
/// inverse, a difference, a product, each of 2^-24, on either side; and of this product.
constexpr float kGrown = 1.0f + 16.0f / 16777216.0f;

/// A ray in all lanes of registers, for a whole walk.
struct Slabs {
    Floats8 nearOrigin[3], farOrigin[3], inverse[3];
    const float* nearRow[3];  ///< of the tree's first node; null: it has none
    const float* farRow[3];

    Slabs(const Tree& tree, const PreparedRay& ray) {
        for (int k = 0; k < 3; ++k) {
            const bool forward = ray.nearRow[k] < 3;
            nearOrigin[k] = Floats8::all(forward ? ray.originUp[k] : ray.originDown[k]);
            farOrigin[k] = Floats8::all(forward ? ray.originDown[k] : ray.originUp[k]);
            inverse[k] = Floats8::all(ray.inverse[k]);
            nearRow[k] = tree.nodes ? tree.nodes->box[ray.nearRow[k]] : nullptr;
            farRow[k] = tree.nodes ? tree.nodes->box[ray.farRow[k]] : nullptr;
        }
    }
};

/// Bits of the children whose boxes the ray meets up to `limit`, and where it enters them.
inline unsigned meetBoxes(const Slabs& slabs, std::size_t node, float limit, float* near) {
    const std::size_t at = node * (sizeof(Node) / sizeof(float));
    const auto enters = [&](int k) {
        return (Floats8::load(slabs.nearRow[k] + at) - slabs.nearOrigin[k]) * slabs.inverse[k];
    };
    const auto leaves = [&](int k) {
        return (Floats8::load(slabs.farRow[k] + at) - slabs.farOrigin[k]) * slabs.inverse[k];
    };
    const Floats8 from = max(max(enters(0), enters(1)), max(enters(2), Floats8::all(0)));
    const Floats8 to = min(min(min(leaves(0), leaves(1)), leaves(2)) * Floats8::all(kGrown), Floats8::all(limit));
    from.store(near);
    return lessOrEqual(from, to);
}

/// t of the four triangles, and which of them the ray meets at 0 <= t <= limit.
struct Met {
    double t[4], u[4], v[4], w[4];
};
inline unsigned meetTriangles(const Leaf& leaf, const PreparedRay& ray, double limit, Met& met) {
    const unsigned x = ray.axis[0], y = ray.axis[1], z = ray.axis[2];
    const Doubles4 ox = Doubles4::all(ray.origin[x]), oy = Doubles4::all(ray.origin[y]),
                   oz = Doubles4::all(ray.origin[z]);
    const Doubles4 sx = Doubles4::all(ray.shear[0]), sy = Doubles4::all(ray.shear[1]);
    const Doubles4 az = Doubles4::load(leaf.corner[z]) - oz, bz = Doubles4::load(leaf.corner[3 + z]) - oz,
                   cz = Doubles4::load(leaf.corner[6 + z]) - oz;
    const Doubles4 ax = Doubles4::load(leaf.corner[x]) - ox - sx * az,
                   ay = Doubles4::load(leaf.corner[y]) - oy - sy * az;
    const Doubles4 bx = Doubles4::load(leaf.corner[3 + x]) - ox - sx * bz,
                   by = Doubles4::load(leaf.corner[3 + y]) - oy - sy * bz;
    const Doubles4 cx = Doubles4::load(leaf.corner[6 + x]) - ox - sx * cz,
                   cy = Doubles4::load(leaf.corner[6 + y]) - oy - sy * cz;
    const Doubles4 u = cx * by - cy * bx, v = ax * cy - ay * cx, w = bx * ay - by * ax;
    const Doubles4 none = Doubles4::all(0);
    const unsigned inside = (lessOrEqual(none, u) & lessOrEqual(none, v) & lessOrEqual(none, w)) |
                            (lessOrEqual(u, none) & lessOrEqual(v, none) & lessOrEqual(w, none));
    if (inside == 0) return 0;
    const Doubles4 sum = u + v + w;
    const Doubles4 t = (u * az + v * bz + w * cz) * Doubles4::all(ray.shear[2]) / sum;
    t.store(met.t);
    (u / sum).store(met.u);
    (v / sum).store(met.v);
    (w / sum).store(met.w);
    // Of a triangle that is seen from its edge all are 0, and t is no number.
    return inside & lessOrEqual(none, t) & lessOrEqual(t, Doubles4::all(limit));
}

/// A float that is not below.
inline float roundedUp(double value) {
    const float rounded = static_cast<float>(value);
    return static_cast<double>(rounded) < value ? rounded * kGrown : rounded;
}

/// What a walk comes to next is mostly in no cache.
inline void fetch(const Tree& tree, std::uint32_t child) {
    const bool leaf = (child & kLeafBit) != 0;
    const char* const at = leaf ? reinterpret_cast<const char*>(tree.leaves + (child & ~kLeafBit))
                                : reinterpret_cast<const char*>(tree.nodes + child);
    __builtin_prefetch(at);
    __builtin_prefetch(at + 64);
    __builtin_prefetch(at + 128);
    if (!leaf) __builtin_prefetch(at + 192);
}

/// `meet(leaf, limit)` looks at a leaf and may lower the limit; true ends the walk.
template <typename Meet>
inline void walk(const Tree& tree, const PreparedRay& ray, double& limit, const Meet& meet) {
    struct Open {
        std::uint32_t child;
        float near;
    };
    Open stack[kStack];
    std::size_t size = 0;
    const Slabs slabs(tree, ray);
    std::uint32_t at = tree.root;
    float limitUp = roundedUp(limit);
    for (;;) {
        while ((at & kLeafBit) == 0) {
            const Node& node = tree.nodes[at];
            alignas(32) float near[kWidth];
            unsigned mask = meetBoxes(slabs, at, limitUp, near);
            if (mask == 0) goto next;
            unsigned first = static_cast<unsigned>(__builtin_ctz(mask));
            mask &= mask - 1;
            at = node.child[first];
            fetch(tree, at);
            if (mask == 0) continue;
            // The nearest is entered at once, the others wait, the nearest of them on top.
            float nearest = near[first];
            const std::size_t bottom = size;
            do {
                const unsigned i = static_cast<unsigned>(__builtin_ctz(mask));
                mask &= mask - 1;
                Open other{node.child[i], near[i]};
                fetch(tree, other.child);
                if (other.near < nearest) {
                    const Open swapped{at, nearest};
                    at = other.child;
                    nearest = other.near;
                    other = swapped;
                }
                std::size_t place = size++;
                while (place > bottom && stack[place - 1].near < other.near) {
                    stack[place] = stack[place - 1];
                    --place;
                }
                stack[place] = other;
            } while (mask != 0);
        }
        if (meet(tree.leaves[at & ~kLeafBit], limit)) return;
        limitUp = roundedUp(limit);
    next:
        do {
            if (size == 0) return;
            --size;
        } while (stack[size].near > limitUp);
        at = stack[size].child;
    }
}

bool nearest(const Tree& tree, const PreparedRay& ray, Hit* best) {
    bool found = false;
    double limit = best->t;
    walk(tree, ray, limit, [&](const Leaf& leaf, double& most) {
        Met met;
        for (unsigned mask = meetTriangles(leaf, ray, most, met); mask != 0; mask &= mask - 1) {
            const unsigned i = static_cast<unsigned>(__builtin_ctz(mask));
            if (met.t[i] > most || (found && met.t[i] == most && leaf.face[i] > best->face)) continue;
            *best = {met.t[i], {met.u[i], met.v[i], met.w[i]}, leaf.face[i]};
            most = met.t[i];
            found = true;
        }
        return false;
    });
    return found;
}

bool any(const Tree& tree, const PreparedRay& ray, double limit) {
    bool found = false;
    walk(tree, ray, limit, [&](const Leaf& leaf, double& most) {
        Met met;
        return found = meetTriangles(leaf, ray, most, met) != 0;
    });
    return found;
}

void all(const Tree& tree, const PreparedRay& ray, HitSink* sink) {
    double limit = sink->limit;
    walk(tree, ray, limit, [&](const Leaf& leaf, double& most) {
        Met met;
        for (unsigned mask = meetTriangles(leaf, ray, most, met); mask != 0; mask &= mask - 1) {
            const unsigned i = static_cast<unsigned>(__builtin_ctz(mask));
            sink->take(sink, {met.t[i], {met.u[i], met.v[i], met.w[i]}, leaf.face[i]});
        }
        most = sink->limit;
        return false;
    });
}

}  // namespace

extern const RayKernels kKernels;
const RayKernels kKernels{&nearest, &any, &all};

}  // namespace tessera::rays::TESSERA_RAYS
