/// Drawables whose arrays are not their fields but are made of them: surfaces that control points stand for.
///
/// A type says what its arrays depend on and how they are made; renderer, collision and picks ask `Drawable` as they ask one of arrays.
/// What is made is made once a process, by content, and kept while somebody keeps its positions. Edits of ranges of the control points
/// lead from arrays to arrays by `Blob::withRange`: so these have origins (Drawable.h, originsOf), and who follows ranges follows them.
///
/// Every host derives for itself, and seams and collisions rest on all getting the same bytes: a derivation is a pure function of its source, with
/// no clock, no order of asking, no eye, and the same result along every way of edits. (One build of the programs on all hosts: processors
/// agree on IEEE's operations, compilers need not agree on their order.) Nothing of it is in a scene's state or hash.
#pragma once

#include <memory>
#include <optional>

#include "common/geometry/Mesh.h"

namespace tessera {

struct DerivedMesh {
    MeshArrays arrays;
    /// What the type wants to find again when the points have moved: rows of weights, …; any thread reads it.
    std::shared_ptr<const void> plan;

    [[nodiscard]] std::size_t bytes() const { return 512 + arrays.positions.sizeBytes() + arrays.normals.sizeBytes(); }
    /// Indices may be shared by all positions of the points; positions are not.
    [[nodiscard]] bool inUse() const { return !arrays.positions.empty() && !arrays.positions.soleHandle(); }
};

struct DerivedSource {
    Hash128 recipe;  ///< of all that the arrays depend on but where the control points are; other types' differ
    Blob points;     ///< the control points: what ranges are edited of
};

/// An earlier state, of the same recipe and as many points, and the bytes of the points that have changed since.
struct EarlierMesh {
    const DerivedMesh& mesh;
    ByteRange changed;
};

/// The functions take one of the type's objects.
struct Derivation {
    /// What is wrong with it: asked before an edit is applied. Nothing at all is fine. Absent arrays are not.
    Expected<void> (*check)(const void*);
    /// Nothing where there is nothing to be seen, or an array is not here.
    std::optional<DerivedSource> (*source)(const void*);
    /// Empty arrays where the object is none that `check` lets pass. With or without `earlier` the same bytes.
    DerivedMesh (*derive)(const void*, const EarlierMesh* earlier);
    /// Whether all the bytes that it is made of are here.
    bool (*resident)(const void*);
};

/// Of what nobody keeps, so much is kept for who asks next.
inline constexpr std::size_t kMostUnusedDerivedBytes = std::size_t{1} << 28;

/// Made, or found. Any thread; waits for another thread that is making the same.
[[nodiscard]] MeshArrays derivedArrays(const Derivation& derivation, const void* core);

}  // namespace tessera
