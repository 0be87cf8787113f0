/// How much of its detail a wall leaves away where a frame has to be done in time: by steps, the same ones on every
/// tile.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

namespace tessera {

/// One step. A frame says which it is drawn at (View::detail): so all tiles, both eyes and who joins late draw alike,
/// whatever each of them takes.
struct DetailStep {
    /// Levels of detail are chosen as if everything were so many times as far away, materials too; curves may be so
    /// many times as far off, and steps through volumes so many times as long.
    double coarser = 1;
    int mostSamples = 4;  ///< per pixel, of those that the wall asks for
    bool shadows = true;
    /// Samples that an image is looked up with, at most, where it is seen at a grazing angle (anisotropic filtering).
    int anisotropy = 16;
};

/// From all of it to the least. What a step changes is seen by people in about this order: curves, levels and images at
/// grazing angles least, shadows most.
inline constexpr std::array<DetailStep, 7> kDetailSteps{
    {{.coarser = 1, .mostSamples = 4, .shadows = true, .anisotropy = 16},
     {.coarser = 1.5, .mostSamples = 4, .shadows = true, .anisotropy = 4},
     {.coarser = 2, .mostSamples = 4, .shadows = true, .anisotropy = 2},
     {.coarser = 2, .mostSamples = 1, .shadows = true, .anisotropy = 1},
     {.coarser = 3, .mostSamples = 1, .shadows = true, .anisotropy = 1},
     {.coarser = 4, .mostSamples = 1, .shadows = false, .anisotropy = 1},
     {.coarser = 8, .mostSamples = 1, .shadows = false, .anisotropy = 1}}};

[[nodiscard]] constexpr const DetailStep& detailStep(unsigned step) {
    return kDetailSteps[std::min<std::size_t>(step, kDetailSteps.size() - 1)];
}

}  // namespace tessera
