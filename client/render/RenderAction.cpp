#include "client/render/RenderAction.h"

#include <algorithm>
#include <tuple>

#include "client/render/MaskedCuller.h"
#include "client/render/SceneItems.h"

namespace tessera {

namespace {

/// An item's place in the one draw order. Node ids are unique, so the order is total.
struct Ranked {
    double depth;
    ObjectId node;
    std::uint32_t item;
};

bool nearerFirst(const Ranked& a, const Ranked& b) {
    return std::tie(a.depth, a.node) < std::tie(b.depth, b.node);
}
bool fartherFirst(const Ranked& a, const Ranked& b) {
    return std::tie(b.depth, a.node) < std::tie(a.depth, b.node);
}

/// When to look for what is hidden. Where some looks one after the other have not paid, the next one comes after a pause, and
/// after ever longer ones: in a scene that hides nothing that costs a hundredth of one look a frame.
class LookingHabit {
public:
    /// `items`: in the frustum now. Where there are far more than at the last look, it is another sight.
    bool looks(std::size_t items) {
        if (items > 2 * itemsThen_ + 16) left_ = inVain_ = 0;
        if (left_ == 0) return true;
        --left_;
        return false;
    }
    void looked(std::size_t items, const CullingWork& work) {
        itemsThen_ = items;
        inVain_ = work.savedNs > work.spentNs ? 0 : inVain_ + 1;
        left_ = inVain_ < kPatience ? 0 : (1u << std::min(inVain_ - kPatience, kLongestPause)) - 1;
    }

private:
    static constexpr unsigned kPatience = 3;      ///< looks: the first ones find meshes that are not yet ready to hide things
    static constexpr unsigned kLongestPause = 7;  ///< 127 frames
    std::size_t itemsThen_ = 0;
    unsigned inVain_ = 0;  ///< looks, the last ones
    unsigned left_ = 0;    ///< frames until the next
};

}  // namespace

// What a box is inside of is not tested again below it.
void collectInFrustum(const RenderScene::Impl& scene, const Frustum& frustum, std::vector<std::uint32_t>& found) {
    if (scene.tree.empty()) return;
    struct Open {
        std::uint32_t node;
        Frustum::Mask mask;
    };
    std::vector<Open> open{{BoxTree::kRoot, Frustum::kAllPlanes}};
    while (!open.empty()) {
        const auto [index, mask] = open.back();
        open.pop_back();
        const BoxTree::Node& node = scene.tree.node(index);
        const Frustum::Result result = mask == 0 ? Frustum::Result{} : frustum.classify(node.box, mask);
        if (result.outside) continue;
        if (!node.leaf) {
            open.push_back({node.below[1], result.undecided});
            open.push_back({node.below[0], result.undecided});
            continue;
        }
        for (const std::uint32_t item : node.items()) {
            if (result.undecided == 0 || !frustum.classify(scene.boxes[item], result.undecided).outside)
                found.push_back(item);
        }
    }
}

struct RenderAction::Impl {
    CullerKind kind = CullerKind::kAuto;
    MaskedCuller masked;
    LookingHabit habit;
    std::vector<std::uint32_t> items;
    std::vector<Ranked> opaque, transparent;

    void rank(const RenderScene::Impl& scene, const ScreenCamera& camera);
    [[nodiscard]] DrawList list(const RenderScene::Impl& scene, const ScreenCamera& camera) const;
};

RenderAction::RenderAction(CullerKind kind) : impl_(std::make_unique<Impl>()) {
    impl_->kind = kind;
}
RenderAction::~RenderAction() = default;

DrawList RenderAction::run(const RenderScene& scene, const ScreenCamera& camera, const PixelRect& pixels,
                           CullCounts* counts) {
    const RenderScene::Impl& all = scene.impl();
    std::vector<std::uint32_t>& items = impl_->items;
    items.clear();
    if (impl_->kind == CullerKind::kNone) {
        for (std::uint32_t i = 0; i < all.items.size(); ++i) {
            if (!all.boxes[i].empty()) items.push_back(i);
        }
    } else {
        collectInFrustum(all, tileFrustum(camera, pixels, kFrustumMarginPx + all.widestLineReachPx()), items);
    }
    CullCounts count;
    count.inFrustum = items.size();
    count.looked = impl_->kind == CullerKind::kMasked ||
                   (impl_->kind == CullerKind::kAuto && impl_->habit.looks(count.inFrustum));
    if (count.looked) impl_->habit.looked(count.inFrustum, impl_->masked.cull(all, camera, pixels, items));
    count.drawn = items.size();
    for (const std::uint32_t item : items) count.trianglesDrawn += all.items[item].mesh->triangles;
    if (counts) *counts = count;

    impl_->rank(all, camera);
    return impl_->list(all, camera);
}

// The order looks at the screen's camera and the item alone: not at the tile, the culler or what else is there.
void RenderAction::Impl::rank(const RenderScene::Impl& scene, const ScreenCamera& camera) {
    opaque.clear();
    transparent.clear();
    const Vec3d axis = -camera.eye_T_world.linear().row(2).transpose();
    const double offset = -camera.eye_T_world.translation().z();
    for (const std::uint32_t i : items) {
        const SceneItem& item = scene.items[i];
        const Ranked ranked{axis.dot(scene.boxes[i].center()) + offset, item.node, i};
        (item.transparent ? transparent : opaque).push_back(ranked);
    }
    std::sort(opaque.begin(), opaque.end(), nearerFirst);
    std::sort(transparent.begin(), transparent.end(), fartherFirst);
}

DrawList RenderAction::Impl::list(const RenderScene::Impl& scene, const ScreenCamera& camera) const {
    const auto drawItems = [&](const std::vector<Ranked>& ranking) {
        std::vector<DrawItem> result;
        result.reserve(ranking.size());
        for (const Ranked& ranked : ranking) {
            const SceneItem& item = scene.items[ranked.item];
            DrawItem& drawn = result.emplace_back(scene.drawItem(ranked.item));
            // `none` leaves nothing away anywhere: what others are compared with.
            if (kind == CullerKind::kNone) continue;
            drawn.box = scene.boxes[ranked.item];
            drawn.clusters = item.mesh->clusters;
        }
        return result;
    };
    DrawList result;
    result.opaque = drawItems(opaque);
    result.transparent = drawItems(transparent);
    result.lights = scene.lights;
    result.lightsLeftOut = scene.lightsLeftOut;
    result.shadowsLeftOut = scene.shadowsLeftOut;
    result.casters = scene.shadowCasters(camera);
    result.environment = scene.environment;
    result.detailed = scene.detailedItems > 0;
    result.coated = scene.coatedItems > 0;
    return result;
}

}  // namespace tessera
