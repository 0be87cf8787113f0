/// Animations and Motions as animations of glTF 2.0.
#pragma once

#include <map>
#include <unordered_map>

#include "common/cores/Animation.h"
#include "common/cores/Motion.h"
#include "common/export/GltfParts.h"
#include "common/export/PlannedTree.h"

namespace tessera {

class GltfMotions {
public:
    GltfMotions(const Aspect& scene, const Selection& selection, const PlannedTree& tree, GltfParts& parts,
                ExportNotes& notes);

    /// All that plays, or could, among the selected nodes.
    void addAll();

private:
    struct Track {
        std::vector<double> times;   ///< s, ascending
        std::vector<double> values;  ///< as KeyFrames has them
        std::int64_t interpolation = KeyFrames::kLinear;
    };
    class Channels;
    void add(const SelectedNode& node, const Animation& animation);
    void add(const SelectedNode& node, const Motion& motion);
    void addKeys(const SelectedNode& node, const KeyFrames& keys, Channels& channels);
    [[nodiscard]] int sampler(Track track, std::string_view path, std::size_t components, Channels& channels);

    const Aspect& scene_;
    const Selection& selection_;
    const PlannedTree& tree_;
    GltfParts& parts_;
    ExportNotes& notes_;
    std::unordered_map<ObjectId, std::vector<std::size_t>> bearers_;  ///< of a core, in Selection::nodes
    std::map<std::vector<float>, int> times_;                         ///< accessors
};

}  // namespace tessera
