/// What interests say, and what that makes two parts to each other.
#pragma once

#include <cstdint>
#include <span>

#include "common/change/Value.h"
#include "common/cores/CollisionWords.h"

namespace tessera {

/// An enabled interest as its core says it, in document order. One whose object is gone or hidden has no pairs.
struct InterestTerms {
    ObjectId core;
    std::int64_t response = InterestWords::kStop;
    std::int64_t mode = InterestWords::kPseudoDynamic;
    std::int64_t detail = InterestWords::kAllFaces;
    double threshold = 0;
    std::int64_t show = 0;
    std::int64_t patience = 0;
    bool operator==(const InterestTerms&) const = default;
};

/// What one pair of parts is to each other. Nothing where an ignoring interest speaks of the pair.
struct Relation {
    bool relevant = false;
    bool firstIsObject = true;  ///< the lower-numbered part is on the deciding interest's object side: side A
    std::int64_t response = InterestWords::kReport;  ///< of the deciding interest: the first in document order
    /// What all its interests ask of it together.
    bool contacts = false, dynamic = false, distance = false;
    std::int64_t detail = InterestWords::kYesOrNo;  ///< the most demanding, of those that ask for contacts
    double threshold = 0;                           ///< the largest, of those that ask for the distance
    std::span<const std::uint32_t>
        interests;  ///< indices into ObjectHandler::interests(), ascending; the first decides

    [[nodiscard]] bool wantsAllFaces() const { return contacts && detail != InterestWords::kYesOrNo; }
};

}  // namespace tessera
