/// The tree that Tessera and its peer build, said in plain numbers: no type of either side is nearer to it. Place 0 is
/// the top; each place has ten below it, all levels are full but for the last.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

namespace tessera::bench {

inline constexpr std::uint64_t kFanOut = 10;

/// parent_T_place = translation · rotation · scale.
struct TreePlace {
    double translation[3];
    double rotation[4];  ///< w x y z, of length 1
    double scale[3];
};

/// Not for place 0.
[[nodiscard]] inline std::uint64_t parentOf(std::uint64_t place) {
    return (place - 1) / kFanOut;
}

/// Where a place is in one of the versions that edits take turns with.
[[nodiscard]] inline TreePlace treePlace(std::uint64_t place, int version) {
    const double t = 1e-3 * static_cast<double>(place % 1000) + 0.1 * version;
    const double half = 0.05 * t;
    return {{t, 1 - t, 0.25}, {std::cos(half), 0, std::sin(half), 0}, {1, 1 + 0.01 * t, 1}};
}

[[nodiscard]] inline std::vector<TreePlace> treePlaces(std::uint64_t count) {
    std::vector<TreePlace> places;
    places.reserve(count);
    for (std::uint64_t i = 0; i < count; ++i) places.push_back(treePlace(i, 0));
    return places;
}

/// A tenth of all places, of every level but the top: the sixth child of each place that has so many.
[[nodiscard]] inline std::uint64_t changedCount(std::uint64_t count) {
    return count < 6 ? 0 : (count - 6) / kFanOut + 1;
}
[[nodiscard]] inline std::uint64_t changedPlace(std::uint64_t k) {
    return kFanOut * k + 6;
}

[[nodiscard]] inline std::vector<TreePlace> changedPlaces(std::uint64_t count, int version) {
    std::vector<TreePlace> places;
    for (std::uint64_t k = 0; k < changedCount(count); ++k) places.push_back(treePlace(changedPlace(k), version));
    return places;
}

}  // namespace tessera::bench
