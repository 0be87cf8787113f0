/// What of a Volume is a surface, and how it is drawn.
///
/// Collisions, picks and whoever counts triangles get its surface where the field is `surfaceValue`, in every mode:
/// isoSurface of common/geometry/IsoSurface.h, closed by the box where the field is above at its border; then cut at
/// the clip planes and left open there (common/geometry/PlaneCut.h). Of what would have more than kMostVolumeTriangles
/// fewer voxels are looked at (isoSurfaceWithin). The whole surface is kept while one that is cut is: a plane that
/// moves cuts it anew, at a fraction of making it.
#pragma once

#include <cstddef>

#include "common/cores/Volume.h"
#include "common/drawable/Derivation.h"
#include "common/geometry/IsoSurface.h"

namespace tessera {

/// What one volume may hold.
inline constexpr std::size_t kMostVolumeBytes = std::size_t{1} << 28, kMostVolumeTriangles = 8'000'000,
                             kMostTransferStops = 65536, kMostVolumePlanes = 64;

static_assert(static_cast<std::int64_t>(VoxelFormat::kUint8) == Volume::kUint8 &&
              static_cast<std::int64_t>(VoxelFormat::kUint16) == Volume::kUint16 &&
              static_cast<std::int64_t>(VoxelFormat::kInt16) == Volume::kInt16 &&
              static_cast<std::int64_t>(VoxelFormat::kFloat) == Volume::kFloat);

/// A view of its voxels, which have to be here. Only of a volume that `check` lets pass.
[[nodiscard]] VoxelGrid gridOf(const Volume& volume);

/// Refused in words: a size that is not that of the voxels, fewer than two voxels along an axis, more than
/// kMostVolumeBytes or kMostVoxelsOfLayer, floats that are not finite, a transfer function that ends where it begins or
/// has parts of stops, planes without a normal, planes beyond kMostVolumePlanes.
extern const Derivation kVolumeDerivation;

}  // namespace tessera
