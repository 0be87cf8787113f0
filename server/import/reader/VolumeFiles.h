/// Scalar fields in files: MetaImage (.mhd and what it names, .mha), VolVis (.slc), legacy VTK structured points
/// (.vtk), NRRD (.nrrd, .nhdr) whose data are not packed.
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/Bytes.h"
#include "common/base/Error.h"
#include "common/geometry/IsoSurface.h"
#include "server/import/reader/FolderFiles.h"

namespace tessera {

/// As a Volume core holds it; numbers of other formats become floats.
struct VolumeData {
    VoxelFormat format = VoxelFormat::kUint8;
    std::array<std::size_t, 3> size{};
    Vec3d origin = Vec3d::Zero(), spacing = Vec3d::Ones();
    Bytes voxels;
    std::vector<std::string> notes;  ///< what of the file is not shown

    [[nodiscard]] VoxelGrid grid() const {
        return {.format = format, .size = size, .origin = origin, .spacing = spacing, .voxels = voxels};
    }
};

/// In lower case, without a dot.
[[nodiscard]] std::span<const std::string_view> volumeEndings();
/// `extension`: in lower case, without its dot.
[[nodiscard]] bool isVolumeFile(std::string_view extension);
/// `name`: in the folder. kBadInput where the file is damaged, kLimit where it says more than 2^28 bytes of voxels:
/// before anything is taken for them; kUnsupported what packs its data, or has more than one number a voxel; kRefused
/// data outside of the folder.
[[nodiscard]] Expected<VolumeData> readVolumeFile(const FolderFiles& files, const std::string& name);

}  // namespace tessera
