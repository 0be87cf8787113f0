/// A ray through a tree of triangles: what the kernels of the two instruction sets share.
///
/// Plain data: this header is compiled into files of different instruction sets and must bring no inline function with
/// it. Every lane does the same IEEE operations whatever the instruction set (nothing is contracted): answers do not
/// depend on the processor.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tessera::rays {

inline constexpr std::uint32_t kWidth = 8, kLeafFaces = 4;
inline constexpr std::uint32_t kLeafBit = 0x80000000u, kNoChild = 0xffffffffu;
/// Of nodes above each other (RayTree.cpp divides so); a walk leaves seven siblings behind at each.
inline constexpr std::size_t kMaxDepth = 48, kStack = kMaxDepth * (kWidth - 1) + 1;

/// Eight children: boxes in floats, rounded outwards. Rows: lower x y z, upper x y z. Where there is none the box is
/// empty.
struct alignas(64) Node {
    float box[6][kWidth];
    std::uint32_t child[kWidth];  ///< a node, or kLeafBit and a leaf
    std::uint32_t padding[kWidth];
};

/// Four triangles, by corner and coordinate. Where there are fewer, corners are NaN.
struct alignas(32) Leaf {
    float corner[9][kLeafFaces];
    std::uint32_t face[kLeafFaces];
};

struct Tree {
    const Node* nodes;
    const Leaf* leaves;
    std::uint32_t root;  ///< as Node::child
};

struct Hit {
    double t;
    double weights[3];  ///< of the corners; they sum up to 1
    std::uint32_t face;
};

/// A ray from near the tree, ready for boxes (floats) and for triangles (doubles).
struct PreparedRay {
    float originUp[3], originDown[3];  ///< the origin, rounded up and down
    float inverse[3];                  ///< of the direction, of at most 1e30
    unsigned nearRow[3], farRow[3];    ///< of Node::box
    double origin[3];
    unsigned axis[3];  ///< the last one is that of the direction's largest component
    double shear[3];   ///< x / z, y / z, 1 / z of the direction by those axes
};

/// Takes hits in no order; `limit`: no farther ones are wanted from then on.
struct HitSink {
    void (*take)(HitSink* self, const Hit& hit);
    double limit;
};

struct RayKernels {
    /// The nearest hit with t <= best->t; of equal t the one of the lowest face. `best` is set and true returned where
    /// there is one.
    bool (*nearest)(const Tree& tree, const PreparedRay& ray, Hit* best);
    /// Whether there is any with t <= limit.
    bool (*any)(const Tree& tree, const PreparedRay& ray, double limit);
    /// All with t <= sink->limit.
    void (*all)(const Tree& tree, const PreparedRay& ray, HitSink* sink);
};

}  // namespace tessera::rays
