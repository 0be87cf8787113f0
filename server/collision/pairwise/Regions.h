/// What two surfaces share, region by region: each with one direction and one depth, whatever its faces look like
/// (Penetration.h), so that no arrow points sideways.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/collision/pairwise/PairTable.h"

namespace tessera {

struct ContactRegions {
    static constexpr std::uint32_t kNone = 0xffffffffu;
    std::vector<PairDepth> regions;       ///< a direction of zero: it has none (a rod through a plate)
    std::vector<std::uint32_t> regionOf;  ///< per pair of faces; kNone: they only touch, or a surface has no inside
};

/// `faces`: all that meet in these poses, ascending. Costs about a microsecond for each, and once for each shape the
/// neighbours of all its faces.
[[nodiscard]] ContactRegions regionsOf(const PlacedShape& a, const PlacedShape& b, std::span<const FacePair> faces);

[[nodiscard]] PairDepth deepestOf(const ContactRegions& regions);

}  // namespace tessera
