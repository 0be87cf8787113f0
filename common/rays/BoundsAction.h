/// What is around all that can be drawn below each node? OpenSG's volumes of nodes, for whoever has an aspect of its
/// own.
///
///     BoundsAction bounds;
///     application->onChanges([&](const ChangeList& list, Sequence) { bounds.follow(application->scene(), list); });
///     const Box box = bounds.worldBox(application->scene(), node);
#pragma once

#include <cstdint>
#include <memory>

#include "common/change/ChangeList.h"
#include "common/math/Box.h"
#include "common/scene/Aspect.h"

namespace tessera {

/// Contains what it is said to contain; empty: `radius` below 0.
struct Sphere {
    Vec3d center = Vec3d::Zero();
    double radius = -1;
    [[nodiscard]] bool empty() const { return radius < 0; }
};

/// A box around everything that can be drawn at and below each node, whatever switches, levels and users choose:
/// surfaces as fine as screens draw them, points with their radius, letters, skins as they are posed, lines (their
/// width in pixels not counted), what billboards turn in any direction. Rounding is on the outer side. Of what is not
/// here (absent arrays) nothing is known. What no number can say (an InverseTransform below a scale of 0, products
/// beyond all numbers) has the infinite box.
///
/// Follows the scene list by list: a list costs what it changes, and on the way up from there O(log n) of a node's n
/// children, as far as boxes change. Each InverseTransform of the scene costs the same again for every list that moves
/// anything. A mesh is looked at once, however many nodes show it. One thread at a time.
class BoundsAction {
public:
    BoundsAction();
    ~BoundsAction();
    BoundsAction(BoundsAction&&) noexcept;
    BoundsAction& operator=(BoundsAction&&) noexcept;

    /// After every list that was applied to the aspect; before the first, and after what is no list (another scene),
    /// `lookAnew`.
    void follow(const Aspect& aspect, const ChangeList& list);
    void lookAnew(const Aspect& aspect);

    /// In the coordinates of what is below the node: its own transform counts for its parent's box, not for its own.
    /// Empty where there is nothing to be seen, and for what is no node.
    [[nodiscard]] Box box(ObjectId node) const;
    /// Around the box.
    [[nodiscard]] Sphere sphere(ObjectId node) const;
    /// The same in the world's coordinates: the box around that box, seen from there.
    [[nodiscard]] Box worldBox(const Aspect& aspect, ObjectId node) const;

    struct Work {
        std::uint64_t boxes = 0;   ///< put together, moved or compared
        std::uint64_t meshes = 0;  ///< looked at, vertex by vertex
    };
    /// Since the beginning.
    [[nodiscard]] const Work& work() const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace tessera
