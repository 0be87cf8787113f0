/// A field from a file as the content of a node.
#pragma once

#include "server/import/reader/PlainScene.h"
#include "server/import/reader/VolumeFiles.h"

namespace tessera {

/// What a person would look at first.
struct FirstLook {
    double low = 0, high = 1;  ///< the least and the greatest number, a little apart where they are one
    double surfaceValue =
        0;  ///< tells the numbers apart best: Otsu 1979, "A threshold selection method from gray-level histograms"
    double thickness = 1;  ///< a 32nd of the longest side
};
[[nodiscard]] FirstLook firstLookAt(const VoxelGrid& grid);

/// The content of a node from a file, as far as `said` does not say otherwise. The voxels go into `scene`.
[[nodiscard]] Expected<proto::scene::Volume> plainVolume(const FolderFiles& files, const proto::scene::Volume& said,
                                                         PlainScene& scene);

}  // namespace tessera
