/// Who touches whom, or is near whom, by interest: what began, stays and ended.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "server/collision/pipeline/StepResult.h"

namespace tessera {

/// Remembers the last frame in ids of the scene, so that it survives any change of structure: a pair whose object is
/// deleted, hidden or no longer of interest ends. Not thread-safe.
class EventBook {
public:
    /// Two objects of an interest touch at the end of the frame, or touched on the way (firstTime, point, normal).
    /// Several entries for one pair (of several parts): the earliest counts.
    struct Touching {
        PairEvent event;  ///< phase is of no meaning
        bool atEnd = true;
    };
    struct Near {
        PairDistance distance;  ///< phase is of no meaning. Of several entries for one pair the nearest counts
    };

    /// Takes this frame's entries in any order; appends what is to be told, in order, at most `most` of each; returns
    /// how many were left out.
    [[nodiscard]] std::size_t turnPage(std::vector<Touching> touching, std::vector<Near> near, std::size_t most,
                                       StepResult& result);

private:
    std::vector<PairEvent> touching_;  ///< at the end of the last frame, ascending
    std::vector<PairDistance> near_;
};

}  // namespace tessera
