/// Makes one tile's pictures, and makes none where the last one would come out again.
#pragma once

#include <functional>
#include <memory>

#include "client/draw/passes/Renderer.h"
#include "client/render/order/RenderAction.h"
#include "client/replica/ProcessorQueue.h"
#include "common/base/Clock.h"

namespace tessera {

/// A tile's picture and what it took.
struct PaintedTile {
    std::shared_ptr<const Picture> picture;
    bool again = false;  ///< the picture before, which shows this frame too
    Duration cull{}, draw{};
    Duration cullQueued{}, drawQueued{};  ///< of these, the thread waited for a processor
    CullCounts counts;                    ///< of what the picture shows
    std::uint64_t skipped = 0;            ///< items that cannot be drawn, of what it shows
    std::string trouble;                  ///< why the surroundings' image is not used
    std::uint64_t lightsLeftOut = 0;      ///< of the scene: more than can be drawn
    NarrowedLines narrowed;               ///< of the screen
    std::uint64_t scopesLeftOut = 0;      ///< DrawCounts::scopesLeftOut
};

/// The picture before is right again when nothing that it was made from has changed: the scene (or, where that has,
/// what of it this tile draws), the camera, to the bit, and what the renderer makes of persons' programs. One thread:
/// that of surface, scene and renderer, which must be the same in every call.
class TilePainter {
public:
    /// `rect`: the tile in the pixels of its screen.
    TilePainter(PixelRect rect, CullerKind culler) : rect_(rect), asks_(asksRenderer(culler)), action_(culler) {}

    /// Errors are the renderer's, and those of `draw`, which makes the tile's picture of a list. `queue`: the calling
    /// thread's.
    using DrawPicture = std::function<Expected<Picture>(const DrawList&)>;
    [[nodiscard]] Expected<PaintedTile> paint(const RenderScene& scene, Renderer& renderer, const ScreenCamera& camera,
                                              const ProcessorQueue& queue, const DrawPicture& draw);

    /// The picture before is not there any more: the next one is drawn.
    void forget() { last_ = {}; }

private:
    PixelRect rect_;
    bool asks_;  ///< the culler, the renderer
    RenderAction action_;
    // What the last picture was made from; none yet: no picture.
    PaintedTile last_;
    ScreenCamera camera_;
    SceneVersion version_;
    std::uint64_t programs_ = 0;  ///< Renderer::programChanges, before it was drawn
    DrawList list_;
};

}  // namespace tessera
