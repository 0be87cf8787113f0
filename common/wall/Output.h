/// What becomes of a tile's picture on its way to a projector or monitor: packed for two eyes, warped, blended with its
/// neighbours, coloured. Values only; `client/output` makes pictures with them, `findOutputFault` says what is wrong.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/Bytes.h"

namespace tessera {

/// How two eyes' pictures share one output.
enum class StereoPacking : std::uint8_t {
    kNone,            ///< one picture, of one tile
    kSideBySide,      ///< left half: the left eye; each squeezed to half its width
    kSideBySideFull,  ///< the same at twice the width, nothing squeezed
    kTopBottom,       ///< upper half: the left eye; each squeezed to half its height
    kTopBottomFull,   ///< the same at twice the height
    kAnaglyph,        ///< red-cyan, Dubois' matrices
    kAnaglyphPlain,   ///< red of the left eye, green and blue of the right
    kRows,            ///< rows 0, 2 … from the top: the left eye
    kColumns,         ///< columns 0, 2 … from the left: the left eye
    kCheckerboard,    ///< pixels whose row and column add up to an even number: the left eye
    kQuadBuffered,    ///< a graphics driver shows both in turn
};

/// One value for each of red, green, blue.
using ChannelValues = std::array<double, 3>;

/// A node of a warp mesh. Where it lies in the output: -1 (left, lower edge) to 1 (right, upper edge); nodes may lie
/// beyond. What it shows of the tile's picture: 0 (left, lower edge) to 1. How much of its light: 0 to 1.
struct WarpNode {
    float x = 0, y = 0, u = 0, v = 0, intensity = 1;
    bool operator==(const WarpNode&) const = default;
};

/// A mesh that bends a tile's picture: rows of nodes; four neighbours make a face.
struct WarpMesh {
    int columns = 0, rows = 0;
    std::vector<WarpNode> nodes;  ///< row by row
    [[nodiscard]] const WarpNode& at(int column, int row) const {
        return nodes[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                     static_cast<std::size_t>(column)];
    }
    bool operator==(const WarpMesh&) const = default;
};

struct TileOutput {
    std::string monitor;  ///< name or number, as `--window` takes them; empty: the command line's, else a plain window
    int widthPx = 0, heightPx = 0;  ///< of one eye's picture as the projector gets it; 0: the tile's
    StereoPacking stereo =
        StereoPacking::kNone;  ///< said at the left eye's tile; the right one's has no output of its own
    bool swapEyes = false;
    std::string warpFile, blendFile;       ///< as the wall file names them
    std::shared_ptr<const WarpMesh> warp;  ///< null: none
    SharedBytes blendPicture;              ///< a PNG: how much of its light each pixel of the output keeps; null: none
    double blendPictureGamma = 1;          ///< share of light = (value of the picture) ^ this
    bool blend = false;                    ///< ramps where the grid's tiles overlap
    ChannelValues gain{1, 1, 1};           ///< of the light, up to 1
    ChannelValues gamma{2.2, 2.2, 2.2};    ///< the projector's: light = signal ^ gamma
    double black = 0;  ///< light of the projector's black, as a part of its white's: lifted where fewer tiles overlap
    bool flipX = false, flipY = false;  ///< each eye's picture with its warp and blend, for projection from behind and
                                        ///< for hanging upside down

    /// The tile's picture goes out as it is.
    [[nodiscard]] bool plain() const;
    bool operator==(const TileOutput& other) const;
};

/// Bounds on outputs.
struct OutputLimits {
    int maxWarpSide = 1024;  ///< nodes
    std::size_t maxWarpNodes = 262'144;
    double maxNodePlace = 16;                           ///< |x|, |y|, |u|, |v|
    int maxOutputPixels = 16384;                        ///< each way, packed
    std::size_t maxName = 256;                          ///< bytes, of a monitor or a file
    std::size_t maxBlendBytes = std::size_t{16} << 20;  ///< of a PNG
};

/// What is wrong with a mesh: its node or face, counted from 0. Missing and negative nodes, folds, sizes.
[[nodiscard]] std::optional<std::string> findWarpFault(const WarpMesh& mesh, const OutputLimits& limits = {});

struct Wall;
/// What is wrong with the outputs of a wall that is whole otherwise; the first finding.
struct OutputFault {
    std::size_t host = 0, tile = 0;  ///< of the assignment
    std::string message;
};
[[nodiscard]] std::optional<OutputFault> findOutputFault(const Wall& wall, const OutputLimits& limits = {});

}  // namespace tessera
