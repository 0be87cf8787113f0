#include "tests/drill/Network.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <linux/filter.h>
#include <sched.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <utility>

#include "tests/integration/Process.h"

namespace tessera::drill {
namespace {

using namespace std::chrono_literals;

int openOwn() {
    return open("/proc/thread-self/ns/net", O_RDONLY | O_CLOEXEC);
}

std::string toolPath(const std::string& name) {
    for (const char* folder : {"/usr/sbin/", "/sbin/", "/usr/bin/", "/bin/"})
        if (access((folder + name).c_str(), X_OK) == 0) return folder + name;
    throw RowSkipped(fmt::format("there is no '{}' here (Debian: iproute2)", name));
}

/// Runs `ip` or `tc` in the namespace. Throws RowSkipped with what it says when it fails.
void command(const NetworkNamespace& where, std::vector<std::string> words) {
    const std::string text = fmt::format("{}", fmt::join(words, " "));
    words[0] = toolPath(words[0]);
    const NetworkNamespace::Inside inside(&where);
    const test::Outcome outcome = test::run(std::filesystem::temp_directory_path(), words, 10s);
    if (outcome.exitCode != 0) throw RowSkipped(fmt::format("'{}': {}", text, outcome.output.substr(0, 200)));
}
void command(const NetworkNamespace& where, const std::string& text) {
    std::istringstream in(text);
    command(where, std::vector<std::string>(std::istream_iterator<std::string>(in), {}));
}

/// Of the server (0) and of the hosts behind it.
std::string addressOf(std::size_t number) {
    return fmt::format("10.200.0.{}", number + 1);
}
/// Where a packet filter loads a random number from (linux/filter.h).
constexpr std::uint32_t kRandom = static_cast<std::uint32_t>(SKF_AD_OFF + SKF_AD_RANDOM);

}  // namespace

NetworkNamespace::NetworkNamespace() {
    const int before = openOwn();
    if (before < 0 || unshare(CLONE_NEWNET) != 0) {
        const std::string why = std::strerror(errno);
        if (before >= 0) close(before);
        throw RowSkipped("no network namespace (root is needed): " + why);
    }
    handle_ = openOwn();
    const bool returned = setns(before, CLONE_NEWNET) == 0;
    close(before);
    if (handle_ < 0 || !returned) throw std::runtime_error("cannot leave a network namespace");
    command(*this, "ip link set lo up");
}

NetworkNamespace::~NetworkNamespace() {
    if (handle_ >= 0) close(handle_);
}

NetworkNamespace::NetworkNamespace(NetworkNamespace&& other) noexcept : handle_(std::exchange(other.handle_, -1)) {}

std::string NetworkNamespace::path() const {
    return fmt::format("/proc/{}/fd/{}", getpid(), handle_);
}

NetworkNamespace::Inside::Inside(const NetworkNamespace* where) {
    if (!where) return;
    before_ = openOwn();
    if (before_ < 0 || setns(where->handle_, CLONE_NEWNET) != 0)
        throw std::runtime_error(std::string("cannot enter a network namespace: ") + std::strerror(errno));
}

NetworkNamespace::Inside::~Inside() {
    if (before_ < 0) return;
    (void)setns(before_, CLONE_NEWNET);
    close(before_);
}

SwitchedNetwork::SwitchedNetwork(std::size_t hosts) : hosts_(hosts) {
    command(switch_, "ip link add br0 type bridge forward_delay 0");
    command(switch_, "ip link set br0 up");
    plugIn(server_, 0);
    for (std::size_t i = 0; i < hosts; ++i) plugIn(hosts_[i], i + 1);
}

void SwitchedNetwork::plugIn(const NetworkNamespace& machine, std::size_t number) {
    // One packet each: where the kernel joins packets to 64 KiB ones, losing one of them loses a whole list.
    command(switch_, fmt::format("ip link add p{} gso_max_segs 1 type veth peer name eth0 gso_max_segs 1 netns {}",
                                 number, machine.path()));
    command(switch_, fmt::format("ip link set p{} master br0 up", number));
    command(machine, fmt::format("ip addr add {}/24 dev eth0", addressOf(number)));
    command(machine, "ip link set eth0 up");
}

std::string SwitchedNetwork::serverAddress() {
    return addressOf(0);
}

std::string SwitchedNetwork::hostAddress(std::size_t index) const {
    return addressOf(index + 1);
}

void SwitchedNetwork::cut(std::size_t host) {
    command(switch_, fmt::format("ip link set p{} down", host + 1));
}

void SwitchedNetwork::mute(std::size_t host) {
    dropAtRandom(switch_, fmt::format("p{}", host + 1), 1000);
}

void SwitchedNetwork::lose(std::size_t host, double percent) {
    const auto perMille = static_cast<unsigned>(percent * 10);
    dropAtRandom(switch_, fmt::format("p{}", host + 1), perMille);
    dropAtRandom(hosts_.at(host), "eth0", perMille);
}

void SwitchedNetwork::dropAtRandom(const NetworkNamespace& where, const std::string& interface, unsigned perMille) {
    // A kernel may have neither netem nor the modules of nftables; a packet filter as a classifier it has. This one
    // takes a random number modulo 1000 and lets pass (0) where it is not below `perMille`, else drops (2).
    command(where, fmt::format("tc qdisc add dev {} ingress", interface));
    command(where, {"tc", "filter", "add", "dev", interface, "ingress", "bpf", "da", "bytecode",
                    fmt::format("5,32 0 0 {},148 0 0 1000,53 1 0 {},6 0 0 2,6 0 0 0", kRandom, perMille)});
}

void SwitchedNetwork::heal(std::size_t host) {
    const std::string port = fmt::format("p{}", host + 1);
    const std::vector<std::pair<const NetworkNamespace*, std::string>> ends = {{&switch_, port},
                                                                               {&hosts_.at(host), "eth0"}};
    for (const auto& [where, interface] : ends) {
        try {
            command(*where, fmt::format("tc qdisc del dev {} ingress", interface));
        } catch (const RowSkipped&) {
            continue;  // nothing was lost there
        }
    }
    command(switch_, fmt::format("ip link set {} up", port));
}

void SwitchedNetwork::limitRate(std::size_t host, const std::string& rate) {
    const std::string shape = "root tbf rate " + rate + " burst 32kb latency 50ms";
    command(hosts_.at(host), "tc qdisc replace dev eth0 " + shape);
    command(switch_, fmt::format("tc qdisc replace dev p{} {}", host + 1, shape));
}

std::uint64_t networkBytesOf(pid_t process) {
    std::ifstream file(fmt::format("/proc/{}/net/dev", process));
    std::uint64_t own = 0, others = 0;
    for (std::string line; std::getline(file, line);) {
        const std::size_t colon = line.find(':');
        if (colon == std::string::npos) continue;
        std::istringstream numbers(line.substr(colon + 1));
        std::vector<std::uint64_t> columns{std::istream_iterator<std::uint64_t>(numbers), {}};
        if (columns.size() < 9) continue;
        const bool loopback = line.substr(0, colon).ends_with(" lo") || line.starts_with("lo:");
        if (loopback)
            own += columns[0];  // what goes out there comes in there
        else
            others += columns[0] + columns[8];
    }
    return others > 0 ? others : own;
}

}  // namespace tessera::drill
