/// What waits to be written to one link, without its socket.
#pragma once

#include <algorithm>
#include <array>
#include <deque>
#include <vector>

#include "common/base/ByteSlice.h"
#include "common/net/FrameHeader.h"

namespace tessera {

struct OutgoingFrame {
    std::array<std::byte, FrameHeader::kBytes> header;
    SharedChain payload;
    [[nodiscard]] std::size_t bytes() const { return header.size() + (payload ? payload->size() : 0); }
};

/// Frames in their order. Payloads are written from where they lie, whoever else holds them. Not thread-safe.
class SendQueue {
public:
    void push(OutgoingFrame frame) { frames_.push_back(std::move(frame)); }
    [[nodiscard]] bool empty() const { return frames_.empty(); }
    [[nodiscard]] bool writing() const { return writing_ != 0; }
    /// Of everything that waits, headers included.
    [[nodiscard]] std::size_t bytes() const {
        std::size_t sum = 0;
        for (const OutgoingFrame& frame : frames_) sum += frame.bytes();
        return sum;
    }

    /// What the next write sends, in several pieces: the spans hold until `written`. Only when nothing is being
    /// written.
    [[nodiscard]] std::vector<ByteSpan> next() {
        writing_ = std::min(frames_.size(), kGatherFrames);
        std::vector<ByteSpan> pieces;
        pieces.reserve(3 * writing_);
        for (std::size_t i = 0; i < writing_; ++i) {
            const OutgoingFrame& frame = frames_[i];
            pieces.emplace_back(frame.header);
            if (!frame.payload) continue;
            for (const ByteSlice& slice : frame.payload->slices()) pieces.push_back(slice);
        }
        return pieces;
    }
    /// The last `next` is on its way. Returns its bytes.
    std::size_t written() {
        std::size_t sum = 0;
        for (; writing_ > 0; --writing_) {
            sum += frames_.front().bytes();
            frames_.pop_front();
        }
        return sum;
    }

private:
    /// In one write: a few pieces each, the kernel's limit is 1024.
    static constexpr std::size_t kGatherFrames = 32;

    std::deque<OutgoingFrame> frames_;
    std::size_t writing_ = 0;  ///< frames at the front that are being written
};

}  // namespace tessera
