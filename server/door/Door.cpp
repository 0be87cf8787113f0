#include "server/door/Door.h"

#include <fmt/format.h>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>

#include <algorithm>
#include <array>
#include <exception>
#include <thread>

#include "server/door/DoorContext.h"
#include "server/door/HttpSession.h"

namespace tessera {

using boost::asio::ip::tcp;
using namespace std::chrono_literals;

namespace {

/// One of this machine's, by which others reach it; empty: it has none.
std::string addressForOthers() {
    ifaddrs* all = nullptr;
    if (::getifaddrs(&all) != 0) return {};
    const std::unique_ptr<ifaddrs, void (*)(ifaddrs*)> keep(all, &::freeifaddrs);
    for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
        if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET || (one->ifa_flags & IFF_LOOPBACK) != 0)
            continue;
        std::array<char, INET_ADDRSTRLEN> text{};
        const in_addr& number = reinterpret_cast<const sockaddr_in*>(one->ifa_addr)->sin_addr;
        if (::inet_ntop(AF_INET, &number, text.data(), text.size()) != nullptr) return text.data();
    }
    return {};
}

/// By which name a link leads to a door: of one that listens everywhere the first that is in its certificate.
Address addressInLink(const Address& bound, const DoorReach& reach) {
    if (bound.host != "0.0.0.0" && bound.host != "::") return bound;
    const std::shared_ptr<const TlsContext> keys = reach.keys ? reach.keys() : nullptr;
    if (keys && keys->own())
        for (const std::string& name : keys->own()->names)
            if (const Address said{name, bound.port}; !said.isLoopback()) return said;
    const std::string host = addressForOthers();
    return {host.empty() ? "127.0.0.1" : host, bound.port};
}

}  // namespace

struct Door::Impl {
    explicit Impl(const DoorOptions& options, std::uint16_t port)
        : context(options, port), acceptor(context.io), pause(context.io), keysClock(context.io) {}

    void accept() {
        acceptor.async_accept([this](boost::system::error_code error, tcp::socket socket) {
            if (over || error == boost::asio::error::operation_aborted) return;
            if (!error) return admit(std::move(socket));
            // Where no descriptor is left, whoever came waits in the backlog for one of somebody silent.
            const bool crowded = error == boost::asio::error::no_descriptors && !context.silent.empty();
            later(crowded ? makeRoom() : std::chrono::steady_clock::now() + 50ms, [this] { accept(); });
        });
    }
    /// Whoever means it says so at once: of too many the one that has been silent for longest goes.
    void admit(tcp::socket socket) {
        if (context.guests.size() < context.limits.maxConnections) {
            startHttpSession(std::move(socket), context);
            return accept();
        }
        if (context.silent.empty()) {
            DoorStream stream(std::move(socket));
            sayTooMany(stream, context);
            return accept();
        }
        const auto held = std::make_shared<tcp::socket>(std::move(socket));
        later(makeRoom(), [this, held] { admit(std::move(*held)); });
    }
    /// When to look for room again.
    TimePoint makeRoom() {
        Guest* const oldest = context.silent.front();
        const TimePoint now = std::chrono::steady_clock::now();
        if (oldest->waitsToBeRead()) {
            oldest->since = now;
            context.silent.splice(context.silent.end(), context.silent, context.silent.begin());
        } else if (oldest->since + context.limits.patience <= now) {
            context.silent.pop_front();
            oldest->giveWay();  // it is gone once its reader has heard of it
            return now;
        }
        return context.silent.front()->since + context.limits.patience;
    }
    void watchKeys() {
        keysClock.expires_after(context.options.reach.look);
        keysClock.async_wait([this](boost::system::error_code stopped) {
            if (stopped || over) return;  // a look that was due when it was cancelled comes all the same
            context.judgeAgain();
            watchKeys();
        });
    }
    template <typename F>
    void later(TimePoint due, F f) {
        pause.expires_at(due);
        pause.async_wait([this, f = std::move(f)](boost::system::error_code stopped) {
            if (!stopped && !over) f();  // as above: nobody is admitted, or waited for, at a port that is closed
        });
    }

    DoorContext context;
    tcp::acceptor acceptor;
    boost::asio::steady_timer pause, keysClock;
    Address bound;
    bool over = false;  ///< on the door's thread
    std::thread thread;
};

Door::Door(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Expected<std::unique_ptr<Door>> Door::open(const DoorOptions& options) {
    if (!options.listen.isLoopback() && !options.reach.keys && !options.reach.open)
        return fail(ErrorCode::kUsage, fmt::format("--console {}: without keys the console opens on this machine "
                                                   "alone (127.0.0.1:PORT)",
                                                   toString(options.listen)));
    const std::string host = options.listen.host == "localhost" ? "127.0.0.1" : options.listen.host;
    boost::system::error_code error;
    const auto address = boost::asio::ip::make_address(host, error);
    boost::asio::io_context probe;
    tcp::acceptor acceptor(probe);
    const tcp::endpoint wanted(address, options.listen.port);
    // Bound before the rest is made: who checks what comes in has to know the port.
    if (!error) acceptor.open(wanted.protocol(), error);
    if (!error) acceptor.set_option(tcp::acceptor::reuse_address(wanted.port() != 0), error);
    if (!error) acceptor.bind(wanted, error);
    if (!error) acceptor.listen(tcp::acceptor::max_listen_connections, error);
    if (!error) acceptor.set_option(tcp::acceptor::reuse_address(true), error);  // Transport.cpp says why only now
    if (error)
        return fail(ErrorCode::kNetwork,
                    fmt::format("the console cannot listen on {}: {}", toString(options.listen), error.message()));
    const tcp::endpoint bound = acceptor.local_endpoint(error);
    auto impl = std::make_unique<Impl>(options, bound.port());
    const int descriptor = acceptor.release(error);
    impl->acceptor.assign(bound.protocol(), descriptor, error);
    impl->bound = {bound.address().to_string(), bound.port()};
    impl->accept();
    if (options.reach.keys) impl->watchKeys();
    impl->thread = std::thread([raw = impl.get()] {
        standBehindFrames();
        // What the library throws of what a guest has said ends that guest, whom nobody holds then, and not the wall.
        for (bool over = false; !over;) try {
                raw->context.io.run();
                over = true;
            } catch (const std::exception&) {
            }
    });
    return std::unique_ptr<Door>(new Door(std::move(impl)));
}

Door::~Door() {
    boost::asio::post(impl_->context.io, [impl = impl_.get()] {
        boost::system::error_code ignored;
        impl->acceptor.close(ignored);
        impl->pause.cancel();
        impl->over = true;
        impl->keysClock.cancel();
        impl->context.sendAllAway();
    });
    impl_->thread.join();
    impl_->context.pictures.finish();
    impl_->context.beside.finish();
    impl_->context.io.restart();
    impl_->context.io.poll();
}

const Address& Door::address() const {
    return impl_->bound;
}

std::string Door::link() const {
    const DoorOptions& options = impl_->context.options;
    const std::string place = toString(addressInLink(impl_->bound, options.reach));
    const std::string& token = options.tokens.of(Role::kOperator);
    if (!options.reach.keys) return fmt::format("http://{}/?token={}", place, token);
    return fmt::format("https://{}/?token={}&authority={}", place, token,
                       options.reach.keys()->authorityFingerprint());
}

}  // namespace tessera
