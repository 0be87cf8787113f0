/// The display: screens in metres, tiles in pixels, users with eyes, hosts with tiles. Values only; `common/codec`
/// reads them from files, `checkWall` says what is wrong with them in words.
///
/// Frame of reference: the wall's own, metres, right-handed, +Y up, -Z into the front wall.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/Error.h"
#include "common/base/SyncPolicy.h"
#include "common/math/Types.h"
#include "common/wall/Culler.h"
#include "common/wall/Machine.h"
#include "common/wall/Navigation.h"
#include "common/wall/Output.h"
#include "common/wall/Tracking.h"

namespace tessera {

/// One physical plane and the grid of tiles on it. Column 0 is left, row 0 is at the bottom.
struct Screen {
    std::string name;
    Vec3d lowerLeft = Vec3d::Zero();
    Vec3d lowerRight = Vec3d::UnitX();
    Vec3d upperLeft = Vec3d::UnitY();
    struct Grid {
        int columns = 1, rows = 1;
        int tileWidthPx = 960, tileHeightPx = 540;
        /// Uneven shares of an odd total (`--size`); empty: all alike.
        std::vector<int> columnWidthsPx, rowHeightsPx;
        int bezelXPx = 0, bezelYPx = 0;      ///< pixels hidden behind the frame between two tiles
        int overlapXPx = 0, overlapYPx = 0;  ///< pixels that two neighbours both show (blended projectors)

        [[nodiscard]] int columnWidthPx(int column) const;
        [[nodiscard]] int rowHeightPx(int row) const;
    } grid;

    [[nodiscard]] double widthMetres() const { return (lowerRight - lowerLeft).norm(); }
    [[nodiscard]] double heightMetres() const { return (upperLeft - lowerLeft).norm(); }
};

enum class Eye : std::uint8_t { kCenter, kLeft, kRight };

struct User {
    std::string name;
    Vec3d position{0, 1.7, 2.4};
    Quatd orientation = Quatd::Identity();
    double eyeSeparationMetres = 0.065;
    /// Left and right lie along the head's own right axis.
    [[nodiscard]] Vec3d eye(Eye which) const;
};

struct TileAssignment {
    std::string screen;
    int column = 0, row = 0;
    Eye eye = Eye::kCenter;
    std::string user;
    TileOutput output;
};

struct WallHost {
    std::string name;
    std::vector<TileAssignment> tiles;
    std::optional<Machine> machine = {};  ///< that its client is started on; none: the server's
};

/// From the eye, along the screen's axis.
inline constexpr double kNearPlaneMetres = 0.05;
[[nodiscard]] inline bool isNear(double metres) {
    return metres >= 0.001 && metres <= 1;
}

struct Wall {
    std::string name;
    std::vector<Screen> screens;
    std::vector<User> users;
    std::vector<WallHost> hosts;
    SyncPolicy sync;
    int samples = 4;  ///< per pixel: 1 or 4
    /// That hosts may take for a frame: where they take longer, detail is left away until they do not (Detail.h). 0:
    /// none is ever left away.
    double budgetMs = 0;
    double nearMetres = kNearPlaneMetres;   ///< what is nearer to an eye's plane is not drawn; isNear
    CullerKind culler = CullerKind::kAuto;  ///< of hosts that are not told another one
    WallTracking tracking;
    Navigation navigation;

    [[nodiscard]] const Screen* findScreen(std::string_view name) const;
    [[nodiscard]] const User* findUser(std::string_view name) const;
};

/// What a frame may be wanted in.
inline constexpr double kLeastBudgetMs = 0.1, kMostBudgetMs = 60'000;
/// One of these, or 0: no detail is left away.
[[nodiscard]] inline bool isBudget(double milliseconds) {
    return milliseconds == 0 || (milliseconds >= kLeastBudgetMs && milliseconds <= kMostBudgetMs);
}

/// Rectangle in the pixels of a whole screen, origin at the lower left.
struct PixelRect {
    int x = 0, y = 0, width = 0, height = 0;
    bool operator==(const PixelRect&) const = default;
};

/// One tile, ready to draw.
struct Tile {
    std::string name;  ///< e.g. "front-0-1", with "-left" or "-right" for eyes; also the folder of its images
    std::string host;
    std::string screen;
    int column = 0, row = 0;
    Eye eye = Eye::kCenter;
    std::string user;
    PixelRect rect;        ///< in the screen's picture, hidden pixels behind bezels counted
    PixelRect mosaicRect;  ///< in the exact stitch without gaps
    TileOutput output;
};

/// Pixels of a screen's whole picture, those behind bezels included.
struct ScreenPixels {
    int width = 0, height = 0;
};
[[nodiscard]] ScreenPixels screenPixels(const Screen& screen);
/// Of the exact stitch: the visible pixels only.
[[nodiscard]] ScreenPixels mosaicPixels(const Screen& screen);

/// All tiles in the order hosts and tiles are written.
[[nodiscard]] std::vector<Tile> layoutTiles(const Wall& wall);
[[nodiscard]] std::vector<Tile> tilesOf(const Wall& wall, std::string_view host);

/// Bounds on what a wall may hold, checked before anything is laid out.
struct WallLimits {
    std::size_t maxScreens = 64, maxUsers = 64, maxHosts = 1024, maxTiles = 4096;
    int maxGrid = 128;            ///< columns, rows
    int maxTilePixels = 16384;    ///< each way: what one picture can hold
    int maxScreenPixels = 65536;  ///< each way; what single precision places to a hundredth of a pixel
    std::size_t maxName = 64;     ///< bytes; names become names of folders
    double maxMetres = 100;       ///< longer than that, a screen was written in millimetres
};

/// What is wrong with a wall, and in which part of it (so that a file's line can be named).
struct WallFault {
    enum class Part { kWall, kScreen, kUser, kHost, kTile, kSync, kTracker, kWand, kNavigation } part = Part::kWall;
    std::size_t index = 0;  ///< of the screen, user, host, tracker or wand
    std::size_t tile = 0;   ///< kTile: of the assignment in its host
    std::string message;
};
/// The first finding.
[[nodiscard]] std::optional<WallFault> findWallFault(const Wall& wall, const WallLimits& limits = {});

/// What is wrong with its trackers, heads and wands; a part of `findWallFault`.
[[nodiscard]] std::optional<WallFault> findTrackingFault(const Wall& wall, const WallLimits& limits);

/// Explains skewed, left-handed, zero-sized, millimetre-like, doubly assigned, uncovered, unknown-name and oversized
/// walls, and names what to change. First finding only.
[[nodiscard]] Expected<void> checkWall(const Wall& wall);

/// The visible pixels of the whole wall become width × height, shared out over the tiles of each screen; the odd rest
/// goes to the first columns and rows, so that the mosaic is exactly that size. Several screens stand side by side in
/// the mosaic: they share the width in proportion to what they had, and the height is that of the tallest. Bezels grow
/// and shrink with it, in whole pixels; overlaps stay as they are.
[[nodiscard]] Expected<Wall> withSize(const Wall& wall, int widthPx, int heightPx);

}  // namespace tessera
