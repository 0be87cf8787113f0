/// What sealing a link costs, beside a plain one in the same run: bytes a second, round trips, handshakes. `--json
/// FILE`.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "common/base/Channel.h"
#include "common/net/TcpTransport.h"
#include "common/tls/Certificate.h"
#include "common/tls/KeyRing.h"

namespace {

using namespace tessera;
using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

double seconds(Clock::duration time) {
    return std::chrono::duration<double>(time).count();
}
double quantile(std::vector<double> values, double q) {
    std::ranges::sort(values);
    return values[std::min(values.size() - 1, static_cast<std::size_t>(q * static_cast<double>(values.size())))];
}

/// A transport whose events are waited for.
class End {
public:
    explicit End(CurrentKeys keys)
        : events_(1 << 16),
          transport_(limitsWith(std::move(keys)), [this](LinkEvent e) { events_.push(std::move(e)); }) {}
    Transport* operator->() { return &transport_; }
    template <typename What>
    What next() {
        for (;;) {
            auto event = events_.popFor(20s);
            if (!event) {
                fmt::print(stderr, "bench_sealed: an event did not come\n");
                std::exit(1);
            }
            if (auto* what = std::get_if<What>(&event->what)) return std::move(*what);
        }
    }

private:
    static TransportLimits limitsWith(CurrentKeys keys) {
        TransportLimits limits;
        limits.tls = std::move(keys);
        limits.maxPayload = [](std::uint16_t) { return std::size_t{256} << 20; };
        return limits;
    }
    Channel<LinkEvent> events_;
    TcpTransport transport_;
};

struct Keys {
    Keys() : authority(Authority::make("bench", std::chrono::system_clock::now())) {}
    CurrentKeys of(const Identity& holder) const {
        TlsKeys keys;
        keys.own = authority.issue(holder, {}, std::chrono::system_clock::now())->pem;
        keys.authority = authority.certificatePem();
        return *keysThatStay(std::move(keys));
    }
    CurrentKeys server() const { return of({.wall = "bench", .kind = Identity::Kind::kServer, .name = {}}); }
    CurrentKeys host() const { return of({.wall = "bench", .kind = Identity::Kind::kHost, .name = "a"}); }
    Authority authority;
};

/// Two ends that are connected.
struct Pair {
    Pair(CurrentKeys serverKeys, CurrentKeys clientKeys)
        : server(std::move(serverKeys)), client(std::move(clientKeys)), port(*server->listen({"127.0.0.1", 0})) {
        link = client->connect({"127.0.0.1", port}, 5s);
        client->send(link, 1, Epoch(1), ByteSlice());
        accepted = server.next<link_event::Received>().link;
    }
    End server, client;
    std::uint16_t port;
    LinkId link, accepted;
};

double mibPerSecond(Pair& pair, const SharedChain& payload) {
    constexpr int kTimes = 8;
    const Clock::time_point begin = Clock::now();
    for (int i = 0; i < kTimes; ++i) pair.server->send(pair.accepted, 2, Epoch(1), payload);
    for (int i = 0; i < kTimes; ++i) (void)pair.client.next<link_event::Received>();
    return kTimes * static_cast<double>(payload->size()) / (1 << 20) / seconds(Clock::now() - begin);
}

std::vector<double> roundTripsUs(Pair& pair) {
    const SharedChain small = share(ByteChain(share(Bytes(100))));
    std::vector<double> times;
    for (int i = 0; i < 3000; ++i) {
        const Clock::time_point begin = Clock::now();
        pair.client->send(pair.link, 3, Epoch(1), small);
        (void)pair.server.next<link_event::Received>();
        pair.server->send(pair.accepted, 3, Epoch(1), small);
        (void)pair.client.next<link_event::Received>();
        times.push_back(1e6 * seconds(Clock::now() - begin));
    }
    return times;
}

/// From `connect` to the first message at the other side. `client`: its keys, each time; the same context again
/// resumes.
std::vector<double> handshakesMs(const CurrentKeys& serverKeys, const std::function<CurrentKeys()>& client) {
    constexpr int kTimes = 400;
    End server(serverKeys);
    const std::uint16_t port = *server->listen({"127.0.0.1", 0});
    std::vector<double> times;
    for (int i = 0; i <= kTimes; ++i) {
        End end(client());
        const Clock::time_point begin = Clock::now();
        const LinkId link = end->connect({"127.0.0.1", port}, 5s);
        end->send(link, 1, Epoch(1), ByteSlice());
        const LinkId accepted = server.next<link_event::Received>().link;
        if (i > 0) times.push_back(1e3 * seconds(Clock::now() - begin));  // the first has no ticket
        server->send(accepted, 1, Epoch(1), ByteSlice());                 // behind the ticket
        (void)end.next<link_event::Received>();
    }
    return times;
}

}  // namespace

int main(int argc, char** argv) {
    const Keys keys;
    const CurrentKeys server = keys.server(), host = keys.host();
    nlohmann::json rows = nlohmann::json::array();
    {
        Pair plain(nullptr, nullptr), sealed(server, host);
        const SharedChain payload = share(ByteChain(share(Bytes(std::size_t{32} << 20))));
        std::vector<double> ratios, plains, seals;
        for (int round = 0; round < 9; ++round) {
            plains.push_back(mibPerSecond(plain, payload));
            seals.push_back(mibPerSecond(sealed, payload));
            ratios.push_back(seals.back() / plains.back());
        }
        rows.push_back({{"row", "bytes"},
                        {"plain_mib_s", quantile(plains, 0.5)},
                        {"sealed_mib_s", quantile(seals, 0.5)},
                        {"ratio", quantile(ratios, 0.5)},
                        {"at_least", 0.3}});
        const std::vector<double> a = roundTripsUs(plain), b = roundTripsUs(sealed);
        rows.push_back({{"row", "round trip"},
                        {"plain_us", quantile(a, 0.5)},
                        {"sealed_us", quantile(b, 0.5)},
                        {"ratio", quantile(b, 0.5) / quantile(a, 0.5)}});
    }
    const auto handshake = [&](const char* name, const std::vector<double>& times) {
        rows.push_back({{"row", name}, {"p50_ms", quantile(times, 0.5)}, {"p99_ms", quantile(times, 0.99)}});
    };
    handshake("connection, plain", handshakesMs(nullptr, [] { return CurrentKeys(); }));
    handshake("connection, whole handshake", handshakesMs(server, [&] { return keys.host(); }));
    handshake("connection, resumed (p99 at most 20)", handshakesMs(server, [&] { return host; }));
    for (const nlohmann::json& row : rows) fmt::print("{}\n", row.dump());
    if (argc == 3 && std::string(argv[1]) == "--json") std::ofstream(argv[2]) << rows.dump(1) << "\n";
    return 0;
}
