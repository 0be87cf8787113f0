/// The receiving half of a link, without its socket: bytes in, whole frames out.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "common/base/Bytes.h"
#include "common/base/Error.h"
#include "common/net/FrameHeader.h"
#include "common/net/PayloadBuffer.h"

namespace tessera {

struct ReceivedFrame {
    std::uint16_t type = 0;
    Epoch epoch;
    ByteSlice payload;
};

/// Takes memory only as bytes arrive, whatever length the header claims: never more than 1 MiB ahead of them, and not
/// even that before as much has come. What does not fit into the first read goes straight to its place in the message;
/// nothing is copied afterwards. Not thread-safe. After an error the stream cannot be read any further.
class FrameReader {
public:
    /// `maxPayload`: see TransportLimits.
    explicit FrameReader(std::function<std::size_t(std::uint16_t)> maxPayload);

    /// Where the next bytes are to be written; never empty. Valid until the next call of `filled`.
    [[nodiscard]] std::span<std::byte> room();
    /// The first `count` bytes of `room()` have arrived. Appends the frames that are now complete to `frames`.
    [[nodiscard]] Expected<void> filled(std::size_t count, std::vector<ReceivedFrame>& frames);
    /// Whether the stream stands in the middle of a frame.
    [[nodiscard]] bool midFrame() const { return header_.has_value() || begin_ != end_; }
    /// Bytes of the message whose header is here and whose end is not.
    [[nodiscard]] std::size_t arriving() const { return header_ ? header_->payloadBytes : 0; }

private:
    Expected<void> begin(const FrameHeader& header);
    void growPayload();
    Expected<void> finish(std::vector<ReceivedFrame>& frames);

    std::function<std::size_t(std::uint16_t)> maxPayload_;
    /// Small frames come through here, many per read; the rest of a large payload goes straight to its place.
    Bytes buffer_;
    std::size_t begin_ = 0, end_ = 0;    ///< unread bytes of buffer_
    std::optional<FrameHeader> header_;  ///< of the frame whose payload is arriving
    PayloadBuffer payload_;
    std::size_t arrived_ = 0;  ///< bytes of payload_ that are there
    std::size_t allowed_ = 0;  ///< bytes of payload_ that may be written by now
};

}  // namespace tessera
