#include "client/render/order/RenderAction.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <tuple>
#include <utility>

#include "client/render/cull/MaskedCuller.h"
#include "client/render/cull/PartCuller.h"
#include "client/render/order/TransparentOrder.h"
#include "client/render/scene/SceneItems.h"
#include "client/render/scene/ShadowReach.h"
#include "common/wall/Detail.h"

namespace tessera {
namespace {

static_assert(static_cast<std::int64_t>(ToneMap::kNeutral) == Environment::kNeutral &&
              static_cast<std::int64_t>(ToneMap::kClamp) == Environment::kClamp &&
              static_cast<std::int64_t>(ToneMap::kReinhard) == Environment::kReinhard &&
              static_cast<std::int64_t>(ToneMap::kAces) == Environment::kAces &&
              static_cast<std::int64_t>(ToneMap::kAgx) == Environment::kAgx);

/// As the wall exposes it: `exposure` is all of it then, what was metered too.
Environment exposedBy(Environment environment, const Exposure& wall) {
    environment.metered = wall.wish.metered.value_or(environment.metered);
    environment.exposure = static_cast<float>(wall.wish.stops.value_or(environment.exposure) +
                                              (environment.metered ? wall.foundStops() : 0.0));
    if (wall.wish.toneMap) environment.toneMap = static_cast<std::int64_t>(*wall.wish.toneMap);
    return environment;
}

}  // namespace

/// An item's place in the one draw order (DrawSorting.h). Node ids are unique, so the order is total.
struct Ranked {
    /// Band of depth and state, the greater of them above; nothing where the sorting does not ask.
    std::uint64_t bandAndState = 0;
    ObjectId material, geometry;
    double depth = 0;
    ObjectId node;
    std::uint32_t item = 0;

    bool operator<(const Ranked& other) const {
        if (bandAndState != other.bandAndState) return bandAndState < other.bandAndState;
        if (material != other.material) return material < other.material;
        if (geometry != other.geometry) return geometry < other.geometry;
        return std::tie(depth, node) < std::tie(other.depth, other.node);
    }
};

/// Sorts what was sorted a frame ago: an eye that moves changes little. What stands out of order is taken out, sorted
/// by itself and merged with the rest, however far it goes: Ernerfeldt's drop-merge sort.
class FormerOrder {
public:
    /// `ranked` into its order. The order that comes out is that of the elements, whatever came before.
    void sort(std::vector<Ranked>& ranked, std::size_t slots) {
        divide(ranked, slots);
        std::sort(loose_.begin(), loose_.end());
        std::merge(kept_.begin(), kept_.end(), loose_.begin(), loose_.end(), ranked.begin());
        order_.clear();
        for (const Ranked& one : ranked) order_.push_back(one.item);
    }

private:
    static constexpr std::uint32_t kGone = 0xffffffffu;

    /// All of `ranked` into those that still stand in order, and the others.
    void divide(const std::vector<Ranked>& ranked, std::size_t slots) {
        places_.resize(std::max(places_.size(), slots), kGone);
        for (std::uint32_t i = 0; i < ranked.size(); ++i) places_[ranked[i].item] = i;
        kept_.clear();
        loose_.clear();
        looseInARow_ = 0;
        for (const std::uint32_t item : order_)
            if (const std::uint32_t place = item < slots ? std::exchange(places_[item], kGone) : kGone; place != kGone)
                put(ranked[place]);
        for (const Ranked& one : ranked)
            if (std::exchange(places_[one.item], kGone) != kGone) loose_.push_back(one);
    }
    void put(const Ranked& one) {
        if (kept_.empty() || !(one < kept_.back())) {
            kept_.push_back(one);
        } else if (kept_.size() < 2 || !(one < kept_[kept_.size() - 2])) {
            // The one before has moved: this stands in order without it.
            loose_.push_back(std::exchange(kept_.back(), one));
        } else if (looseInARow_ < kMostInARow) {
            ++looseInARow_;
            return loose_.push_back(one);
        } else {
            // Or it has moved together with its neighbours, and all behind them only seem to have.
            loose_.push_back(kept_.back());
            kept_.pop_back();
            looseInARow_ = 0;
            return put(one);
        }
        looseInARow_ = 0;
    }

    static constexpr std::size_t kMostInARow = 8;
    std::vector<std::uint32_t> order_;   ///< items, as they stood
    std::vector<std::uint32_t> places_;  ///< by item, while it is sorted
    std::vector<Ranked> kept_, loose_;
    std::size_t looseInARow_ = 0;
};

/// Asks for what will be read, so many elements ahead.
constexpr std::size_t kAhead = 8;

/// When to look for what is hidden. Where some looks one after the other have not paid, the next one comes after a
/// pause, and after ever longer ones: in a scene that hides nothing that costs a hundredth of one look a frame.
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
    static constexpr unsigned kPatience =
        3;  ///< looks: the first ones find meshes that are not yet ready to hide things
    static constexpr unsigned kLongestPause = 7;  ///< 127 frames
    std::size_t itemsThen_ = 0;
    unsigned inVain_ = 0;  ///< looks, the last ones
    unsigned left_ = 0;    ///< frames until the next
};

struct RenderAction::Impl {
    CullerKind kind = CullerKind::kAuto;
    DrawSorting sorting = kDefaultSorting;
    MaskedCuller masked;
    LookingHabit habit;
    std::vector<std::unique_ptr<PartCuller>> parts;  ///< of the tile, where the renderer is asked
    std::vector<std::uint32_t> visible;
    std::vector<std::uint32_t> items;
    std::vector<Ranked> opaque, transparent;
    FormerOrder former;
    TransparentOrder transparentOrder;
    std::vector<TransparentOrder::Item> transparentItems;
    ShadowWatch shadowWatch;

    /// Keeps of `items` what the renderer does not say is hidden.
    [[nodiscard]] Expected<void> askRenderer(const RenderScene::Impl& scene, const ScreenCamera& camera,
                                             const PixelRect& pixels, VisibilityDevice& device, CullCounts& count);
    /// What is visible, into its order. How many triangles that is.
    [[nodiscard]] std::uint64_t rank(const RenderScene::Impl& scene, const ScreenCamera& camera);
    void describe(const RenderScene::Impl& scene, std::uint32_t item, DrawItem& drawn) const;
    [[nodiscard]] DrawList list(const RenderScene::Impl& scene, const ScreenCamera& camera);
};

RenderAction::RenderAction(CullerKind kind, DrawSorting sorting) : impl_(std::make_unique<Impl>()) {
    impl_->kind = kind;
    impl_->sorting = sorting;
}
RenderAction::~RenderAction() = default;

DrawList RenderAction::run(const RenderScene& scene, const ScreenCamera& camera, const PixelRect& pixels,
                           CullCounts* counts) {
    TESSERA_CHECK(!asksRenderer(impl_->kind), "this culler asks the renderer: run it with one");
    return *run(scene, camera, pixels, nullptr, counts);
}

Expected<DrawList> RenderAction::run(const RenderScene& scene, const ScreenCamera& camera, const PixelRect& pixels,
                                     VisibilityDevice* device, CullCounts* counts) {
    const bool asks = asksRenderer(impl_->kind);
    if (asks && !device)
        return fail(ErrorCode::kUnsupported,
                    fmt::format("the culler '{}' asks the renderer what is hidden, and there is none here",
                                nameOf(impl_->kind)));
    const RenderScene::Impl& all = scene.seenFrom(camera);
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
    count.looked = asks || impl_->kind == CullerKind::kMasked ||
                   (impl_->kind == CullerKind::kAuto && impl_->habit.looks(count.inFrustum));
    // What was found hidden is not true of another sight.
    impl_->masked.forget();
    if (asks) {
        if (auto asked = impl_->askRenderer(all, camera, pixels, *device, count); !asked)
            return tl::unexpected(asked.error());
    } else if (count.looked) {
        impl_->habit.looked(count.inFrustum, impl_->masked.cull(all, camera, pixels, items));
    }
    count.drawn = items.size();
    count.trianglesDrawn = impl_->rank(all, camera);
    if (counts) *counts = count;
    DrawList result = impl_->list(all, camera);
    result.shadowState = impl_->shadowWatch.look(all, result, camera, pixels);
    return result;
}

Expected<void> RenderAction::Impl::askRenderer(const RenderScene::Impl& scene, const ScreenCamera& camera,
                                               const PixelRect& pixels, VisibilityDevice& device, CullCounts& count) {
    const std::vector<VisibilityDevice::Part> partsNow = device.partsOf(camera, pixels);
    while (parts.size() < partsNow.size()) parts.push_back(makePartCuller(kind));
    visible.clear();
    DeviceWork work;
    for (std::size_t i = 0; i < partsNow.size(); ++i) {
        const PartView view(scene, partsNow[i]);
        // Nothing is known of other projections: all that is in the frustum stays.
        if (!view.usable()) return {};
        if (auto begun = device.begin(partsNow[i]); !begun) return begun;
        if (auto culled = parts[i]->cull(view, device, visible, work); !culled) return culled;
    }
    // What several parts show is drawn once; what the whole tile's frustum leaves out has no pixel in any part.
    std::sort(visible.begin(), visible.end());
    visible.erase(std::unique(visible.begin(), visible.end()), visible.end());
    std::sort(items.begin(), items.end());
    std::vector<std::uint32_t> kept;
    std::set_intersection(items.begin(), items.end(), visible.begin(), visible.end(), std::back_inserter(kept));
    items.swap(kept);
    count.queries = work.queries;
    count.waits = work.waits;
    count.depthTriangles = work.depthTriangles;
    return {};
}

// The order looks at the screen's camera and the item alone: not at the tile, the culler or what else is there.
std::uint64_t RenderAction::Impl::rank(const RenderScene::Impl& scene, const ScreenCamera& camera) {
    opaque.clear();
    transparent.clear();
    const Vec3d axis = -camera.eye_T_world.linear().row(2).transpose();
    const double offset = -camera.eye_T_world.translation().z();
    std::uint64_t triangles = 0;
    for (std::size_t k = 0; k < items.size(); ++k) {
        if (k + kAhead < items.size()) {
            __builtin_prefetch(&scene.items[items[k + kAhead]]);
            __builtin_prefetch(&scene.boxes[items[k + kAhead]]);
        }
        const std::uint32_t i = items[k];
        const SceneItem& item = scene.items[i];
        triangles += item.mesh->triangles;
        Ranked ranked{.depth = axis.dot(scene.boxes[i].center()) + offset, .node = item.node, .item = i};
        if (sorting == DrawSorting::kBoth)
            ranked.bandAndState = std::uint64_t{static_cast<std::uint32_t>(depthBand(ranked.depth))} << 32;
        if (sorting != DrawSorting::kDepth) {
            ranked.bandAndState |= 2u * item.state + item.mirrored;
            ranked.material = item.material;
            ranked.geometry = item.geometry;
        }
        (item.transparent ? transparent : opaque).push_back(ranked);
        if (item.over) transparent.push_back(ranked);
    }
    former.sort(opaque, scene.items.size());
    return triangles;
}

void RenderAction::Impl::describe(const RenderScene::Impl& scene, std::uint32_t index, DrawItem& drawn) const {
    scene.describe(index, drawn);
    // `none` leaves nothing away anywhere: what others are compared with.
    drawn.everywhere = kind == CullerKind::kNone;
    if (drawn.everywhere) return;
    if (!scene.items[index].asWhole) drawn.clusters = scene.items[index].mesh->clusters();
    drawn.hiddenFrom = masked.hiddenFrom(index);
}

DrawList RenderAction::Impl::list(const RenderScene::Impl& scene, const ScreenCamera& camera) {
    DrawList result;
    result.hiddenClusters = masked.hiddenClusters();
    result.opaque.reserve(opaque.size());
    for (std::size_t i = 0; i < opaque.size(); ++i) {
        if (i + kAhead < opaque.size()) scene.askFor(opaque[i + kAhead].item);
        describe(scene, opaque[i].item, result.opaque.emplace_back());
    }
    transparentItems.clear();
    for (const Ranked& ranked : transparent) {
        TransparentOrder::Item& item = transparentItems.emplace_back();
        item = {.drawn = {}, .item = ranked.item, .depth = ranked.depth};
        describe(scene, ranked.item, item.drawn);
        item.drawn.over = scene.items[ranked.item].over;
    }
    transparentOrder.append(scene, camera, transparentItems, result);
    result.lights = scene.lights;
    const bool shadows = detailStep(camera.detail).shadows;
    if (!shadows)
        for (LightItem& light : result.lights) light.shadows = false;
    result.narrowed = scene.narrowed;
    result.lightsLeftOut = scene.lightsLeftOut;
    result.shadowsLeftOut = scene.shadowsLeftOut;
    result.scopesLeftOut = scene.scopesLeftOut;
    result.casters = scene.shadowCasters(camera);
    result.environment = exposedBy(scene.environment, camera.exposure);
    result.studio = scene.studio;
    result.detailed = scene.detailedItems > 0;
    result.coated = scene.coatedItems > 0;
    result.glossy = scene.glossyItems > 0;
    return result;
}

}  // namespace tessera
