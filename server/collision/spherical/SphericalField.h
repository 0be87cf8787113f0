/// The hierarchical spherical distance field: the surface of a body as it is seen from within.
///
/// From a centre the directions are those of a cube's six faces, each cut into 2^l × 2^l texels, level by level. A
/// texel says between which radii, and between which two parallel planes, the surface in its pyramid lies; the finest
/// ones list its triangles. So a piece of another body, wherever it is and however the bodies are turned, scaled or
/// mirrored, is looked up where it stands: no box of this body has to be turned. Long bodies have several centres, each
/// with its own triangles.
///
/// The idea is that of C. Fünfzig, "Spherical Techniques" (TU Braunschweig, 2007), chapter 5; bounds, planes and walk
/// are derived here (README.md). Nothing is assumed of the surface: open, thin, with handles, seen through itself from
/// the centre, or through it. What such a surface costs is tightness (`looseness`).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "common/base/Error.h"
#include "common/math/Types.h"
#include "server/collision/spherical/FieldTypes.h"
#include "server/collision/tree/TriangleTree.h"

namespace tessera {

class Workers;

struct SphericalFieldOptions {
    /// Finest level, 0 to 8; -1: so that a texel has about eleven triangles of its own.
    int level = -1;
    /// Centres, 1 to 8; 0: one for each 5 widths of length.
    unsigned centres = 0;
    Workers* workers = nullptr;  ///< for the build; the field does not depend on them
};

struct FieldPartStorage;

/// Where the surface is in one direction.
struct FieldShell {
    bool empty = true;             ///< there is none
    double inner = 0, outer = 0;   ///< radii, in the mesh's lengths: all of the surface in the texel is between them
    double error = 0;              ///< half of what is between them
    Vec3d normal = Vec3d::Zero();  ///< about the mean normal of the surface there, away from the centre
};

/// Follows its tree: the tree must outlive it, and after a refit or rebuild of it, `rebuild` comes before the next
/// query. Any number of threads may query it.
class SphericalField {
public:
    explicit SphericalField(const TriangleTree& tree, const SphericalFieldOptions& options = {});
    ~SphericalField();
    SphericalField(SphericalField&&) noexcept;
    SphericalField& operator=(SphericalField&&) noexcept;

    /// From the mesh as it is now, with the same options.
    void rebuild();

    [[nodiscard]] const TriangleTree& tree() const { return *tree_; }
    [[nodiscard]] std::size_t centreCount() const { return parts_.size(); }
    /// In the mesh's frame.
    [[nodiscard]] Vec3d centre(std::size_t i) const;
    [[nodiscard]] unsigned finestLevel(std::size_t i) const;
    /// How far apart a texel's planes are, in widths of the texel, on average: about 0.1 for what is smooth and seen
    /// once from the centre, 1 and more for what is seen through itself. Measured at the level above the finest.
    [[nodiscard]] double looseness() const { return looseness_; }
    /// Without the tree.
    [[nodiscard]] std::size_t memoryBytes() const;
    [[nodiscard]] std::size_t entryCount() const;

    /// What is seen from a centre in a direction (any length but 0; in the mesh's frame), at a level; levels beyond the
    /// finest are the finest. kBadInput: no direction, or no such centre.
    [[nodiscard]] Expected<FieldShell> shell(std::size_t centre, const Vec3d& direction, unsigned level = ~0U) const;

    /// For the queries of this folder: parts in the tree's own coordinates less `offset`.
    [[nodiscard]] const std::vector<kernel::FieldPart>& views() const { return views_; }
    [[nodiscard]] const Vec3d& offset(std::size_t part) const;

private:
    const TriangleTree* tree_;
    SphericalFieldOptions options_;
    std::vector<std::unique_ptr<FieldPartStorage>> parts_;
    std::vector<kernel::FieldPart> views_;
    double looseness_ = 0;
};

}  // namespace tessera
