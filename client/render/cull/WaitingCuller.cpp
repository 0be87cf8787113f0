#include "client/render/cull/WaitingCuller.h"

#include <algorithm>

namespace tessera {

namespace {

constexpr auto kFartherBox = [](const auto& a, const auto& b) { return a.sight.nearest < b.sight.nearest; };

}  // namespace

void WaitingCuller::add(const BoxSight& sight, std::uint32_t index, bool isItem) {
    nearestFirst_.push_back({sight, index, isItem});
    std::push_heap(nearestFirst_.begin(), nearestFirst_.end(), kFartherBox);
}

Expected<void> WaitingCuller::cull(const PartView& view, VisibilityDevice& device, std::vector<std::uint32_t>& visible,
                                   DeviceWork& work) {
    nearestFirst_.clear();
    draws_.forget();
    if (!view.tree().empty())
        if (const BoxSight all = view.node(BoxTree::kRoot, Frustum::kAllPlanes); all.fate != BoxSight::Fate::kBeside)
            add(all, BoxTree::kRoot, false);
    while (!nearestFirst_.empty()) {
        std::pop_heap(nearestFirst_.begin(), nearestFirst_.end(), kFartherBox);
        const Box box = nearestFirst_.back();
        nearestFirst_.pop_back();
        if (box.sight.fate == BoxSight::Fate::kAsk) {
            const std::uint32_t one = 1;
            const auto ticket = device.ask({&box.sight.plate, 1}, {&one, 1});
            if (!ticket) return tl::unexpected(ticket.error());
            const auto shows = device.answer(*ticket);
            if (!shows) return tl::unexpected(shows.error());
            ++work.queries;
            ++work.waits;
            if (!*shows) continue;
        }
        if (!box.isItem) {
            view.forEachBelow(
                box.index, box.sight.undecided,
                [&](const BoxSight& sight, std::uint32_t index, bool isItem) { add(sight, index, isItem); });
            continue;
        }
        visible.push_back(box.index);
        if (!view.mayHide(box.index)) continue;
        draws_.add(view, box.index);
        work.depthTriangles += view.triangles(box.index);
        if (auto drawn = draws_.draw(device); !drawn) return drawn;
    }
    return {};
}

}  // namespace tessera
