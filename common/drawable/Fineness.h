/// How fine derived triangles are (Derivation.h).
#pragma once

#include <compare>

#include "common/base/Blob.h"

namespace tessera {

/// So many steps finer than the fields say, each with edges half as long: everywhere, or of each part by itself.
struct Fineness {
    unsigned steps = 0;
    Blob levels;  ///< a byte for each of the surface's parts (ScreenParts): its steps. Empty: `steps`, everywhere

    Fineness() = default;
    Fineness(unsigned everywhere) : steps(everywhere) {}
    explicit Fineness(Blob ofParts) : levels(std::move(ofParts)) {}
    bool operator==(const Fineness&) const = default;
    /// Some order, the same on every host; what is as the fields say comes first.
    std::strong_ordering operator<=>(const Fineness& other) const {
        if (steps != other.steps) return steps <=> other.steps;
        return levels.id() <=> other.levels.id();
    }
};

}  // namespace tessera
