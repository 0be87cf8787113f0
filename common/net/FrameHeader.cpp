#include "common/net/FrameHeader.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>

#include "common/base/Hash.h"

namespace tessera {

namespace {

static_assert(std::endian::native == std::endian::little, "the wire is little-endian and written by memcpy");

constexpr std::size_t kMagicAt = 0, kVersionAt = 4, kTypeAt = 6, kLengthAt = 8, kReservedAt = 12, kEpochAt = 16,
                      kChecksumAt = 24;

template <typename T>
void put(std::span<std::byte> out, std::size_t at, T value) {
    std::memcpy(out.data() + at, &value, sizeof value);
}
template <typename T>
T get(ByteSpan in, std::size_t at) {
    T value;
    std::memcpy(&value, in.data() + at, sizeof value);
    return value;
}

/// What the peer seems to speak, for the person who reads the message: the printable part of its first bytes.
std::string printable(ByteSpan bytes) {
    std::string text;
    for (const std::byte b : bytes.first(std::min<std::size_t>(bytes.size(), 16))) {
        const auto c = static_cast<unsigned char>(b);
        if (c >= 0x20 && c < 0x7f)
            text.push_back(static_cast<char>(c));
        else
            text += fmt::format("\\x{:02x}", c);
    }
    return text;
}

}  // namespace

std::array<std::byte, FrameHeader::kBytes> encodeHeader(std::uint16_t type, Epoch epoch, const ByteChain& payload) {
    TESSERA_CHECK(payload.size() <= 0xffffffffu, "a frame's payload is shorter than 4 GiB");
    std::array<std::byte, FrameHeader::kBytes> bytes{};
    put(bytes, kMagicAt, FrameHeader::kMagic);
    put(bytes, kVersionAt, FrameHeader::kVersion);
    put(bytes, kTypeAt, type);
    put(bytes, kLengthAt, static_cast<std::uint32_t>(payload.size()));
    put(bytes, kEpochAt, epoch.value);
    const std::uint64_t seed = hash64(ByteSpan(bytes).first(kChecksumAt));
    put(bytes, kChecksumAt, payload.hash64(seed));
    return bytes;
}

Expected<void> checkMagic(ByteSpan firstBytes) {
    const std::uint32_t magic = FrameHeader::kMagic;
    const std::size_t n = std::min(firstBytes.size(), sizeof magic);
    if (std::memcmp(firstBytes.data(), &magic, n) != 0)
        return fail(ErrorCode::kNetwork,
                    fmt::format("not a Tessera peer: it began a message with \"{}\"", printable(firstBytes)));
    return {};
}

Expected<FrameHeader> decodeHeader(std::span<const std::byte, FrameHeader::kBytes> bytes) {
    if (auto magic = checkMagic(bytes); !magic) return tl::unexpected(magic.error());
    if (const auto version = get<std::uint16_t>(bytes, kVersionAt); version != FrameHeader::kVersion)
        return fail(ErrorCode::kNetwork,
                    fmt::format("the peer frames its messages in version {}, this program in version {}: "
                                "use programs of one release",
                                version, FrameHeader::kVersion));
    if (get<std::uint32_t>(bytes, kReservedAt) != 0)
        return fail(ErrorCode::kNetwork, "a message header is damaged: its reserved bytes are not zero");
    FrameHeader header;
    header.type = get<std::uint16_t>(bytes, kTypeAt);
    header.payloadBytes = get<std::uint32_t>(bytes, kLengthAt);
    header.epoch = Epoch(get<std::uint64_t>(bytes, kEpochAt));
    header.checksum = get<std::uint64_t>(bytes, kChecksumAt);
    header.headSeed = hash64(ByteSpan(bytes).first(kChecksumAt));
    return header;
}

Expected<void> checkPayload(const FrameHeader& header, ByteSpan payload) {
    if (payload.size() != header.payloadBytes || hash64(payload, header.headSeed) != header.checksum)
        return fail(ErrorCode::kNetwork,
                    fmt::format("a message of type {} with {} bytes is damaged: its checksum is wrong", header.type,
                                header.payloadBytes));
    return {};
}

}  // namespace tessera
