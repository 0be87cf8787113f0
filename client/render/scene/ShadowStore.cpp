#include "client/render/scene/ShadowStore.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <unordered_set>
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
    if (!item.asWhole) drawn.clusters = item.mesh->clusters();
    // Of what lies over surfaces nothing casts a shadow.
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

}  // namespace

ShadowStore::Entry::Entry(const ScreenCamera& camera, bool ofSun, unsigned ofUser)
    : sight(camera, ofSun), user(ofUser), sun(ofSun) {}

void ShadowStore::clear() {
    entries_.clear();
    changes_.clear();
}

void ShadowStore::beginFrame() {
    told_ = frameBegins_ = true;
}

// A frame without looks is none: who does not look knows that all is as before.
void ShadowStore::beginLook() {
    if (told_ && !frameBegins_) return;
    frameBegins_ = false;
    ++frame_;
    forgetOld();
}

void ShadowStore::forgetOld() {
    std::erase_if(entries_, [this](const auto& entry) { return entry->usedIn + kKeptFrames < frame_; });
    const auto isOld = [this](const auto& entry) { return entry->usedIn + 1 < frame_; };
    std::size_t views = 0, casters = 0;
    for (const auto& entry : entries_) {
        views += isOld(entry) ? 1 : 0;
        casters += isOld(entry) ? entry->casters() : 0;
    }
    for (; casters > kMostKept || views > kMostViews; --views) {
        const auto oldest = std::ranges::min_element(entries_, {}, [](const auto& entry) { return entry->usedIn; });
        casters -= (*oldest)->casters();
        entries_.erase(oldest);
    }
}

void ShadowStore::changed(std::uint32_t item) {
    if (entries_.empty()) return;
    changes_.push_back({++changed_, item});
    if (changes_.size() > kMostChanges) shortenChanges();
}

/// What moves all the time is named once: views that nobody has asked for follow it from where it was to where it is.
void ShadowStore::shortenChanges() {
    std::unordered_set<std::uint32_t> named;
    auto kept = changes_.end();
    for (auto change = changes_.end(); change != changes_.begin();)
        if (named.insert((--change)->item).second) *--kept = *change;
    constexpr auto kHalf = static_cast<std::ptrdiff_t>(kMostChanges / 2);
    if (changes_.end() - kept > kHalf) {
        kept = changes_.end() - kHalf;
        changesFrom_ = std::prev(kept)->number;
    }
    changes_.erase(changes_.begin(), kept);
}

std::shared_ptr<const ShadowView> ShadowStore::view(const RenderScene::Impl& scene, const ScreenCamera& camera,
                                                    bool sun, unsigned user) {
    auto found = std::ranges::find_if(entries_, [&](const auto& entry) {
        return entry->sun == sun && entry->user == user && drawAlike(entry->now->camera, camera);
    });
    const bool follows = found != entries_.end() && (*found)->known >= changesFrom_;
    if (found == entries_.end()) {
        entries_.push_back(std::make_unique<Entry>(camera, sun, user));
        found = std::prev(entries_.end());
    }
    Entry& entry = **found;
    entry.usedIn = frame_;
    if (!follows) {
        entry.now = std::make_shared<ShadowView>(ShadowView{.camera = camera, .clamped = sun});
        start(entry, scene);
    } else if (entry.known < changed_) {
        follow(entry, scene);
    }
    entry.known = changed_;
    join(entry);
    return entry.now;
}

void ShadowStore::start(Entry& entry, const RenderScene::Impl& scene) const {
    static std::atomic<std::uint64_t> kin{0};
    std::vector<std::uint32_t> found;
    collectInFrustum(scene, entry.sight.frustum(), found, entry.sight.planes());
    std::vector<ShadowCaster> casters;
    entry.still.clear();
    entry.moving.clear();
    entry.changes.clear();
    for (const std::uint32_t index : found)
        if (auto caster = casterOf(scene, entry.sight, index)) {
            entry.still.emplace(index, rankOf(*caster));
            casters.push_back(std::move(*caster));
        }
    auto still = std::make_shared<StillCasters>();
    work_ += still->all.edit({}, std::move(casters));
    still->changes = StillChanges(1);
    entry.knownAfter = 1;
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
    const StillCasters& were = *entry.now->still;
    std::vector<PixelRect> changes;  // of what is still
    std::vector<CasterRank> gone;
    std::vector<ShadowCaster> come;
    bool any = false, handedOver = false;
    std::vector<std::uint32_t> changed;
    for (auto change = std::ranges::upper_bound(changes_, entry.known, {}, &ItemChange::number);
         change != changes_.end(); ++change)
        changed.push_back(change->item);
    std::ranges::sort(changed);
    changed.erase(std::unique(changed.begin(), changed.end()), changed.end());
    work_ += changed.size();
    for (const std::uint32_t index : changed) {
        std::optional<ShadowCaster> now = casterOf(scene, entry.sight, index);
        const auto still = entry.still.find(index);
        const auto moving = entry.moving.find(index);
        const ShadowCaster* then = still != entry.still.end()     ? &were.all.at(still->second)
                                   : moving != entry.moving.end() ? &moving->second.caster
                                                                  : nullptr;
        if (then ? now && sameShadow(*now, *then) : !now) {
            if (!then || then->item.mesh == now->item.mesh) continue;
            // The same shadow of another mesh: the one before is not to stay for it.
            handedOver = true;
            now->since = then->since;
            if (moving != entry.moving.end()) {
                moving->second.caster = std::move(*now);
                continue;
            }
            gone.push_back(std::exchange(still->second, rankOf(*now)));
            come.push_back(std::move(*now));
            continue;
        }
        any = true;
        if (then) entry.changes.push_back({state, {then->rect, then->front}});
        if (now) entry.changes.push_back({state, {now->rect, now->front}});
        if (still != entry.still.end()) {
            changes.push_back(then->rect);
            gone.push_back(still->second);
            entry.still.erase(still);
        }
        if (now) {
            now->since = state;
            entry.moving.insert_or_assign(index, Moving{std::move(*now), frame_});
        } else if (moving != entry.moving.end()) {
            entry.moving.erase(moving);
        }
    }
    if (!any && !handedOver) return;
    shorten(entry);
    std::shared_ptr<const StillCasters> rests = entry.now->still;
    if (!gone.empty() || !come.empty()) {
        auto edited = std::make_shared<StillCasters>(*rests);
        work_ += edited->all.edit(std::move(gone), std::move(come));
        work_ += edited->changes.add(state, std::move(changes));
        rests = std::move(edited);
    }
    renew(entry, any ? state : entry.now->state, std::move(rests));
}

/// Halves a history that has grown too long.
void ShadowStore::shorten(Entry& entry) {
    std::vector<Change>& changes = entry.changes;
    if (changes.size() <= kMostSteps) return;
    const auto keptFrom = changes.begin() + static_cast<std::ptrdiff_t>(changes.size() / 2);
    entry.knownAfter = std::prev(keptFrom)->state;
    changes.erase(changes.begin(), keptFrom);
    std::erase_if(changes, [&](const Change& change) { return change.state <= entry.knownAfter; });
}

// Of very many that move together, as what has just come, nobody waits for long.
void ShadowStore::join(Entry& entry) const {
    constexpr std::size_t kMany = 1024;
    const std::uint64_t rest = entry.moving.size() > kMany ? 2 : kRestFrames;
    if (entry.moving.empty() || entry.joinedIn + rest > frame_) return;
    const auto rests = [&](const auto& moving) { return moving.second.frame + rest <= frame_; };
    if (std::ranges::none_of(entry.moving, rests)) return;
    entry.joinedIn = frame_;
    const std::uint64_t state = entry.now->state + 1;
    auto still = std::make_shared<StillCasters>(*entry.now->still);
    std::vector<ShadowCaster> come;
    std::vector<PixelRect> changes;
    for (auto moving = entry.moving.begin(); moving != entry.moving.end();) {
        if (!rests(*moving)) {
            ++moving;
            continue;
        }
        ShadowCaster& caster = moving->second.caster;
        changes.push_back(caster.rect);
        entry.still.emplace(moving->first, rankOf(caster));
        come.push_back(std::move(caster));
        moving = entry.moving.erase(moving);
    }
    work_ += still->changes.add(state, std::move(changes)) + still->all.edit({}, std::move(come));
    renew(entry, state, std::move(still));
}

void ShadowStore::renew(Entry& entry, std::uint64_t state, std::shared_ptr<const StillCasters> still) {
    ShadowView next{.camera = entry.now->camera,
                    .clamped = entry.sun,
                    .kin = entry.now->kin,
                    .state = state,
                    .still = std::move(still),
                    .moving = {}};
    next.moving.reserve(entry.moving.size());
    for (const auto& [index, one] : entry.moving) next.moving.push_back(one.caster);
    std::ranges::sort(next.moving, {}, rankOf);
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
