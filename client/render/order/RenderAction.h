/// Scene → draw list for one tile: the one draw order, culling by frustum, culling of what is hidden.
#pragma once

#include <memory>

#include "client/render/DrawList.h"
#include "client/render/cull/VisibilityDevice.h"
#include "client/render/order/DrawSorting.h"
#include "client/render/scene/RenderScene.h"
#include "common/wall/Culler.h"
#include "common/wall/View.h"

namespace tessera {

struct CullCounts {
    std::uint64_t inFrustum = 0;  ///< items that passed the frustum test (culler `none`: all)
    std::uint64_t drawn = 0;      ///< items in the draw list
    std::uint64_t trianglesDrawn = 0;
    bool looked = false;  ///< for what is hidden
    // Of the cullers that ask the renderer.
    std::uint64_t queries = 0;         ///< questions asked; of `twophase` boxes tested
    std::uint64_t waits = 0;           ///< times that it waited for an answer
    std::uint64_t depthTriangles = 0;  ///< drawn for depth alone
};

/// What is fastest (COSTS.md). All tiles of a screen must have the same one.
inline constexpr DrawSorting kDefaultSorting = DrawSorting::kBoth;

/// Culls and orders for one tile. Conservative: what leaves no pixel may be left away, what leaves one never is. Best
/// one per tile: all but `none` and `frustum` remember something of the frames before, which changes the speed alone.
class RenderAction {
public:
    /// Another sorting than the default is for measuring: `./deploy/run-bench sorting`.
    explicit RenderAction(CullerKind kind, DrawSorting sorting = kDefaultSorting);
    ~RenderAction();
    /// `pixels` is the tile's rectangle in the pixels of its whole screen. Not for cullers that ask the renderer.
    [[nodiscard]] DrawList run(const RenderScene& scene, const ScreenCamera& camera, const PixelRect& pixels,
                               CullCounts* counts);
    /// The same with any culler. `device` draws what the list will be drawn with, from the aspect that the scene
    /// follows; errors are its own. None: kUnsupported for a culler that asks the renderer.
    [[nodiscard]] Expected<DrawList> run(const RenderScene& scene, const ScreenCamera& camera, const PixelRect& pixels,
                                         VisibilityDevice* device, CullCounts* counts);

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace tessera
