/// The scene as drawing needs it, kept from frame to frame.
#pragma once

#include <memory>
#include <set>
#include <string>

#include "common/math/Box.h"
#include "common/scene/Aspect.h"
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
    /// Says that another frame begins, whatever tiles of whatever screens look at it: what the one before has asked for
    /// is kept. Where nobody says so each look from a tile is a frame.
    void beginFrame();
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

}  // namespace tessera
