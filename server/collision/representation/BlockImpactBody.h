/// A body whose parts are boxes of its own frame, for RigidImpactSearch: height fields and sets of points.
#pragma once

#include <algorithm>

#include "server/collision/query/RigidImpactSearch.h"
#include "server/collision/representation/BodyParts.h"

namespace tessera {

/// The boxes are handed to the kernels as 6-DOPs of a node of a tree that is made when it is looked at.
struct BlockImpactBody : ImpactBody {
    const NumberedParts& parts;  ///< in the body's own frame, not empty

    BlockImpactBody(const NumberedParts& parts, const Box& bounds, const BodyMotion& motion);

    [[nodiscard]] bool isLeaf(std::uint32_t part) const { return parts.isLeaf(part); }
    void place(const kernel::ImpactKernels& kernels, const kernel::ImpactFrame& f, const kernel::MovingFrame& m,
               std::uint32_t part, kernel::PlacedBox& out) const {
        Rows rows;
        rows.set(*this, 0, parts.box(part));
        kernels.place[kShape](rows.view(), f, m, 0, out);
    }
    template <typename Found>
    void eachPart(const kernel::ImpactKernels& kernels, const kernel::ImpactFrame& f, const kernel::MovingFrame& m,
                  std::uint32_t part, const kernel::PlacedBox& other, Found&& found) const {
        PartBoxes boxes;
        parts.open(part, boxes);
        Rows rows;
        for (unsigned i = 0; i < boxes.count; ++i) rows.set(*this, i, boxes.box(i));
        alignas(64) float times[kernel::kWidth];
        kernels.nodeTimes[f.similarity ? 0 : 1][kShape](rows.view(), m, 0, other, f, times);
        for (unsigned i = 0; i < boxes.count; ++i) found(times[i], boxes.part[i]);
    }
    struct Leaf {
        alignas(16) float corners[kernel::kLeafRows * kernel::kLeafFaces];
        std::uint32_t faces[kernel::kLeafFaces];
        unsigned count;
    };
    [[nodiscard]] Leaf leaf(std::uint32_t part) const;
    [[nodiscard]] Triangle triangle(std::uint32_t face) const { return parts.triangle(face); }
    [[nodiscard]] Extent extentAlong(const BodyMoment& moment, std::uint32_t part, const Vec3d& n) const;

private:
    static constexpr std::size_t kShape = static_cast<std::size_t>(kernel::Shape::kDop6);
    /// A node's volumes; what is not set is 0.
    struct Rows {
        alignas(64) float lane[6 * kernel::kWidth] = {};

        void set(const BlockImpactBody& body, unsigned i, const Box& box);
        [[nodiscard]] kernel::TreeView view() const { return {.volumes = lane}; }
    };
    [[nodiscard]] float own(double x, int axis) const { return static_cast<float>((x - centre[axis]) * unit); }
};

}  // namespace tessera
