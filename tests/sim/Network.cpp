#include "tests/sim/Network.h"

namespace tessera::simulation {

std::size_t sizeOf(const Message& message) {
    constexpr std::size_t kHead = 64;
    if (const auto* m = std::get_if<message::BlobChunk>(&message)) return kHead + m->bytes.size();
    if (const auto* m = std::get_if<message::Snapshot>(&message)) return kHead + m->list->encoded.size();
    if (const auto* m = std::get_if<message::Changes>(&message)) return kHead + m->list->encoded.size();
    if (const auto* m = std::get_if<message::Begin>(&message)) return kHead + m->list->encoded.size();
    if (const auto* m = std::get_if<message::TileImage>(&message)) return kHead + m->picture.size();
    return kHead;
}

ConnectionId Network::connect(const Link& link, End& client) {
    const ConnectionId id(++given_);
    Connection& connection = connections_[id];
    connection.link = link;
    connection.client = &client;
    const Duration there = link.latency + random_.between(0ns, link.jitter);
    const Duration back = link.latency + random_.between(0ns, link.jitter);
    connection.free[kUp] = timeline_.now() + there;
    connection.free[kDown] = timeline_.now() + there + back;
    connection.openAt[kUp] = connection.openAt[kDown] = true;
    const auto tell = [this, id](Direction direction) {
        const auto it = connections_.find(id);
        if (it != connections_.end() && it->second.openAt[direction] && !it->second.cut)
            endOf(it->second, direction).opened(id);
    };
    timeline_.at(connection.free[kUp], [tell] { tell(kUp); });
    timeline_.at(connection.free[kDown], [tell] { tell(kDown); });
    return id;
}

void Network::carry(ConnectionId id, Direction direction, std::size_t bytes, std::function<void(End&)> arrive,
                    bool last) {
    const auto it = connections_.find(id);
    if (it == connections_.end()) return;
    Connection& connection = it->second;
    const auto transfer =
        Duration(static_cast<std::int64_t>(static_cast<double>(bytes) / connection.link.bytesPerSecond * 1e9));
    const TimePoint when = std::max(connection.free[direction], timeline_.now() + connection.link.latency +
                                                                    random_.between(0ns, connection.link.jitter)) +
                           transfer;
    connection.free[direction] = when;
    timeline_.at(when, [this, id, direction, last, arrive = std::move(arrive)] {
        const auto found = connections_.find(id);
        if (found == connections_.end() || found->second.cut || !found->second.openAt[direction]) return;
        if (last) found->second.openAt[direction] = false;
        End& end = endOf(found->second, direction);
        if (last && !found->second.openAt[1 - direction]) connections_.erase(found);
        arrive(end);
    });
}

void Network::send(ConnectionId id, Direction direction, Epoch epoch, Message message) {
    const std::size_t bytes = sizeOf(message);
    carry(id, direction, bytes, [id, epoch, shared = std::make_shared<const Message>(std::move(message))](End& end) {
        end.received(id, epoch, shared);
    });
}

void Network::garbageToServer(ConnectionId id) {
    carry(id, kUp, 64, [id](End& end) { end.undecodable(id); });
}

void Network::close(ConnectionId id, Direction direction) {
    const auto it = connections_.find(id);
    if (it == connections_.end()) return;
    it->second.openAt[1 - direction] = false;  // nothing more is heard at the closing end
    if (!it->second.openAt[direction]) {
        connections_.erase(it);
        return;
    }
    carry(
        id, direction, 0, [id](End& end) { end.closed(id); }, true);
}

void Network::cut(ConnectionId id) {
    if (const auto it = connections_.find(id); it != connections_.end()) it->second.cut = true;
}

void Network::sever(ConnectionId id) {
    for (const Direction direction : {kUp, kDown})
        carry(
            id, direction, 0, [id](End& end) { end.closed(id); }, true);
}

}  // namespace tessera::simulation
