/// Bytes of others' protocols: datagrams that come to a port, streams that are dialled and dialled again. No frames of
/// ours (Transport carries those).
#pragma once

#include <functional>
#include <memory>

#include "common/base/Bytes.h"
#include "common/base/HostRange.h"
#include "common/net/Transport.h"

namespace tessera {

/// Bytes that come too fast are not read: the system then drops them, and nobody else's time is taken. Handlers are
/// called by one thread at a time, and by none once destruction has begun.
class Feeds {
public:
    /// Of one port. Beyond, it is not read until the slice is over.
    static constexpr int kMostInSlice = 2000;
    static constexpr std::chrono::milliseconds kSlice{16};
    static constexpr std::size_t kMaxDatagramBytes = std::size_t{64} << 10;

    struct Datagram {
        ByteSpan bytes;  ///< during the call
        HostBytes from;
        TimePoint at;  ///< when it was read
    };
    struct Stream {
        std::function<Bytes()> opened;  ///< what is said first; the stream is there
        /// An error closes the stream, which is dialled again.
        std::function<Expected<void>(ByteSpan bytes, TimePoint at)> received;
        std::function<void(const Error& why)> lost;  ///< or not reached; it is dialled again
        std::chrono::milliseconds silence{10'000};   ///< without a byte: dialled again
        std::chrono::milliseconds firstPause{500},
            longestPause{10'000};  ///< between dials; the pause doubles until bytes come
    };

    Feeds() = default;
    virtual ~Feeds() = default;
    Feeds(const Feeds&) = delete;
    Feeds& operator=(const Feeds&) = delete;

    /// Returns the bound port (for port 0). kNetwork: cannot bind, saying why.
    [[nodiscard]] virtual Expected<std::uint16_t> listen(const Address& address,
                                                         std::function<void(const Datagram&)> onDatagram) = 0;
    /// For as long as this lives.
    virtual void dial(const Address& address, Stream stream) = 0;
};
using MakeFeeds = std::function<std::unique_ptr<Feeds>()>;

}  // namespace tessera
