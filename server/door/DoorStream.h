/// The bytes of one connection of a door, plain or sealed (TLS 1.3), in the shape in which Beast reads and writes them.
#pragma once

#include <boost/asio/associated_executor.hpp>
#include <boost/asio/async_result.hpp>
#include <boost/asio/bind_executor.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/dispatch.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/basic_stream.hpp>
#include <boost/beast/core/bind_handler.hpp>
#include <boost/beast/core/role.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "common/base/Bytes.h"
#include "common/base/Clock.h"
#include "common/tls/TlsContext.h"

namespace tessera {

/// Whether any byte has gone either way, in the midst of a long message too. In the shape of Beast's RatePolicy.
struct DoorProgress {
    bool moved = false;
    std::uint64_t written = 0;  ///< bytes, to the kernel

private:
    friend class boost::beast::rate_policy_access;
    static constexpr std::size_t available_read_bytes() { return std::numeric_limits<std::size_t>::max(); }
    static constexpr std::size_t available_write_bytes() { return std::numeric_limits<std::size_t>::max(); }
    void transfer_read_bytes(std::size_t bytes) { moved = moved || bytes > 0; }
    void transfer_write_bytes(std::size_t bytes) {
        moved = moved || bytes > 0;
        written += bytes;
    }
    void on_timer() const {}
};

/// Whoever waits for bytes, of whatever type.
class DoorWaiter {
public:
    virtual ~DoorWaiter() = default;
    /// Once.
    virtual void done(boost::system::error_code error, std::size_t bytes) = 0;
};

/// A socket, with a TlsChannel in it where `seal` was called. What it asks the socket for ends at `expiresAfter`, as of
/// Beast's own streams. One reads and one writes at a time. All members on the door's thread.
///
/// Beside the socket a sealed one holds at most the bytes of a write, twice, and 17 KiB of what has come.
class DoorStream {
public:
    using Error = boost::system::error_code;
    using executor_type = boost::asio::any_io_executor;
    using Raw = boost::beast::basic_stream<boost::asio::ip::tcp, executor_type, DoorProgress>;

    explicit DoorStream(boost::asio::ip::tcp::socket socket);
    /// Closes it.
    ~DoorStream();
    DoorStream(DoorStream&&) noexcept = default;
    DoorStream& operator=(DoorStream&&) = delete;

    enum class Greeting {
        kSealed,
        kPlain,  ///< the peer does not begin with TLS: what is written from now on is plain
        kGone,   ///< it has gone, or the handshake has failed
    };
    /// Does what it is given, when it is its turn: a step of a handshake, of one that goes on or of one that begins.
    using InTurn = std::function<void(bool goesOn, std::function<void()> step)>;
    /// Before anything else: the peer begins with a handshake. `then` is called once, not from within.
    void seal(std::shared_ptr<const TlsContext> keys, InTurn inTurn, std::function<void(Greeting)> then);
    /// As the keys are now. None: it has shown no certificate, or is plain.
    [[nodiscard]] std::optional<Credential> peer(const TlsContext& keys) const;
    /// The other end's address, without its port; empty: it has gone.
    [[nodiscard]] std::string from();

    [[nodiscard]] executor_type get_executor() const { return executor_; }
    [[nodiscard]] boost::asio::ip::tcp::socket& socket() { return raw().socket(); }
    [[nodiscard]] DoorProgress& progress() { return raw().rate_policy(); }
    void expiresAfter(std::chrono::steady_clock::duration time) { raw().expires_after(time); }
    void neverExpires() { raw().expires_never(); }
    /// What is under way ends with an error; what comes later may go on.
    void cancel() { raw().cancel(); }
    void close();
    /// Its peer had taken all until now, and something waits for it from here on.
    void waitsFrom(TimePoint now) { tookAt_ = now; }
    /// When its peer took something last, as far as was looked.
    [[nodiscard]] TimePoint tookAt(TimePoint now);
    /// Bytes have come that nobody has read, or its handshake waits for its turn.
    [[nodiscard]] bool waitsToBeRead();
    /// Nothing more is written: the peer is told so behind what is on its way.
    void endSending();
    /// As far as it takes no time; then it is over. `plain`: said to peers that have not begun a handshake, too.
    void sayLast(std::string_view text, bool plain);

    // ---- of Beast's AsyncStream

    template <typename Buffers, typename Handler>
    auto async_read_some(const Buffers& buffers, Handler&& handler) {
        return boost::asio::async_initiate<Handler, void(Error, std::size_t)>(
            [this](auto&& waits, const Buffers& into) {
                read(piecesOf<boost::asio::mutable_buffer>(into), waiter(std::forward<decltype(waits)>(waits)));
            },
            handler, buffers);
    }
    template <typename Buffers, typename Handler>
    auto async_write_some(const Buffers& buffers, Handler&& handler) {
        return boost::asio::async_initiate<Handler, void(Error, std::size_t)>(
            [this](auto&& waits, const Buffers& from) {
                write(piecesOf<boost::asio::const_buffer>(from), waiter(std::forward<decltype(waits)>(waits)));
            },
            handler, buffers);
    }
    friend void beast_close_socket(DoorStream& stream) { stream.close(); }
    template <typename Handler>
    friend void async_teardown(boost::beast::role_type, DoorStream& stream, Handler&& handler) {
        auto executor = boost::asio::get_associated_executor(handler, stream.get_executor());
        stream.endSending();
        stream.drain(stream.waiter(boost::asio::bind_executor(
            executor, [handler = std::forward<Handler>(handler)](Error error, std::size_t) mutable {
                std::move(handler)(error);
            })));
    }

private:
    using Waits = std::unique_ptr<DoorWaiter>;

    /// The first buffers of a sequence, whatever its type: what the socket does is compiled once, and not for each type
    /// of buffers and of who waits.
    template <typename Buffer>
    struct Pieces {
        using value_type = Buffer;
        using const_iterator = const Buffer*;
        static constexpr std::size_t kMost = 32;  ///< a head of HTTP is one for each of its fields

        std::array<Buffer, kMost> room;
        std::size_t count = 0;
        [[nodiscard]] const Buffer* begin() const { return room.data(); }
        [[nodiscard]] const Buffer* end() const { return room.data() + count; }
    };
    template <typename Buffer, typename Buffers>
    static Pieces<Buffer> piecesOf(const Buffers& buffers) {
        Pieces<Buffer> pieces;
        const auto end = boost::asio::buffer_sequence_end(buffers);
        for (auto at = boost::asio::buffer_sequence_begin(buffers); at != end && pieces.count < pieces.kMost; ++at)
            if (const Buffer one(*at); one.size() > 0) pieces.room[pieces.count++] = one;
        return pieces;
    }

    template <typename Handler>
    class Waiter : public DoorWaiter {
    public:
        Waiter(Handler handler, executor_type executor)
            : handler_(std::move(handler)), executor_(std::move(executor)) {}
        void done(Error error, std::size_t bytes) override {
            const auto executor = boost::asio::get_associated_executor(handler_, executor_);
            boost::asio::dispatch(executor, boost::beast::bind_front_handler(std::move(handler_), error, bytes));
        }

    private:
        Handler handler_;
        executor_type executor_;
    };
    template <typename Handler>
    Waits waiter(Handler&& handler) const {
        return std::make_unique<Waiter<std::decay_t<Handler>>>(std::forward<Handler>(handler), executor_);
    }

    [[nodiscard]] Raw& raw();
    [[nodiscard]] bool isSealed() const;
    void read(const Pieces<boost::asio::mutable_buffer>& into, Waits waits);
    void write(const Pieces<boost::asio::const_buffer>& from, Waits waits);
    /// Nothing more is said: until the peer has closed, too.
    void drain(Waits waits);

    struct Impl;
    std::shared_ptr<Impl> impl_;  ///< what is under way holds it, too
    executor_type executor_;
    std::uint64_t took_ = 0;  ///< bytes that its peer has had, when that was looked at last
    TimePoint tookAt_ = {};   ///< when that was less, or nothing waited
};

}  // namespace tessera
