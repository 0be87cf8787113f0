/// One connection of a Transport, as its network thread knows it. For Transport.cpp alone.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>

#include <memory>
#include <optional>
#include <string>

#include "common/net/Crowd.h"
#include "common/net/FrameReader.h"
#include "common/net/SealedLink.h"
#include "common/net/SendQueue.h"
#include "common/net/Transport.h"

namespace tessera {

enum class TransportLinkState {
    kConnecting,
    kOpen,
    kClosing,  ///< sends its queue, then waits for the peer's end; what still arrives is thrown away
    kClosed,
};

struct TransportLink {
    TransportLink(LinkId linkId, boost::asio::ip::tcp::socket s, const TransportLimits& limits)
        : id(linkId), socket(std::move(s)), timer(socket.get_executor()), reader(limits.maxPayload) {}

    LinkId id;
    boost::asio::ip::tcp::socket socket;
    boost::asio::steady_timer timer;  ///< connecting: the timeout; closing: the end of patience
    TransportLinkState state = TransportLinkState::kConnecting;
    FrameReader reader;
    SendQueue queue;
    std::unique_ptr<SealedLink> sealed;  ///< null: plain, or nothing has come yet that would tell
    bool heard = false;                  ///< something has come
    TimePoint heardAt{};                 ///< the last event that told of bytes
    TimePoint sentAt{};                  ///< the last write
    struct KeepAlive {
        Duration interval{};
        std::uint16_t type = 0;
        Epoch epoch;
        SharedChain payload;
    };
    std::optional<KeepAlive> keepAlive;
    SourceAddress from;  ///< none: it was dialled
    /// Accepted, and no message has come yet, or it is being closed: where it stands among those.
    std::optional<Crowd<std::shared_ptr<TransportLink>>::Place> stranger;
    std::string target;  ///< what it connects to; empty: it was accepted
    std::string closeReason;
};

}  // namespace tessera
