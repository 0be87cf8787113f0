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
        : context(options, port),
          acceptor(context.io),
          pause(context.io),
          entrance(context.io),
          judgeClock(context.io) {
        context.onRoom = [this] { look(); };
    }

    void accept() {
        acceptor.async_accept([this](boost::system::error_code error, tcp::socket socket) {
            if (over || error == boost::asio::error::operation_aborted) return;
            if (!error) {
                come(std::move(socket));
                acceptMore();
                return accept();
            }
            // Where no descriptor is left, whoever came waits in the backlog for one of somebody silent.
            TimePoint due = std::chrono::steady_clock::now() + 50ms;
            if (error == boost::asio::error::no_descriptors && !waiting.empty()) {
                refuseOne();
                due = std::chrono::steady_clock::now();
            } else if (error == boost::asio::error::no_descriptors && !context.silent.empty()) {
                due = makeRoom();
            }
            pause.expires_at(due);
            pause.async_wait([this](boost::system::error_code stopped) {
                if (!stopped && !over) accept();  // nobody is waited for at a port that is closed
            });
        });
    }
    /// Between two handshakes more may come than one: they would wait in the backlog.
    void acceptMore() {
        constexpr int kAtOnce = 64;
        for (int i = 0; i < kAtOnce; ++i) {
            boost::system::error_code error;
            tcp::socket socket(context.io);
            acceptor.accept(socket, error);
            if (error) return;  // nobody is there, or `accept` says what is wrong
            come(std::move(socket));
        }
    }
    /// As common/net/TcpTransportImpl.h does it, which says why.
    void come(tcp::socket socket) {
        boost::system::error_code error;
        const tcp::endpoint peer = socket.remote_endpoint(error);
        if (error) return;
        const SourceAddress from = sourceOf(*peer.data());
        if (waiting.countOf(from) == 0 && hasRoomFor(from)) return startHttpSession(std::move(socket), from, context);
        waiting.add(from, std::move(socket));
        if (waiting.size() > context.limits.maxConnections) refuseOne();
        look();
    }
    bool hasRoomFor(SourceAddress from) {
        while (context.full() && !context.silent.empty()) {
            const auto goes = context.silent.givesWayTo(from, std::chrono::steady_clock::now(), kWaitsForUs);
            if (!goes) return false;
            sendAway(**goes);
        }
        return !context.full();
    }
    void letIn() {
        while (!waiting.empty() && hasRoomFor(waiting.turn())) {
            const SourceAddress from = waiting.turn();
            startHttpSession(waiting.takeTurn(), from, context);
        }
        // All have shown their tokens: nobody will give way.
        while (!waiting.empty() && context.silent.empty()) refuseOne();
        look();
    }
    void look() {
        if (waiting.empty() || over) return;
        const bool now = context.silent.empty() || !context.full();
        entrance.expires_at(now ? std::chrono::steady_clock::now() : context.silent.due());
        entrance.async_wait([this](boost::system::error_code stopped) {
            if (!stopped && !over) letIn();
        });
    }
    void refuseOne() {
        DoorStream stream(waiting.takeOldestOfCrowd());
        sayTooMany(stream, context);
    }
    void sendAway(Guest& guest) {
        context.isKnown(guest);
        guest.gone = true;
        ++context.gone;
        guest.giveWay();  // it is no more once its reader has heard of it
    }
    /// When to look for room again.
    TimePoint makeRoom() {
        const TimePoint now = std::chrono::steady_clock::now();
        const auto goes = context.silent.givesWay(now, kWaitsForUs);
        if (!goes) return context.silent.due();
        sendAway(**goes);
        return now;
    }
    void judgeOften() {
        judgeClock.expires_after(context.options.reach.look);
        judgeClock.async_wait([this](boost::system::error_code stopped) {
            if (stopped || over) return;  // a look that was due when it was cancelled comes all the same
            context.judgeAgain();
            judgeOften();
        });
    }
    static constexpr auto kWaitsForUs = [](Guest* guest) { return guest->waitsToBeRead(); };

    DoorContext context;
    SourceRows<tcp::socket> waiting;  ///< there is no room for them yet
    tcp::acceptor acceptor;
    boost::asio::steady_timer pause, entrance, judgeClock;
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
    boost::asio::io_context probe;
    tcp::acceptor acceptor(probe);
    tcp::endpoint wanted(boost::asio::ip::make_address(host, error), options.listen.port);
    if (error) {  // a name
        const auto found = tcp::resolver(probe).resolve(host, std::to_string(options.listen.port), error);
        if (!error) wanted = found.begin()->endpoint();
    }
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
    impl->acceptor.non_blocking(true, error);
    impl->bound = {bound.address().to_string(), bound.port()};
    impl->accept();
    impl->judgeOften();
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
        impl->entrance.cancel();
        impl->over = true;
        impl->waiting = {};
        impl->judgeClock.cancel();
        impl->context.sendAllAway();
    });
    impl_->thread.join();
    impl_->context.pictures.finish();
    impl_->context.beside.finish();
    impl_->context.copies.finish();
    impl_->context.disk->finish();
    impl_->context.io.restart();
    impl_->context.io.poll();
}

void Door::renew(AccessTokens tokens, std::vector<DoorPanel> panels) {
    boost::asio::post(impl_->context.io,
                      [impl = impl_.get(), tokens = std::move(tokens), panels = std::move(panels)]() mutable {
                          impl->context.options.panels = panels;
                          impl->context.gate.renew(std::move(tokens), std::move(panels));
                      });
}

const Address& Door::address() const {
    return impl_->bound;
}

std::string Door::linkWith(const std::string& token) const {
    const DoorOptions& options = impl_->context.options;
    const std::string place = toString(addressInLink(impl_->bound, options.reach));
    if (!options.reach.keys) return fmt::format("http://{}/?token={}", place, token);
    return fmt::format("https://{}/?token={}&authority={}", place, token, options.reach.keys()->authorityFingerprint());
}

}  // namespace tessera
