/// How far is a place from a surface, and on which side: known on a lattice, and from there to a stated error
/// everywhere.
///
/// A signed distance changes by no more than the way (it is 1-Lipschitz). So eight known corners of a cell bound it at
/// every place in it: from below by the largest of (known - way), from above by the least of (known + way). Nothing is
/// assumed of the surface. Where it encloses a volume (SurfaceTopology::closed), places that it winds about have
/// negative distances; else all distances are positive.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "common/base/Error.h"
#include "common/math/Types.h"
#include "server/collision/mesh/QueryWork.h"
#include "server/collision/spherical/FieldTypes.h"
#include "server/collision/tree/TriangleTree.h"

namespace tessera {

class Workers;

struct DistanceLatticeOptions {
    /// What queries of two bodies shall be wrong by at most, in diagonals of the mesh's box: 0.001 to 0.2.
    double error = 0.01;
    /// How far around the box it reaches, in diagonals. Beyond, bodies are asked exactly.
    double reach = 0.45;
    Workers* workers = nullptr;  ///< for the build; the lattice does not depend on them
};

struct DistanceBound {
    double lower = 0, upper = 0;
    [[nodiscard]] double distance() const { return 0.5 * (lower + upper); }
    [[nodiscard]] double error() const { return 0.5 * (upper - lower); }
};

/// Immutable; any number of threads. Its tree must outlive it and must not change: for what deforms it is made anew (20
/// to 600 times a tree's build: README.md).
class DistanceLattice {
public:
    /// kBadInput: an empty mesh, options out of range, a tree that is not one of oriented boxes. kLimit: more than 16
    /// million places.
    [[nodiscard]] static Expected<DistanceLattice> make(const TriangleTree& tree,
                                                        const DistanceLatticeOptions& options = {});

    [[nodiscard]] const TriangleTree& tree() const { return *tree_; }
    /// Distances inside are negative.
    [[nodiscard]] bool isSigned() const { return view_.isSigned; }
    /// In the mesh's lengths: what its options asked for, and from place to place.
    [[nodiscard]] double error() const { return error_; }
    [[nodiscard]] double spacing() const;
    [[nodiscard]] std::size_t placeCount() const { return values_.size(); }
    [[nodiscard]] std::size_t memoryBytes() const { return values_.size() * sizeof(std::int16_t); }

    /// Any place in the mesh's frame; far outside the lattice the bounds are far apart. kBadInput: not finite.
    [[nodiscard]] Expected<DistanceBound> at(const Vec3d& place) const;
    /// Which way the distance grows there, unit length; zero where it does not.
    [[nodiscard]] Vec3d gradient(const Vec3d& place) const;

    /// For the queries of this folder: in the tree's own coordinates.
    [[nodiscard]] kernel::LatticeView view() const;

private:
    DistanceLattice() = default;

    const TriangleTree* tree_ = nullptr;
    double error_ = 0;
    kernel::LatticeView view_{};
    std::vector<std::int16_t> values_;
};

struct SignedDistance {
    /// The least signed distance of a point of one surface from the other body. Apart: how far. Where they meet: minus
    /// how deep the deepest point of a surface is in the other body. The truth is within `error` of it.
    double distance = 0;
    double error = 0;
    Vec3d point = Vec3d::Zero();  ///< of a surface, or in a small box of it: less than twice the error from the least;
                                  ///< in A's frame
    /// From A to B there, unit length; zero where there is none. The lattice's: within 50 degrees where the surfaces'
    /// radii are thirteen times the error, and of little worth where they are smaller.
    Vec3d normal = Vec3d::Zero();
    bool complete = true;  ///< false: the work was exhausted; the error is what it then is
    bool exact = false;    ///< asked of the trees: too far for the lattices
    bool farther = false;  ///< nothing is nearer than the upper bound, if there was one; `distance` is the bound then
};

/// Of two bodies; `a_T_b` a similarity, mirrored too. The error is at most the larger of what the lattices were made
/// for, in A's lengths, and where a surface is seen through rounding or lies between places that cannot tell its sides,
/// up to a quarter more; it is always stated. Depths need both lattices signed; with one that is not, what is inside it
/// counts as outside. kBadInput: a map that is no similarity, or that is not finite or out of range.
[[nodiscard]] Expected<SignedDistance> signedDistance(const DistanceLattice& a, const DistanceLattice& b,
                                                      const Affine3d& a_T_b, QueryWork& work);

// Of one body that has a lattice, and the surface of another that has none; under any finite affine map. All in the
// field's frame and lengths; `point` is on the other's surface, `normal` goes from the field's body to it. kBadInput:
// maps that are not finite, or out of range; a tree that is not one of oriented boxes.

/// How far two surfaces are apart: 0 where they meet, more where one is within the other. The error is at most the
/// field's.
[[nodiscard]] Expected<SignedDistance> surfaceDistance(const DistanceLattice& field, const TriangleTree& other,
                                                       const Affine3d& field_T_other, double upperBound,
                                                       QueryWork& work);
/// The least signed distance of a point of the other surface from the field's body; the other way round nothing is
/// asked. kBadInput, too: a field without sides.
[[nodiscard]] Expected<SignedDistance> signedDistance(const DistanceLattice& field, const TriangleTree& other,
                                                      const Affine3d& field_T_other, QueryWork& work);

}  // namespace tessera
