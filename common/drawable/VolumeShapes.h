/// What of a Volume a screen draws where it is not its surface: the box that rays go through, or the planes that it
/// shows itself on.
///
///   kMarched  of clouds and maxima the faces of the voxels' box, as far as clip planes leave it, seen from inside:
///   each
///             ray that meets it leaves it once, wherever the eye is
///   kSlices   of each plane what lies in that box, cut where earlier planes go through it; `texcoords` are no place:
///             (0, the slice that a corner is of)
/// What is seen there is the voxels' (client/draw/store/VolumeTextures.h).
#pragma once

#include "common/cores/Volume.h"
#include "common/drawable/Fineness.h"
#include "common/geometry/Mesh.h"
#include "common/scene/Aspect.h"

namespace tessera {

/// As a Fineness of a Volume: what screens draw. 0 is its surface, for whoever collides, picks, counts.
inline constexpr unsigned kVolumeOnScreens = 1;
/// How screens draw the core: of a Volume that is not its surface kVolumeOnScreens, of Glyphs kGlyphsOnScreens
/// (GlyphArrays.h), of all others as their fields say.
[[nodiscard]] Fineness finenessOnScreens(const Aspect& aspect, ObjectId core);

/// By its mode, in the node's coordinates; empty where nothing is left. Of volumes whose sizes and planes have been
/// checked. Corners are found in double in the box's own coordinates, where it is a cube, and those nearer than 1e-9 of
/// it are one: faces share their corners, the box is closed.
[[nodiscard]] MeshData shapeOnScreens(const Volume& volume);

/// From the first voxel's middle to the last one's: around all that any mode draws, and the surface.
[[nodiscard]] Box boxOf(const Volume& volume);
/// Of a core that is a Volume and is not drawn as its surface; else empty.
[[nodiscard]] Box boxOnScreens(const Aspect& aspect, ObjectId core);

}  // namespace tessera
