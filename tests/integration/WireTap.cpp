#include "tests/integration/WireTap.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <linux/if_packet.h>
#include <net/ethernet.h>
#include <net/if.h>
#include <netinet/ip.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

namespace tessera::test {
namespace {

constexpr std::size_t kLongestStream = std::size_t{1} << 28;  // what a broken number could make of one

std::string nameOf(std::uint32_t address, std::uint16_t port) {
    std::array<char, INET_ADDRSTRLEN> text{};
    inet_ntop(AF_INET, &address, text.data(), text.size());
    return fmt::format("{}:{}", text.data(), port);
}

}  // namespace

WireTap::WireTap(const drill::NetworkNamespace& machine) {
    {
        const drill::NetworkNamespace::Inside inside(&machine);
        // Of one protocol alone only what comes in would be heard.
        socket_ = ::socket(AF_PACKET, SOCK_DGRAM | SOCK_CLOEXEC, htons(ETH_P_ALL));
        sockaddr_ll at{};
        at.sll_family = AF_PACKET;
        at.sll_protocol = htons(ETH_P_ALL);
        at.sll_ifindex = static_cast<int>(if_nametoindex("eth0"));
        if (socket_ < 0 || ::bind(socket_, reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0) {
            const std::string why = std::strerror(errno);
            if (socket_ >= 0) ::close(socket_);
            throw drill::RowSkipped("nobody may listen at an interface here: " + why);
        }
    }
    // A busy machine lets the thread wait for long.
    const int room = 64 << 20;
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVBUFFORCE, &room, sizeof room);
    thread_ = std::jthread([this](const std::stop_token& stop) { hear(stop); });
}

WireTap::~WireTap() {
    thread_ = {};
    ::close(socket_);
}

void WireTap::hear(const std::stop_token& stop) {
    std::array<unsigned char, 65'536> packet{};
    for (;;) {
        sockaddr_ll whence{};
        socklen_t size = sizeof whence;
        const ssize_t got = ::recvfrom(socket_, packet.data(), packet.size(), MSG_DONTWAIT,
                                       reinterpret_cast<sockaddr*>(&whence), &size);
        if (got >= 0) {
            if (whence.sll_protocol == htons(ETH_P_IP)) take(packet.data(), static_cast<std::size_t>(got));
            continue;
        }
        if (stop.stop_requested()) return;
        pollfd more{.fd = socket_, .events = POLLIN, .revents = 0};
        (void)::poll(&more, 1, 20);
    }
}

void WireTap::take(const unsigned char* packet, std::size_t size) {
    iphdr ip{};
    if (size < sizeof ip) return;
    std::memcpy(&ip, packet, sizeof ip);
    const std::size_t ipBytes = ip.ihl * std::size_t{4};
    const std::size_t all = std::min<std::size_t>(size, ntohs(ip.tot_len));
    tcphdr tcp{};
    if (ip.version != 4 || ip.protocol != IPPROTO_TCP || all < ipBytes + sizeof tcp) return;
    std::memcpy(&tcp, packet + ipBytes, sizeof tcp);
    const std::size_t head = ipBytes + tcp.doff * std::size_t{4};
    const Way way{ip.saddr, ntohs(tcp.source), ip.daddr, ntohs(tcp.dest)};
    if (tcp.syn) {
        streams_[way] = {.first = ntohl(tcp.seq) + 1, .dialled = !tcp.ack, .bytes = {}};
        return;
    }
    const auto stream = streams_.find(way);
    if (stream == streams_.end() || all <= head) return;
    const std::uint32_t place = ntohl(tcp.seq) - stream->second.first;
    std::string& bytes = stream->second.bytes;
    if (place > kLongestStream) return;
    if (bytes.size() < place + (all - head)) bytes.resize(place + (all - head));
    bytes.replace(place, all - head, reinterpret_cast<const char*>(packet + head), all - head);
}

std::vector<HeardStream> WireTap::end() {
    thread_ = {};  // once all that has come is taken
    tpacket_stats counted{};
    socklen_t size = sizeof counted;
    if (::getsockopt(socket_, SOL_PACKET, PACKET_STATISTICS, &counted, &size) != 0 || counted.tp_drops > 0)
        throw std::runtime_error(fmt::format("{} packets were missed", counted.tp_drops));
    std::vector<HeardStream> heard;
    for (auto& [way, stream] : streams_) {
        const auto& [from, fromPort, to, toPort] = way;
        if (stream.bytes.empty()) continue;
        heard.push_back({nameOf(from, fromPort), nameOf(to, toPort), stream.dialled, std::move(stream.bytes)});
    }
    streams_.clear();
    return heard;
}

}  // namespace tessera::test
