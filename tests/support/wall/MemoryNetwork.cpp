#include "tests/support/wall/MemoryNetwork.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

namespace tessera::simulation {
namespace {

constexpr auto kFlushTime = 1s;  ///< for what is queued when a link is closed
constexpr std::size_t kMessageCost = 256;

}  // namespace

MakeTransport MemoryNetwork::transportOf(std::string program, std::function<void()> poke) {
    return [this, program = std::move(program), poke = std::move(poke)](TransportLimits limits,
                                                                        std::function<void(LinkEvent)> onEvent) {
        return std::make_unique<MemoryTransport>(*this, program, poke, std::move(limits), std::move(onEvent));
    };
}

bool MemoryNetwork::isCut(const Connection& connection) const {
    return std::ranges::any_of(connection.programs, [&](const std::string& program) {
        const auto found = cut_.find(program);
        return found != cut_.end() && found->second;
    });
}

void MemoryNetwork::cutOff(const std::string& program, bool cut) {
    cut_[program] = cut;
    if (cut) return;
    // Bytes that waited go on.
    for (const auto& weak : connections_)
        if (const ConnectionPtr connection = weak.lock())
            for (const int side : {0, 1}) carry(connection, side);
}

void MemoryNetwork::reset(const std::string& program) {
    std::erase_if(listeners_, [&](const auto& entry) { return entry.second->program_ == program; });
    for (const auto& weak : connections_) {
        const ConnectionPtr connection = weak.lock();
        if (!connection) continue;
        for (const int side : {0, 1})
            if (connection->programs[side] == program) {
                End& end = connection->ends[side];
                end.owner = nullptr;
                end.open = false;
                end.out.clear();
                end.outBytes = 0;
                timeline_.after(delay(), [this, connection, side] {
                    breakLink(connection, 1 - side, "the connection broke: Connection reset by peer");
                });
            }
    }
}

void MemoryNetwork::dial(MemoryTransport& from, LinkId link, const Address& to, std::chrono::milliseconds timeout) {
    const auto connection = std::make_shared<Connection>();
    std::erase_if(connections_, [](const auto& weak) { return weak.expired(); });
    connections_.push_back(connection);
    connection->programs[0] = from.program_;
    connection->ends[0].owner = &from;
    connection->ends[0].link = link;
    connection->ends[0].reader = std::make_unique<FrameReader>(from.limits_.maxPayload);
    connection->peer[0] = toString(to);
    from.links_[link] = {connection, 0};
    const auto refused = [this, connection, to](const std::string& why) {
        finish(connection, 0, fmt::format("cannot connect to {}: {}", toString(to), why));
    };
    timeline_.after(delay(), [this, connection, to, refused, timeout] {
        const auto listener = listeners_.find(to.port);
        if (listener == listeners_.end()) return refused("Connection refused");
        MemoryTransport& server = *listener->second;
        connection->programs[1] = server.program_;
        if (isCut(*connection)) return timeline_.after(timeout, [refused] { refused("nobody answers"); });
        End& end = connection->ends[1];
        end.owner = &server;
        end.link = LinkId{++lastLink_};
        end.reader = std::make_unique<FrameReader>(server.limits_.maxPayload);
        connection->peer[1] = fmt::format("127.0.0.1:{}", 50'000 + end.link.value % 10'000);
        server.links_[end.link] = {connection, 1};
        const bool full = server.links_.size() > server.limits_.maxLinks;
        for (const int side : {1, 0})
            timeline_.after(side == 1 ? Duration{} : delay(), [this, connection, side, full] {
                End& opened = connection->ends[side];
                if (!opened.owner) return finish(connection, 1 - side, "the peer closed the connection");
                opened.open = true;
                if (side == 1 && full) {
                    queue(connection, 1, opened.owner->limits_.lastWord.type, {},
                          opened.owner->limits_.lastWord.payload);
                    return opened.owner->close(opened.link, "as many links are open as may be");
                }
                opened.owner->emit(link_event::Opened{opened.link, connection->peer[side], true});
                carry(connection, side);
            });
    });
}

void MemoryNetwork::queue(const ConnectionPtr& connection, int side, std::uint16_t type, Epoch epoch,
                          const SharedChain& payload) {
    End& end = connection->ends[side];
    const auto header = encodeHeader(type, epoch, payload ? *payload : ByteChain());
    end.out.emplace_back(Bytes(header.begin(), header.end()));
    end.outBytes += header.size();
    if (payload)
        for (const ByteSlice& slice : payload->slices()) {
            if (slice.size() == 0) continue;
            end.out.push_back(slice);
            end.outBytes += slice.size();
        }
    end.sentAt = timeline_.now();
    carry(connection, side);
}

/// Has the next piece of what `side` has sent arrive at the other end.
void MemoryNetwork::carry(const ConnectionPtr& connection, int side) {
    End& from = connection->ends[side];
    End& to = connection->ends[1 - side];
    if (from.carrying || !from.open || isCut(*connection)) return;
    if (from.out.empty() && !from.closing) return;
    const bool rests = to.owner && !to.closing && to.untaken > to.owner->limits_.maxUntakenBytes;
    if (rests) return;
    from.carrying = true;
    timeline_.after(delay(), [this, connection, side] {
        connection->ends[side].carrying = false;
        if (isCut(*connection)) return;
        arrive(connection, side);
    });
}

void MemoryNetwork::arrive(const ConnectionPtr& connection, int side) {
    End& from = connection->ends[side];
    End& to = connection->ends[1 - side];
    if (from.out.empty()) {
        if (from.closing) endOf(connection, side);
        return;
    }
    // Small pieces now and then: a message may come byte by byte.
    std::size_t left = random_.chance(0.05) ? 1 + random_.below(40) : 1 + random_.below(weather.largestPiece);
    std::vector<ReceivedFrame> frames;
    while (left > 0 && !from.out.empty()) {
        ByteSlice& slice = from.out.front();
        std::size_t count = std::min<std::size_t>(left, slice.size());
        const bool reads = to.owner && !to.closing;
        fingerprint_ = hash64(slice.bytes().first(count),
                              fingerprint_ ^ std::uint64_t(timeline_.now().time_since_epoch().count()));
        if (reads) {
            const std::span<std::byte> room = to.reader->room();
            count = std::min(count, room.size());
            std::memcpy(room.data(), slice.bytes().data(), count);
        }
        const ByteSlice rest = slice.slice(slice.bytes().subspan(count));
        left -= count;
        from.outBytes -= count;
        if (from.owner) from.owner->traffic_.sent += count;
        if (rest.size() == 0)
            from.out.pop_front();
        else
            slice = rest;
        if (!reads) continue;
        to.owner->traffic_.received += count;
        if (const Expected<void> good = to.reader->filled(count, frames); !good) {
            const std::string why = good.error().message;
            return breakLink(connection, 1 - side, why);
        }
    }
    for (ReceivedFrame& frame : frames) {
        if (!to.owner || to.closing) break;
        to.untaken += frame.payload.size() + kMessageCost;
        to.heardAt = timeline_.now();
        to.owner->emit(link_event::Received{to.link, frame.type, frame.epoch, std::move(frame.payload)});
    }
    if (frames.empty() && to.owner && !to.closing && timeline_.now() >= to.heardAt + to.owner->limits_.heardEvery) {
        to.heardAt = timeline_.now();
        to.owner->emit(link_event::Heard{to.link});
    }
    carry(connection, side);
}

/// All that `side` has sent is there, and it sends no more.
void MemoryNetwork::endOf(const ConnectionPtr& connection, int side) {
    finish(connection, 1 - side, "the peer closed the connection");
    finish(connection, side, connection->ends[side].reason);
}

void MemoryNetwork::finish(const ConnectionPtr& connection, int side, const std::string& reason) {
    End& end = connection->ends[side];
    if (!end.owner) return;
    MemoryTransport* const owner = std::exchange(end.owner, nullptr);
    owner->links_.erase(end.link);
    end.out.clear();
    end.outBytes = 0;
    owner->emit(link_event::Closed{end.link, end.closing ? end.reason : reason});
}

/// `side` ends it, or finds it broken; the other one is told.
void MemoryNetwork::breakLink(const ConnectionPtr& connection, int side, const std::string& reason) {
    finish(connection, side, reason);
    timeline_.after(delay(), [this, connection, side] {
        finish(connection, 1 - side, "the connection broke: Connection reset by peer");
    });
}

void MemoryNetwork::beat(const ConnectionPtr& connection, int side) {
    End& end = connection->ends[side];
    if (!end.owner || !end.keepAlive) return;
    const End::KeepAlive& life = *end.keepAlive;
    if (!end.closing && end.out.empty() && timeline_.now() >= end.sentAt + life.interval)
        queue(connection, side, life.type, life.epoch, life.payload);
    timeline_.after(std::max<Duration>(life.interval / 2, 1ms), [this, connection, side] { beat(connection, side); });
}

// ---- MemoryTransport

void MemoryTransport::emit(decltype(LinkEvent::what) what) {
    if (ending_) return;
    onEvent_({network_.timeline_.now(), std::move(what)});
    poke_();
}

Expected<std::uint16_t> MemoryTransport::listen(const Address& address,
                                                const std::function<void(std::uint16_t)>& onBound) {
    const std::uint16_t port = address.port != 0 ? address.port : ++network_.lastPort_;
    if (network_.listeners_.contains(port))
        return fail(ErrorCode::kNetwork, fmt::format("cannot listen on port {}: it is taken", port));
    if (onBound) onBound(port);
    network_.listeners_[port] = this;
    return port;
}

LinkId MemoryTransport::connect(const Address& address, std::chrono::milliseconds timeout) {
    const LinkId link{++network_.lastLink_};
    network_.dial(*this, link, address, timeout);
    return link;
}

void MemoryTransport::send(LinkId link, std::uint16_t type, Epoch epoch, SharedChain payload) {
    const auto found = links_.find(link);
    if (found == links_.end()) return;
    const auto [connection, side] = found->second;
    MemoryNetwork::End& end = connection->ends[side];
    if (end.closing) return;
    network_.queue(connection, side, type, epoch, payload);
    if (end.outBytes > limits_.maxSendQueueBytes)
        network_.timeline_.after({}, [network = &network_, connection, side] {
            network->breakLink(connection, side, "the peer reads too slowly");
        });
}

void MemoryTransport::keepAlive(LinkId link, std::chrono::milliseconds interval, std::uint16_t type, Epoch epoch,
                                SharedChain payload) {
    const auto found = links_.find(link);
    if (found == links_.end()) return;
    const auto [connection, side] = found->second;
    const bool beats = connection->ends[side].keepAlive.has_value();
    connection->ends[side].keepAlive = {interval, type, epoch, std::move(payload)};
    if (!beats)
        network_.timeline_.after(interval / 2,
                                 [network = &network_, connection, side] { network->beat(connection, side); });
}

void MemoryTransport::taken(LinkId link, std::size_t payloadBytes) {
    const auto found = links_.find(link);
    if (found == links_.end()) return;
    const auto [connection, side] = found->second;
    MemoryNetwork::End& end = connection->ends[side];
    end.untaken -= std::min(end.untaken, payloadBytes + kMessageCost);
    if (end.untaken <= limits_.maxUntakenBytes / 2) network_.carry(connection, 1 - side);
}

void MemoryTransport::close(LinkId link, std::string reason) {
    const auto found = links_.find(link);
    if (found == links_.end()) return;
    const auto [connection, side] = found->second;
    MemoryNetwork::End& end = connection->ends[side];
    if (std::exchange(end.closing, true)) return;
    end.reason = std::move(reason);
    if (!end.open)
        network_.timeline_.after({}, [network = &network_, connection, side] {
            network->finish(connection, side, connection->ends[side].reason);
        });
    network_.carry(connection, side);
    network_.carry(connection, 1 - side);
    network_.timeline_.after(kFlushTime, [network = &network_, connection, side] { network->endOf(connection, side); });
}

void MemoryTransport::end() {
    if (std::exchange(ending_, true)) return;
    std::erase_if(network_.listeners_, [this](const auto& entry) { return entry.second == this; });
    // Queued bytes are sent all the same: their owner is not told how that ends.
    for (const auto& [link, place] : std::exchange(links_, {})) {
        const auto& [connection, side] = place;
        MemoryNetwork::End& end = connection->ends[side];
        end.owner = nullptr;
        end.closing = true;
        network_.carry(connection, side);
        network_.carry(connection, 1 - side);
    }
}

std::size_t MemoryTransport::queuedBytes(LinkId link) const {
    const auto found = links_.find(link);
    return found == links_.end() ? 0 : found->second.connection->ends[found->second.side].outBytes;
}

}  // namespace tessera::simulation
