/// VESA's "Multiple Projection Common Data Interchange" (MPCDI 1.0, 2013, and 2.0): a zip archive with mpcdi.xml, which
/// names the regions of buffers (a projector each), and pictures: where each pixel of a projector looks (PFM), how much
/// of its light it keeps (alpha map, PNG), how much of its black is lifted (beta map, PNG).
///
/// Taken as: rows of all pictures from the top; a region's x and y, and what warp maps say, 0 to 1 from the upper left
/// corner, the warp map's within the region. Angles in degrees: yaw turns right, pitch up, roll clockwise as the viewer
/// sees it.
///
/// Profiles a3 and sl have places in space: of what each pixel hits (a3's maps), of projectors (sl's coordinate
/// frames). A frame says which axis is which, as an aircraft's: pitch's points right, yaw's down, roll's ahead; without
/// one x is right, y up, -z ahead. The axes are understood as in github.com/ChristieDigital/mpcdi, MPCDI_explained.md;
/// units, origins and names of elements as in VESA's own library (github.com/scaredyfish/MPCDI).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/wall/Wall.h"
#include "server/tools/mpcdi/PfmFile.h"

namespace tessera {

struct MpcdiFrustum {
    double yaw = 0, pitch = 0, roll = 0;
    double left = 0, right = 0, up = 0, down = 0;  ///< left and down usually below 0
};

/// Where a projector is, and its file's axes; orthonormal.
struct MpcdiFrame {
    Vec3d position = Vec3d::Zero(), yaw = -Vec3d::UnitY(), pitch = Vec3d::UnitX(), roll = -Vec3d::UnitZ();
    /// x right, y up, -z ahead.
    [[nodiscard]] Vec3d here(const Vec3d& place) const { return {place.dot(pitch), -place.dot(yaw), -place.dot(roll)}; }
};

enum class MpcdiProfile : std::uint8_t { k2d, k3d, kA3, kSl };

struct MpcdiRegion {
    std::string id;
    int widthPx = 0, heightPx = 0;               ///< of the projector
    double x = 0, y = 0, width = 1, height = 1;  ///< in the buffer
    std::optional<MpcdiFrustum> frustum;
    std::optional<MpcdiFrame> frame;
    std::string warpName;
    FloatPicture warp;      ///< a3: places in the file's unit and axes; sl: the lens's distortion, or empty
    double unitMetres = 1;  ///< of places
    std::string origin;     ///< of an a3's places: "idealEyePoint", "floorCenter", …
    Bytes alpha;            ///< PNG; empty: none
    double alphaGamma = 1;  ///< that its values were made with: share of light = value ^ this
};

struct MpcdiBuffer {
    std::string id;
    int widthPx = 0, heightPx = 0;
    std::vector<MpcdiRegion> regions;
};

struct MpcdiFile {
    MpcdiProfile profile = MpcdiProfile::k2d;
    std::vector<MpcdiBuffer> buffers;
    std::vector<std::string> notes;  ///< what was there and is not carried over
};

/// At most 256 regions. An XML without an archive around it is read too, where it names no files. Refused, in words:
/// other profiles, archives and pictures that ZipFile and readPfm refuse, XML that is none, what is missing in it or
/// out of range.
[[nodiscard]] Expected<MpcdiFile> readMpcdi(const std::string& path);

}  // namespace tessera
