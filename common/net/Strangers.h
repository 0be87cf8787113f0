/// Connections that were accepted and have sent no message yet, or are being closed, and those that wait to be such.
/// For Transport.cpp alone.
#pragma once

#include <sys/socket.h>

#include <array>
#include <boost/asio/buffer.hpp>
#include <memory>
#include <vector>

#include "common/base/SourceRows.h"
#include "common/net/FrameHeader.h"
#include "common/net/TransportLink.h"
#include "common/tls/TlsChannel.h"

namespace tessera {

/// How they give way: `Crowd`. The network thread's alone.
class Strangers {
public:
    using Socket = boost::asio::ip::tcp::socket;

    explicit Strangers(const TransportLimits& limits) : limits_(limits), crowd_(limits.patience) {}

    [[nodiscard]] bool empty() const { return crowd_.empty(); }
    [[nodiscard]] bool full() const { return crowd_.size() >= limits_.maxStrangers; }
    /// It has just been accepted, or is closed by us; or its time begins anew.
    void add(const std::shared_ptr<TransportLink>& link, TimePoint now) {
        if (link->stranger)
            crowd_.beginAgain(*link->stranger, now);
        else
            link->stranger = crowd_.add(link->from, link, now);
    }
    /// It has sent a message, or is gone. Others are no strangers: nothing happens.
    void forget(TransportLink& link) {
        if (link.stranger) crowd_.remove(*link.stranger);
        link.stranger.reset();
    }
    /// Who is to go so that one from there may come; null: nobody before `due`. Not when it is empty.
    [[nodiscard]] std::shared_ptr<TransportLink> givesWayTo(SourceAddress newcomer, TimePoint now) {
        return crowd_.givesWayTo(newcomer, now, waitsForUs).value_or(nullptr);
    }
    /// Who is to go whoever comes; null: nobody before `due`. Not when it is empty.
    [[nodiscard]] std::shared_ptr<TransportLink> givesWay(TimePoint now) {
        return crowd_.givesWay(now, waitsForUs).value_or(nullptr);
    }
    /// When somebody has had the time that each has. Not when it is empty.
    [[nodiscard]] TimePoint due() { return crowd_.due(); }

    // ---- those for whom there is no room yet

    [[nodiscard]] SourceRows<Socket>& waiting() { return waiting_; }
    /// Of too many the oldest one of the most crowded address is told so and closed. Not when nobody waits.
    void refuseOne() {
        Socket socket = waiting_.takeOldestOfCrowd();
        sayLastWord(socket);
    }
    [[nodiscard]] bool tooManyWait() const { return waiting_.size() > limits_.maxStrangers; }

    /// One that is being closed has had its own; into one that is sealed no plain word goes.
    void sayLastWord(TransportLink& link) const {
        if (link.state != TransportLinkState::kClosing && !link.sealed) sayLastWord(link.socket);
    }
    void sayLastWord(Socket& socket) const {
        const auto& [type, payload] = limits_.lastWord;
        if (!payload || (limits_.tls && !speaksPlainly(socket))) return;
        boost::system::error_code ignored;
        socket.non_blocking(true, ignored);
        const auto header = encodeHeader(type, Epoch(), *payload);
        std::vector<boost::asio::const_buffer> buffers{boost::asio::buffer(header)};
        for (const ByteSlice& piece : payload->slices())
            buffers.emplace_back(piece.bytes().data(), piece.bytes().size());
        socket.write_some(buffers, ignored);
        socket.shutdown(Socket::shutdown_send, ignored);
        // A close with unread bytes would take the word away.
        std::array<std::byte, 4096> unread{};
        socket.read_some(boost::asio::buffer(unread), ignored);
    }

private:
    static bool waitsForUs(const std::shared_ptr<TransportLink>& link) {
        if (link->state == TransportLinkState::kClosing) return false;
        boost::system::error_code ignored;
        return (link->sealed && link->sealed->shaking) || link->socket.available(ignored) > 0;
    }
    /// To who begins with TLS a plain word would be rubbish.
    static bool speaksPlainly(Socket& socket) {
        std::byte first{};
        return ::recv(socket.native_handle(), &first, 1, MSG_PEEK | MSG_DONTWAIT) == 1 &&
               first != TlsChannel::kFirstByte;
    }

    const TransportLimits& limits_;
    Crowd<std::shared_ptr<TransportLink>> crowd_;
    SourceRows<Socket> waiting_;
};

}  // namespace tessera
