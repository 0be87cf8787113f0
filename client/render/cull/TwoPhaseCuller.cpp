#include "client/render/cull/TwoPhaseCuller.h"

#include <algorithm>

namespace tessera {

namespace {

/// Newcomers that cover less of the part, together, are not worth a second look: it costs about what drawing them does.
constexpr double kSecondLookShare = 0.02;

}  // namespace

void TwoPhaseCuller::draw(const PartView& view, std::uint32_t item, DeviceWork& work) {
    draws_.add(view, item);
    drawn_[item] = true;
    work.depthTriangles += view.triangles(item);
}

Expected<void> TwoPhaseCuller::drawSeenBefore(const PartView& view, VisibilityDevice& device, DeviceWork& work) {
    for (const std::uint32_t item : before_) {
        // Slots are used again: whoever is in it now is as good, if it is there at all.
        if (!view.holds(item)) continue;
        const BoxSight sight = view.item(item, Frustum::kAllPlanes);
        if (sight.fate != BoxSight::Fate::kBeside && view.worthHidingWith(item, sight)) draw(view, item, work);
    }
    empty_ = draws_.empty();
    return draws_.draw(device);
}

/// The pyramid, of what is drawn so far.
Expected<void> TwoPhaseCuller::look(const PartView& view, VisibilityDevice& device, DeviceWork& work) {
    const auto farthest = device.farthest();
    if (!farthest) return tl::unexpected(farthest.error());
    ++work.waits;
    pyramid_.build(*farthest, view.widthPx(), view.heightPx());
    return {};
}

void TwoPhaseCuller::findSeen(const PartView& view, DeviceWork& work) {
    seen_.clear();
    struct Open {
        std::uint32_t node;
        Frustum::Mask mask;
    };
    std::vector<Open> open;
    const auto test = [&](const BoxSight& sight, std::uint32_t index, bool isItem) {
        if (sight.fate == BoxSight::Fate::kAsk && !empty_) {
            ++work.queries;
            if (pyramid_.hides(sight.plate)) return;
        }
        if (isItem)
            seen_.push_back({index, sight});
        else
            open.push_back({index, sight.undecided});
    };
    if (const BoxSight all = view.node(BoxTree::kRoot, Frustum::kAllPlanes); all.fate != BoxSight::Fate::kBeside)
        test(all, BoxTree::kRoot, false);
    while (!open.empty()) {
        const auto [node, mask] = open.back();
        open.pop_back();
        view.forEachBelow(node, mask, test);
    }
}

Expected<void> TwoPhaseCuller::cull(const PartView& view, VisibilityDevice& device, std::vector<std::uint32_t>& visible,
                                    DeviceWork& work) {
    if (rebuilds_ != view.rebuilds()) {
        rebuilds_ = view.rebuilds();
        before_.clear();
    }
    drawn_.assign(view.itemSlots(), false);
    draws_.forget();
    if (view.tree().empty()) return {};
    if (auto drawn = drawSeenBefore(view, device, work); !drawn) return drawn;
    if (!empty_)
        if (auto looked = look(view, device, work); !looked) return looked;
    findSeen(view, work);

    double newcomersPx = 0;
    for (const Seen& seen : seen_) {
        if (drawn_[seen.item] || !view.worthHidingWith(seen.item, seen.sight)) continue;
        newcomersPx += seen.sight.fate == BoxSight::Fate::kAsk ? seen.sight.plate.areaPx() : view.areaPx();
        draw(view, seen.item, work);
    }
    if (newcomersPx > kSecondLookShare * view.areaPx()) {
        if (auto drawn = draws_.draw(device); !drawn) return drawn;
        if (auto looked = look(view, device, work); !looked) return looked;
        work.queries += seen_.size();
        std::erase_if(seen_, [&](const Seen& seen) {
            return seen.sight.fate == BoxSight::Fate::kAsk && pyramid_.hides(seen.sight.plate);
        });
    }
    before_.clear();
    for (const Seen& seen : seen_) before_.push_back(seen.item);
    visible.insert(visible.end(), before_.begin(), before_.end());
    return {};
}

}  // namespace tessera
