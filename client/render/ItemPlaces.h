/// Where many items lie, before an eye and on a screen, several at once. The same bits on any processor.
#pragma once

#include <span>

#include "client/render/PlaceKernels.h"
#include "client/render/TileProjection.h"
#include "common/math/Types.h"

namespace tessera {

/// `rows[i]` gets places::kRowFloats numbers of item i: eye_T_item, composed in double, then rounded; then the inverse
/// transpose of its linear part up to a positive factor, the largest number of which is 1 (all 0: it is of rank 1).
/// The same bits for an item alone and among others. As many rows as items.
void placeBeforeEye(const Affine3d& eye_T_world, std::span<const places::Matrix> world_T_items,
                    std::span<float* const> rows);

/// What a box around each item covers of a screen, as TileProjection::footprint has it, the item's own noise included
/// (a little more: sums for lengths). `boxes[i]`: six numbers of item i's, in the world, none of them infinite.
void placeOnScreen(const TileProjection& screen, std::span<const double* const> boxes,
                   std::span<const places::Matrix> world_T_items, std::span<places::Rectangle> found);

/// Those that this processor has, the fastest last: all give the same bits.
[[nodiscard]] std::span<const places::PlaceKernels* const> placeKernelsHere();

}  // namespace tessera
