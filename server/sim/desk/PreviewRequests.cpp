#include "server/sim/desk/PreviewRequests.h"

#include <algorithm>
#include <bit>

namespace tessera {

namespace {

/// The number of a question says its size.
constexpr int kSizeBit = 56;
std::uint64_t numberOf(std::uint32_t shrink, std::uint64_t round) {
    return std::uint64_t{1} << 63 | std::uint64_t{shrink} << kSizeBit | round;
}
std::uint32_t shrinkOf(std::uint64_t number) {
    return static_cast<std::uint32_t>(number >> kSizeBit & 0x7f);
}

}  // namespace

PreviewRequests::PreviewRequests(const Wall& wall, ServerSession& session) : session_(session) {
    for (const Tile& tile : layoutTiles(wall)) hostOf_.emplace(tile.name, tile.host);
}

std::set<std::string> PreviewRequests::liveHosts() const {
    std::set<std::string> live;
    for (const ServerSession::HostStatus& host : session_.hosts())
        if (host.state == HostState::kLive || host.state == HostState::kLate) live.insert(host.name);
    return live;
}

/// Each size is a sweep over all pixels of every host.
PreviewRequests::Sizes::iterator PreviewRequests::sizeFor(std::uint32_t shrink) {
    const std::uint32_t wanted = std::bit_ceil(std::clamp(shrink, std::uint32_t{1}, kMostPreviewShrink));
    if (sizes_.contains(wanted) || sizes_.size() < kMostSizes) return sizes_.try_emplace(wanted).first;
    const auto above = sizes_.lower_bound(wanted);
    return above == sizes_.end() ? std::prev(above) : above;
}

ServerActions PreviewRequests::ask(const Asker& asker, std::uint32_t shrink, std::uint64_t after, TimePoint now) {
    const auto found = sizeFor(shrink);
    Size& size = found->second;
    size.looked = now;
    // A stamp that was never given is of a server before this one.
    size.waiting.push_back({asker, after > stamp_ ? 0 : after, now + kNothing});
    ServerActions actions;
    answerWhoCan(size, now, actions);
    begin(found->first, size, now, actions);
    return actions;
}

void PreviewRequests::begin(std::uint32_t shrink, Size& size, TimePoint now, ServerActions& actions) {
    if (size.round || size.waiting.empty() || now < size.next) return;
    const std::set<std::string> live = liveHosts();
    std::set<std::string> awaited;
    for (const auto& [tile, host] : hostOf_)
        if (live.contains(host)) awaited.insert(tile);
    size.next = now + kPace;
    if (awaited.empty()) return;
    const std::uint64_t number = numberOf(shrink, ++rounds_);
    size.round = Round{number, now + kRound, std::move(awaited)};
    append(actions, session_.requestImages(number, session_.nextFrame(), shrink, std::exchange(size.known, true)));
}

ServerActions PreviewRequests::imageReceived(const server_action::ImageReceived& received, TimePoint now) {
    const message::TileImage& image = received.image;
    const auto found = sizes_.find(shrinkOf(image.request));
    const auto tile = hostOf_.find(image.tile);
    // Of a tile its own host says what it shows, and nobody else.
    if (found == sizes_.end() || tile == hostOf_.end() || tile->second != received.host) return {};
    Size& size = found->second;
    if (!image.picture.empty() && image.picture.size() <= kMostBytes) {
        Seen& seen = size.tiles[image.tile];
        if (!(seen.preview.jpeg == image.picture)) seen.stamp = ++stamp_;  // sky that was drawn anew is the same sky
        seen.preview = {image.tile, received.host, image.frame, image.picture};
    } else if (image.same && !size.tiles.contains(image.tile)) {
        size.known = false;  // it was sent before somebody looked at this size again
    }
    ServerActions actions;
    if (size.round && size.round->number == image.request) {
        size.round->awaited.erase(image.tile);
        if (!size.round->awaited.empty()) return actions;
        size.round.reset();
    }
    answerWhoCan(size, now, actions);
    begin(found->first, size, now, actions);
    return actions;
}

/// Those for whom there is something new, or who have waited for it long enough. While a round is under way the
/// tiles that have come wait for the others: so they show one frame.
void PreviewRequests::answerWhoCan(Size& size, TimePoint now, ServerActions& actions) {
    std::vector<std::string> missing;
    if (!size.waiting.empty()) {
        const std::set<std::string> live = liveHosts();
        for (const auto& [tile, host] : hostOf_)
            if (!live.contains(host)) missing.push_back(tile);
    }
    std::erase_if(size.waiting, [&](const Waiting& waiting) {
        answer::Preview preview{.stamp = stamp_, .tiles = {}, .missing = missing};
        if (size.round && now < waiting.until) return false;
        for (const auto& [name, seen] : size.tiles)
            if (seen.stamp > waiting.after) preview.tiles.push_back(seen.preview);
        if (preview.tiles.empty() && now < waiting.until) return false;
        append(actions, Answers{session_}.to(waiting.asker, ApplicationAnswer(std::move(preview))));
        return true;
    });
}

ServerActions PreviewRequests::advance(TimePoint now) {
    ServerActions actions;
    for (auto& [shrink, size] : sizes_) {
        if (size.round && size.round->until <= now) size.round.reset();  // what comes later is taken all the same
        answerWhoCan(size, now, actions);
        begin(shrink, size, now, actions);
    }
    std::erase_if(sizes_, [&](const auto& each) {
        const Size& size = each.second;
        return size.waiting.empty() && !size.round && now >= size.looked + kForgotten;
    });
    return actions;
}

TimePoint PreviewRequests::nextDeadline() const {
    TimePoint due = TimePoint::max();
    for (const auto& [shrink, size] : sizes_) {
        if (size.round) due = std::min(due, size.round->until);
        if (!size.round && !size.waiting.empty()) due = std::min(due, size.next);
        if (size.waiting.empty() && !size.round) due = std::min(due, size.looked + kForgotten);
        for (const Waiting& waiting : size.waiting) due = std::min(due, waiting.until);
    }
    return due;
}

std::size_t PreviewRequests::openCount(ConnectionId connection) const {
    std::size_t count = 0;
    for (const auto& [shrink, size] : sizes_)
        count += static_cast<std::size_t>(std::ranges::count_if(
            size.waiting, [&](const Waiting& waiting) { return waiting.asker.connection == connection; }));
    return count;
}

void PreviewRequests::applicationLeft(ConnectionId connection) {
    for (auto& [shrink, size] : sizes_)
        std::erase_if(size.waiting, [&](const Waiting& waiting) { return waiting.asker.connection == connection; });
}

}  // namespace tessera
