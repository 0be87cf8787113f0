/// Animations of places as lists of values over time, for formats that know straight lines alone.
#pragma once

#include <string>
#include <vector>

#include "common/export/ExportNotes.h"
#include "common/export/PlannedTree.h"

namespace tessera {

/// One property of one node over one time for all: values between times lie on straight lines (rotations turn).
struct NodeTrack {
    int node = -1;                              ///< in PlannedTree::nodes
    std::string field;                          ///< "translation", "rotation" (w x y z) or "scale"
    std::vector<double> times;                  ///< s, ascending, from 0
    std::vector<std::array<double, 4>> values;  ///< as many
};

/// Of all animations and motions of the selected nodes; where several drive a property the first does. Splines become a
/// value for each frame of a simulation, steps two values a hundredth of a frame apart.
[[nodiscard]] std::vector<NodeTrack> nodeTracks(const Aspect& scene, const Selection& selection,
                                                const PlannedTree& tree, ExportNotes& notes);

}  // namespace tessera
