#include "common/session/ListFollowers.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace tessera {

namespace {
/// Of lists since a snapshot: kept for who comes soon, however small that was.
constexpr std::size_t kFewBytes = 64 * 1024;
}  // namespace

ListFollowers::ListFollowers(const ServerSessionConfig& config, Unsent unsent)
    : config_(config), unsent_(std::move(unsent)), tail_(config.maxTailLists, config.maxTailBytes) {}

const ListFollowers::Follower& ListFollowers::of(ConnectionId connection) const {
    static const Follower nobody;
    const auto it = of_.find(connection);
    return it == of_.end() ? nobody : it->second;
}

void ListFollowers::ask(ConnectionId connection, const std::string& name, ServerActions& out) {
    Follower& follower = of_[connection];
    follower.name = name;
    follower.snapshotAsked = true;
    follower.following = false;
    follower.behind = false;
    updateTail();
    out.push_back(server_action::SnapshotWanted{connection, name});
}

void ListFollowers::given(ConnectionId connection, message::Snapshot& snapshot, Blob content, TimePoint now) {
    Follower& follower = of_[connection];
    follower.snapshotAsked = false;
    follower.following = true;
    follower.everFollowed = true;
    follower.sentThrough = snapshot.list->sequence;
    follower.content = std::move(content);
    snapshot.current = std::max(snapshot.list->sequence, tail_.last());
    keptUntil_ = now + config_.snapshotServesFor;
    lastSnapshotBytes_ = std::max<std::size_t>({snapshot.content.sizeBytes, snapshot.list->encoded.size(), kFewBytes});
}

std::vector<ListFollowers::Fetching> ListFollowers::sendSince(ConnectionId connection, ServerActions& out) {
    std::vector<Fetching> fetching;
    sendSince(connection, of_[connection], fetching, out);
    updateTail();
    return fetching;
}

void ListFollowers::sendSince(ConnectionId connection, Follower& follower, std::vector<Fetching>& fetching,
                              ServerActions& out) {
    for (const CommittedListPtr& list : tail_.lists()) {
        MessagePtr changes;
        send(connection, follower, list, changes, fetching, out);
    }
}

std::vector<ListFollowers::Fetching> ListFollowers::send(const CommittedListPtr& list, ServerActions& out) {
    std::vector<Fetching> fetching;
    MessagePtr changes;
    for (auto& [connection, follower] : of_)
        if (follower.following) send(connection, follower, list, changes, fetching, out);
    return fetching;
}

void ListFollowers::send(ConnectionId connection, Follower& follower, const CommittedListPtr& list, MessagePtr& changes,
                         std::vector<Fetching>& fetching, ServerActions& out) {
    if (follower.behind || list->sequence <= follower.sentThrough) return;
    if (unsent_(connection) > config_.maxUnsentBytes) {
        follower.behind = true;
        return updateTail();
    }
    TESSERA_CHECK(list->sequence == follower.sentThrough.next(), "a follower gets every list");
    follower.sentThrough = list->sequence;
    if (!changes) changes = std::make_shared<const Message>(message::Changes{list});
    out.push_back(server_action::Send{connection, changes});
    if (!list->blobs.empty()) fetching.push_back({connection, list->sequence});
}

std::vector<ListFollowers::Fetching> ListFollowers::catchUp(ServerActions& out) {
    std::vector<Fetching> fetching;
    for (auto& [connection, follower] : of_) {
        if (!follower.behind || unsent_(connection) > config_.maxUnsentBytes / 2) continue;
        follower.behind = false;
        if (tooOld(follower.sentThrough)) {
            ask(connection, follower.name, out);
            continue;
        }
        sendSince(connection, follower, fetching, out);
        updateTail();
    }
    return fetching;
}

void ListFollowers::synced(ConnectionId connection) {
    if (const auto it = of_.find(connection); it != of_.end()) it->second.content = {};
}

void ListFollowers::pause(ConnectionId connection) {
    if (const auto it = of_.find(connection); it != of_.end()) it->second.following = false;
}

void ListFollowers::stop(ConnectionId connection) {
    if (const auto it = of_.find(connection); it != of_.end()) it->second.following = it->second.snapshotAsked = false;
}

void ListFollowers::forget(ConnectionId connection) {
    of_.erase(connection);
    updateTail();
}

bool ListFollowers::lacksJust(ConnectionId connection, const CommittedList& list) const {
    const Sequence sent = sentThrough(connection);
    return (list.changed() ? sent.next() : sent) == list.sequence;
}

void ListFollowers::record(const CommittedListPtr& list) {
    if (list->changed())
        tail_.append(list);
    else if (!tail_.started())
        tail_.startAt(list->sequence, list->stateHash);
}

void ListFollowers::updateTail() {
    const auto anybody = [&](bool Follower::*waits) {
        return std::ranges::any_of(of_, [waits](const auto& item) { return item.second.*waits; });
    };
    const bool asked = anybody(&Follower::snapshotAsked), behind = anybody(&Follower::behind);
    // For who comes soon: no more than another snapshot would be.
    const bool recent = looked_ && *looked_ < keptUntil_;
    std::size_t bytes = lastSnapshotBytes_;
    if (behind) bytes = std::max(bytes, config_.maxUnsentBytes);
    if (asked) bytes = std::numeric_limits<std::size_t>::max();
    tail_.keep(asked || behind || recent, bytes);
}

}  // namespace tessera
