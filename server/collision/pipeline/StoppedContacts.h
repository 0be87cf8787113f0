/// What stopped motions, and is still where it did.
#pragma once

#include <vector>

#include "server/collision/pipeline/ContactList.h"

namespace tessera {

/// A motion is stopped a little before what it would run into, so the two do not touch; whoever pushed is told that
/// they do, in the frame of the stop and for as long as both stay where they are. What is pushed again is told as it
/// was stopped last: a push that goes on for long keeps one step's stops. Kept by nodes, so that it survives changes of
/// structure. Not thread-safe.
class StoppedContacts {
public:
    /// Something stopped a motion in this step.
    void add(Touching touching) { fresh_.push_back(std::move(touching)); }

    /// When everything stands where it will stand: those of this step, and those of earlier ones whose parts have
    /// neither moved nor stopped each other since, with the time at which they stopped a motion then.
    [[nodiscard]] std::vector<Touching> settle(const ObjectHandler& handler);

private:
    struct Kept {
        Touching touching;
        std::uint64_t versionA = 0, versionB = 0;
    };
    std::vector<Touching> fresh_;
    std::vector<Kept> kept_;
};

}  // namespace tessera
