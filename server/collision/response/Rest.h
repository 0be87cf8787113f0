/// By what do two parts lie on each other before a motion begins?
#pragma once

#include <span>
#include <vector>

#include "server/collision/pairwise/WorldFaces.h"
#include "server/collision/query/TimeOfImpact.h"

namespace tessera {

struct RestingFaces {
    FacePair faces;
    WorldFaces placed;
};

struct RestTerms {
    double tolerance = 0;  ///< what lies deeper in each other is stuck
    double rounding = 0;   ///< of which a slide may get deeper
    double length = 0;     ///< of the way, at most
    bool turnsA = false, turnsB = false;
};

/// What a slide may add by rounding: a million frames of it stay below the tolerance.
[[nodiscard]] inline RestTerms restingTerms(double tolerance, double length, bool turnsA, bool turnsB) {
    return {tolerance, 1e-6 * tolerance, length, turnsA, turnsB};
}

struct Rest {
    std::vector<Support> supports;
    std::vector<FacePair> within;  ///< stuck in each other; ascending
};

/// At most so many; faces that none of them fits are left out of account (Rest::within).
inline constexpr std::size_t kMostSupports = 32;

/// Adds to a rest what holds some pairs of faces that touch, or nearly so: the directions along which they overlap
/// least and no more than the tolerance, as few as do for all, large faces first. Of pairs that overlap more
/// everywhere: the direction in which they part, and the pair. Says whether anything was added.
bool addRest(Rest& rest, std::vector<RestingFaces> touching, const RestTerms& terms);

}  // namespace tessera
