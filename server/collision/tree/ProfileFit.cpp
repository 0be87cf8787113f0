#include "server/collision/tree/ProfileFit.h"

#include <algorithm>

namespace tessera {
namespace {

using kernel::kWidth;

class ProfileFitter {
public:
    ProfileFitter(TreeStorage& tree, std::span<const OwnPosition> positions)
        : tree_(tree), positions_(positions), shape_(profileShape(tree.options.volume)) {}

    void fit() {
        tree_.profileRows.assign(4 * tree_.nodeCount(), {});
        tree_.profileTables.assign(shape_.size() * tree_.nodeCount(), {});
        (void)fitNode(0);
    }

private:
    /// The vertices below a node, each once, ascending.
    std::vector<std::uint32_t> fitNode(std::uint32_t node) {
        std::vector<std::uint32_t> all;
        for (unsigned lane = 0; lane < kWidth; ++lane) {
            const kernel::ChildRef ref = tree_.children[std::size_t{node} * kWidth + lane];
            std::vector<std::uint32_t> below;
            if (ref != kernel::kNoChild)
                below = (ref & kernel::kLeafBit) != 0 ? ofLeaf((ref & ~kernel::kLeafBit) >> 2) : fitNode(ref);
            put(node, lane, below);
            all.insert(all.end(), below.begin(), below.end());
        }
        sortOut(all);
        return all;
    }
    static void sortOut(std::vector<std::uint32_t>& vertices) {
        std::sort(vertices.begin(), vertices.end());
        vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
    }
    std::vector<std::uint32_t> ofLeaf(std::size_t leaf) const {
        std::vector<std::uint32_t> vertices;
        for (unsigned i = 0; i < kernel::kLeafFaces; ++i) {
            const std::uint32_t face = tree_.leafFaces[leaf * kernel::kLeafFaces + i];
            if (face == TreeStorage::kNoFace) continue;
            for (unsigned c = 0; c < 3; ++c) vertices.push_back(tree_.mesh->vertexOf(face, c));
        }
        sortOut(vertices);
        return vertices;
    }
    void put(std::uint32_t node, unsigned lane, const std::vector<std::uint32_t>& vertices) {
        float* const rows = tree_.profileRows[4 * std::size_t{node}].lane;
        TreeStorage::ByteRow* const table = &tree_.profileTables[shape_.size() * std::size_t{node}];
        if (vertices.empty()) {
            // Overlaps nothing.
            rows[3 * kWidth + lane] = -1e30f;
            for (std::size_t i = 0; i < shape_.size(); ++i) table[i].lane[lane] = 1;
            return;
        }
        std::vector<Vec3d> points;
        for (const std::uint32_t v : vertices) {
            const float* const p = positions_[v].xyz0;
            points.emplace_back(static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2]));
        }
        const SupportProfile profile = SupportProfile::around(shape_, points);
        for (unsigned axis = 0; axis < 3; ++axis) rows[axis * kWidth + lane] = profile.center[axis];
        rows[3 * kWidth + lane] = profile.step;
        for (std::size_t i = 0; i < shape_.size(); ++i) table[i].lane[lane] = profile.table[i];
    }

    TreeStorage& tree_;
    std::span<const OwnPosition> positions_;
    ProfileShape shape_;
};

}  // namespace

ProfileShape profileShape(VolumeKind kind) {
    const DirectionSet set = kind == VolumeKind::kDop14   ? DirectionSet::k14
                             : kind == VolumeKind::kDop26 ? DirectionSet::k26
                                                          : DirectionSet::k18;
    return {.directions = set, .sectors = 4, .bins = 8};
}

bool hasProfiles(const TreeOptions& options) {
    return options.profiles && (options.volume == VolumeKind::kDop14 || options.volume == VolumeKind::kDop18 ||
                                options.volume == VolumeKind::kDop26);
}

void fitProfiles(TreeStorage& tree, std::span<const OwnPosition> positions) {
    tree.profileRows.clear();
    tree.profileTables.clear();
    if (hasProfiles(tree.options) && !tree.empty()) ProfileFitter(tree, positions).fit();
}

}  // namespace tessera
