#include "server/collision/tree/TriangleTree.h"

#include <algorithm>
#include <cmath>

#include "server/collision/tree/ProfileFit.h"
#include "server/collision/tree/TreeStorage.h"
#include "server/collision/tree/TreeTopology.h"
#include "server/collision/tree/VolumeFit.h"

namespace tessera {

namespace {

/// Own coordinates: about the middle, in a power of two that makes the farthest corner of the box at most 1 away.
void chooseCoordinates(TreeStorage& tree) {
    tree.centre = Vec3d::Zero();
    tree.unit = 1;
    if (tree.mesh->faceCount() == 0) return;
    tree.centre = tree.mesh->bounds().center();
    const double reach = 0.5 * tree.mesh->bounds().size().norm();
    if (reach > 0) tree.unit = std::ldexp(1.0, std::clamp(-std::ilogb(reach) - 1, -200, 200));
}

}  // namespace

TriangleTree::TriangleTree(TriangleMesh mesh, const TreeOptions& options)
    : TriangleTree(std::make_shared<TriangleMesh>(std::move(mesh)), options) {}

TriangleTree::TriangleTree(std::shared_ptr<TriangleMesh> mesh, const TreeOptions& options)
    : storage_(std::make_unique<TreeStorage>()) {
    storage_->mesh = std::move(mesh);
    storage_->options = options;
    rebuild();
}

TriangleTree::~TriangleTree() = default;
TriangleTree::TriangleTree(TriangleTree&&) noexcept = default;
TriangleTree& TriangleTree::operator=(TriangleTree&&) noexcept = default;

const TriangleMesh& TriangleTree::mesh() const {
    return *storage_->mesh;
}
const TreeOptions& TriangleTree::options() const {
    return storage_->options;
}
std::size_t TriangleTree::depth() const {
    return storage_->depth;
}

void TriangleTree::rebuild() {
    TreeStorage& tree = *storage_;
    chooseCoordinates(tree);
    const std::vector<OwnPosition> positions = ownPositions(tree);
    TreeTopology topology = divide(positions, tree.mesh->indices(), tree.options.split);
    tree.children = std::move(topology.children);
    tree.leafFaces = std::move(topology.leafFaces);
    tree.depth = topology.depth;
    tree.refits.reset();
    tree.children.shrink_to_fit();
    tree.leafFaces.shrink_to_fit();
    fitVolumes(tree, positions);
    fitProfiles(tree, positions);
    tree.thin = hasManyPlates(tree);
    tree.builtCost = tree.cost;
}

Expected<void> TriangleTree::refit(std::span<const Vec3d> positions) {
    TreeStorage& tree = *storage_;
    Expected<void> moved = tree.mesh->move(positions);
    if (!moved) return moved;
    refitted();
    return {};
}

void TriangleTree::refitted() {
    TreeStorage& tree = *storage_;
    chooseCoordinates(tree);
    const std::vector<OwnPosition> own = ownPositions(tree);
    fitVolumes(tree, own);
    fitProfiles(tree, own);
    tree.thin = hasManyPlates(tree);
}

void TriangleTree::refitted(std::size_t first, std::size_t count) {
    if (fitSome(*storage_, first, count))
        storage_->thin = hasManyPlates(*storage_);
    else
        refitted();
}

double TriangleTree::decay() const {
    return storage_->builtCost > 0 ? storage_->cost / storage_->builtCost : 1;
}

std::size_t TriangleTree::memoryBytes() const {
    const TreeStorage& tree = *storage_;
    return sizeof(TreeStorage) + tree.mesh->memoryBytes() + tree.children.capacity() * sizeof(kernel::ChildRef) +
           tree.leafFaces.capacity() * sizeof(std::uint32_t) +
           tree.volumes.capacity() * sizeof(TreeStorage::VolumeRow) +
           tree.corners.capacity() * sizeof(TreeStorage::LeafRow) +
           tree.profileRows.capacity() * sizeof(TreeStorage::VolumeRow) +
           tree.profileTables.capacity() * sizeof(TreeStorage::ByteRow) +
           (tree.refits ? (tree.refits->leafStart.capacity() + tree.refits->leaves.capacity() +
                           tree.refits->nodeOfLeaf.capacity() + tree.refits->parent.capacity()) *
                                  sizeof(std::uint32_t) +
                              tree.refits->nodes.capacity() * sizeof(kernel::FitNode)
                        : 0);
}

}  // namespace tessera
