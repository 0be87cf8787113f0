#include "server/door/LinkTunnel.h"

#include <boost/asio/connect.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>

#include <array>

#include "common/base/Utf8.h"
#include "common/codec/MessageCodec.h"
#include "common/net/FrameHeader.h"

namespace tessera {
namespace {

namespace beast = boost::beast;
namespace websocket = beast::websocket;
using boost::asio::ip::tcp;

class LinkTunnel : public Guest, public std::enable_shared_from_this<LinkTunnel> {
public:
    LinkTunnel(DoorStream stream, DoorContext& context)
        : Guest(context), context_(context), outside_(std::move(stream)), inside_(context.io) {
        ++context_.sockets;
        isSocket = true;
    }
    ~LinkTunnel() override { --context_.sockets; }

    void accept(const beast::http::request<beast::http::string_body>& upgrade) {
        websocket::stream_base::timeout patience{};
        patience.handshake_timeout = context_.limits.headWait;
        patience.idle_timeout = context_.limits.idle;
        patience.keep_alive_pings = true;
        outside_.set_option(patience);
        outside_.read_message_max(0);  // it is read in parts
        outside_.binary(true);
        outside_.auto_fragment(false);  // else each 4 KiB would be a frame of its own
        outside_.async_accept(upgrade, [self = shared_from_this()](beast::error_code error) {
            if (!error) self->dial();
        });
    }
    void leave() override {
        over_ = true;
        beast::error_code ignored;
        outside_.next_layer().close();
        inside_.socket().close(ignored);
    }
    [[nodiscard]] std::string faultOfKey(const TlsContext& keys) const override {
        const std::optional<Credential> peer = outside_.next_layer().peer(keys);
        return peer ? peer->fault : std::string();
    }
    void sendAway(const std::string& why) override { finish(why); }

private:
    static constexpr std::size_t kAtOnce = std::size_t{64} << 10;
    static constexpr std::size_t kMostOfHello = std::size_t{64} << 10;
    static constexpr std::size_t kMostOfReason = 120;  // a frame that closes has room for 123 bytes

    void dial() {
        beast::error_code error;
        const Address& server = context_.options.server;
        const tcp::endpoint to(boost::asio::ip::make_address(server.host, error), server.port);
        if (error) return finish("the server listens at a name, and not at a number");
        inside_.expires_after(context_.limits.headWait);
        inside_.async_connect(to, [self = shared_from_this()](beast::error_code failed) {
            if (failed) return self->finish("the server cannot be reached");
            beast::error_code ignored;
            self->inside_.socket().set_option(tcp::no_delay(true), ignored);
            self->inside_.expires_never();
            self->takeOutside();
            self->takeInside();
        });
    }

    void takeOutside() {
        outside_.async_read_some(fromOutside_, kAtOnce,
                                 [self = shared_from_this()](beast::error_code error, std::size_t) {
                                     if (error) return self->leave();
                                     if (self->outside_.got_text())
                                         return self->finish("bytes of the link are said in binary messages");
                                     if (self->isHost()) return self->finish("a render host does not come in here");
                                     if (self->knowsWho_)
                                         self->giveInside();
                                     else
                                         self->takeOutside();
                                 });
    }
    /// Hosts come to the server's own port, where their keys are looked at. Nothing goes in before the first message
    /// has said who it is.
    bool isHost() {
        if (knowsWho_) return false;
        const auto bytes = fromOutside_.data();
        const ByteSpan said(static_cast<const std::byte*>(bytes.data()), bytes.size());
        if (said.size() < FrameHeader::kBytes) return false;
        const Expected<FrameHeader> header = decodeHeader(said.first<FrameHeader::kBytes>());
        // What is no Hello the server refuses.
        knowsWho_ = !header || header->payloadBytes > kMostOfHello;
        if (knowsWho_ || said.size() < FrameHeader::kBytes + header->payloadBytes) return false;
        knowsWho_ = true;
        const ByteSpan payload = said.subspan(FrameHeader::kBytes, header->payloadBytes);
        const Expected<Message> message = decodeMessage(header->type, share(Bytes(payload.begin(), payload.end())));
        const auto* const hello = message ? std::get_if<message::Hello>(&*message) : nullptr;
        return hello != nullptr && hello->channel == ChannelKind::kControl && hello->role == PeerRole::kHost;
    }
    void giveInside() {
        boost::asio::async_write(inside_, fromOutside_.data(),
                                 [self = shared_from_this()](beast::error_code error, std::size_t) {
                                     if (error) return self->finish("the server has hung up");
                                     self->fromOutside_.clear();
                                     self->takeOutside();
                                 });
    }

    void takeInside() {
        inside_.async_read_some(boost::asio::buffer(fromInside_),
                                [self = shared_from_this()](beast::error_code error, std::size_t bytes) {
                                    if (error) return self->finish("the server has hung up");
                                    self->giveOutside(bytes);
                                });
    }
    void giveOutside(std::size_t bytes) {
        outside_.async_write(boost::asio::buffer(fromInside_.data(), bytes),
                             [self = shared_from_this()](beast::error_code error, std::size_t) {
                                 if (error) return self->leave();
                                 self->takeInside();
                             });
    }

    /// In words, where it still can be.
    void finish(std::string_view why) {
        if (std::exchange(over_, true)) return;
        beast::error_code ignored;
        inside_.socket().close(ignored);
        outside_.async_close({websocket::close_code::going_away, cutUtf8(why, kMostOfReason)},
                             [self = shared_from_this()](beast::error_code) { self->leave(); });
    }

    DoorContext& context_;
    websocket::stream<DoorStream> outside_;
    beast::tcp_stream inside_;
    beast::flat_buffer fromOutside_;
    std::array<char, kAtOnce> fromInside_{};
    bool over_ = false, knowsWho_ = false;
};

}  // namespace

void startLinkTunnel(DoorStream stream, beast::http::request<beast::http::string_body> upgrade, const Entrant& who,
                     std::string token, DoorContext& context) {
    const auto tunnel = std::make_shared<LinkTunnel>(std::move(stream), context);
    tunnel->who = who;
    tunnel->token = std::move(token);
    tunnel->accept(upgrade);
}

}  // namespace tessera
