/// What one centre of a field holds. For this folder only.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/math/Types.h"
#include "server/collision/spherical/FieldRaster.h"
#include "server/collision/spherical/FieldTypes.h"

namespace tessera {

struct FieldPartStorage {
    Vec3d offset = Vec3d::Zero();  ///< the centre, in the tree's own coordinates
    kernel::FieldPart view{};      ///< into what follows
    std::array<std::vector<kernel::FieldTexel>, kernel::kMostFieldLevels> texels;
    std::vector<std::uint32_t> start, faces;
    std::vector<std::int16_t> ballX, ballY, ballZ;
    std::vector<std::uint16_t> ballR;
    double looseness = 0;
    std::size_t occupied = 0;  ///< texels at the level that looseness is of

    [[nodiscard]] std::size_t memoryBytes() const;
};

namespace spherical {

/// `triangles`: about the centre; `faces`: what each is called.
void fillPart(FieldPartStorage& part, std::span<const Corners> triangles, std::span<const std::uint32_t> faces,
              unsigned level, Workers* workers);

}  // namespace spherical
}  // namespace tessera
