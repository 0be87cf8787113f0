/// Stands between a program and a server on loopback and counts what the server says.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

namespace tessera::test {

/// Passes on every connection, each on a thread of its own, until destroyed.
class CountingProxy {
public:
    /// `server`: "127.0.0.1:PORT".
    explicit CountingProxy(const std::string& server);
    ~CountingProxy();
    CountingProxy(const CountingProxy&) = delete;
    CountingProxy& operator=(const CountingProxy&) = delete;

    [[nodiscard]] std::string address() const;
    /// Bytes that the server has sent since the last call.
    [[nodiscard]] std::uint64_t taken() { return fromServer_.exchange(0); }

private:
    void run();
    void passOn(int client);  ///< and closes it

    std::uint16_t serverPort_ = 0, port_ = 0;
    int listener_ = -1;
    std::atomic<bool> done_{false};
    std::atomic<std::uint64_t> fromServer_{0};
    std::vector<std::thread> passing_;  ///< of the listening thread, until it has ended
    std::thread thread_;
};

}  // namespace tessera::test
