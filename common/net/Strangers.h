/// Connections that were accepted and have sent no message yet, or are being closed, and how they give way. For
/// Transport.cpp alone.
#pragma once

#include <array>
#include <boost/asio/buffer.hpp>
#include <list>
#include <memory>
#include <vector>

#include "common/net/FrameHeader.h"
#include "common/net/TransportLink.h"

namespace tessera {

/// The oldest comes first. Nobody gives way before it has had `TransportLimits::patience` to speak: a peer whose
/// machine is busy would lose its place to a thousand that connect and say nothing. The network thread's alone.
class Strangers {
public:
    explicit Strangers(const TransportLimits& limits) : limits_(limits) {}

    [[nodiscard]] bool empty() const { return links_.empty(); }
    [[nodiscard]] bool full() const { return links_.size() >= limits_.maxStrangers; }
    /// It has just been accepted, or is closed by us: at the end of the row.
    void add(const std::shared_ptr<TransportLink>& link, TimePoint now) {
        forget(*link);
        link->stranger = TransportLink::Stranger{now, links_.insert(links_.end(), link)};
    }
    /// It has sent a message, or is gone. Others are no strangers: nothing happens.
    void forget(TransportLink& link) {
        if (link.stranger) links_.erase(link.stranger->place);
        link.stranger.reset();
    }
    /// Who is to go so that another may come; null: nobody before `due`. Not when it is empty.
    [[nodiscard]] std::shared_ptr<TransportLink> givesWay(TimePoint now) {
        const std::shared_ptr<TransportLink> oldest = links_.front();
        boost::system::error_code ignored;
        // It may have spoken, and was not read yet.
        if (oldest->state != TransportLinkState::kClosing && oldest->socket.available(ignored) > 0) {
            oldest->stranger->since = now;
            links_.splice(links_.end(), links_, oldest->stranger->place);
            return nullptr;
        }
        return due() <= now ? oldest : nullptr;
    }
    /// When the oldest has had its time. Not when it is empty.
    [[nodiscard]] TimePoint due() const { return links_.front()->stranger->since + limits_.patience; }

    /// One that is being closed has had its own; into one that is sealed no plain word goes.
    void sayLastWord(TransportLink& link) const {
        if (link.state != TransportLinkState::kClosing && !link.sealed) sayLastWord(link.socket);
    }
    void sayLastWord(boost::asio::ip::tcp::socket& socket) const {
        const auto& [type, payload] = limits_.lastWord;
        if (!payload) return;
        boost::system::error_code ignored;
        socket.non_blocking(true, ignored);
        const auto header = encodeHeader(type, Epoch(), *payload);
        std::vector<boost::asio::const_buffer> buffers{boost::asio::buffer(header)};
        for (const ByteSlice& piece : payload->slices())
            buffers.emplace_back(piece.bytes().data(), piece.bytes().size());
        socket.write_some(buffers, ignored);
        socket.shutdown(boost::asio::ip::tcp::socket::shutdown_send, ignored);
        // A close with unread bytes would take the word away.
        std::array<std::byte, 4096> unread{};
        socket.read_some(boost::asio::buffer(unread), ignored);
    }

private:
    const TransportLimits& limits_;
    std::list<std::shared_ptr<TransportLink>> links_;
};

}  // namespace tessera
