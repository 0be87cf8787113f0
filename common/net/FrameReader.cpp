#include "common/net/FrameReader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

namespace tessera {

namespace {
constexpr std::size_t kBufferBytes = 16 * 1024;
constexpr std::size_t kFirstStepBytes = 64 * 1024;
constexpr std::size_t kLastStepBytes = 1024 * 1024;
}  // namespace

FrameReader::FrameReader(std::function<std::size_t(std::uint16_t)> maxPayload)
    : maxPayload_(std::move(maxPayload)), buffer_(kBufferBytes) {}

std::span<std::byte> FrameReader::room() {
    if (header_) {
        growPayload();
        return {payload_.data() + arrived_, allowed_ - arrived_};
    }
    return std::span(buffer_).subspan(end_);
}

Expected<void> FrameReader::filled(std::size_t count, std::vector<ReceivedFrame>& frames) {
    if (header_) {
        arrived_ += count;
        if (arrived_ < header_->payloadBytes) return {};
        return finish(frames);
    }
    end_ += count;
    while (begin_ < end_) {
        const ByteSpan unread = ByteSpan(buffer_).subspan(begin_, end_ - begin_);
        if (unread.size() < FrameHeader::kBytes) {
            if (auto magic = checkMagic(unread); !magic) return magic;
            break;
        }
        const auto header = decodeHeader(unread.first<FrameHeader::kBytes>());
        if (!header) return tl::unexpected(header.error());
        begin_ += FrameHeader::kBytes;
        if (auto begun = begin(*header); !begun) return begun;

        arrived_ = std::min<std::size_t>(header->payloadBytes, end_ - begin_);
        growPayload();
        if (arrived_ > 0) std::memcpy(payload_.data(), buffer_.data() + begin_, arrived_);
        begin_ += arrived_;
        if (arrived_ < header->payloadBytes) break;  // the buffer is used up: the rest goes straight into the payload
        if (auto finished = finish(frames); !finished) return finished;
    }
    // At most the beginning of a header is left; it moves to the front, so that there is always room.
    std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
    end_ -= begin_;
    begin_ = 0;
    return {};
}

Expected<void> FrameReader::begin(const FrameHeader& header) {
    const std::size_t most = maxPayload_(header.type);
    if (most == 0)
        return fail(ErrorCode::kNetwork, fmt::format("the peer sent a message of unexpected type {}", header.type));
    if (header.payloadBytes > most)
        return fail(ErrorCode::kNetwork, fmt::format("a message of type {} claims {} bytes; at most {} are allowed",
                                                     header.type, header.payloadBytes, most));
    header_ = header;
    allowed_ = 0;
    return {};
}

void FrameReader::growPayload() {
    if (arrived_ < allowed_) return;
    const std::size_t whole = header_->payloadBytes;
    allowed_ = std::min(whole, allowed_ + std::clamp(allowed_, kFirstStepBytes, kLastStepBytes));
    // Three sizes, so that a long payload is not moved again and again: addresses for the rest of it cost nothing until
    // bytes come, and are not taken before a part as large as that of a first or second size has come.
    payload_.reserve(std::min(whole, allowed_ <= kFirstStepBytes  ? kFirstStepBytes
                                     : allowed_ <= kLastStepBytes ? kLastStepBytes
                                                                  : whole));
}

Expected<void> FrameReader::finish(std::vector<ReceivedFrame>& frames) {
    if (auto good = checkPayload(*header_, {payload_.data(), arrived_}); !good) return good;
    frames.push_back({header_->type, header_->epoch, payload_.take(arrived_)});
    header_.reset();
    arrived_ = 0;
    return {};
}

}  // namespace tessera
