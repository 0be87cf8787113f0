/// What can be wrong with a wall, in words.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "common/wall/Wall.h"
#include "common/wall/WallNames.h"

namespace tessera {

namespace {

using Part = WallFault::Part;

/// Checks one wall; `fault` ends up with the first finding.
class WallCheck {
public:
    WallCheck(const Wall& wall, const WallLimits& limits) : wall_(wall), limits_(limits) {}

    std::optional<WallFault> run() {
        checkCounts() && checkScreens() && checkUsers() && checkHosts() && checkCoverage() && checkOutputs() &&
            checkSync() && checkNavigation();
        if (!fault_) fault_ = findTrackingFault(wall_, limits_);
        return std::move(fault_);
    }

private:
    bool found(Part part, std::size_t index, std::string message, std::size_t tile = 0) {
        fault_ = WallFault{.part = part, .index = index, .tile = tile, .message = std::move(message)};
        return false;
    }

    bool checkNavigation() {
        const std::optional<std::string> fault = findNavigationFault(wall_.navigation);
        return !fault || found(Part::kNavigation, 0, "navigation: " + *fault);
    }

    bool checkCounts() {
        const auto count = [&](std::size_t have, std::size_t most, std::string_view what) {
            if (have == 0)
                return found(Part::kWall, 0,
                             fmt::format("the wall has no {0}s: at least one `{0}s {{ … }}` is needed", what));
            if (have > most)
                return found(Part::kWall, 0,
                             fmt::format("the wall has {} {}s, at most {} are allowed", have, what, most));
            return true;
        };
        if (!count(wall_.screens.size(), limits_.maxScreens, "screen") ||
            !count(wall_.users.size(), limits_.maxUsers, "user") ||
            !count(wall_.hosts.size(), limits_.maxHosts, "host")) {
            return false;
        }
        std::size_t tiles = 0;
        for (const WallHost& host : wall_.hosts) tiles += host.tiles.size();
        if (tiles > limits_.maxTiles)
            return found(Part::kWall, 0,
                         fmt::format("the wall has {} tiles, at most {} are allowed", tiles, limits_.maxTiles));
        if (wall_.samples != 1 && wall_.samples != 4) {
            return found(Part::kWall, 0, fmt::format("{} samples per pixel: 1 and 4 are possible", wall_.samples));
        }
        if (!isNear(wall_.nearMetres))
            return found(Part::kWall, 0, fmt::format("near_m: {} m; 0.001 to 1 are possible", wall_.nearMetres));
        if (!isBudget(wall_.budgetMs))
            return found(Part::kWall, 0,
                         fmt::format("a budget of {} ms for a frame: 0, which is none, and 0.1 to 60000 are possible",
                                     wall_.budgetMs));
        return true;
    }

    /// Names become names of folders and stand in logs.
    bool checkName(Part part, std::size_t index, std::string_view kind, const std::string& name,
                   std::set<std::string>& taken) {
        if (std::optional<std::string> wrong = nameFault(kind, index, name, limits_.maxName, taken))
            return found(part, index, std::move(*wrong));
        return true;
    }

    bool checkScreens() {
        std::set<std::string> taken;
        for (std::size_t i = 0; i < wall_.screens.size(); ++i) {
            if (!checkName(Part::kScreen, i, "screen", wall_.screens[i].name, taken) || !checkCorners(i) ||
                !checkGrid(i))
                return false;
        }
        return true;
    }

    bool checkCorners(std::size_t i) {
        const Screen& screen = wall_.screens[i];
        const auto say = [&](std::string text) {
            return found(Part::kScreen, i, fmt::format("screen \"{}\" {}", screen.name, text));
        };
        for (const Vec3d* corner : {&screen.lowerLeft, &screen.lowerRight, &screen.upperLeft}) {
            if (!corner->allFinite()) return say("has a corner that is not made of finite numbers");
        }
        const Vec3d right = screen.lowerRight - screen.lowerLeft;
        const Vec3d up = screen.upperLeft - screen.lowerLeft;
        constexpr double kSmallest = 0.01;
        if (right.norm() < kSmallest || up.norm() < kSmallest) {
            return say(
                fmt::format("is {:.6g} m wide and {:.6g} m high: it has no area; are two of its corners the same?",
                            right.norm(), up.norm()));
        }
        const double farthest =
            std::max({screen.lowerLeft.cwiseAbs().maxCoeff(), screen.lowerRight.cwiseAbs().maxCoeff(),
                      screen.upperLeft.cwiseAbs().maxCoeff()});
        if (right.norm() > limits_.maxMetres || up.norm() > limits_.maxMetres || farthest > 10 * limits_.maxMetres) {
            return say(
                fmt::format("is {:.6g} m wide and {:.6g} m high: that looks like millimetres; corners are in metres",
                            right.norm(), up.norm()));
        }
        const double cosine = right.dot(up) / (right.norm() * up.norm());
        if (std::abs(cosine) > 0.001) {
            const double degrees = std::acos(std::clamp(cosine, -1.0, 1.0)) * 180 / 3.14159265358979323846;
            return say(
                fmt::format("is skewed: its lower and its left edge meet at {:.2f} degrees, not 90; check lower_left, "
                            "lower_right and upper_left",
                            degrees));
        }
        return true;
    }

    bool checkGrid(std::size_t i) {
        const Screen& screen = wall_.screens[i];
        const Screen::Grid& g = screen.grid;
        const auto say = [&](std::string text) {
            return found(Part::kScreen, i, fmt::format("the grid of screen \"{}\" {}", screen.name, text));
        };
        if (g.columns < 1 || g.rows < 1 || g.columns > limits_.maxGrid || g.rows > limits_.maxGrid) {
            return say(
                fmt::format("has {} columns and {} rows: 1 to {} are possible", g.columns, g.rows, limits_.maxGrid));
        }
        if ((!g.columnWidthsPx.empty() && g.columnWidthsPx.size() != static_cast<std::size_t>(g.columns)) ||
            (!g.rowHeightsPx.empty() && g.rowHeightsPx.size() != static_cast<std::size_t>(g.rows))) {
            return say(fmt::format(
                "has {} columns and {} rows, but {} column widths and {} row heights: give one for each, or none",
                g.columns, g.rows, g.columnWidthsPx.size(), g.rowHeightsPx.size()));
        }
        if (g.bezelXPx < 0 || g.bezelYPx < 0 || g.overlapXPx < 0 || g.overlapYPx < 0)
            return say("has a negative bezel or overlap");
        if ((g.bezelXPx > 0 && g.overlapXPx > 0) || (g.bezelYPx > 0 && g.overlapYPx > 0)) {
            return say(
                "has both a bezel and an overlap in the same direction: neighbours either have a gap or share pixels");
        }
        std::int64_t width = 0, height = 0;
        for (int c = 0; c < g.columns; ++c) {
            const int px = g.columnWidthPx(c);
            if (px < 1 || px > limits_.maxTilePixels)
                return say(fmt::format("has tiles {} pixels wide: 1 to {} are possible", px, limits_.maxTilePixels));
            if (g.columns > 1 && g.overlapXPx >= px)
                return say(fmt::format("has tiles {} pixels wide that overlap by {}", px, g.overlapXPx));
            width += px + (c > 0 ? std::int64_t{g.bezelXPx} - g.overlapXPx : 0);
        }
        for (int r = 0; r < g.rows; ++r) {
            const int px = g.rowHeightPx(r);
            if (px < 1 || px > limits_.maxTilePixels)
                return say(fmt::format("has tiles {} pixels high: 1 to {} are possible", px, limits_.maxTilePixels));
            if (g.rows > 1 && g.overlapYPx >= px)
                return say(fmt::format("has tiles {} pixels high that overlap by {}", px, g.overlapYPx));
            height += px + (r > 0 ? std::int64_t{g.bezelYPx} - g.overlapYPx : 0);
        }
        if (width > limits_.maxScreenPixels || height > limits_.maxScreenPixels) {
            return say(
                fmt::format("makes a picture of {} x {} pixels, hidden ones included: at most {} each way can be "
                            "drawn; use fewer pixels or two screens",
                            width, height, limits_.maxScreenPixels));
        }
        return true;
    }

    bool checkUsers() {
        std::set<std::string> taken;
        for (std::size_t i = 0; i < wall_.users.size(); ++i) {
            const User& user = wall_.users[i];
            if (!checkName(Part::kUser, i, "user", user.name, taken)) return false;
            const auto say = [&](std::string text) {
                return found(Part::kUser, i, fmt::format("user \"{}\" {}", user.name, text));
            };
            if (!user.position.allFinite()) return say("has a position that is not made of finite numbers");
            if (user.position.cwiseAbs().maxCoeff() > limits_.maxMetres) {
                return say(fmt::format("stands {:.6g} m away: that looks like millimetres; positions are in metres",
                                       user.position.cwiseAbs().maxCoeff()));
            }
            if (!tellsRotation(user.orientation.squaredNorm()))
                return say(
                    "has an orientation whose length is 0, or nearly, or beyond what numbers can hold: a quaternion w, "
                    "x, y, z is needed");
            if (!(user.eyeSeparationMetres >= 0 && user.eyeSeparationMetres <= 0.5)) {
                return say(fmt::format(
                    "has eyes {:.6g} m apart: that looks like millimetres, or a sign is wrong; 0.065 is usual",
                    user.eyeSeparationMetres));
            }
        }
        return true;
    }

    bool checkHosts() {
        std::set<std::string> taken;
        for (std::size_t h = 0; h < wall_.hosts.size(); ++h) {
            const WallHost& host = wall_.hosts[h];
            if (!checkName(Part::kHost, h, "host", host.name, taken)) return false;
            if (host.tiles.empty())
                return found(Part::kHost, h,
                             fmt::format("host \"{}\" has no tiles: nothing would be drawn on it", host.name));
            if (auto fault = host.machine ? findMachineFault(*host.machine) : std::nullopt)
                return found(Part::kHost, h, fmt::format("the machine of host \"{}\" {}", host.name, *fault));
            for (std::size_t t = 0; t < host.tiles.size(); ++t) {
                if (!checkTile(h, t)) return false;
            }
        }
        return true;
    }

    bool checkTile(std::size_t h, std::size_t t) {
        const WallHost& host = wall_.hosts[h];
        const TileAssignment& tile = host.tiles[t];
        const auto say = [&](std::string text) {
            return found(Part::kTile, h, fmt::format("host \"{}\": {}", host.name, text), t);
        };
        const Screen* screen = wall_.findScreen(tile.screen);
        if (screen == nullptr) return say(unknownName("screen", tile.screen, namesOf(wall_.screens)));
        const User* user = wall_.findUser(tile.user);
        if (user == nullptr) return say(unknownName("user", tile.user, namesOf(wall_.users)));
        const Screen::Grid& g = screen->grid;
        if (tile.column < 0 || tile.row < 0 || tile.column >= g.columns || tile.row >= g.rows) {
            return say(
                fmt::format("column {} row {} is not on screen \"{}\", which has columns 0 to {} and rows 0 to {}",
                            tile.column, tile.row, screen->name, g.columns - 1, g.rows - 1));
        }
        auto& cell = cells_[{tile.screen, tile.column, tile.row}];
        const auto where = [&] {
            return fmt::format("column {} row {} of screen \"{}\"", tile.column, tile.row, tile.screen);
        };
        if (const auto other = cell.find(tile.eye); other != cell.end()) {
            return say(fmt::format("{} is assigned twice, first to host \"{}\"", where(), other->second));
        }
        if (!cell.empty() && (tile.eye == Eye::kCenter || cell.contains(Eye::kCenter))) {
            return say(fmt::format(
                "{} is assigned twice, once for both eyes together and once for one eye, first to host \"{}\"", where(),
                cell.begin()->second));
        }
        cell.emplace(tile.eye, host.name);
        return checkEye(*screen, *user, tile.eye, h, t);
    }

    bool checkEye(const Screen& screen, const User& user, Eye which, std::size_t h, std::size_t t) {
        const Vec3d right = (screen.lowerRight - screen.lowerLeft).normalized();
        const Vec3d up = (screen.upperLeft - screen.lowerLeft).normalized();
        const double distance = right.cross(up).dot(user.eye(which) - screen.lowerLeft);
        const std::size_t index = static_cast<std::size_t>(&screen - wall_.screens.data());
        const auto corners = [&](std::string text) {
            return found(Part::kScreen, index, fmt::format("screen \"{}\" {}", screen.name, text));
        };
        if (up.y() < -0.5)
            return corners(
                "is upside down: its upper edge is below its lower edge; are its upper and lower corners swapped?");
        if (std::abs(distance) < 0.01) {
            return found(
                Part::kTile, h,
                fmt::format("an eye of user \"{}\" lies in the plane of screen \"{}\": it would see the screen edge-on",
                            user.name, screen.name),
                t);
        }
        if (distance > 0) return true;
        // Seen from the user the corners run clockwise. Which of the ways to get there it is shows by the head's own
        // axes.
        if ((user.orientation.normalized() * Vec3d::UnitX()).dot(right) < -0.5) {
            return corners(fmt::format(
                "is left-handed seen from user \"{}\", a mirror image: are its left and right corners swapped?",
                user.name));
        }
        if (std::abs(right.y()) > 0.5 && std::abs(up.y()) < 0.5) {
            return corners(
                fmt::format("is left-handed seen from user \"{}\", and its lower edge runs upwards: are lower_right "
                            "and upper_left swapped?",
                            user.name));
        }
        return corners(fmt::format(
            "shows its back to user \"{}\": the user stands behind it, or two of its corners are swapped", user.name));
    }

    bool checkCoverage() {
        for (std::size_t i = 0; i < wall_.screens.size(); ++i) {
            const Screen& screen = wall_.screens[i];
            for (int row = 0; row < screen.grid.rows; ++row) {
                for (int column = 0; column < screen.grid.columns; ++column) {
                    const auto cell = cells_.find({screen.name, column, row});
                    if (cell == cells_.end()) {
                        return found(Part::kScreen, i,
                                     fmt::format("column {} row {} of screen \"{}\" is drawn by no host: add `tiles {{ "
                                                 "screen: \"{}\" column: {} row: {} … }}` to one",
                                                 column, row, screen.name, screen.name, column, row));
                    }
                    if (cell->second.size() == 1 && !cell->second.contains(Eye::kCenter)) {
                        const bool left = cell->second.contains(Eye::kLeft);
                        return found(
                            Part::kScreen, i,
                            fmt::format("column {} row {} of screen \"{}\" is drawn for the {} eye only: the {} eye "
                                        "would see nothing",
                                        column, row, screen.name, left ? "left" : "right", left ? "right" : "left"));
                    }
                }
            }
        }
        return true;
    }

    bool checkOutputs() {
        auto fault = findOutputFault(wall_);
        return !fault || found(Part::kTile, fault->host, std::move(fault->message), fault->tile);
    }

    bool checkSync() {
        const SyncPolicy& s = wall_.sync;
        const auto say = [&](std::string text) { return found(Part::kSync, 0, std::move(text)); };
        constexpr std::chrono::milliseconds kLongest = std::chrono::hours(1);
        const std::pair<std::string_view, std::chrono::milliseconds> times[] = {
            {"frame_deadline_ms", s.frameDeadline}, {"first_frame_deadline_ms", s.firstFrameDeadline},
            {"late_after_ms", s.lateAfter},         {"heartbeat_ms", s.heartbeat},
            {"lost_after_ms", s.lostAfter},         {"start_deadline_ms", s.startDeadline}};
        for (const auto& [name, time] : times) {
            if (time.count() < 1 || time > kLongest)
                return say(fmt::format("{} is {}: 1 to {} ms are possible", name, time.count(), kLongest.count()));
        }
        if (s.lostAfter < 2 * s.heartbeat) {
            return say(
                fmt::format("a host is lost after {} ms of silence but speaks only every {} ms: lost_after_ms has to "
                            "be at least twice heartbeat_ms",
                            s.lostAfter.count(), s.heartbeat.count()));
        }
        if (s.lateFrame != LateFramePolicy::kWait && s.lateAfter >= s.frameDeadline) {
            return say(fmt::format("late_after_ms ({}) has to be below frame_deadline_ms ({})", s.lateAfter.count(),
                                   s.frameDeadline.count()));
        }
        return true;
    }

    const Wall& wall_;
    const WallLimits limits_;
    std::optional<WallFault> fault_;
    /// Which host draws a cell (screen, column, row), for which eye.
    std::map<std::tuple<std::string, int, int>, std::map<Eye, std::string>> cells_;
};

}  // namespace

std::optional<WallFault> findWallFault(const Wall& wall, const WallLimits& limits) {
    return WallCheck(wall, limits).run();
}

}  // namespace tessera
