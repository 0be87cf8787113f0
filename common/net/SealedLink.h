/// TLS of one link of a Transport, and what of its queue is sealed. For Transport.cpp alone.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <string>
#include <utility>
#include <vector>

#include "common/net/SendQueue.h"
#include "common/tls/TlsChannel.h"

namespace tessera {

/// So much is sealed at a time: more would be memory that waits for the socket.
class SealedLink {
public:
    SealedLink(std::shared_ptr<const TlsContext> context, TlsChannel::Side side, const std::string& target)
        : channel(std::move(context), side, target) {}

    TlsChannel channel;
    Bytes out;                      ///< what is being written to the socket
    bool writing = false;           ///< the reactor has it
    bool shaking = false;           ///< another thread has the channel, or it waits for that
    bool begun = false;             ///< its first step has been taken
    bool ended = false;             ///< nothing more is sealed
    std::atomic<bool> over{false};  ///< the link is closed: nobody needs its handshake any more

    /// Seals what comes next in the queue, until 256 KiB are to be sent. Small pieces go together: each record has a
    /// price. Errors: of `TlsChannel::seal`.
    [[nodiscard]] Expected<void> sealMore(SendQueue& queue) {
        constexpr std::size_t kAtOnce = std::size_t{256} << 10;
        while (channel.outgoing().size() < kAtOnce) {
            if (at_ == pieces_.size()) {
                if (queue.writing() || queue.empty()) return {};
                pieces_ = queue.next();
                at_ = offset_ = 0;
            }
            if (Expected<void> sealed = sealRecord(); !sealed) return sealed;
        }
        return {};
    }
    /// All that the queue has given is sealed.
    [[nodiscard]] bool drained() const { return at_ == pieces_.size(); }

private:
    static constexpr std::size_t kRecord = 16 * 1024;

    [[nodiscard]] Expected<void> sealRecord() {
        std::size_t filled = 0;
        while (at_ < pieces_.size() && filled < kRecord) {
            const ByteSpan rest = pieces_[at_].subspan(offset_);
            if (filled == 0 && rest.size() >= kRecord) {
                Expected<void> sealed = channel.seal(rest.first(kRecord));
                go(kRecord);
                return sealed;
            }
            const ByteSpan part = rest.first(std::min(rest.size(), kRecord - filled));
            std::ranges::copy(part, record_.begin() + static_cast<std::ptrdiff_t>(filled));
            filled += part.size();
            go(part.size());
        }
        return channel.seal(ByteSpan(record_).first(filled));
    }
    void go(std::size_t bytes) {
        offset_ += bytes;
        if (offset_ < pieces_[at_].size()) return;
        offset_ = 0;
        // Empty ones have nothing to seal.
        while (++at_ < pieces_.size() && pieces_[at_].empty()) {
        }
    }

    std::vector<ByteSpan> pieces_;
    std::size_t at_ = 0, offset_ = 0;
    std::array<std::byte, kRecord> record_{};
};

}  // namespace tessera
