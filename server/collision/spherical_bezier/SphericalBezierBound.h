/// A deforming body bounded by its radius as a function of direction: spherical Bernstein-Bézier patches of degree 2.
///
/// About a centre the sphere is divided into patches (SphereLayout.h), with one continuous function p over them:
/// coefficients on a common edge are common. In every shape that the body takes
///   - no point x of any triangle is farther from the centre than p in its direction, and
///   - each triangle is on the list of every patch in whose cone it has a point.
/// Bodies need not be star-shaped, nor the centre inside; p is then larger than need be, nothing worse.
///
/// Why p holds a triangle T with corners c + y_i, r_i = |y_i|, u_i = y_i / r_i. A point of it, x = sum of l_i y_i, has
/// direction u = sum of b_i u_i with b_i = l_i r_i / r, r = |x|; so 1/r = sum of b_i / r_i, and as the b_i sum to at
/// least 1 (the triangle inequality), r <= max r_i. A patch's p is a quadratic form u'Mu, so on T it is the sum of b_i
/// b_j f_ij with f_ij = u_i'M u_j: where no f_ij is negative, p >= min f_ij. Adding e >= 0 to all six coefficients of a
/// patch adds at least e everywhere in it (the sum of its basis functions is at least 1). So e = max over its list of
/// max r_i - min f_ij will do; where an f_ij is negative, the patch's own range takes the place of min f_ij.
/// Of triangles in a single patch f_ij >= min(p(u_i), p(u_j)) - |M| |u_i - u_j|² / 2, which needs no product with M.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/base/Error.h"
#include "common/math/Types.h"
#include "server/collision/mesh/TriangleMesh.h"
#include "server/collision/spherical_bezier/SphereLayout.h"

namespace tessera {

struct SphericalBezierOptions {
    unsigned levels = 2;          ///< 8 · 4^levels patches; at most SphereLayout::kMostLevels
    std::optional<Vec3d> centre;  ///< none: the middle of the first shape's box
};

/// What holds in one patch.
struct PatchBound {
    Mat3d form = Mat3d::Zero();  ///< p(u) = u' form u, for unit u in the patch
    double formNorm = 0;         ///< Frobenius' norm of it
    double upper = 0;  ///< p and the radius of the body are not larger in the patch: the lesser of p's range and the
                       ///< largest corner's
    double lift = 0;   ///< what the list asked to be added to the first shape's fit
    /// Along the patch's axis every triangle of the list is between these two; the first is not negative. With the cone
    /// they say how near the body can be to the centre, and how far.
    double nearest = 0, farthest = 0;
    /// Around what of the body is in the patch's cone, about the centre.
    Vec3d ballCentre = Vec3d::Zero();
    double ballRadius = 0;
    std::vector<std::uint32_t> faces;  ///< ascending; no face: none of the above counts
};

/// One thread moves it, while nobody asks.
class SphericalBezierBound {
public:
    /// Of a mesh as it is now; fits p to it.
    explicit SphericalBezierBound(const TriangleMesh& mesh, const SphericalBezierOptions& options = {});

    /// Follows a deformation: one position per vertex. kBadInput as TriangleMesh::move; nothing is changed then.
    Expected<void> move(std::span<const Vec3d> positions);
    /// Of the vertices from `first` on. Costs these, their triangles, and the lists of the patches where these were or
    /// are.
    Expected<void> move(std::size_t first, std::span<const Vec3d> positions);
    /// Fits p to the shape as it is now, about the same centre: what has been lifted for earlier shapes is forgotten.
    /// Costs every vertex for each of the layout's points near it.
    void fit();

    [[nodiscard]] const SphereLayout& layout() const { return layout_; }
    [[nodiscard]] const Vec3d& centre() const { return centre_; }
    [[nodiscard]] const std::vector<PatchBound>& patches() const { return patches_; }
    /// Six per patch, in the order of SphereLayout::points, from the layout's.
    [[nodiscard]] double coefficient(std::size_t point) const { return fitted_[point] + lifted_[point]; }
    /// Not below the distance of any point of the body that lies in that direction; 0 where there is surely none.
    [[nodiscard]] double outerRadius(const Vec3d& direction) const;
    [[nodiscard]] const TriangleMesh& mesh() const { return mesh_; }
    /// With its copy of the mesh, as it is now.
    [[nodiscard]] std::size_t memoryBytes() const;

private:
    struct Corner {
        Vec3d offset, direction;
        double radius = 0;
        double value = 0;  ///< p before it is lifted, in its own patch
        double along = 0;  ///< the patch's axis
        std::uint32_t patch = 0;
        bool inside = false;  ///< of the patch, well beyond rounding
    };

    void place(std::size_t first, std::size_t count);
    /// Calls `each(patch)` for the patches whose cones a face reaches into.
    template <typename Each>
    void visit(std::uint32_t face, Each&& each) const;
    void list(std::uint32_t face);
    void findLift(std::uint32_t patch);
    void lift();
    void finish(std::uint32_t patch);
    void follow();
    void fitCoefficients();

    TriangleMesh mesh_;
    SphereLayout layout_;
    Vec3d centre_;
    std::vector<Corner> corners_;
    std::vector<double> fitted_, lifted_;  ///< per point of the layout
    std::vector<Mat3d> fittedForms_;
    std::vector<double> fittedNorms_;
    std::vector<double> fittedLowest_;  ///< a lower bound of the fit in each patch
    std::vector<double> needs_;         ///< lift of each patch
    std::vector<double> largest_;       ///< radius of a corner on its list
    std::vector<PatchBound> patches_;
    std::vector<std::uint32_t> onlyPatch_;           ///< of each face the one that it is in, where it is in one alone
    std::vector<std::uint32_t> facesStart_, faces_;  ///< of each vertex
};

}  // namespace tessera
