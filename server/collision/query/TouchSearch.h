/// What the touch queries share: the pair of trees as the kernels see them, and the list of candidates. For the queries
/// of this folder only.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "server/collision/query/TouchQuery.h"
#include "server/collision/tree/KernelTypes.h"

namespace tessera::touch {

/// Of two trees with volumes of two shapes the smaller mesh, divided anew in the kind of the other one; else nothing.
/// Kernels compare volumes of one shape.
[[nodiscard]] std::optional<TriangleTree> ofOneShape(const TriangleTree& a, const TriangleTree& b);
[[nodiscard]] inline bool smallerIsA(const TriangleTree& a, const TriangleTree& b) {
    return a.mesh().faceCount() <= b.mesh().faceCount();
}

/// Two trees that are not empty, in one pose. Read only; any number of threads. Kernels compare volumes of one shape:
/// of two shapes the smaller mesh is divided anew, in the kind of the other tree, which costs a build.
class TreePair {
    std::optional<TriangleTree> ofOneShape_;

public:
    TreePair(const TriangleTree& a, const TriangleTree& b, const Affine3d& a_T_b, const TouchOptions& options);

    TreePair(const TreePair&) = delete;
    TreePair& operator=(const TreePair&) = delete;

    [[nodiscard]] bool rootsOverlap() const;
    [[nodiscard]] bool meets(FacePair pair) const;
    const TriangleTree &treeA, &treeB;  ///< as they are compared
    const TriangleMesh &meshA, &meshB;
    const Affine3d& a_T_b;
    kernel::TreeView a, b;
    kernel::MeshView viewA, viewB;
    kernel::PairFrame frame;
    kernel::PairMap map;
    const kernel::TreeKernels& kernels;
    std::size_t shape;
    kernel::TouchWalk touch;
    PlacedVolumes* placed;  ///< as TouchOptions::placed; null for what is no k-DOP
    void measure(const float* rows, const kernel::ChildRef* children) const;

private:
    kernel::SlotTest overlap_;
    kernel::ProfileLookups lookups_;
};

/// Walks down and decides what the kernels leave: eight pairs of faces at once in double, exactly where that cannot
/// tell.
class Search {
public:
    enum class For { kAny, kAll };
    Search(const TreePair& pair, For what, const QueryWork& work);
    Search(const Search&) = delete;
    Search& operator=(const Search&) = delete;

    /// So many tests of triangles does one in exact arithmetic count for. It takes longer still, up to 30 of them; but
    /// what a limit leaves undecided is asked again in each frame, and a body of 200,000 faces in its copy is to be
    /// decided in one. Where a body stands in its copy almost every test is exact.
    static constexpr std::uint64_t kExactTests = 8;
    static constexpr unsigned kAllLevels = ~0u;
    /// Looks at what is below an overlapping pair of slots. True: the search is over (found, or out of work).
    bool walk(kernel::SlotPair from, unsigned levels = kAllLevels);
    /// After the last walk: decides about the candidates that are left.
    void finish();
    /// Pairs so many levels below are put here and not walked into, while there is room.
    void putOff(kernel::SlotPair* to, std::uint32_t capacity);
    [[nodiscard]] std::uint32_t countPutOff() const { return sink_.laterCount; }

    [[nodiscard]] std::vector<FacePair>& pairs() { return pairs_; }
    /// Above the leaves that the last candidates were in, or near them.
    [[nodiscard]] kernel::SlotPair lastPlace() const { return sink_.place; }
    [[nodiscard]] bool exhausted() const { return sink_.exhausted; }
    void take(QueryWork& work) const;

private:
    bool decide();

    const TreePair& pair_;
    bool any_;
    static constexpr std::uint32_t kCapacity = 256;
    std::array<std::uint32_t, kCapacity> facesA_, facesB_;
    kernel::TouchSink sink_{};
    std::vector<FacePair> pairs_;
};

inline constexpr kernel::SlotPair kRoots{0, 0};

/// By ascending faces; A has so many.
void sort(std::vector<FacePair>& pairs, std::size_t facesA);

}  // namespace tessera::touch
