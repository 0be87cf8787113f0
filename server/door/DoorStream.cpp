#include "server/door/DoorStream.h"

#include <linux/sockios.h>
#include <sys/ioctl.h>

#include <boost/asio/error.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/write.hpp>

#include <algorithm>
#include <array>

#include "common/net/HungUp.h"
#include "common/net/OwnAddress.h"
#include "common/tls/TlsChannel.h"

namespace tessera {

namespace asio = boost::asio;
using asio::ip::tcp;

struct DoorStream::Impl : std::enable_shared_from_this<DoorStream::Impl> {
    static constexpr std::size_t kIn = std::size_t{17} << 10;    // a record of TLS, and its head
    static constexpr std::size_t kKept = std::size_t{16} << 10;  // of what was written, for the next
    static constexpr std::size_t kRest = 2048;                   // of what nobody will look at

    explicit Impl(tcp::socket socket) : raw(std::move(socket)) {}

    // ---- the handshake

    /// The first byte tells who speaks TLS.
    void greet() {
        in.resize(kIn);
        raw.async_read_some(asio::buffer(in), [self = shared_from_this()](Error error, std::size_t count) {
            if (error) return self->greeted(Greeting::kGone);
            if (!self->ready && !self->hasBegun && self->in.front() != TlsChannel::kFirstByte) {
                self->channel.reset();
                return self->greeted(Greeting::kPlain);
            }
            const bool goesOn = std::exchange(self->hasBegun, true);
            self->waitsForTurn = true;
            self->inTurn(goesOn, [self, count] {
                self->waitsForTurn = false;
                self->shake(count);
            });
        });
    }
    void shake(std::size_t count) {
        // Who begins handshakes and goes costs no more than this look.
        if (!raw.socket().is_open() || hasHungUp(raw.socket().native_handle())) return greeted(Greeting::kGone);
        channel->arrived(ByteSpan(in).first(count));
        const Expected<void> good = channel->shake();
        channel->keep();
        if (!good) {
            sayNow();  // an alert
            return greeted(Greeting::kGone);
        }
        ready = channel->ready();
        flush();
        if (ready) return greeted(Greeting::kSealed);
        greet();
    }
    void greeted(Greeting greeting) {
        const InTurn held = std::exchange(inTurn, nullptr);  // whoever calls may stand in it
        const std::function<void(Greeting)> then = std::exchange(onGreeting, nullptr);
        if (then) then(greeting);
    }

    // ---- what comes

    void read(std::span<std::byte> into, Waits waits) {
        reading = std::move(waits);
        room = into;
        // Not from within: whoever asks has not returned yet.
        if (room.empty() || broken) return readLater(broken, 0);
        std::size_t count = 0;
        if (take(count)) return readLater(broken, count);
        fill();
    }
    void fill() {
        raw.async_read_some(asio::buffer(in), [self = shared_from_this()](Error error, std::size_t count) {
            if (error) return self->haveRead(error, 0);  // it may have been cancelled, and goes on then
            self->channel->arrived(ByteSpan(self->in).first(count));
            std::size_t taken = 0;
            if (self->take(taken)) return self->haveRead(taken > 0 ? Error() : self->broken, taken);
            self->fill();
        });
    }
    /// What has come into `room`. False: more has to come.
    bool take(std::size_t& count) {
        while (count < room.size()) {
            const Expected<std::size_t> part = channel->read(room.subspan(count));
            if (!part) broken = asio::error::connection_reset;
            if (!part || *part == 0) break;
            count += *part;
        }
        channel->keep();
        if (channel->peerEnded()) broken = asio::error::eof;
        flush();  // what TLS itself answers
        return count > 0 || broken;
    }
    void readLater(Error error, std::size_t count) {
        asio::post(raw.get_executor(),
                   [self = shared_from_this(), error, count] { self->haveRead(count > 0 ? Error() : error, count); });
    }
    void haveRead(Error error, std::size_t count) {
        room = {};
        if (const Waits waits = std::move(reading)) waits->done(error, count);
    }

    // ---- what goes

    void write(ByteSpan bytes, Waits waits) {
        writing = std::move(waits);
        written = bytes.size();
        if (broken && broken != asio::error::eof) return writeLater(broken);
        if (bytes.empty() || ending) return writeLater(bytes.empty() ? Error() : Error(asio::error::shut_down));
        if (!channel->seal(bytes)) {
            broken = asio::error::connection_reset;
            return writeLater(broken);
        }
        flush();
    }
    void writeLater(Error error) {
        asio::post(raw.get_executor(), [self = shared_from_this(), error] { self->haveWritten(error); });
    }
    void haveWritten(Error error) {
        if (const Waits waits = std::move(writing)) waits->done(error, error ? 0 : written);
    }
    /// In the order in which it was sealed, however much of it there is.
    void flush() {
        if (flushing || channel->outgoing().empty()) return;
        flushing = true;
        out.swap(channel->outgoing());
        asio::async_write(raw, asio::buffer(out), [self = shared_from_this()](Error error, std::size_t) {
            self->flushing = false;
            self->out.clear();
            if (self->out.capacity() > kKept) self->out = Bytes();
            if (error) {  // part of it may have gone: nothing can follow
                self->broken = error;
                return self->haveWritten(error);
            }
            if (!self->channel->outgoing().empty()) return self->flush();
            if (self->ending) self->shutDown();
            self->haveWritten({});
        });
    }
    /// What is to be sent, as far as it takes no time.
    void sayNow() {
        if (flushing) return;
        Error ignored;
        raw.socket().non_blocking(true, ignored);
        raw.socket().write_some(asio::buffer(channel->outgoing()), ignored);
        channel->outgoing().clear();
    }
    void end() {
        if (std::exchange(ending, true)) return;
        if (ready) {
            channel->end();
            flush();
        }
        if (!flushing) shutDown();
    }
    void shutDown() {
        Error ignored;
        raw.socket().shutdown(tcp::socket::shutdown_send, ignored);
    }
    void drain(Waits waits) {
        if (in.empty()) in.resize(kRest);
        raw.async_read_some(asio::buffer(in),
                            [self = shared_from_this(), waits = std::move(waits)](Error error, std::size_t) mutable {
                                if (!error) return self->drain(std::move(waits));
                                if (error == asio::error::eof) self->raw.close();
                                waits->done(error == asio::error::eof ? Error() : error, 0);
                            });
    }

    Raw raw;
    std::unique_ptr<TlsChannel> channel;  ///< null: it is plain
    InTurn inTurn;
    std::function<void(Greeting)> onGreeting;
    bool toBeSealed = false, hasBegun = false, waitsForTurn = false, ready = false, flushing = false, ending = false;
    Bytes in, out;
    std::span<std::byte> room;
    Waits reading, writing;
    std::size_t written = 0;
    Error broken;
};

DoorStream::DoorStream(tcp::socket socket)
    : impl_(std::make_shared<Impl>(std::move(socket))), executor_(impl_->raw.get_executor()) {}

DoorStream::~DoorStream() {
    close();
}

DoorStream::Raw& DoorStream::raw() {
    return impl_->raw;
}

bool DoorStream::isSealed() const {
    return impl_->channel != nullptr;
}

void DoorStream::seal(std::shared_ptr<const TlsContext> keys, InTurn inTurn, std::function<void(Greeting)> then) {
    impl_->toBeSealed = true;
    impl_->channel = std::make_unique<TlsChannel>(std::move(keys), TlsChannel::Side::kAccepts);
    impl_->inTurn = std::move(inTurn);
    impl_->onGreeting = std::move(then);
    impl_->greet();
}

std::optional<Credential> DoorStream::peer(const TlsContext& keys) const {
    if (!impl_ || !impl_->ready || !impl_->channel->peer()) return std::nullopt;
    Credential peer = *impl_->channel->peer();
    if (peer.fault.empty()) peer.fault = impl_->channel->faultNow(keys);
    return peer;
}

std::string DoorStream::from() {
    Error gone;
    const boost::asio::ip::tcp::endpoint other = socket().remote_endpoint(gone);
    return gone ? std::string() : plainAddress(other.address().to_string());
}

void DoorStream::close() {
    if (impl_) impl_->raw.close();
}

TimePoint DoorStream::tookAt(TimePoint now) {
    // Of what the kernel has it asks for more only once it is rid of a good part.
    int unacknowledged = 0;
    (void)::ioctl(socket().native_handle(), SIOCOUTQ, &unacknowledged);
    const std::uint64_t took = progress().written - static_cast<std::uint64_t>(unacknowledged);
    if (took != took_) tookAt_ = now;
    took_ = took;
    return tookAt_;
}

bool DoorStream::waitsToBeRead() {
    Error ignored;
    return impl_->waitsForTurn || socket().available(ignored) > 0;
}

void DoorStream::endSending() {
    impl_->end();
}

void DoorStream::sayLast(std::string_view text, bool plain) {
    Error ignored;
    if (impl_->ready && !impl_->ending && !impl_->broken) {
        (void)impl_->channel->seal(std::as_bytes(std::span(text)));  // who cannot be told is hung up on all the same
        impl_->channel->end();
        impl_->ending = true;
        impl_->sayNow();
    } else if (plain && !isSealed()) {
        socket().non_blocking(true, ignored);
        socket().write_some(asio::buffer(text), ignored);
    }
    socket().shutdown(tcp::socket::shutdown_both, ignored);
}

void DoorStream::read(const Pieces<asio::mutable_buffer>& into, Waits waits) {
    if (!isSealed())
        return raw().async_read_some(
            into, [waits = std::move(waits)](Error error, std::size_t count) { waits->done(error, count); });
    const asio::mutable_buffer first = into.count > 0 ? into.room.front() : asio::mutable_buffer();
    impl_->read({static_cast<std::byte*>(first.data()), first.size()}, std::move(waits));
}

void DoorStream::write(const Pieces<asio::const_buffer>& from, Waits waits) {
    if (!isSealed())
        return raw().async_write_some(
            from, [waits = std::move(waits)](Error error, std::size_t count) { waits->done(error, count); });
    constexpr std::size_t kSealedAtOnce = std::size_t{64} << 10;
    // Header and content of a message are one record.
    Bytes bytes(std::min(asio::buffer_size(from), kSealedAtOnce));
    asio::buffer_copy(asio::buffer(bytes), from);
    impl_->write(bytes, std::move(waits));
}

void DoorStream::drain(Waits waits) {
    impl_->drain(std::move(waits));
}

}  // namespace tessera
