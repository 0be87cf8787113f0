/// Hears all that passes a machine's interface, and puts its TCP streams together again.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include "tests/drill/Network.h"

namespace tessera::test {

/// One way of a TCP connection.
struct HeardStream {
    std::string from, to;  ///< ADDR:PORT
    bool dialled = false;  ///< it is what the side says that has dialled
    std::string bytes;
};

/// From its making on. Of IPv4 alone; of connections that were open before, nothing.
class WireTap {
public:
    /// At that machine's eth0. Throws RowSkipped where nobody may listen.
    explicit WireTap(const drill::NetworkNamespace& machine);
    ~WireTap();
    WireTap(const WireTap&) = delete;
    WireTap& operator=(const WireTap&) = delete;

    /// Ends, and returns those that have said anything. Throws std::runtime_error where packets were missed: then
    /// nobody knows what was in them.
    [[nodiscard]] std::vector<HeardStream> end();

private:
    /// Whose address, port, to whose.
    using Way = std::tuple<std::uint32_t, std::uint16_t, std::uint32_t, std::uint16_t>;
    struct Stream {
        std::uint32_t first = 0;  ///< sequence number of its first byte
        bool dialled = false;
        std::string bytes;
    };

    void hear(const std::stop_token& stop);
    void take(const unsigned char* packet, std::size_t size);

    int socket_ = -1;
    std::map<Way, Stream> streams_;  ///< the thread's until it has ended
    std::jthread thread_;
};

}  // namespace tessera::test
