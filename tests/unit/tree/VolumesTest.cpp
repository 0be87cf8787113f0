#include <array>

#include "server/collision/tree/VolumeFit.h"
#include "server/collision/volume/KDop.h"
#include "tests/unit/tree/Meshes.h"

namespace tessera::trees {
namespace {

using Real = long double;
using kernel::kLeafFaces;
using kernel::kWidth;

DirectionSet directionsOf(VolumeKind kind) {
    switch (kind) {
        case VolumeKind::kDop14:
            return DirectionSet::k14;
        case VolumeKind::kDop18:
            return DirectionSet::k18;
        case VolumeKind::kDop26:
            return DirectionSet::k26;
        default:
            return DirectionSet::k6;
    }
}

/// How far out of each half-space of a slot's volume its farthest corner is: at most 0 everywhere, or the volume does
/// not hold them. In the tree's own lengths, from exact positions.
std::vector<Real> overhangs(const TreeStorage& tree, std::uint32_t slot, std::uint32_t firstLeaf,
                            std::uint32_t endLeaf) {
    const VolumeKind kind = tree.options.volume;
    const unsigned rows = rowsOf(kind);
    const auto cell = [&](unsigned row) {
        return static_cast<Real>(tree.volumes[slot / kWidth * rows + row].lane[slot % kWidth]);
    };
    const std::size_t bounds = kind == VolumeKind::kSphere ? 1 : kind == VolumeKind::kObb ? 3 : rows;
    std::vector<Real> most(bounds, -1e30L);
    const std::span<const Vec3d> ways = directions(directionsOf(kind));
    for (std::uint32_t i = firstLeaf * kLeafFaces; i < endLeaf * kLeafFaces; ++i) {
        if (tree.leafFaces[i] == TreeStorage::kNoFace) continue;
        for (unsigned corner = 0; corner < 3; ++corner) {
            const Vec3d p = tree.mesh->corner(tree.leafFaces[i], corner);
            std::array<Real, 3> x;
            for (int axis = 0; axis < 3; ++axis)
                x[static_cast<unsigned>(axis)] =
                    (static_cast<Real>(p[axis]) - static_cast<Real>(tree.centre[axis])) * static_cast<Real>(tree.unit);
            const auto keep = [&](std::size_t bound, Real overhang) { most[bound] = std::max(most[bound], overhang); };
            const Real fromCentre[3] = {x[0] - cell(0), x[1] - cell(1), x[2] - cell(2)};
            if (kind == VolumeKind::kSphere) {
                keep(0, std::sqrt(fromCentre[0] * fromCentre[0] + fromCentre[1] * fromCentre[1] +
                                  fromCentre[2] * fromCentre[2]) -
                            cell(3));
            } else if (kind == VolumeKind::kObb) {
                for (unsigned k = 0; k < 3; ++k)
                    keep(k, std::abs(cell(3 + 3 * k) * fromCentre[0] + cell(4 + 3 * k) * fromCentre[1] +
                                     cell(5 + 3 * k) * fromCentre[2]) -
                                cell(12 + k));
            } else {
                for (unsigned k = 0; k < rows / 2; ++k) {
                    const Real along = ways[k].x() * x[0] + ways[k].y() * x[1] + ways[k].z() * x[2];
                    keep(k, along - cell(k));
                    keep(k + rows / 2, -along - cell(k + rows / 2));
                }
            }
        }
    }
    return most;
}

void expectVolumesHold(const TreeStorage& tree) {
    if (tree.empty()) return;
    // What kernel/Fit.inl adds, and as much for its own rounding; a sphere's centre is not the best one.
    const Real loose = 5e-6L;
    forSlots(tree, 0, [&](std::uint32_t slot, std::uint32_t first, std::uint32_t end) {
        for (const Real overhang : overhangs(tree, slot, first, end)) {
            ASSERT_LE(overhang, 0) << "slot " << slot;
            ASSERT_GE(overhang, -loose) << "slot " << slot << " is wider than it need be";
        }
    });
    for (std::uint32_t slot = 0; slot < tree.children.size(); ++slot) {
        if (tree.children[slot] != kernel::kNoChild) continue;
        const unsigned rows = rowsOf(tree.options.volume);
        const unsigned row = tree.options.volume == VolumeKind::kSphere ? 3
                             : tree.options.volume == VolumeKind::kObb  ? 12
                                                                        : 0;
        ASSERT_LT(tree.volumes[slot / kWidth * rows + row].lane[slot % kWidth], -1e29f)
            << "an empty slot overlaps nothing";
    }
    for (std::uint32_t face = 0; face < tree.mesh->faceCount(); ++face)
        for (unsigned i = 0; i < 3; ++i)
            ASSERT_LE((tree.mesh->corner(face, i) - tree.centre).norm() * tree.unit, tree.radius + 1e-20);
}

TEST(TreeVolumes, HoldEveryTriangleBelowThem) {
    for (const NamedMesh& mesh : hardMeshes())
        for (const VolumeKind kind : kKinds) {
            SCOPED_TRACE(mesh.name + ", kind " + std::to_string(static_cast<int>(kind)));
            const TriangleTree tree(mesh.arrays.mesh(), {.volume = kind});
            expectVolumesHold(tree.storage());
            if (HasFatalFailure()) return;
        }
}

TEST(TreeVolumes, HoldThemWithEveryInstructionSet) {
    const TriangleMesh meshes[] = {soup(500, 31).mesh(), field(30, 0.3).mesh(), series(200, 0.8).mesh()};
    for (const InstructionSet set : {InstructionSet::kSse41, InstructionSet::kAvx2, InstructionSet::kAvx512}) {
        if (set > instructionSet()) continue;
        for (const TriangleMesh& mesh : meshes)
            for (const VolumeKind kind : kKinds) {
                SCOPED_TRACE(std::string(name(set)) + ", kind " + std::to_string(static_cast<int>(kind)));
                TreeStorage tree = TriangleTree(mesh, {.volume = kind}).storage();
                std::fill(tree.volumes.begin(), tree.volumes.end(), TreeStorage::VolumeRow{});
                fitVolumes(tree, ownPositions(tree), set);
                expectVolumesHold(tree);
                if (HasFatalFailure()) return;
            }
    }
}

TEST(TreeVolumes, OfAFlatPieceAreFlat) {
    // Turned out of the axes, an oriented box still finds the plane.
    Arrays flat = field(32, 0);
    const Quatd turn = Quatd(0.3, 0.5, -0.7, 0.2).normalized();
    for (std::size_t v = 0; v < flat.positions.size(); v += 3) {
        const Vec3d p = turn * Vec3d(flat.positions[v], flat.positions[v + 1], flat.positions[v + 2]);
        std::copy_n(p.data(), 3, &flat.positions[v]);
    }
    const TriangleTree tree(flat.mesh());
    const TreeStorage& s = tree.storage();
    forSlots(s, 0, [&](std::uint32_t slot, std::uint32_t, std::uint32_t) {
        float thinnest = 1;
        for (unsigned k = 12; k < 15; ++k)
            thinnest = std::min(thinnest, s.volumes[slot / kWidth * 15 + k].lane[slot % kWidth]);
        EXPECT_LT(thinnest, 1e-5f) << "slot " << slot;
    });
}

}  // namespace
}  // namespace tessera::trees
