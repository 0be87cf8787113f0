/// Animations of places as lists of values over time, for formats that know straight lines alone.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "common/export/LeavingMotions.h"
#include "common/export/PlannedTree.h"

namespace tessera {

/// s; readers take no longer ones, ours too.
inline constexpr double kLongestCycle = 1e9;

/// One property of one node: values between times lie on straight lines (rotations turn).
struct NodeTrack {
    int node = -1;                              ///< in PlannedTree::nodes
    std::size_t clock = 0;                      ///< in NodeTracks::clocks
    std::string field;                          ///< "translation", "rotation" (w x y z) or "scale"
    std::vector<double> times;                  ///< s, ascending, from 0
    std::vector<std::array<double, 4>> values;  ///< as many
};

/// What one Animation or Motion plays by.
struct NodeClock {
    ObjectId node;
    std::string name;
    /// Speeds and ways back are in the times of the tracks: it loops, or plays once. Where it stands, all is as it was.
    Playing playing;
    bool stands = false;  ///< it takes longer than kLongestCycle, or for ever as its speed is 0
};

struct NodeTracks {
    std::vector<NodeClock> clocks;
    std::vector<NodeTrack> tracks;
};

/// Of all splines together, and of one, beside those at their keys.
inline constexpr double kMostSplineValues = 1e6, kMostValuesOfASpline = 1e5;

/// Of all animations and motions of the selected nodes; where several drive a property the first does. Steps become two
/// values a hundredth of a frame apart, splines straight lines of a frame of a simulation. Where these would be too
/// many the longest splines have longer lines, with a note: short ones keep what each has a right to.
[[nodiscard]] NodeTracks nodeTracks(const Aspect& scene, const Selection& selection, const PlannedTree& tree,
                                    ExportNotes& notes);

}  // namespace tessera
