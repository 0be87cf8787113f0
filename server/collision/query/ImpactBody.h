/// A body as the search for the first contact sees it: where it is at a moment, and its parts down to the faces. For
/// the queries of this library.
#pragma once

#include "server/collision/query/BodyWay.h"
#include "server/collision/query/ImpactKernels.h"
#include "server/collision/query/SupportSet.h"
#include "server/collision/tree/TreeStorage.h"

namespace tessera {

/// What is the same at any moment of a body's way. Its own coordinates are (x - centre) · unit, at most `radius` in
/// size.
struct ImpactBody {
    BodyWay way;
    Vec3d centre;
    double unit, radius;
    double meshReach;  ///< of its points from the mesh's origin, in the model's lengths
    double reach;      ///< of its points from the origin of the frame that moves

    ImpactBody(const BodyMotion& motion, const Vec3d& ownCentre, double ownUnit, double ownRadius)
        : way(motion),
          centre(ownCentre),
          unit(ownUnit),
          radius(ownRadius),
          meshReach(centre.norm() + radius / unit),
          reach(way.reachAround(centre, radius / unit)) {}

    /// The size that it has in the shared frame, at most.
    [[nodiscard]] double size() const { return way.stretch() * radius / unit; }
    /// What counts as rounding in the shared frame.
    [[nodiscard]] double rounding() const { return 0x1p-53 * 64 * way.extent(meshReach); }
    /// Of its points, but for that of the origin of the frame that moves.
    [[nodiscard]] double turn() const { return way.turn() * radius / unit; }

    /// Of its points, where it is not square to the way's axis.
    [[nodiscard]] double anyAcceleration() const { return way.carried() ? way.acceleration(reach) : 0; }

    [[nodiscard]] kernel::MovingFrame frame(const BodyMoment& m, double t, const Vec3d& origin, const Vec3d& drift,
                                            double sharedUnit, bool similarity) const;
};

/// Rounded to float, and a little more than rounding can take off.
[[nodiscard]] inline float roundedUp6(double x) {
    return static_cast<float>(x * (1 + 1e-6));
}

/// A TriangleTree; parts are its slots.
struct TreeImpactBody : ImpactBody {
    const TriangleMesh& mesh;
    const TreeStorage& storage;
    kernel::TreeView view;
    std::size_t shape;

    TreeImpactBody(const TriangleTree& tree, const BodyMotion& motion)
        : ImpactBody(motion, tree.storage().centre, tree.storage().unit, tree.storage().radius),
          mesh(tree.mesh()),
          storage(tree.storage()),
          view(storage.view()),
          shape(static_cast<std::size_t>(shapeOf(tree.options().volume))) {}

    [[nodiscard]] bool isLeaf(std::uint32_t part) const { return (view.children[part] & kernel::kLeafBit) != 0; }
    void place(const kernel::ImpactKernels& kernels, const kernel::ImpactFrame& f, const kernel::MovingFrame& m,
               std::uint32_t part, kernel::PlacedBox& out) const {
        kernels.place[shape](view, f, m, part, out);
    }
    /// found(time free, part) for what a part that is no leaf is made of.
    template <typename Found>
    void eachPart(const kernel::ImpactKernels& kernels, const kernel::ImpactFrame& f, const kernel::MovingFrame& m,
                  std::uint32_t part, const kernel::PlacedBox& other, Found&& found) const {
        alignas(64) float times[kernel::kWidth];
        const kernel::ChildRef node = view.children[part];
        kernels.nodeTimes[f.similarity ? 0 : 1][shape](view, m, node, other, f, times);
        for (kernel::Slot i = 0; i < kernel::kWidth; ++i) {
            const kernel::Slot slot = node * kernel::kWidth + i;
            if (view.children[slot] != kernel::kNoChild) found(times[i], slot);
        }
    }
    struct Leaf {
        const float* corners;
        const std::uint32_t* faces;
        unsigned count;
    };
    [[nodiscard]] Leaf leaf(std::uint32_t part) const {
        const std::size_t leaf = (view.children[part] & ~kernel::kLeafBit) >> 2;
        return {view.corners + leaf * kernel::kLeafRows * kernel::kLeafFaces, view.faces + leaf * kernel::kLeafFaces,
                (view.children[part] & 3) + 1};
    }
    [[nodiscard]] Triangle triangle(std::uint32_t face) const { return mesh.triangle(face); }
    [[nodiscard]] Extent extentAlong(const BodyMoment& moment, std::uint32_t part, const Vec3d& n) const {
        return tessera::extentAlong(storage, moment, part, n);
    }
};

}  // namespace tessera
