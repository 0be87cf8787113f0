#include "common/drawable/VolumeArrays.h"

#include "common/drawable/VolumeShapes.h"
#include "common/geometry/PlaneCut.h"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cmath>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tessera {
namespace {

const Volume& volumeOf(const void* core) {
    return *static_cast<const Volume*>(core);
}
bool volumeHoldsNothing(const Volume& v) {
    return v.voxels.empty() && v.sizeX == 0 && v.sizeY == 0 && v.sizeZ == 0;
}

tl::unexpected<Error> badVolume(std::string why) {
    return fail(ErrorCode::kBadInput, std::move(why));
}

Expected<void> checkPlanes(const Blob& blob, std::string_view name) {
    if (blob.sizeBytes() % (4 * sizeof(double)) != 0)
        return badVolume(fmt::format("{} has {} bytes, no whole number of planes of 32 bytes", name, blob.sizeBytes()));
    if (!blob.empty() && !blob.resident()) return badVolume(fmt::format("{} are not here", name));
    const std::span<const double> numbers = blob.as<double>();
    if (numbers.size() / 4 > kMostVolumePlanes)
        return fail(ErrorCode::kLimit, fmt::format("{} are {} planes, at most {} are allowed", name, numbers.size() / 4,
                                                   kMostVolumePlanes));
    for (std::size_t i = 0; i + 3 < numbers.size(); i += 4) {
        const Vec4d plane(numbers[i], numbers[i + 1], numbers[i + 2], numbers[i + 3]);
        if (!plane.allFinite() || !(plane.head<3>().norm() > 1e-30 && plane.norm() < 1e30))
            return badVolume(fmt::format("plane {} of {} has no normal, or numbers beyond 1e30", i / 4, name));
    }
    return {};
}

Expected<void> checkVoxels(const Volume& v) {
    if (volumeHoldsNothing(v)) return {};
    std::uint64_t count = 1;
    for (const auto& [size, axis] : {std::pair(v.sizeX, 'X'), std::pair(v.sizeY, 'Y'), std::pair(v.sizeZ, 'Z')}) {
        if (size < 2 || size > 4096)
            return badVolume(fmt::format("size{} is {}: a volume has 2 to 4096 voxels along each axis", axis, size));
        count *= static_cast<std::uint64_t>(size);
    }
    const std::uint64_t bytes = count * bytesOf(static_cast<VoxelFormat>(v.format));
    if (bytes > kMostVolumeBytes)
        return fail(ErrorCode::kLimit, fmt::format("{} x {} x {} voxels have {} bytes, at most {} are allowed", v.sizeX,
                                                   v.sizeY, v.sizeZ, bytes, kMostVolumeBytes));
    if (static_cast<std::uint64_t>(v.sizeX) * static_cast<std::uint64_t>(v.sizeY) > kMostVoxelsOfLayer)
        return fail(ErrorCode::kLimit, fmt::format("a layer of {} x {} voxels: at most {} are allowed", v.sizeX,
                                                   v.sizeY, kMostVoxelsOfLayer));
    if (v.voxels.sizeBytes() != bytes)
        return badVolume(fmt::format("voxels has {} bytes; {} x {} x {} of its format have {}", v.voxels.sizeBytes(),
                                     v.sizeX, v.sizeY, v.sizeZ, bytes));
    if (!v.voxels.resident()) return badVolume("the voxels are not here");
    // As floats, which positions are.
    const Vec3d last(static_cast<double>(v.sizeX - 1), static_cast<double>(v.sizeY - 1),
                     static_cast<double>(v.sizeZ - 1));
    if (!((v.origin + v.spacing.cwiseProduct(last)).cwiseAbs().maxCoeff() < 1e30))
        return badVolume("the far corner of the volume is beyond 1e30");
    if (v.format != Volume::kFloat) return {};
    const std::span<const float> numbers = v.voxels.as<float>();
    for (std::size_t i = 0; i < numbers.size(); ++i)
        if (!std::isfinite(numbers[i])) return badVolume(fmt::format("voxel {} is not finite", i));
    return {};
}

Expected<void> checkVolume(const void* core) {
    const Volume& v = volumeOf(core);
    if (!(v.low < v.high))
        return badVolume(
            fmt::format("low is {} and high {}: the transfer function needs low below high", v.low, v.high));
    if (v.transfer.sizeBytes() % 4 != 0 || v.transfer.sizeBytes() / 4 > kMostTransferStops)
        return badVolume(fmt::format("transfer has {} bytes: up to {} stops of 4 bytes", v.transfer.sizeBytes(),
                                     kMostTransferStops));
    if (!v.transfer.empty() && !v.transfer.resident()) return badVolume("the transfer function is not here");
    for (const auto& [planes, name] : {std::pair(&v.slices, "slices"), std::pair(&v.clipPlanes, "clipPlanes")})
        if (Expected<void> good = checkPlanes(*planes, name); !good) return good;
    return checkVoxels(v);
}

Hash128 recipeOfVolume(const Volume& v, const Fineness& fineness) {
    const auto bits = [](double number) { return std::bit_cast<std::uint64_t>(number); };
    const std::array<Hash128, 7> parts{
        Hash128{Volume::kType.value, fineness.steps},
        Hash128{static_cast<std::uint64_t>(v.format), bits(v.surfaceValue)},
        Hash128{static_cast<std::uint64_t>(v.sizeX) << 32 | static_cast<std::uint64_t>(v.sizeY),
                static_cast<std::uint64_t>(v.sizeZ)},
        Hash128{bits(v.origin.x()), bits(v.origin.y())},
        Hash128{bits(v.origin.z()), bits(v.spacing.x())},
        Hash128{bits(v.spacing.y()), bits(v.spacing.z())},
        v.clipPlanes.id()};
    return hash128(std::as_bytes(std::span(parts)));
}

/// What screens draw follows the box and the planes alone: whatever becomes of the voxels, it stays.
Hash128 recipeOnScreens(const Volume& v) {
    const std::array<Hash128, 3> parts{recipeOfVolume(v, kVolumeOnScreens),
                                       Hash128{static_cast<std::uint64_t>(v.mode), 0}, v.slices.id()};
    return hash128(std::as_bytes(std::span(parts)));
}

/// Voxels and clip planes.
bool allHere(const Volume& v) {
    return (v.voxels.empty() || v.voxels.resident()) && (v.clipPlanes.empty() || v.clipPlanes.resident());
}

std::optional<DerivedSource> sourceOfVolume(const void* core, const Fineness& fineness) {
    const Volume& v = volumeOf(core);
    if (v.voxels.empty() || !allHere(v)) return std::nullopt;
    if (fineness.steps == kVolumeOnScreens) return DerivedSource{recipeOnScreens(v), {}};
    return DerivedSource{recipeOfVolume(v, fineness), v.voxels};
}

/// Of the whole surface, which is kept beside it: planes that move cut it anew, and nobody looks at the voxels again.
DerivedMesh cutSurface(const Volume& v) {
    Volume uncut = v;
    uncut.clipPlanes = {};
    const MeshArrays whole = derivedArrays(kVolumeDerivation, &uncut);
    if (whole.indices.empty()) return {};
    std::vector<Vec4d> planes;
    const std::span<const double> numbers = v.clipPlanes.as<double>();
    for (std::size_t i = 0; i + 3 < numbers.size(); i += 4)
        planes.emplace_back(numbers[i], numbers[i + 1], numbers[i + 2], numbers[i + 3]);
    // What a plane goes through becomes two triangles at the most.
    const Expected<MeshData> left = cutAtPlanes(whole, planes, 2 * kMostVolumeTriangles);
    if (!left || left->indices.empty()) return {.arrays = {}, .plan = std::make_shared<const MeshArrays>(whole)};
    return {.arrays = left->toArrays(), .plan = std::make_shared<const MeshArrays>(whole)};
}

DerivedMesh deriveVolume(const void* core, const Fineness& fineness, const EarlierMesh*) {
    const Volume& v = volumeOf(core);
    if (fineness.steps == kVolumeOnScreens) {
        if (!checkVolume(core)) return {};
        const MeshData shape = shapeOnScreens(v);
        if (shape.indices.empty()) return {};
        DerivedMesh out{.arrays = shape.toArrays(), .plan = nullptr};
        out.arrays.kind = v.mode == Volume::kSlices ? MeshKind::kSlices : MeshKind::kMarched;
        return out;
    }
    if (!checkVoxels(v) || !checkPlanes(v.clipPlanes, "clipPlanes")) return {};
    if (!v.clipPlanes.empty()) return cutSurface(v);
    const MeshData surface = isoSurfaceWithin(gridOf(v), v.surfaceValue, kMostVolumeTriangles);
    if (surface.indices.empty()) return {};
    return {.arrays = surface.toArrays(), .plan = nullptr};
}

}  // namespace

VoxelGrid gridOf(const Volume& v) {
    return {.format = static_cast<VoxelFormat>(v.format),
            .size = {static_cast<std::size_t>(v.sizeX), static_cast<std::size_t>(v.sizeY),
                     static_cast<std::size_t>(v.sizeZ)},
            .origin = v.origin,
            .spacing = v.spacing,
            .voxels = v.voxels.bytes()};
}

constinit const Derivation kVolumeDerivation{
    .check = &checkVolume,
    .source = &sourceOfVolume,
    .derive = &deriveVolume,
    .resident = [](const void* core) { return allHere(volumeOf(core)); },
};

}  // namespace tessera
