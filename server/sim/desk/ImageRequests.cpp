#include "server/sim/desk/ImageRequests.h"

#include <algorithm>
#include <set>

namespace tessera {

ServerActions ImageRequests::ask(const Asker& asker, TimePoint now) {
    Open images{.asker = asker,
                .deadline = now + deadline_,
                .latest = now + kLongest,
                .frame = session_.nextFrame(),
                .awaited = {},
                .answer = {}};
    std::set<std::string> live;
    for (const ServerSession::HostStatus& host : session_.hosts())
        if (host.state == HostState::kLive || host.state == HostState::kLate) live.insert(host.name);
    for (const Tile& tile : layoutTiles(wall_))
        if (live.contains(tile.host))
            images.awaited.push_back({tile.name, tile.host});
        else
            images.answer.missing.push_back(tile.name);
    const std::uint64_t number = next_++;
    const auto [it, isNew] = open_.emplace(number, std::move(images));
    if (it->second.awaited.empty()) return finish(it);
    return session_.requestImages(number, it->second.frame);
}

ServerActions ImageRequests::imageReceived(const server_action::ImageReceived& received) {
    const auto open = open_.find(received.image.request);
    if (open == open_.end()) return {};
    // Of a tile its own host says what it shows, and nobody else.
    const auto tile = std::ranges::find_if(open->second.awaited, [&](const Open::Awaited& awaited) {
        return awaited.tile == received.image.tile && awaited.host == received.host;
    });
    if (tile == open->second.awaited.end()) return {};
    open->second.awaited.erase(tile);
    if (received.image.picture.empty())
        open->second.answer.missing.push_back(received.image.tile);  // a host that draws nothing
    else
        open->second.answer.tiles.push_back({.tile = received.image.tile,
                                             .host = received.host,
                                             .frame = received.image.frame,
                                             .png = received.image.picture});
    return open->second.awaited.empty() ? finish(open) : ServerActions{};
}

ServerActions ImageRequests::finish(Opens::iterator open) {
    Open done = std::move(open->second);
    open_.erase(open);
    for (Open::Awaited& awaited : done.awaited) done.answer.missing.push_back(std::move(awaited.tile));
    return Answers{session_}.to(done.asker, ApplicationAnswer(std::move(done.answer)));
}

ServerActions ImageRequests::advance(TimePoint now) {
    ServerActions actions;
    for (auto it = open_.begin(); it != open_.end();) {
        const auto next = std::next(it);
        Open& open = it->second;
        if (open.deadline <= now + deadline_ - kLook && isAtWork(open))
            open.deadline = std::min(open.latest, now + deadline_);
        if (open.deadline <= now) append(actions, finish(it));
        it = next;
    }
    return actions;
}

TimePoint ImageRequests::nextDeadline() const {
    TimePoint next = TimePoint::max();
    for (const auto& [number, open] : open_) next = std::min(next, open.deadline);
    return next;
}

bool ImageRequests::isAtWork(const Open& open) const {
    const std::vector<std::string> drawing = session_.waitingFor();
    return !drawing.empty() && std::ranges::any_of(session_.hosts(), [&](const ServerSession::HostStatus& host) {
        return (!host.everShown || host.lastShown < open.frame) && std::ranges::count(drawing, host.name) > 0 &&
               std::ranges::count(open.awaited, host.name, &Open::Awaited::host) > 0;
    });
}

std::size_t ImageRequests::openCount(ConnectionId connection) const {
    return static_cast<std::size_t>(
        std::ranges::count_if(open_, [&](const auto& entry) { return entry.second.asker.connection == connection; }));
}

void ImageRequests::applicationLeft(ConnectionId connection) {
    std::erase_if(open_, [&](const auto& entry) { return entry.second.asker.connection == connection; });
}

}  // namespace tessera
