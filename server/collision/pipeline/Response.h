/// What happens to a motion that would lead into something.
#pragma once

#include <cstdint>
#include <vector>

#include "server/collision/pipeline/MotionTrial.h"

namespace tessera {

/// Faces of an obstacle (its index in the trial) that meet, and the poses in which they do.
struct Hit {
    std::size_t obstacle = 0;
    std::vector<FacePair> faces;
    Affine3d worldA = Affine3d::Identity();
    Affine3d worldB = Affine3d::Identity();
};

struct Resolution {
    Pose accepted;      ///< must not make a new contact
    bool stopped = false;         ///< did not get where it was wanted
    std::vector<Hit> hits;        ///< what was in the way, where it is not touched in the accepted pose
    std::uint64_t undecided = 0;  ///< questions that a limit left open; taken as blocked
};

class Response {
public:
    virtual ~Response() = default;
    [[nodiscard]] virtual Resolution resolve(const MotionTrial& trial) const = 0;
};

/// Goes as far along the way as it is free.
///
/// A pair that is apart at the start stays apart: the whole sweep is tested, then halved until the gap is within the
/// stop tolerance, so a thin obstacle is not jumped however long the way is. A pair that touches at the start and is no
/// deeper in than the stop tolerance *rests*: it may slide and part, but get no deeper. A pair that is deeper in is
/// *stuck*: it may go on while no more of its faces meet than at the start, so that it can be pulled apart. Both are
/// sampled, at steps of half the moving part's thickness (at least a 64th of its size), and end after maxPieces of
/// them.
class StopResponse final : public Response {
public:
    [[nodiscard]] Resolution resolve(const MotionTrial& trial) const override;
};

}  // namespace tessera
