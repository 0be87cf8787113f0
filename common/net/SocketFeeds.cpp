#include "common/net/SocketFeeds.h"

#include <array>
#include <boost/asio/connect.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ip/udp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include "common/base/StartThread.h"

namespace tessera {

namespace {

namespace feed_asio = boost::asio;
using FeedUdp = feed_asio::ip::udp;
using FeedTcp = feed_asio::ip::tcp;
using FeedError = boost::system::error_code;

constexpr std::chrono::milliseconds kDialTimeout{5000};

HostBytes hostBytesOf(const feed_asio::ip::address& address) {
    const feed_asio::ip::address_v6 v6 =
        address.is_v6() ? address.to_v6() : feed_asio::ip::make_address_v6(feed_asio::ip::v4_mapped, address.to_v4());
    return v6.to_bytes();
}

/// A port that datagrams come to.
class DatagramPort : public std::enable_shared_from_this<DatagramPort> {
public:
    DatagramPort(feed_asio::io_context& io, std::function<void(const Feeds::Datagram&)> onDatagram)
        : socket_(io), pause_(io), onDatagram_(std::move(onDatagram)), room_(Feeds::kMaxDatagramBytes) {}

    Expected<std::uint16_t> bind(const FeedUdp::endpoint& endpoint) {
        FeedError error;
        socket_.open(endpoint.protocol(), error);
        if (!error) socket_.non_blocking(true, error);
        // As much as the system gives: datagrams that come at once wait there.
        FeedError ignored;
        if (!error) socket_.set_option(feed_asio::socket_base::receive_buffer_size(1 << 20), ignored);
        if (!error) socket_.bind(endpoint, error);
        if (error) return fail(ErrorCode::kNetwork, error.message());
        return socket_.local_endpoint(error).port();
    }

    void wait() {
        socket_.async_wait(FeedUdp::socket::wait_read, [self = shared_from_this()](const FeedError& error) {
            if (!error) self->readAll();
        });
    }

private:
    void readAll() {
        for (;;) {
            const TimePoint now = clockNow();
            if (now - sliceBegan_ >= Feeds::kSlice) {
                sliceBegan_ = now;
                inSlice_ = 0;
            }
            if (inSlice_ == Feeds::kMostInSlice) {
                pause_.expires_at(sliceBegan_ + Feeds::kSlice);
                pause_.async_wait([self = shared_from_this()](const FeedError& error) {
                    if (!error) self->wait();
                });
                return;
            }
            FeedUdp::endpoint from;
            FeedError error;
            const std::size_t count = socket_.receive_from(feed_asio::buffer(room_), from, 0, error);
            if (error == feed_asio::error::would_block || error == feed_asio::error::try_again) return wait();
            ++inSlice_;
            // Others (an answer of the network to something that this socket never sent) say nothing about the next
            // datagram.
            if (!error)
                onDatagram_({.bytes = ByteSpan(room_).first(count), .from = hostBytesOf(from.address()), .at = now});
        }
    }

    FeedUdp::socket socket_;
    feed_asio::steady_timer pause_;
    std::function<void(const Feeds::Datagram&)> onDatagram_;
    Bytes room_;
    TimePoint sliceBegan_{};
    int inSlice_ = 0;
};

/// A stream that is dialled again whenever it ends. Handlers of an attempt that is over are told apart by its number.
class DialledStream : public std::enable_shared_from_this<DialledStream> {
public:
    DialledStream(feed_asio::io_context& io, Address address, Feeds::Stream stream)
        : resolver_(io),
          socket_(io),
          timer_(io),
          address_(std::move(address)),
          stream_(std::move(stream)),
          pause_(stream_.firstPause),
          room_(std::size_t{16} << 10) {}

    void dial() {
        const std::uint64_t attempt = ++attempt_;
        watch(attempt, kDialTimeout, "does not answer");
        FeedError notNumeric;
        const auto numeric = feed_asio::ip::make_address(address_.host, notNumeric);
        if (!notNumeric) return connect(attempt, std::array{FeedTcp::endpoint(numeric, address_.port)});
        const auto found = [self = shared_from_this(), attempt](const FeedError& error,
                                                                const FeedTcp::resolver::results_type& results) {
            if (self->attempt_ != attempt) return;
            if (error) return self->lose({ErrorCode::kNetwork, error.message()});
            self->connect(attempt, results);
        };
        try {
            resolver_.async_resolve(address_.host, std::to_string(address_.port), found);
        } catch (const std::exception&) {  // Asio starts a thread for names
            lose({ErrorCode::kNetwork, kNoThread});
        }
    }

private:
    template <typename Endpoints>
    void connect(std::uint64_t attempt, const Endpoints& endpoints) {
        feed_asio::async_connect(
            socket_, endpoints, [self = shared_from_this(), attempt](const FeedError& error, const FeedTcp::endpoint&) {
                if (self->attempt_ != attempt) return;
                if (error) return self->lose({ErrorCode::kNetwork, error.message()});
                FeedError ignored;
                self->socket_.set_option(FeedTcp::no_delay(true), ignored);
                auto first = std::make_shared<const Bytes>(self->stream_.opened());
                feed_asio::async_write(self->socket_, feed_asio::buffer(*first),
                                       [self, attempt, first](const FeedError& failed, std::size_t) {
                                           if (self->attempt_ == attempt && failed)
                                               self->lose({ErrorCode::kNetwork, failed.message()});
                                       });
                self->read(attempt);
            });
    }

    void read(std::uint64_t attempt) {
        watch(attempt, stream_.silence, "is silent");
        socket_.async_read_some(
            feed_asio::buffer(room_), [self = shared_from_this(), attempt](const FeedError& error, std::size_t count) {
                if (self->attempt_ != attempt) return;
                if (error)
                    return self->lose({ErrorCode::kNetwork,
                                       error == feed_asio::error::eof ? "has closed the connection" : error.message()});
                if (const Expected<void> taken = self->stream_.received(ByteSpan(self->room_).first(count), clockNow());
                    !taken)
                    return self->lose(taken.error());
                self->pause_ = self->stream_.firstPause;
                self->read(attempt);
            });
    }

    void watch(std::uint64_t attempt, std::chrono::milliseconds patience, const char* what) {
        timer_.expires_after(patience);
        timer_.async_wait([self = shared_from_this(), attempt, patience, what](const FeedError& error) {
            if (error || self->attempt_ != attempt) return;
            self->lose({ErrorCode::kNetwork,
                        fmt::format("{} for {} s", what, std::chrono::duration<double>(patience).count())});
        });
    }

    void lose(const Error& why) {
        const std::uint64_t attempt = ++attempt_;
        FeedError ignored;
        resolver_.cancel();
        socket_.close(ignored);
        stream_.lost(why);
        timer_.expires_after(pause_);
        pause_ = std::min(2 * pause_, stream_.longestPause);
        timer_.async_wait([self = shared_from_this(), attempt](const FeedError& error) {
            if (!error && self->attempt_ == attempt) self->dial();
        });
    }

    FeedTcp::resolver resolver_;
    FeedTcp::socket socket_;
    feed_asio::steady_timer timer_;
    Address address_;
    Feeds::Stream stream_;
    std::chrono::milliseconds pause_;
    std::uint64_t attempt_ = 0;
    Bytes room_;
};

}  // namespace

struct SocketFeeds::Impl {
    feed_asio::io_context io{1};
    feed_asio::executor_work_guard<feed_asio::io_context::executor_type> work = feed_asio::make_work_guard(io);
    std::thread thread{[this] { io.run(); }};
};

SocketFeeds::SocketFeeds() : impl_(std::make_unique<Impl>()) {}

SocketFeeds::~SocketFeeds() {
    impl_->io.stop();
    impl_->thread.join();
}

Expected<std::uint16_t> SocketFeeds::listen(const Address& address, std::function<void(const Datagram&)> onDatagram) {
    FeedError error;
    FeedUdp::resolver resolver(impl_->io);
    const auto found = resolver.resolve(address.host, std::to_string(address.port), FeedUdp::resolver::passive, error);
    if (error || found.empty())
        return fail(ErrorCode::kNetwork,
                    fmt::format("cannot listen for datagrams at {}: {}", toString(address), error.message()));
    auto port = std::make_shared<DatagramPort>(impl_->io, std::move(onDatagram));
    Expected<std::uint16_t> bound = port->bind(*found.begin());
    if (!bound) return failWith(fmt::format("cannot listen for datagrams at {}", toString(address)), bound.error());
    feed_asio::post(impl_->io, [port] { port->wait(); });
    return bound;
}

void SocketFeeds::dial(const Address& address, Stream stream) {
    auto dialled = std::make_shared<DialledStream>(impl_->io, address, std::move(stream));
    feed_asio::post(impl_->io, [dialled] { dialled->dial(); });
}

}  // namespace tessera
