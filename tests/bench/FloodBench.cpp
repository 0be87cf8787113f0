/// Who comes in while one address floods a door with connections that begin a handshake (TLS 1.3), and how long it
/// takes. `--json FILE`, `--rate N` connections a second, `--tries N`, `--only TEXT`; `--at HOST:PORT --seconds N`:
/// floods that port alone, with those that wait, for a look at frames.
#include <fmt/format.h>

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <fstream>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>

#include "common/base/Channel.h"
#include "common/net/TcpTransport.h"
#include "common/tls/Certificate.h"
#include "common/tls/KeyRing.h"
#include "common/tls/TlsChannel.h"
#include "server/door/Door.h"
#include "tests/unit/door/SealedPeer.h"

namespace {

using namespace tessera;
using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kDeadline = 5s;

double milliseconds(Clock::duration time) {
    return std::chrono::duration<double, std::milli>(time).count();
}
double quantile(std::vector<double> values, double q) {
    if (values.empty()) return 0;
    std::ranges::sort(values);
    return values[std::min(values.size() - 1, static_cast<std::size_t>(q * static_cast<double>(values.size())))];
}

struct Keys {
    Keys() : authority(Authority::make("bench", std::chrono::system_clock::now())) {}
    CurrentKeys of(const Identity& holder) const {
        TlsKeys keys;
        keys.own = authority.issue(holder, {"127.0.0.1"}, std::chrono::system_clock::now())->pem;
        keys.authority = authority.certificatePem();
        return *keysThatStay(std::move(keys));
    }
    CurrentKeys server() const { return of({.wall = "bench", .kind = Identity::Kind::kServer, .name = {}}); }
    CurrentKeys host() const { return of({.wall = "bench", .kind = Identity::Kind::kHost, .name = "a"}); }
    /// Of somebody who knows the wall by its link alone.
    std::shared_ptr<const TlsContext> stranger() const {
        TlsKeys keys;
        keys.pinned = authority.certificate().fingerprint;
        return *TlsContext::make(std::move(keys));
    }
    Authority authority;
};

enum class Deed {
    kNothing,
    kStaysSilent,  ///< connects, and no more
    kResets,       ///< says hello, and resets the connection
    kWaits,        ///< says hello, and nothing after it
    kGoesOn,       ///< makes a whole handshake, and says nothing after it
};

/// One address' flood, by a thread of its own, until it is destroyed.
class Flood {
public:
    Flood(const Keys& keys, Deed deed, const std::string& from, const Address& to, double perSecond)
        : keys_(keys.stranger()), deed_(deed), perSecond_(perSecond) {
        from_.sin_family = to_.sin_family = AF_INET;
        to_.sin_port = htons(to.port);
        inet_pton(AF_INET, from.c_str(), &from_.sin_addr);
        inet_pton(AF_INET, to.host.c_str(), &to_.sin_addr);
        if (deed != Deed::kNothing) thread_ = std::thread([this] { run(); });
    }
    ~Flood() {
        over_ = true;
        if (thread_.joinable()) thread_.join();
    }
    /// So far.
    [[nodiscard]] std::size_t count() const { return count_; }

private:
    static constexpr std::size_t kMostOpen = 4000;  // above it the oldest is closed here

    struct Line {
        int socket;
        std::unique_ptr<TlsChannel> channel;
    };

    void run() {
        TlsChannel first(keys_, TlsChannel::Side::kDials);
        (void)first.shake();
        hello_ = first.outgoing();
        const Clock::time_point begin = Clock::now();
        while (!over_) {
            const auto due = static_cast<std::size_t>(perSecond_ * milliseconds(Clock::now() - begin) / 1e3);
            for (int burst = 0; count_ < due && burst < 100; ++burst) come();
            if (deed_ == Deed::kGoesOn) goOn();
            while (open_.size() > kMostOpen) {
                ::close(open_.front().socket);
                open_.pop_front();
            }
            std::this_thread::sleep_for(500us);
        }
        for (const Line& line : open_) ::close(line.socket);
    }
    void come() {
        const int one = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
        if (one < 0) return;
        const int yes = 1;
        ::setsockopt(one, IPPROTO_IP, IP_BIND_ADDRESS_NO_PORT, &yes, sizeof yes);
        ::bind(one, reinterpret_cast<const sockaddr*>(&from_), sizeof from_);
        // Over loopback it is connected at once, or its first packet was not taken.
        const bool connected =
            ::connect(one, reinterpret_cast<const sockaddr*>(&to_), sizeof to_) == 0 || errno == EINPROGRESS;
        ++count_;
        Line line{one, nullptr};
        if (connected && deed_ == Deed::kGoesOn) {
            line.channel = std::make_unique<TlsChannel>(keys_, TlsChannel::Side::kDials);
            (void)line.channel->shake();
            push(line);
        } else if (connected && deed_ != Deed::kStaysSilent) {
            (void)!::send(one, hello_.data(), hello_.size(), MSG_NOSIGNAL);
        }
        if (deed_ == Deed::kResets) {
            const linger now{1, 0};
            ::setsockopt(one, SOL_SOCKET, SO_LINGER, &now, sizeof now);
            ::close(one);
            return;
        }
        open_.push_back(std::move(line));
    }
    static void push(Line& line) {
        Bytes& out = line.channel->outgoing();
        (void)!::send(line.socket, out.data(), out.size(), MSG_NOSIGNAL);
        out.clear();
    }
    void goOn() {
        for (Line& line : open_) {
            std::array<std::byte, 4096> wire;
            if (line.channel->ready()) continue;
            const ssize_t count = ::recv(line.socket, wire.data(), wire.size(), 0);
            if (count <= 0) continue;
            line.channel->arrived(ByteSpan(wire).first(static_cast<std::size_t>(count)));
            (void)line.channel->shake();
            line.channel->keep();
            push(line);
        }
    }

    std::shared_ptr<const TlsContext> keys_;
    Deed deed_;
    double perSecond_;
    sockaddr_in from_{}, to_{};
    Bytes hello_;
    std::deque<Line> open_;
    std::atomic<std::size_t> count_{0};
    std::atomic<bool> over_{false};
    std::thread thread_;
};

TransportLimits limitsWith(CurrentKeys keys) {
    TransportLimits limits;
    limits.tls = std::move(keys);
    limits.maxPayload = [](std::uint16_t) { return std::size_t{1} << 20; };
    return limits;
}

/// Milliseconds from connecting to the first answer; none: it was not let in.
using Try = std::function<std::optional<double>()>;

/// A listener that sends back what it hears.
class EchoingServer {
public:
    explicit EchoingServer(CurrentKeys keys)
        : transport_(limitsWith(std::move(keys)), [this](LinkEvent event) {
              if (const auto* came = std::get_if<link_event::Received>(&event.what))
                  transport_.send(came->link, 2, Epoch(1), came->payload);
          }) {}
    std::uint16_t listen() { return *transport_.listen({"127.0.0.1", 0}); }

private:
    TcpTransport transport_;
};

std::optional<double> tryLink(const CurrentKeys& keys, std::uint16_t port) {
    Channel<LinkEvent> events(100);
    TcpTransport client(limitsWith(keys), [&](LinkEvent event) { events.push(std::move(event)); });
    const Clock::time_point begin = Clock::now();
    const LinkId link = client.connect({"127.0.0.1", port}, kDeadline);
    client.send(link, 1, Epoch(1), ByteSlice(Bytes(10)));
    while (Clock::now() < begin + kDeadline) {
        const auto event = events.popFor(10ms);
        if (event && std::holds_alternative<link_event::Closed>(event->what)) break;
        if (event && std::holds_alternative<link_event::Received>(event->what)) {
            events.close();
            return milliseconds(Clock::now() - begin);
        }
    }
    events.close();
    return std::nullopt;
}

std::optional<double> tryDoor(const std::shared_ptr<const TlsContext>& keys, const std::string& token,
                              std::uint16_t port) {
    const Clock::time_point begin = Clock::now();
    test::SealedPeer peer(port, keys);
    if (!peer.ready()) return std::nullopt;
    peer.say(fmt::format("GET /api HTTP/1.1\r\nHost: 127.0.0.1:{}\r\nAuthorization: Bearer {}\r\n\r\n", port, token));
    const bool came = peer.hear("GetStatus", kDeadline).starts_with("HTTP/1.1 200 ");
    if (!came || Clock::now() > begin + kDeadline) return std::nullopt;
    return milliseconds(Clock::now() - begin);
}

struct Options {
    double rate = 2700;
    int tries = 60;
    std::string only, json, at;
    int seconds = 10;
};

nlohmann::json rowOf(const std::string& name, const Options& options, Flood& flood, const Try& come) {
    std::this_thread::sleep_for(1s);  // until the flood is what it will be
    const Clock::time_point begin = Clock::now();
    const std::size_t before = flood.count();
    std::vector<double> times;
    for (int i = 0; i < options.tries; ++i) {
        if (const auto took = come()) times.push_back(*took);
        std::this_thread::sleep_for(20ms);
    }
    const double seconds = milliseconds(Clock::now() - begin) / 1e3;
    return {{"row", name},
            {"tried", options.tries},
            {"came_in", times.size()},
            {"p50_ms", times.empty() ? nlohmann::json() : nlohmann::json(quantile(times, 0.5))},
            {"max_ms", times.empty() ? nlohmann::json() : nlohmann::json(quantile(times, 1))},
            {"flood_per_s", static_cast<double>(flood.count() - before) / seconds}};
}

Options readOptions(int argc, char** argv) {
    Options options;
    for (int i = 1; i + 1 < argc; i += 2) {
        const std::string name = argv[i], value = argv[i + 1];
        if (name == "--rate") options.rate = std::stod(value);
        if (name == "--tries") options.tries = std::stoi(value);
        if (name == "--only") options.only = value;
        if (name == "--json") options.json = value;
        if (name == "--at") options.at = value;
        if (name == "--seconds") options.seconds = std::stoi(value);
    }
    return options;
}

}  // namespace

int main(int argc, char** argv) {
    ::setvbuf(stdout, nullptr, _IOLBF, 0);
    const Options options = readOptions(argc, argv);
    rlimit descriptors{};
    ::getrlimit(RLIMIT_NOFILE, &descriptors);
    descriptors.rlim_cur = descriptors.rlim_max;
    ::setrlimit(RLIMIT_NOFILE, &descriptors);
    const Keys keys;
    if (!options.at.empty()) {
        const Flood flood(keys, Deed::kWaits, "127.0.0.1", *parseAddress(options.at), options.rate);
        std::this_thread::sleep_for(std::chrono::seconds(options.seconds));
        fmt::print("{} connections in {} s\n", flood.count(), options.seconds);
        return 0;
    }
    const CurrentKeys server = keys.server();
    const AccessTokens tokens = AccessTokens::fresh();
    nlohmann::json rows = nlohmann::json::array();
    const std::array<std::pair<Deed, std::string>, 5> deeds{{{Deed::kNothing, "no flood"},
                                                             {Deed::kStaysSilent, "says nothing"},
                                                             {Deed::kResets, "hello, and resets"},
                                                             {Deed::kWaits, "hello, and waits"},
                                                             {Deed::kGoesOn, "whole handshake"}}};
    for (const bool door : {false, true})
        for (const std::string from : {"127.0.0.2", "127.0.0.1"})
            for (const auto& [deed, words] : deeds) {
                if (deed == Deed::kNothing && from != "127.0.0.1") continue;
                const std::string name = fmt::format("{}, {}, from {} address", door ? "door" : "link", words,
                                                     from == "127.0.0.1" ? "the same" : "another");
                if (name.find(options.only) == std::string::npos) continue;
                EchoingServer echoing(server);
                const auto opened = Door::open({.listen = {"127.0.0.1", 0},
                                                .server = {"127.0.0.1", 1},
                                                .wall = "bench",
                                                .tokens = tokens,
                                                .reach = {.keys = server}});
                const std::uint16_t port = door ? (*opened)->address().port : echoing.listen();
                Flood flood(keys, deed, from, {"127.0.0.1", port}, options.rate);
                const Try come = door ? Try([&] { return tryDoor(keys.stranger(), tokens.of(Role::kViewer), port); })
                                      : Try([&] { return tryLink(keys.host(), port); });
                rows.push_back(rowOf(name, options, flood, come));
                fmt::print("{}\n", rows.back().dump());
            }
    if (!options.json.empty()) std::ofstream(options.json) << rows.dump(1) << "\n";
    return 0;
}
