/// What a frame of the cluster costs when drawing costs nothing: Tessera's session, codec and transport against a bare
/// epoll barrier over TCP, as many processes, in the same run, in turns.
///
/// A round is Begin to everybody, Ready from everybody, Swap to everybody. The bare side sends 64 bytes a message and
/// nothing else: no heartbeats, no checks, no statistics.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <signal.h>
#include <sys/epoll.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "common/base/Channel.h"
#include "common/codec/MessageCodec.h"
#include "common/session/ClientSession.h"
#include "server/sim/peers/Peers.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

std::int64_t nowNs() {
    return Clock::now().time_since_epoch() / 1ns;
}

struct Samples {
    std::vector<double> roundUs, spreadUs;
    static double quantile(std::vector<double> values, double share) {
        if (values.empty()) return 0;
        std::ranges::sort(values);
        return values[std::min(values.size() - 1,
                               static_cast<std::size_t>(share * static_cast<double>(values.size())))];
    }
};

// ---- the bare barrier ----------------------------------------------------------------------------------------------

struct Packet {
    std::int64_t shownAtNs = 0;
    char rest[56] = {};
};

void readAll(int socket, void* data, std::size_t size) {
    for (char* at = static_cast<char*>(data); size > 0;) {
        const ssize_t n = read(socket, at, size);
        if (n <= 0) _exit(0);
        at += n;
        size -= static_cast<std::size_t>(n);
    }
}

[[noreturn]] void bareClient(std::uint16_t port) {
    const int s = socket(AF_INET, SOCK_STREAM, 0);
    const int one = 1;
    setsockopt(s, IPPROTO_TCP, TCP_NODELAY, &one, sizeof one);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(port);
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (connect(s, reinterpret_cast<sockaddr*>(&to), sizeof to) != 0) _exit(1);
    Packet packet;
    std::int64_t shown = 0;
    for (;;) {
        readAll(s, &packet, sizeof packet);  // Begin
        packet.shownAtNs = shown;
        if (write(s, &packet, sizeof packet) != sizeof packet) _exit(0);  // Ready
        readAll(s, &packet, sizeof packet);                               // Swap
        shown = nowNs();
    }
}

class BareBarrier {
public:
    explicit BareBarrier(int hosts) {
        listener_ = socket(AF_INET, SOCK_STREAM, 0);
        sockaddr_in at{};
        at.sin_family = AF_INET;
        at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        if (bind(listener_, reinterpret_cast<sockaddr*>(&at), sizeof at) != 0 || listen(listener_, hosts) != 0)
            std::abort();
        socklen_t size = sizeof at;
        getsockname(listener_, reinterpret_cast<sockaddr*>(&at), &size);
        epoll_ = epoll_create1(0);
        for (int i = 0; i < hosts; ++i) {
            const pid_t pid = fork();
            if (pid == 0) {
                prctl(PR_SET_PDEATHSIG, SIGKILL);
                bareClient(ntohs(at.sin_port));
            }
            pids_.push_back(pid);
            const int s = accept(listener_, nullptr, nullptr);
            const int one = 1;
            setsockopt(s, IPPROTO_TCP, TCP_NODELAY, &one, sizeof one);
            epoll_event event{.events = EPOLLIN, .data = {.fd = s}};
            epoll_ctl(epoll_, EPOLL_CTL_ADD, s, &event);
            sockets_.push_back(s);
        }
    }
    ~BareBarrier() {
        for (const int s : sockets_) close(s);
        for (const pid_t pid : pids_) waitpid(pid, nullptr, 0);
        close(listener_);
        close(epoll_);
    }
    void rounds(int count, Samples& samples) {
        for (int round = 0; round < count; ++round) {
            const auto begin = Clock::now();
            Packet packet;
            for (const int s : sockets_)
                if (write(s, &packet, sizeof packet) < 0) std::abort();
            std::int64_t first = 0, last = 0;
            for (std::size_t waiting = sockets_.size(); waiting > 0;) {
                epoll_event events[64];
                const int n = epoll_wait(epoll_, events, 64, -1);
                for (int i = 0; i < n; ++i, --waiting) {
                    readAll(events[i].data.fd, &packet, sizeof packet);
                    first = first == 0 ? packet.shownAtNs : std::min(first, packet.shownAtNs);
                    last = std::max(last, packet.shownAtNs);
                }
            }
            for (const int s : sockets_)
                if (write(s, &packet, sizeof packet) < 0) std::abort();
            samples.roundUs.push_back(std::chrono::duration<double, std::micro>(Clock::now() - begin).count());
            if (round > 0) samples.spreadUs.push_back(static_cast<double>(last - first) * 1e-3);
        }
    }

private:
    int listener_ = -1, epoll_ = -1;
    std::vector<int> sockets_;
    std::vector<pid_t> pids_;
};

// ---- ours ----------------------------------------------------------------------------------------------------------

/// A render host without a picture: everything but drawing.
[[noreturn]] void ourClient(std::uint16_t port, const std::string& name) {
    Channel<LinkEvent> inbox(4096);
    TcpTransport transport({.maxPayload = maxPayloadBytes}, [&](LinkEvent event) { inbox.push(std::move(event)); });
    ClientSession session({.name = name});
    const Address address{.host = "127.0.0.1", .port = port};
    std::map<LinkId, ChannelKind> kinds;
    std::map<ChannelKind, LinkId> links;
    Epoch epoch;
    const auto dial = [&](ChannelKind kind) {
        const LinkId link = transport.connect(address, 5s);
        kinds[link] = kind;
        links[kind] = link;
    };
    const std::function<void(ClientActions)> carryOut = [&](ClientActions actions) {
        for (ClientAction& action : actions) {
            if (auto* send = std::get_if<client_action::Send>(&action)) {
                transport.send(links[send->channel], wireType(send->message), epoch,
                               share(encodeMessage(send->message)));
            } else if (std::holds_alternative<client_action::OpenBulk>(action)) {
                dial(ChannelKind::kBulk);
            } else if (auto* configured = std::get_if<client_action::Configured>(&action)) {
                epoch = configured->epoch;
            } else if (auto* snapshot = std::get_if<client_action::ApplySnapshot>(&action)) {
                carryOut(session.applied(snapshot->snapshot.list->sequence, snapshot->snapshot.list->stateHash));
            } else if (auto* draw = std::get_if<client_action::Draw>(&action)) {
                carryOut(session.drawn(draw->begin.frame, draw->begin.list->stateHash, nullptr));
            } else if (auto* show = std::get_if<client_action::Show>(&action)) {
                carryOut(session.shown(show->frame, Clock::now()));
            } else if (std::holds_alternative<client_action::Finish>(action) ||
                       std::holds_alternative<client_action::Disconnect>(action)) {
                std::_Exit(0);
            }
        }
    };
    dial(ChannelKind::kControl);
    for (;;) {
        const Duration wait = std::max<Duration>(session.nextDeadline() - Clock::now(), Duration{0});
        const std::optional<LinkEvent> event = inbox.popFor(std::min<Duration>(wait, 100ms));
        if (!event) {
            carryOut(session.advance(Clock::now()));
            continue;
        }
        if (const auto* opened = std::get_if<link_event::Opened>(&event->what)) {
            carryOut(session.channelOpened(kinds[opened->link], event->at));
        } else if (const auto* received = std::get_if<link_event::Received>(&event->what)) {
            const Expected<Message> message = decodeMessage(received->type, received->payload);
            if (!message) std::_Exit(1);
            carryOut(session.received(kinds[received->link], received->epoch, *message, event->at));
        } else {
            carryOut(session.channelClosed(kinds[std::get<link_event::Closed>(event->what).link], event->at));
        }
    }
}

class OurBarrier {
public:
    explicit OurBarrier(int hosts) {
        ServerSessionConfig config;
        for (int i = 0; i < hosts; ++i) config.hosts.push_back("host" + std::to_string(i));
        config.sync.lostAfter = 5s;
        int ports[2];
        if (pipe(ports) != 0) std::abort();
        // Children first: a process with threads must not fork.
        for (const std::string& name : config.hosts) {
            const pid_t pid = fork();
            if (pid == 0) {
                prctl(PR_SET_PDEATHSIG, SIGKILL);
                close(ports[1]);
                std::uint16_t port = 0;
                readAll(ports[0], &port, sizeof port);
                ourClient(port, name);
            }
            pids_.push_back(pid);
        }
        peers_ = std::make_unique<Peers>(
            config, blobs_, [this](LinkEvent event) { inbox_.push(std::move(event)); }, Platform());
        const std::uint16_t port = peers_->listen({.host = "127.0.0.1", .port = 0}).value();
        for (int i = 0; i < hosts; ++i)
            if (write(ports[1], &port, sizeof port) < 0) std::abort();
        close(ports[0]);
        close(ports[1]);
        while (!peers_->session().mayBegin(Clock::now())) turn(nullptr);
    }
    ~OurBarrier() {
        (void)peers_->perform(peers_->session().finish("done"));
        for (const pid_t pid : pids_) waitpid(pid, nullptr, 0);
        inbox_.close();
    }
    void rounds(int count, Samples& samples) {
        for (int round = 0; round < count; ++round) {
            const auto begin = Clock::now();
            released_ = false;
            take(peers_->perform(peers_->session().beginFrame(
                     {.frame = peers_->session().nextFrame(), .payload = payload_}, begin)),
                 &samples);
            while (!released_) turn(&samples);
            samples.roundUs.push_back(std::chrono::duration<double, std::micro>(Clock::now() - begin).count());
        }
    }

private:
    void turn(Samples* samples) {
        if (const std::optional<LinkEvent> event = inbox_.popFor(20ms)) take(peers_->handle(*event), samples);
        if (Clock::now() >= peers_->session().nextDeadline()) take(peers_->advance(Clock::now()), samples);
    }
    void take(ServerActions actions, Samples* samples) {
        for (ServerAction& action : actions) {
            if (const auto* wanted = std::get_if<server_action::SnapshotWanted>(&action)) {
                take(peers_->perform(peers_->session().snapshotReady(wanted->connection, {}, Clock::now())), samples);
            } else if (std::holds_alternative<server_action::FrameReleased>(action)) {
                released_ = true;
            } else if (const auto* shown = std::get_if<server_action::FrameShown>(&action)) {
                auto& instants = shownAt_[shown->frame];
                instants.push_back(shown->shownAtNs);
                if (samples && instants.size() == pids_.size()) {
                    const auto [low, high] = std::ranges::minmax(instants);
                    samples->spreadUs.push_back(static_cast<double>(high - low) * 1e-3);
                    shownAt_.erase(shown->frame);
                }
            }
        }
    }
    Channel<LinkEvent> inbox_{4096};
    BlobStore blobs_;
    SharedBytes payload_ = share(Bytes(64));
    std::vector<pid_t> pids_;
    bool released_ = false;
    std::map<FrameNumber, std::vector<std::int64_t>> shownAt_;
    std::unique_ptr<Peers> peers_;
};

int bench(const std::string& jsonPath) {
    std::string cases;
    fmt::print("{:<26}{:>12}{:>12}{:>8}\n", "barrier over loopback TCP", "Tessera", "bare epoll", "ratio");
    for (const int hosts : {4, 16}) {
        Samples bare, ours;
        {
            // Both stand at once and take turns, so that the machine's other load meets both alike.
            OurBarrier our(hosts);
            BareBarrier plain(hosts);
            Samples warmUp;
            our.rounds(200, warmUp);
            plain.rounds(200, warmUp);
            for (int block = 0; block < 10; ++block) {
                plain.rounds(200, bare);
                our.rounds(200, ours);
            }
        }
        const auto row = [&](const std::string& name, double mine, double theirs) {
            fmt::print("{:<26}{:>9.1f} us{:>9.1f} us{:>8.2f}\n", name, mine, theirs, mine / theirs);
            cases += fmt::format(
                "{}\n  {{\"case\":\"{}\",\"peer\":\"bare "
                "epoll\",\"ours\":{},\"theirs\":{},\"unit\":\"us\",\"ratio\":{}}}",
                cases.empty() ? "" : ",", name, mine, theirs, mine / theirs);
        };
        row(fmt::format("N={} round p50", hosts), Samples::quantile(ours.roundUs, 0.5),
            Samples::quantile(bare.roundUs, 0.5));
        row(fmt::format("N={} round p99", hosts), Samples::quantile(ours.roundUs, 0.99),
            Samples::quantile(bare.roundUs, 0.99));
        row(fmt::format("N={} swap spread p50", hosts), Samples::quantile(ours.spreadUs, 0.5),
            Samples::quantile(bare.spreadUs, 0.5));
        row(fmt::format("N={} swap spread p99", hosts), Samples::quantile(ours.spreadUs, 0.99),
            Samples::quantile(bare.spreadUs, 0.99));
    }
    if (!jsonPath.empty()) std::ofstream(jsonPath) << "{\"cases\":[" << cases << "\n]}\n";
    return 0;
}

}  // namespace
}  // namespace tessera

int main(int argc, char** argv) {
    std::string json;
    for (int i = 1; i + 1 < argc; ++i)
        if (std::string(argv[i]) == "--json") json = argv[i + 1];
    return tessera::bench(json);
}
