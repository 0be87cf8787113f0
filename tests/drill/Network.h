/// Networks of a row's own: namespaces without a name, which are gone with the last process and handle in them.
#pragma once

#include <sys/types.h>

#include <stdexcept>
#include <string>
#include <vector>

namespace tessera::drill {

/// Thrown where a row cannot be made on this machine; what() says why.
struct RowSkipped : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// One machine's network: interfaces, addresses and ports of its own.
class NetworkNamespace {
public:
    /// With a loopback interface that is up. Throws RowSkipped: not root, or no namespaces here.
    NetworkNamespace();
    ~NetworkNamespace();
    NetworkNamespace(NetworkNamespace&& other) noexcept;
    NetworkNamespace(const NetworkNamespace&) = delete;
    NetworkNamespace& operator=(const NetworkNamespace&) = delete;

    /// Where other processes find it.
    [[nodiscard]] std::string path() const;

    /// As long as it lives, sockets, processes and threads that this thread makes belong there.
    class Inside {
    public:
        /// Of none: stays where it is.
        explicit Inside(const NetworkNamespace* where);
        ~Inside();
        Inside(const Inside&) = delete;
        Inside& operator=(const Inside&) = delete;

    private:
        int before_ = -1;
    };

private:
    int handle_ = -1;
};

/// A server and hosts, a machine each, on a switch. Throws RowSkipped where the system lacks something.
class SwitchedNetwork {
public:
    explicit SwitchedNetwork(std::size_t hosts);

    [[nodiscard]] const NetworkNamespace& server() const { return server_; }
    [[nodiscard]] const NetworkNamespace& host(std::size_t index) const { return hosts_.at(index); }
    [[nodiscard]] static std::string serverAddress();
    [[nodiscard]] std::string hostAddress(std::size_t index) const;

    // A host's cable. Each lasts until `heal`.
    void cut(std::size_t host);
    /// Whatever the host sends is lost; what it is sent arrives.
    void mute(std::size_t host);
    /// Of packets both ways, at random.
    void lose(std::size_t host, double percent);
    void heal(std::size_t host);
    /// Both ways, from now on.
    void limitRate(std::size_t host, const std::string& rate);

private:
    void plugIn(const NetworkNamespace& machine, std::size_t number);
    void dropAtRandom(const NetworkNamespace& where, const std::string& interface, unsigned perMille);

    NetworkNamespace switch_, server_;
    std::vector<NetworkNamespace> hosts_;
};

/// Bytes that came in and went out, since it exists, at the interfaces of that process' network, without those that it
/// says to itself; where there are no others, those.
[[nodiscard]] std::uint64_t networkBytesOf(pid_t process);

}  // namespace tessera::drill
