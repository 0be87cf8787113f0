/// A scene as one part of a tile sees it: where boxes lie in its pixels, how near, and what is worth hiding others
/// with.
#pragma once

#include "client/render/TileProjection.h"
#include "client/render/cull/VisibilityDevice.h"
#include "client/render/scene/SceneItems.h"

namespace tessera {

/// What of a part a box can reach: conservative by the margins of TileProjection, and lines stand out of it by their
/// width.
struct BoxSight {
    enum class Fate : std::uint8_t {
        kBeside,   ///< leaves no pixel here
        kTooNear,  ///< reaches into the near plane: counts as visible
        kAsk,      ///< hidden where its plate is
    } fate = Fate::kBeside;
    Frustum::Mask undecided = 0;  ///< for what lies in the box
    double nearest = 0;           ///< inverse depth, 1/m; infinite where it is too near
    VisibilityDevice::Plate plate;
};

class PartView {
public:
    PartView(const RenderScene::Impl& scene, const VisibilityDevice::Part& part);

    /// False: nothing can be said about hiding (see TileProjection).
    [[nodiscard]] bool usable() const { return tile_.usable(); }
    [[nodiscard]] const BoxTree& tree() const { return scene_.tree; }
    [[nodiscard]] std::size_t itemSlots() const { return scene_.items.size(); }
    [[nodiscard]] std::uint64_t rebuilds() const { return scene_.rebuilds; }
    [[nodiscard]] int widthPx() const { return tile_.widthPx(); }
    [[nodiscard]] int heightPx() const { return tile_.heightPx(); }
    [[nodiscard]] double areaPx() const { return static_cast<double>(tile_.widthPx()) * tile_.heightPx(); }
    /// Whether something that has a place is in this slot.
    [[nodiscard]] bool holds(std::uint32_t item) const {
        return item < scene_.items.size() && scene_.items[item].node && !scene_.boxes[item].empty();
    }
    /// `mask`: planes that what it lies in was not wholly inside of.
    [[nodiscard]] BoxSight node(std::uint32_t node, Frustum::Mask mask) const;
    [[nodiscard]] BoxSight item(std::uint32_t item, Frustum::Mask mask) const;

    /// What lies right below a node: f(sight, index, whether it is an item), what leaves no pixel here left out.
    template <typename F>
    void forEachBelow(std::uint32_t node, Frustum::Mask mask, F&& f) const {
        const BoxTree::Node& inside = scene_.tree.node(node);
        const auto tell = [&](const BoxSight& sight, std::uint32_t index) {
            if (sight.fate != BoxSight::Fate::kBeside) f(sight, index, inside.leaf);
        };
        if (inside.leaf) {
            for (const std::uint32_t below : inside.items()) tell(item(below, mask), below);
        } else {
            for (std::size_t i = 0; i < 2; ++i) tell(this->node(inside.below[i], mask), inside.below[i]);
        }
    }

    /// Whether an item hides enough for what its triangles cost once more. Speed alone.
    [[nodiscard]] bool worthHidingWith(std::uint32_t item, const BoxSight& sight) const;
    /// Opaque in every pixel that it covers.
    [[nodiscard]] bool mayHide(std::uint32_t item) const { return scene_.items[item].occludes; }
    [[nodiscard]] std::uint64_t triangles(std::uint32_t item) const { return scene_.items[item].mesh->triangles; }
    [[nodiscard]] DrawItem drawItem(std::uint32_t item) const;

private:
    [[nodiscard]] BoxSight sightOf(Footprint footprint, double reachPx, Frustum::Mask undecided) const;

    const RenderScene::Impl& scene_;
    TileProjection tile_;
    Frustum frustum_;
    double widestReachPx_, reachBound_;
    double depthAtInfinity_, depthPerInverse_;
};

}  // namespace tessera
