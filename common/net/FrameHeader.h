/// The fixed header in front of every message: versioned, bounded, checksummed.
#pragma once

#include <array>
#include <cstdint>

#include "common/base/ByteSlice.h"
#include "common/base/Error.h"
#include "common/base/HistoryIds.h"

namespace tessera {

/// 32 bytes, little-endian: magic "TSRA", header version u16, message type u16, payload length u32, reserved u32
/// (zero), epoch u64, checksum u64 (XXH3-64 of the payload, seeded with XXH3-64 of the 24 bytes before it).
struct FrameHeader {
    static constexpr std::size_t kBytes = 32;
    static constexpr std::uint32_t kMagic = 0x41525354;  // "TSRA" in memory
    static constexpr std::uint16_t kVersion = 1;

    std::uint16_t type = 0;
    std::uint32_t payloadBytes = 0;
    Epoch epoch;
    std::uint64_t checksum = 0;
    std::uint64_t headSeed = 0;  ///< hash of the first 24 bytes as they came, for checkPayload
};

/// The payload must be shorter than 4 GiB. It may lie in several places.
[[nodiscard]] std::array<std::byte, FrameHeader::kBytes> encodeHeader(std::uint16_t type, Epoch epoch,
                                                                      const ByteChain& payload);
/// Refuses a wrong magic ("not a Tessera peer"), another version, before any payload is looked at. The caller checks
/// length against its limit for the type *before* taking memory.
[[nodiscard]] Expected<FrameHeader> decodeHeader(std::span<const std::byte, FrameHeader::kBytes> bytes);
[[nodiscard]] Expected<void> checkPayload(const FrameHeader& header, ByteSpan payload);

/// Whether these first bytes of a stream can still become a frame: finds a foreign protocol before 32 bytes are there.
[[nodiscard]] Expected<void> checkMagic(ByteSpan firstBytes);

}  // namespace tessera
