/// Scene → draw list for one tile: the one draw order, culling by frustum, culling of what is hidden.
#pragma once

#include <memory>
#include <set>
#include <string>

#include "client/render/DrawList.h"
#include "client/render/DrawSorting.h"
#include "client/render/VisibilityDevice.h"
#include "common/scene/Aspect.h"
#include "common/wall/Culler.h"
#include "common/wall/View.h"

namespace tessera {

/// Numbers that tell states of a scene apart, as far as a picture shows them; only whether they are equal means
/// anything.
struct SceneVersion {
    std::uint64_t scene = 0;     ///< equal: the same pictures
    std::uint64_t contents = 0;  ///< equal: the same arrays, materials and images
    bool operator==(const SceneVersion&) const = default;
};

/// Everything of a scene that does not depend on a tile: items with world transforms and bounds in a hierarchy, meshes'
/// bounds and occluders (cached by blob). Actions look at it from their screen one after the other. Kept from frame to
/// frame; brought up to date by `update`. Belongs to one thread, together with the actions that run on it.
class RenderScene {
public:
    RenderScene();
    ~RenderScene();
    /// Call after the aspect has changed by `list` (null: anything may have changed).
    void update(const Aspect& aspect, const ChangeList* list);
    [[nodiscard]] Box bounds() const;  ///< world bounds of all visible geometry
    [[nodiscard]] SceneVersion version() const;
    /// Nodes of what is shown and yet not drawn: its mesh is not whole (checkMesh), or some of it lies beyond
    /// kUtmostCoordinate. Of what looks at the head it is as the last screen shows it. Not of what is not here yet.
    [[nodiscard]] const std::set<ObjectId>& undrawn() const;

    struct Impl;
    [[nodiscard]] const Impl& impl() const { return *impl_; }
    /// The same with the meshes that this screen draws: what is derived is as fine as its eye and pixels want
    /// (ScreenFineness.h). Holds until it is seen from another camera or updated.
    [[nodiscard]] const Impl& seenFrom(const ScreenCamera& camera) const;

private:
    std::unique_ptr<Impl> impl_;
};

/// In words, for whoever reads a log: which of a node's vertices are at fault. Costs a pass over them.
[[nodiscard]] std::string whyNotDrawn(const Aspect& aspect, ObjectId node);

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
