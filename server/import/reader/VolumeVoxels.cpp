#include "server/import/reader/VolumeVoxels.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

namespace tessera {
namespace {

constexpr std::size_t kMostVoxelBytes = std::size_t{1} << 28, kMostSideVoxels = 4096;

template <typename Number>
double readFileNumber(const std::byte* from, bool swapped) {
    std::array<std::byte, sizeof(Number)> bytes;
    std::copy_n(from, sizeof(Number), bytes.begin());
    if (swapped) std::reverse(bytes.begin(), bytes.end());
    return static_cast<double>(std::bit_cast<Number>(bytes));
}

double readFileNumber(FileNumber number, const std::byte* from, bool swapped) {
    switch (number) {
        case FileNumber::kU8:
            return readFileNumber<std::uint8_t>(from, swapped);
        case FileNumber::kI8:
            return readFileNumber<std::int8_t>(from, swapped);
        case FileNumber::kU16:
            return readFileNumber<std::uint16_t>(from, swapped);
        case FileNumber::kI16:
            return readFileNumber<std::int16_t>(from, swapped);
        case FileNumber::kU32:
            return readFileNumber<std::uint32_t>(from, swapped);
        case FileNumber::kI32:
            return readFileNumber<std::int32_t>(from, swapped);
        case FileNumber::kF32:
            return readFileNumber<float>(from, swapped);
        case FileNumber::kF64:
            break;
    }
    return readFileNumber<double>(from, swapped);
}

VoxelFormat formatFor(FileNumber number) {
    switch (number) {
        case FileNumber::kU8:
            return VoxelFormat::kUint8;
        case FileNumber::kU16:
            return VoxelFormat::kUint16;
        case FileNumber::kI16:
            return VoxelFormat::kInt16;
        default:
            return VoxelFormat::kFloat;
    }
}

}  // namespace

std::size_t bytesOfNumber(FileNumber number) {
    constexpr std::array<std::size_t, 8> kBytes = {1, 1, 2, 2, 4, 4, 4, 8};
    return kBytes[static_cast<std::size_t>(number)];
}

tl::unexpected<Error> badVolumeFile(std::string why) {
    return fail(ErrorCode::kBadInput, std::move(why));
}

Expected<void> checkVolumeHeader(const VolumeHeader& header) {
    std::size_t count = 1;
    for (const std::size_t side : header.size) {
        if (side < 2 || side > kMostSideVoxels)
            return badVolumeFile(fmt::format("{} x {} x {} voxels: from 2 to {} along each axis are read",
                                             header.size[0], header.size[1], header.size[2], kMostSideVoxels));
        count *= side;
    }
    if (count * bytesOfNumber(header.number) > kMostVoxelBytes)
        return fail(ErrorCode::kLimit,
                    fmt::format("{} x {} x {} voxels of {} bytes: at most {} bytes are read", header.size[0],
                                header.size[1], header.size[2], bytesOfNumber(header.number), kMostVoxelBytes));
    for (int axis = 0; axis < 3; ++axis)
        if (!(header.spacing[axis] > 1e-12 && header.spacing[axis] < 1e12) || !(std::abs(header.origin[axis]) < 1e15))
            return badVolumeFile(fmt::format("spacing {} and origin {} of axis {} are no places", header.spacing[axis],
                                             header.origin[axis], axis));
    return {};
}

Expected<VolumeData> volumeFrom(const VolumeHeader& header, ByteSpan data) {
    const std::size_t each = bytesOfNumber(header.number), count = header.count();
    if (data.size() < count * each)
        return badVolumeFile(fmt::format("it ends too early: {} x {} x {} voxels have {} bytes, and {} are there",
                                         header.size[0], header.size[1], header.size[2], count * each, data.size()));
    VolumeData out{.format = formatFor(header.number),
                   .size = header.size,
                   .origin = header.origin,
                   .spacing = header.spacing,
                   .voxels = {},
                   .notes = {}};
    if (out.format != VoxelFormat::kFloat) {
        out.voxels.assign(data.begin(), data.begin() + static_cast<std::ptrdiff_t>(count * each));
        if (header.bigEndian && each == 2)
            for (std::size_t i = 0; i < out.voxels.size(); i += 2) std::swap(out.voxels[i], out.voxels[i + 1]);
        return out;
    }
    std::size_t none = 0;
    out.voxels.resize(count * sizeof(float));
    for (std::size_t i = 0; i < count; ++i) {
        double number = readFileNumber(header.number, data.data() + i * each, header.bigEndian && each > 1);
        if (!(std::abs(number) < 1e30)) {
            number = 0;
            ++none;
        }
        const auto value = static_cast<float>(number);
        std::memcpy(out.voxels.data() + i * sizeof(float), &value, sizeof(float));
    }
    if (none > 0) out.notes.push_back(fmt::format("{} voxels are no numbers, or beyond 1e30: 0 instead", none));
    return out;
}

}  // namespace tessera
