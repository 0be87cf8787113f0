/// How wide lines are drawn where too many of them are too wide: the third of the steps before drawing (SceneItems.h,
/// lookFrom).
///
/// What a line costs is what it covers: its length on the screen and its width, times its width, and more where it is
/// blended; a million of the widest would cover a small screen ten thousand times. So a screen has kMostLinePixels for
/// all edges, corners, lines and streaks that it shows. Where they would cover more, those that cover most are drawn
/// narrower, each as wide as makes all of them alike, and none below one pixel: who covers less keeps its width. The
/// choice looks at what the scene shows and at the screen's camera alone, as that of ScreenFineness.h does.
///
/// What lines cover is found from some of them, at most kMostSampledLines of a screen, spread evenly over each mesh. A
/// surface is taken for closed: it has three edges for two triangles, and half as many corners as triangles.
#pragma once

#include <cstdint>

#include "client/render/scene/MeshCache.h"
#include "common/wall/View.h"

namespace tessera {

inline constexpr double kMostLinePixels =
    134217728;                             // 2^27: about a second and a half of a processor that draws by itself
inline constexpr double kBlendedLine = 4;  ///< pixels of an opaque one
inline constexpr std::uint64_t kMostSampledLines = std::uint64_t{1} << 16, kMostSampledOfMesh = 1024;

/// Which lines of a mesh are drawn.
enum class LineSource : std::uint8_t { kLines, kStreaks, kEdges, kCorners };

/// What lines are on a screen, if they are `widthPx` wide: pixels.
struct LinesOnScreen {
    double length = 0;  ///< of all that is seen, together
    double count = 0;   ///< of those of which something is seen
    [[nodiscard]] double covered(double widthPx) const { return widthPx * (length + count * widthPx); }
    /// The width by which they cover so much.
    [[nodiscard]] double widthThatCovers(double pixels) const;
};

[[nodiscard]] std::uint64_t linesOf(const RenderMesh& mesh, LineSource source);
/// From so many of them. IEEE's four operations and roots alone: hosts with other processors have to choose alike.
[[nodiscard]] LinesOnScreen linesOnScreen(const RenderMesh& mesh, LineSource source, const Affine3d& world_T_item,
                                          const ScreenCamera& camera, double widthPx, std::uint64_t samples);

}  // namespace tessera
