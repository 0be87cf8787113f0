#include "client/render/scene/ShadowStore.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <tuple>
#include <utility>

#include "client/render/scene/SceneItems.h"

namespace tessera {
namespace {

/// As this light sees the item; none: it casts no shadow into the map.
std::optional<ShadowCaster> casterOf(const RenderScene::Impl& scene, const ShadowSight& sight, std::uint32_t index) {
    const SceneItem& item = scene.items[index];
    const Box& box = scene.boxes[index];
    if (box.empty() || item.transparent || !rowOf(item.kind).castsShadows || scene.places[item.place].ofServer)
        return std::nullopt;
    const auto shade = sight.shadeOf(box, item.reach);
    if (!shade) return std::nullopt;
    const MeshArrays& arrays = item.mesh->arrays();
    ShadowCaster caster{.item = {},
                        .rect = shade->rect,
                        .front = shade->front,
                        .positions = arrays.positions.id(),
                        .indices = arrays.indices.id(),
                        .mesh = item.cut || !arrays.copies.empty() ? item.mesh->drawn->serial : 0,
                        .cut = item.cut};
    DrawItem& drawn = caster.item;
    scene.describe(index, drawn);
    drawn.box = box;
    if (!item.asWhole) drawn.clusters = item.mesh->clusters();
    // A light is no eye that something could be small to; of what lies over surfaces nothing casts a shadow.
    drawn.radius = 0;
    drawn.center = Vec3d::Zero();
    drawn.scopes = 0;
    drawn.lineWidth = 0;
    drawn.widestLinePx = DrawItem::kAnyWidth;
    if (!item.cut) drawn.material = {};
    return caster;
}

bool sameShadow(const ShadowCaster& a, const ShadowCaster& b) {
    return a.item.node == b.item.node && a.item.geometry == b.item.geometry && a.item.material == b.item.material &&
           a.item.kind == b.item.kind && a.item.pointRadius == b.item.pointRadius && a.item.fill == b.item.fill &&
           a.positions == b.positions && a.indices == b.indices && a.mesh == b.mesh && a.cut == b.cut &&
           a.item.clusters.data() == b.item.clusters.data() &&
           std::memcmp(a.item.world_T_item.data(), b.item.world_T_item.data(), 16 * sizeof(double)) == 0;
}

// What shares mesh and material stands together, so that it is one call.
bool before(const DrawItem& a, const DrawItem& b) {
    return std::tie(a.material, a.mesh->serial, a.mirrored, a.node) <
           std::tie(b.material, b.mesh->serial, b.mirrored, b.node);
}

/// Halves a history that has grown too long: returns the state of the last one that goes, or `knownAfter`.
template <typename Change>
std::uint64_t shorten(std::vector<Change>& changes, std::size_t most, std::uint64_t knownAfter) {
    if (changes.size() <= most) return knownAfter;
    const auto keptFrom = changes.begin() + static_cast<std::ptrdiff_t>(changes.size() / 2);
    knownAfter = std::prev(keptFrom)->state;
    changes.erase(changes.begin(), keptFrom);
    std::erase_if(changes, [knownAfter](const Change& change) { return change.state <= knownAfter; });
    return knownAfter;
}

}  // namespace

ShadowStore::Entry::Entry(const ScreenCamera& camera, bool ofSun, unsigned ofUser)
    : sight(camera, ofSun), user(ofUser), sun(ofSun) {}

void ShadowStore::clear() {
    entries_.clear();
    changes_.clear();
    changesBefore_ = 0;
}

void ShadowStore::beginFrame() {
    told_ = frameBegins_ = true;
}

// A frame in which nobody asks for views is none: who does not look knows that all is as before.
void ShadowStore::beginLook() {
    if (told_ && !frameBegins_) return;
    frameBegins_ = false;
    ++frame_;
    forgetOld();
}

void ShadowStore::forgetOld() {
    std::erase_if(entries_, [this](const auto& entry) { return entry->usedIn + kKeptFrames < frame_; });
    const auto isOld = [this](const auto& entry) { return entry->usedIn + 1 < frame_; };
    std::size_t casters = 0;
    for (const auto& entry : entries_) casters += isOld(entry) ? entry->casters() : 0;
    while (casters > kMostKept) {
        const auto oldest = std::ranges::min_element(entries_, {}, [](const auto& entry) { return entry->usedIn; });
        casters -= (*oldest)->casters();
        entries_.erase(oldest);
    }
}

void ShadowStore::changed(std::uint32_t item) {
    if (entries_.empty()) return;
    changes_.push_back(item);
    if (changes_.size() <= kMostChanges) return;
    changesBefore_ += changes_.size() / 2;
    changes_.erase(changes_.begin(), changes_.begin() + static_cast<std::ptrdiff_t>(changes_.size() / 2));
}

std::shared_ptr<const ShadowView> ShadowStore::view(const RenderScene::Impl& scene, const ScreenCamera& camera,
                                                    bool sun, unsigned user) {
    auto found = std::ranges::find_if(entries_, [&](const auto& entry) {
        return entry->sun == sun && entry->user == user && drawAlike(entry->now->camera, camera);
    });
    const bool follows = found != entries_.end() && (*found)->known >= changesBefore_;
    if (found == entries_.end()) {
        entries_.push_back(std::make_unique<Entry>(camera, sun, user));
        found = std::prev(entries_.end());
    }
    Entry& entry = **found;
    entry.usedIn = frame_;
    if (!follows) {
        entry.now = std::make_shared<ShadowView>(ShadowView{.camera = camera, .clamped = sun});
        start(entry, scene);
    } else if (entry.known < changesBefore_ + changes_.size()) {
        follow(entry, scene);
    }
    entry.known = changesBefore_ + changes_.size();
    join(entry);
    return entry.now;
}

void ShadowStore::start(Entry& entry, const RenderScene::Impl& scene) const {
    static std::atomic<std::uint64_t> kin{0};
    std::vector<std::uint32_t> found;
    collectInFrustum(scene, entry.sight.frustum(), found, entry.sight.planes());
    std::vector<std::pair<ShadowCaster, std::uint32_t>> casters;
    for (const std::uint32_t index : found)
        if (auto caster = casterOf(scene, entry.sight, index)) casters.emplace_back(std::move(*caster), index);
    std::ranges::sort(casters, before, [](const auto& caster) -> const DrawItem& { return caster.first.item; });
    auto all = std::make_shared<std::vector<ShadowCaster>>();
    entry.stillOf.assign(scene.items.size(), kNone);
    entry.items.clear();
    entry.moving.clear();
    entry.changes.clear();
    for (auto& [caster, index] : casters) {
        entry.stillOf[index] = static_cast<std::uint32_t>(all->size());
        entry.items.push_back(index);
        all->push_back(std::move(caster));
    }
    auto still = std::make_shared<StillCasters>();
    still->gone.resize(all->size());
    still->all = std::move(all);
    still->knownAfter = entry.knownAfter = 1;
    entry.joinedIn = frame_;
    entry.now = std::make_shared<ShadowView>(ShadowView{.camera = entry.now->camera,
                                                        .clamped = entry.sun,
                                                        .kin = ++kin,
                                                        .state = 1,
                                                        .still = std::move(still),
                                                        .moving = {}});
}

void ShadowStore::follow(Entry& entry, const RenderScene::Impl& scene) const {
    const std::uint64_t state = entry.now->state + 1;
    std::shared_ptr<StillCasters> still;  // once it has changed
    bool any = false;
    entry.stillOf.resize(scene.items.size(), kNone);
    const auto changed = std::span(changes_).subspan(entry.known - changesBefore_);
    for (const std::uint32_t index : changed) {
        std::optional<ShadowCaster> now = casterOf(scene, entry.sight, index);
        const std::uint32_t place = entry.stillOf[index];
        const auto moving = entry.moving.find(index);
        const ShadowCaster* then = place != kNone                 ? &(*entry.now->still->all)[place]
                                   : moving != entry.moving.end() ? &moving->second.caster
                                                                  : nullptr;
        if (then ? now && sameShadow(*now, *then) : !now) continue;
        any = true;
        if (then) entry.changes.push_back({state, {then->rect, then->front}});
        if (now) entry.changes.push_back({state, {now->rect, now->front}});
        if (place != kNone) {
            if (!still) still = std::make_shared<StillCasters>(*entry.now->still);
            still->gone[place] = true;
            still->changes.push_back({state, then->rect});
            entry.stillOf[index] = kNone;
        }
        if (now) {
            now->since = state;
            entry.moving.insert_or_assign(index, Moving{std::move(*now), frame_});
        } else if (moving != entry.moving.end()) {
            entry.moving.erase(moving);
        }
    }
    if (!any) return;
    entry.knownAfter = shorten(entry.changes, kMostSteps, entry.knownAfter);
    if (still) still->knownAfter = shorten(still->changes, kMostSteps, still->knownAfter);
    ShadowView next{.camera = entry.now->camera,
                    .clamped = entry.sun,
                    .kin = entry.now->kin,
                    .state = state,
                    .still = still ? std::move(still) : entry.now->still,
                    .moving = {}};
    next.moving.reserve(entry.moving.size());
    for (const auto& [index, one] : entry.moving) next.moving.push_back(one.caster);
    std::ranges::sort(next.moving, before, &ShadowCaster::item);
    entry.now = std::make_shared<const ShadowView>(std::move(next));
}

// Of very many that move together, as what has just come, nobody waits for long.
void ShadowStore::join(Entry& entry) const {
    constexpr std::size_t kMany = 1024;
    const std::uint64_t rest = entry.moving.size() > kMany ? 2 : kRestFrames;
    if (entry.moving.empty() || entry.joinedIn + rest > frame_) return;
    const auto rests = [&](const auto& moving) { return moving.second.frame + rest <= frame_; };
    if (std::ranges::none_of(entry.moving, rests)) return;
    entry.joinedIn = frame_;
    const StillCasters& were = *entry.now->still;
    const std::uint64_t state = entry.now->state + 1;
    auto still = std::make_shared<StillCasters>();
    still->changes = were.changes;
    std::vector<std::pair<const ShadowCaster*, std::uint32_t>> casters;
    for (std::size_t i = 0; i < were.all->size(); ++i)
        if (!were.gone[i]) casters.emplace_back(&(*were.all)[i], entry.items[i]);
    for (const auto& moving : entry.moving) {
        if (!rests(moving)) continue;
        casters.emplace_back(&moving.second.caster, moving.first);
        still->changes.push_back({state, moving.second.caster.rect});
    }
    still->knownAfter = shorten(still->changes, kMostSteps, were.knownAfter);
    std::ranges::sort(casters, before, [](const auto& caster) -> const DrawItem& { return caster.first->item; });
    auto all = std::make_shared<std::vector<ShadowCaster>>();
    all->reserve(casters.size());
    entry.items.clear();
    for (const auto& [caster, index] : casters) {
        entry.stillOf[index] = static_cast<std::uint32_t>(all->size());
        entry.items.push_back(index);
        all->push_back(*caster);
    }
    still->gone.resize(all->size());
    still->all = std::move(all);
    std::erase_if(entry.moving, rests);
    ShadowView next{.camera = entry.now->camera,
                    .clamped = entry.sun,
                    .kin = entry.now->kin,
                    .state = state,
                    .still = std::move(still),
                    .moving = {}};
    for (const auto& [index, one] : entry.moving) next.moving.push_back(one.caster);
    std::ranges::sort(next.moving, before, &ShadowCaster::item);
    entry.now = std::make_shared<const ShadowView>(std::move(next));
}

std::optional<std::span<const ShadowStore::Change>> ShadowStore::changesAfter(std::uint64_t kin,
                                                                              std::uint64_t state) const {
    const auto found = std::ranges::find_if(entries_, [kin](const auto& entry) { return entry->now->kin == kin; });
    if (found == entries_.end() || state < (*found)->knownAfter) return std::nullopt;
    const std::vector<Change>& changes = (*found)->changes;
    const auto first = std::ranges::upper_bound(changes, state, {}, &Change::state);
    return std::span(changes).subspan(static_cast<std::size_t>(first - changes.begin()));
}

}  // namespace tessera
