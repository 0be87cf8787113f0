/// VESA's "Multiple Projection Common Data Interchange" (MPCDI 1.0, 2013, and 2.0): a zip archive with mpcdi.xml, which
/// names the regions of buffers (a projector each), and pictures: where each pixel of a projector looks (PFM), how much
/// of its light it keeps (alpha map, PNG), how much of its black is lifted (beta map, PNG).
///
/// Taken as: rows of all pictures from the top; a region's x and y, and what warp maps say, 0 to 1 from the upper left
/// corner, the warp map's within the region. Angles in degrees: yaw turns right, pitch up, roll clockwise as the viewer
/// sees it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "server/tools/mpcdi/PfmFile.h"

namespace tessera {

struct MpcdiFrustum {
    double yaw = 0, pitch = 0, roll = 0;
    double left = 0, right = 0, up = 0, down = 0;  ///< left and down usually below 0
};

struct MpcdiRegion {
    std::string id;
    int widthPx = 0, heightPx = 0;               ///< of the projector
    double x = 0, y = 0, width = 1, height = 1;  ///< in the buffer
    std::optional<MpcdiFrustum> frustum;
    std::string warpName;
    FloatPicture warp;
    Bytes alpha;            ///< PNG; empty: none
    double alphaGamma = 1;  ///< that its values were made with: share of light = value ^ this
};

struct MpcdiBuffer {
    std::string id;
    int widthPx = 0, heightPx = 0;
    std::vector<MpcdiRegion> regions;
};

struct MpcdiFile {
    bool threeD = false;  ///< profile 3d: regions have frusta; else 2d
    std::vector<MpcdiBuffer> buffers;
    std::vector<std::string> notes;  ///< what was there and is not carried over
};

/// At most 256 regions. Refused, in words: other profiles (a3, sl), archives and pictures that ZipFile and readPfm
/// refuse, XML that is none, what is missing in it or out of range.
[[nodiscard]] Expected<MpcdiFile> readMpcdi(const std::string& path);

}  // namespace tessera
