/// The parts of a TriangleTree: its slots.
#pragma once

#include "server/collision/representation/BodyParts.h"
#include "server/collision/tree/TreeStorage.h"

namespace tessera {

class TreeParts final : public BodyParts {
public:
    TreeParts(const TriangleTree& tree, const Affine3d& target_T_tree);

    void whole(PartBoxes& out) const override;
    void open(std::uint32_t part, PartBoxes& out) const override;
    void faces(std::uint32_t leaf, LeafFaces& out) const override;
    [[nodiscard]] Triangle triangle(std::uint32_t face) const override { return mesh_.triangle(face); }
    [[nodiscard]] std::size_t faceCount() const override { return mesh_.faceCount(); }

private:
    void openNode(std::uint32_t node, PartBoxes& out) const;

    const TriangleMesh& mesh_;
    const TreeStorage& storage_;
    kernel::Shape shape_;
    unsigned rows_;
    Mat3d linear_;   ///< of own coordinates to the target
    Vec3d centre_;   ///< of the tree, there
    Vec3d slack_;    ///< what rounding adds to a half side
    Vec3d stretch_;  ///< how far a step of any direction leads along each axis
};

}  // namespace tessera
