/// The voxels of a field, as the header of its file describes them.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "server/import/reader/VolumeFiles.h"

namespace tessera {

enum class FileNumber : std::uint8_t { kU8, kI8, kU16, kI16, kU32, kI32, kF32, kF64 };
[[nodiscard]] std::size_t bytesOfNumber(FileNumber number);

/// What a header says, before anything is taken for it.
struct VolumeHeader {
    std::array<std::size_t, 3> size{};
    Vec3d origin = Vec3d::Zero(), spacing = Vec3d::Ones();
    FileNumber number = FileNumber::kU8;
    bool bigEndian = false;

    [[nodiscard]] std::size_t count() const { return size[0] * size[1] * size[2]; }
};

/// Before anything is taken for it.
[[nodiscard]] Expected<void> checkVolumeHeader(const VolumeHeader& header);
/// Numbers that are none become 0, and are said.
[[nodiscard]] Expected<VolumeData> volumeFrom(const VolumeHeader& header, ByteSpan data);

[[nodiscard]] tl::unexpected<Error> badVolumeFile(std::string why);

}  // namespace tessera
