/// What happens to a motion that would lead into something.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "server/collision/response/MotionTrial.h"

namespace tessera {

/// Faces of an obstacle (its index in the trial) that meet, and the poses in which they do.
struct Hit {
    std::size_t obstacle = 0;
    std::vector<FacePair> faces;
    Affine3d worldA = Affine3d::Identity();
    Affine3d worldB = Affine3d::Identity();
    double fraction = 0;                    ///< of the way, where that was
    std::vector<MeetingPlace> places = {};  ///< of smooth surfaces one for each of `faces`
};

struct Resolution {
    Pose accepted;                ///< must not make a new contact
    bool stopped = false;         ///< did not get where it was wanted
    std::vector<Hit> hits;        ///< what was in the way, where it is not touched in the accepted pose
    std::uint64_t undecided = 0;  ///< questions that a limit left open; taken as blocked
};

/// Asked for each transform that wants to move and has obstacles, one after the other. One object serves many trials.
class Response {
public:
    virtual ~Response() = default;
    [[nodiscard]] virtual Resolution resolve(const MotionTrial& trial) const = 0;
};

/// Goes as far along the way as it is free. Obstacles of any law stop it.
[[nodiscard]] std::unique_ptr<Response> makeStopResponse();
/// Goes as far as the way is free; what is left of the translation then goes on along the surfaces that were met, where
/// all of them are obstacles that let slide (ObstaclePair::slide), at most a few times; the rotation stays where it was
/// stopped.
[[nodiscard]] std::unique_ptr<Response> makeSlideResponse();

}  // namespace tessera
