/// What the vector kernels and the rest of the library hand each other. Plain data: this header is compiled into files
/// of different instruction sets and must bring no inline function with it.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tessera::kernel {

inline constexpr unsigned kWidth = 16;     ///< children of a node
inline constexpr unsigned kLeafFaces = 4;  ///< triangles of a leaf, at most
inline constexpr unsigned kLeafRows = 9;   ///< x, y, z of three corners
inline constexpr unsigned kMostHalfPlanes = 26;
inline constexpr std::uint32_t kNoChild = 0xffffffffu;
inline constexpr std::uint32_t kLeafBit = 0x80000000u;

/// A child: kNoChild; an inner node's index; or kLeafBit | leaf << 2 | triangles - 1.
using ChildRef = std::uint32_t;
/// A place in a node, node · kWidth + child: it stands for the subtree below. Slot 0 is the whole tree.
using Slot = std::uint32_t;

/// A tree's arrays, in its own coordinates: the model's less its centre. Rows are structures of arrays: row r of node n
/// begins at volumes + (n · rows + r) · kWidth; of leaf l at corners + (l · kLeafRows + r) · kLeafFaces.
/// Rows of a sphere: centre, radius. Of an oriented box: centre, three unit axes, three half sides. Of a k-DOP: the
/// largest x · d over the triangles for its k directions d, where direction i + k/2 is the opposite of i.
struct TreeView {
    const float* volumes = nullptr;
    const ChildRef* children = nullptr;
    const float* corners = nullptr;
    const std::uint32_t* faces = nullptr;
    /// Support profiles, or null. Per node centre x y z and step, and for each entry sixteen bytes.
    const float* profileRows = nullptr;
    const std::uint8_t* profileTables = nullptr;
};

/// A k-DOP seen from the other body: new plane i = sum of weight · plane over three planes + offset.
struct Realigned {
    std::uint16_t row[kMostHalfPlanes][3];  ///< of a node, where each plane begins: plane · kWidth
    float weight[kMostHalfPlanes][3];
    float offset[kMostHalfPlanes];
};

/// By support profiles instead: new plane i = vector · centre + length · step · table[entry] + offset.
struct ProfileLookups {
    std::uint32_t entries;  ///< of one volume
    std::uint16_t entry[kMostHalfPlanes];
    float vector[kMostHalfPlanes][3];
    float length[kMostHalfPlanes];
    float offset[kMostHalfPlanes];
};

/// The relative pose of one query, for trees in their own coordinates.
struct PairFrame {
    float linear[9];  ///< B to A, row by row
    float translation[3];
    float axes[9];  ///< linear / scale, for a similarity; else linear
    float scale;    ///< of a similarity; else 1
    float stretch;  ///< no length grows by more
    bool similarity;
    float slack;                    ///< more than what rounding can do to any position, in A's lengths
    float slackB;                   ///< the same in B's lengths
    bool bothWays;                  ///< b_T_a exists: k-DOPs may be compared in B's frame too
    const ProfileLookups* lookups;  ///< for walks by table
    Realigned bInA, aInB;
};

/// A mesh in its own double coordinates: xyz per vertex, three vertices per face.
struct MeshView {
    const double* positions;  ///< null where all are floats
    const std::uint32_t* indices;
    const float* floats;
};

/// B's mesh to A's, for deciding about pairs of faces.
struct PairMap {
    double linear[9];  ///< row by row
    double translation[3];
    /// An orientation of four points, each coordinate at most r from one of them, is wrong by less than doubt · r².
    double doubt;
};

struct SlotPair {
    Slot a, b;
};

/// Where a walk puts what it finds, and what it has done.
struct TouchSink {
    /// Pairs of faces that may meet. `flush` is called when there are `enough`; it empties the list and returns true to
    /// end the walk. Room for kLeafPairs more is needed. What is left at the end is the caller's.
    std::uint32_t* facesA;
    std::uint32_t* facesB;
    std::uint32_t count;
    std::uint32_t enough;
    bool deepestFirst;           ///< of what overlaps, the deepest is walked into first
    std::uint32_t enoughLeaves;  ///< so many pairs of leaves, at most 16, are looked at in one go
    bool (*flush)(TouchSink& sink, void* context);
    void* context;
    /// Not walked into but put here where `levels` runs out, while there is room: tasks for later.
    SlotPair* later;
    std::uint32_t laterCount;
    std::uint32_t laterCapacity;
    SlotPair place;  ///< the last pair of slots whose nodes were looked into
    /// Null, or told each node of B that is placed in A's frame: its rows there, and its children.
    void (*placed)(const float* rows, const ChildRef* children, void* context);
    void* placedContext;
    std::uint64_t nodeTests;
    std::uint64_t triangleTests;
    std::uint64_t limit;  ///< of both
    bool exhausted;
};

/// What a search for the nearest triangles has found so far. Lengths are A's own.
struct DistanceSink {
    /// Of no interest: pairs farther apart than this. Falls as the walk finds nearer ones; less the tolerance.
    float bound;
    float tolerance;
    /// Pairs of faces that may be the nearest, each at least `atLeast` apart. `decide` is called when the list is full;
    /// it empties it and may lower `bound`.
    std::uint32_t* facesA;
    std::uint32_t* facesB;
    float* atLeast;
    std::uint32_t count;
    std::uint32_t capacity;
    void (*decide)(DistanceSink& sink, void* context);
    void* context;
    std::uint64_t nodeTests;
    std::uint64_t triangleTests;
    std::uint64_t limit;  ///< of both
    bool exhausted;
    float unexplored;  ///< what was left out for want of work is not nearer than this
};

/// Most candidates that one pair of leaves can bring.
inline constexpr unsigned kLeafPairs = kLeafFaces * kLeafFaces;

enum class Shape : std::uint8_t { kSphere, kObb, kDop6, kDop14, kDop18, kDop26 };
inline constexpr unsigned kShapes = 6;

/// Walks down from one overlapping pair of slots. levels: how deep to go before pairs are put into `later`.
using TouchWalk = bool (*)(const TreeView& a, const TreeView& b, const PairFrame& frame, SlotPair start,
                           unsigned levels, TouchSink& sink);
/// Do the volumes of a pair of slots overlap?
using SlotTest = bool (*)(const TreeView& a, const TreeView& b, const PairFrame& frame, SlotPair pair);

using DistanceWalk = void (*)(const TreeView& a, const TreeView& b, const PairFrame& frame, SlotPair start,
                              DistanceSink& sink);

/// Which pairs of faces meet, each where trianglesIntersect says so: bit i of meeting[j] for pair 8 j + i. Where the
/// bit of `open` is set that was not decided: they touch, or nearly.
using DecidePairs = void (*)(const MeshView& a, const MeshView& b, const PairMap& map, const std::uint32_t* facesA,
                             const std::uint32_t* facesB, std::uint32_t count, std::uint8_t* meeting,
                             std::uint8_t* open);

/// Bounds of the distances of pairs of faces, in A's model's lengths; they hold what nearestPoints says. Room for the
/// next multiple of eight is needed. Any finite numbers; of those that are larger than 1e50 nothing is known.
using MeasurePairs = void (*)(const MeshView& a, const MeshView& b, const PairMap& map, const std::uint32_t* facesA,
                              const std::uint32_t* facesB, std::uint32_t count, double* atLeast, double* atMost);

inline constexpr unsigned kNodeFaces = kWidth * kLeafFaces;  ///< triangles of a lowest node, at most
inline constexpr unsigned kBins = 16;

/// A triangle's box while a mesh is divided: x y z of -lower and the face, x y z of upper and 0. So every union is a
/// largest. As a number, face + kFaceBias is a normal one: sums of denormal ones would be slow.
struct alignas(32) BoxItem {
    static constexpr std::uint32_t kFaceBias = 0x40000000u;
    float side[8];
};
/// Around some of them: their sides; twice their centres, and the opposite.
struct alignas(64) BoxBin {
    float side[16];
};
/// The triangles of a part by their centres along an axis: bin = (twice the centre - start) · scale.
struct Bins {
    unsigned axis;
    float start, scale;
    std::uint32_t counts[2][kBins];  ///< the sum of both is meant,
    BoxBin box[2][kBins];            ///< and the union
};
/// Bins from firstRight on go to the right.
struct Cut {
    unsigned axis;
    float start, scale;
    unsigned firstRight;
};
enum class CutRule : std::uint8_t { kSurface, kVolume, kMedian, kMean };
/// A lowest node's triangles, places in a list, leaf by leaf.
struct LeafDivision {
    std::uint8_t order[kNodeFaces];
    std::uint8_t counts[kWidth];
    std::uint32_t leaves;
};

struct DivisionKernels {
    void (*fillBins)(const BoxItem* items, std::uint32_t count, Bins& bins);
    /// Puts the items in order; `left` and `right` have room for as many as go there. Bins may be null.
    void (*part)(const BoxItem* from, std::uint32_t count, const Cut& cut, BoxItem* left, BoxItem* right,
                 Bins* binsLeft, Bins* binsRight);
    /// As few leaves as they can be, for more triangles than one holds and at most kNodeFaces: cuts between whole
    /// leaves.
    void (*intoLeaves)(const BoxItem* items, unsigned count, CutRule rule, LeafDivision& out);
};

/// Of one node, while volumes are fitted.
struct FitNode {
    std::uint32_t firstLeaf, endLeaf;  ///< below it
    float moments[10];                 ///< of the surface below it: area, centre, second moments
};

/// A divided tree whose corners are there (missing ones of a leaf repeat its first triangle's) and whose volumes are to
/// be made. Children come after their node.
struct FitJob {
    float* volumes;
    const ChildRef* children;
    const float* corners;
    std::uint32_t nodeCount;
    FitNode* nodes;  ///< room for each; where only some are fitted, what the last fit made of the others
    double cost;     ///< out: the sum of the volumes' surfaces; of some: in and out
    double whole;    ///< out: the surface of the whole's
    const std::uint32_t* some = nullptr;  ///< ascending, with every node above one of them; null: all
    std::uint32_t someCount = 0;
};
using FitVolumes = void (*)(FitJob& job);

struct TreeKernels {
    DecidePairs decide;
    MeasurePairs measure;
    TouchWalk touch[kShapes];
    SlotTest overlap[kShapes];
    TouchWalk touchByTable[kShapes];  ///< of k-DOPs of 14, 18 and 26 directions
    SlotTest overlapByTable[kShapes];
    DistanceWalk distance[kShapes];
    FitVolumes fit[kShapes];
    DivisionKernels division;
};

}  // namespace tessera::kernel
