#include "server/import/reader/VolumeNode.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "server/import/reader/ReadScene.h"
#include "server/import/reader/VolumeVoxels.h"

namespace tessera {

FirstLook firstLookAt(const VoxelGrid& grid) {
    constexpr std::size_t kBins = 256;
    const auto each = [&](auto&& look) {
        for (std::size_t z = 0; z < grid.size[2]; ++z)
            for (std::size_t y = 0; y < grid.size[1]; ++y)
                for (std::size_t x = 0; x < grid.size[0]; ++x) look(grid.at(x, y, z));
    };
    FirstLook out{.low = 1e300, .high = -1e300};
    each([&](double value) {
        out.low = std::min(out.low, value);
        out.high = std::max(out.high, value);
    });
    out.thickness =
        grid.spacing
            .cwiseProduct(Vec3d(static_cast<double>(grid.size[0] - 1), static_cast<double>(grid.size[1] - 1),
                                static_cast<double>(grid.size[2] - 1)))
            .maxCoeff() /
        32;
    if (!(out.low < out.high)) {
        out.surfaceValue = out.low;
        out.high = out.low + std::max(1.0, std::abs(out.low));
        return out;
    }
    std::array<double, kBins> counts{};
    const double width = (out.high - out.low) / kBins;
    each([&](double value) { ++counts[std::min(static_cast<std::size_t>((value - out.low) / width), kBins - 1)]; });
    double all = 0, sum = 0, below = 0, sumBelow = 0, best = -1;
    for (std::size_t i = 0; i < kBins; ++i) {
        all += counts[i];
        sum += counts[i] * static_cast<double>(i);
    }
    for (std::size_t i = 0; i + 1 < kBins; ++i) {
        below += counts[i];
        sumBelow += counts[i] * static_cast<double>(i);
        if (below == 0 || below == all) continue;
        const double apart = sumBelow / below - (sum - sumBelow) / (all - below),
                     between = below * (all - below) * apart * apart;
        if (between > best) {
            best = between;
            out.surfaceValue = out.low + static_cast<double>(i + 1) * width;
        }
    }
    return out;
}

Expected<proto::scene::Volume> plainVolume(const FolderFiles& files, const proto::scene::Volume& said,
                                           PlainScene& scene) {
    proto::scene::Volume out = said;
    out.clear_file();
    if (said.file().empty()) return out;
    if (said.voxels_size() > 0 || said.size_x() > 0 || said.size_y() > 0 || said.size_z() > 0)
        return badVolumeFile("a volume has a file or voxels, not both");
    if (said.file().front() == '/')
        return fail(ErrorCode::kRefused, fmt::format("'{}' leads out of the file's own folder", said.file()));
    Expected<VolumeData> volume = readVolumeFile(files, said.file());
    if (!volume) return failWith(fmt::format("'{}'", said.file()), volume.error());
    for (const std::string& left : volume->notes) scene.note(fmt::format("'{}': {}", said.file(), left));
    const FirstLook look = firstLookAt(volume->grid());
    out.set_format(static_cast<proto::scene::Volume::Format>(volume->format));
    out.set_size_x(static_cast<std::uint32_t>(volume->size[0]));
    out.set_size_y(static_cast<std::uint32_t>(volume->size[1]));
    out.set_size_z(static_cast<std::uint32_t>(volume->size[2]));
    const auto three = [](proto::scene::Vector& to, const Vec3d& from) {
        to.set_x(from.x());
        to.set_y(from.y());
        to.set_z(from.z());
    };
    if (!said.has_origin()) three(*out.mutable_origin(), volume->origin);
    if (!said.has_spacing()) three(*out.mutable_spacing(), volume->spacing);
    if (!said.has_low()) out.set_low(look.low);
    if (!said.has_high()) out.set_high(look.high);
    if (!said.has_surface_value()) out.set_surface_value(look.surfaceValue);
    if (!said.has_thickness()) out.set_thickness(look.thickness);
    out.set_voxels_blob(scene.addBlob(std::move(volume->voxels)));
    return out;
}

Expected<PlainScene> readVolume(const std::string& path, const ReadLimits& limits) {
    const std::size_t slash = path.rfind('/');
    const FolderFiles files(path.substr(0, std::max<std::size_t>(slash, 1)), limits.maxFileBytes);
    proto::scene::Volume said;
    said.set_file(path.substr(slash + 1));
    said.set_mode(proto::scene::Volume::SURFACE);
    PlainScene scene;
    const Expected<proto::scene::Volume> volume = plainVolume(files, said, scene);
    if (!volume) return tl::unexpected(volume.error());
    *scene.file.add_node()->mutable_volume() = *volume;
    return scene;
}

}  // namespace tessera
