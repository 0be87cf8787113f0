#include "server/tools/walls/WallAssembly.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "server/tools/walls/ScreenGrids.h"

namespace tessera {
namespace {

bool sameHead(const User& a, const User& b) {
    return (a.position - b.position).norm() <= 1e-9 && a.orientation.angularDistance(b.orientation) <= 1e-9 &&
           std::abs(a.eyeSeparationMetres - b.eyeSeparationMetres) <= 1e-9;
}

/// To a nanometre: what decimal files and sines of right angles leave behind it is no length.
Vec3d keptPlace(const Vec3d& place) {
    // Behind that doubles have no nanometres, and the wall is refused anyway.
    if (!(place.cwiseAbs().maxCoeff() < 1e6)) return place;
    Vec3d rounded;
    for (int axis = 0; axis < 3; ++axis) rounded[axis] = std::round(place[axis] * 1e9) / 1e9 + 0.0;
    return rounded;
}

bool isThisMachine(std::string_view address) {
    return address.empty() || address == "localhost" || address == "::1" || address == "0.0.0.0" ||
           address.starts_with("127.");
}

/// What the names of a grid's panels begin with, without what parts names; or `other`.
std::string commonName(const std::vector<DisplayPanel>& panels, const DisplayGrid& grid, const std::string& other) {
    std::string common = panels[grid.cells.front().panel].name;
    if (grid.cells.size() == 1) return common;
    for (const DisplayGrid::Cell& cell : grid.cells) {
        const std::string& name = panels[cell.panel].name;
        common.resize(static_cast<std::size_t>(std::ranges::mismatch(common, name).in1 - common.begin()));
    }
    while (!common.empty() && std::string_view("-_. 0123456789").find(common.back()) != std::string_view::npos)
        common.pop_back();
    return common.size() < 3 ? other : common;
}

/// The wall while it is made of pictures.
class PictureWall {
public:
    PictureWall(WallReading& reading, const std::vector<User>& users, const std::map<std::string, Machine>& machines)
        : reading_(reading), machines_(machines) {
        wall_.users = users;
    }

    /// Pictures of one place and one head are one display's; displays that stand in columns and rows are one screen.
    void addScreens(const std::vector<PlanePicture>& pictures) {
        std::vector<DisplayPanel> panels;
        std::vector<std::size_t> panelOf;
        for (const PlanePicture& picture : pictures) {
            const Vec3d corner = keptPlace(picture.lowerLeft);
            const DisplayPanel panel{.name = picture.name,
                                     .user = picture.user,
                                     .lowerLeft = corner,
                                     .right = keptPlace(picture.lowerRight) - corner,
                                     .up = keptPlace(picture.upperLeft) - corner,
                                     .widthPx = picture.widthPx,
                                     .heightPx = picture.heightPx};
            const auto same =
                std::ranges::find_if(panels, [&](const DisplayPanel& one) { return samePlace(one, panel); });
            panelOf.push_back(static_cast<std::size_t>(same - panels.begin()));
            if (same == panels.end()) panels.push_back(panel);
        }
        std::vector<Cell> cellOf(panels.size());
        std::set<std::string> names;
        for (DisplayGrid& grid : joinPanels(panels)) {
            Screen& screen = grid.screen;
            screen.name = wallName(commonName(panels, grid, "wall"), names);
            for (Vec3d* corner : {&screen.lowerLeft, &screen.lowerRight, &screen.upperLeft})
                *corner = keptPlace(*corner);
            for (const DisplayGrid::Cell& cell : grid.cells)
                cellOf[cell.panel] = {wall_.screens.size(), cell.column, cell.row};
            sayOf(screen, grid.why);
            wall_.screens.push_back(screen);
        }
        for (const std::size_t panel : panelOf) cells_.push_back(cellOf[panel]);
    }

    /// Of the `index`-th picture: one, or two for both eyes.
    void addTiles(const PlanePicture& picture, std::size_t index) {
        const Cell& cell = cells_[index];
        const bool both = picture.stereo != StereoPacking::kNone;
        std::vector<Eye> eyes{picture.eye};
        if (both) eyes = {Eye::kLeft, Eye::kRight};
        for (const Eye eye : eyes) {
            if (!drawn_.contains({cell, eye})) continue;
            return reading_.note(fmt::format("host \"{}\": \"{}\" is left out, as that picture is drawn already",
                                             picture.host, picture.name));
        }
        WallHost& host = hostOf(picture.host);
        for (const Eye eye : eyes) {
            TileAssignment tile{.screen = wall_.screens[cell.screen].name,
                                .column = cell.column,
                                .row = cell.row,
                                .eye = eye,
                                .user = picture.user,
                                .output = {}};
            if (eye == eyes.front()) {
                tile.output.stereo = picture.stereo;
                tile.output.swapEyes = picture.swapEyes;
                tile.output.flipX = picture.flipX;
                tile.output.flipY = picture.flipY;
            }
            host.tiles.push_back(tile);
            drawn_.emplace(cell, eye);
        }
        sayWhereBehind(wall_.screens[cell.screen], picture.user);
    }

    /// Eyes that are alone become both, and heads that nobody looks through go.
    [[nodiscard]] Wall take() {
        std::set<std::string> looked;
        for (WallHost& host : wall_.hosts) {
            for (TileAssignment& tile : host.tiles) {
                looked.insert(tile.user);
                if (tile.eye == Eye::kCenter) continue;
                const auto screen =
                    std::ranges::find(wall_.screens, tile.screen, &Screen::name) - wall_.screens.begin();
                const Cell cell{static_cast<std::size_t>(screen), tile.column, tile.row};
                const Eye other = tile.eye == Eye::kLeft ? Eye::kRight : Eye::kLeft;
                if (drawn_.contains({cell, other}) || drawn_.contains({cell, Eye::kCenter})) continue;
                reading_.note(
                    fmt::format("screen \"{}\": column {} row {} is drawn for the {} eye alone there, here for both",
                                tile.screen, tile.column, tile.row, tile.eye == Eye::kLeft ? "left" : "right"));
                tile.eye = Eye::kCenter;
            }
        }
        std::erase_if(wall_.users, [&](const User& user) { return !looked.contains(user.name); });
        return std::move(wall_);
    }

private:
    struct Cell {
        std::size_t screen = 0;  ///< index
        int column = 0, row = 0;
        auto operator<=>(const Cell&) const = default;
    };

    void sayOf(const Screen& screen, const std::string& whyAlone) {
        if (!whyAlone.empty())
            reading_.note(fmt::format("screen \"{}\" and others in its plane stay screens of their own: {}",
                                      screen.name, whyAlone));
        if (screen.grid.overlapXPx > 0 || screen.grid.overlapYPx > 0)
            reading_.note(
                fmt::format("screen \"{}\": its tiles overlap; say `blend: true` in their outputs, or how they blend",
                            screen.name));
    }

    void sayWhereBehind(const Screen& screen, const std::string& name) {
        const User* user = wall_.findUser(name);
        const Vec3d normal = (screen.lowerRight - screen.lowerLeft).cross(screen.upperLeft - screen.lowerLeft);
        if (user != nullptr && normal.dot(user->position - screen.lowerLeft) <= 0)
            reading_.note(fmt::format("screen \"{}\": user \"{}\" stands behind it; are its left and right exchanged?",
                                      screen.name, name));
    }

    WallHost& hostOf(const std::string& name) {
        const auto [at, isNew] = hosts_.emplace(name, wall_.hosts.size());
        if (isNew) {
            wall_.hosts.push_back({.name = wallName(name, hostNames_), .tiles = {}});
            if (const auto machine = machines_.find(name); machine != machines_.end())
                wall_.hosts.back().machine = machine->second;
        }
        return wall_.hosts[at->second];
    }

    WallReading& reading_;
    const std::map<std::string, Machine>& machines_;
    Wall wall_;
    std::vector<Cell> cells_;  ///< of each picture
    std::set<std::pair<Cell, Eye>> drawn_;
    std::map<std::string, std::size_t> hosts_;  ///< by their names there
    std::set<std::string> hostNames_;
};

}  // namespace

std::string WallAssembly::addUser(User user) {
    if (users_.size() == WallLimits().maxUsers) {
        reading_.refuse("",
                        fmt::format("more than {} heads: leave out those that no picture is drawn for", users_.size()));
        return users_.front().name;
    }
    user.position = keptPlace(user.position);
    user.name = wallName(user.name, userNames_);
    users_.push_back(user);
    return user.name;
}

std::string WallAssembly::addUserOnce(User user) {
    user.position = keptPlace(user.position);
    const auto known = std::ranges::find_if(users_, [&](const User& one) { return sameHead(one, user); });
    return known == users_.end() ? addUser(std::move(user)) : known->name;
}

void WallAssembly::setMachine(const std::string& host, const std::string& address, const std::string& display) {
    if (isThisMachine(address) || machines_.contains(host)) return;
    const Machine machine{.ssh = address, .display = display, .environment = {}, .arguments = {}};
    if (const auto fault = findMachineFault(machine))
        reading_.note(fmt::format("host \"{}\": its address is left out, as it {}", host, *fault));
    else
        machines_.emplace(host, machine);
}

void WallAssembly::add(PlanePicture picture) {
    if (pictures_.size() == kMostPictures)
        reading_.refuse("", fmt::format("more than {} pictures: split the wall", kMostPictures));
    else
        pictures_.push_back(std::move(picture));
}

Expected<ForeignWall> WallAssembly::finish(const std::string& source) {
    if (pictures_.empty())
        reading_.refuse("", "nothing is left that can be drawn on a plane" +
                                (reading_.notes().empty() ? std::string() : ": " + reading_.notes().front()));
    if (!reading_.sound()) return tl::unexpected(*reading_.fault());
    PictureWall made(reading_, users_, machines_);
    made.addScreens(pictures_);
    for (std::size_t i = 0; i < pictures_.size(); ++i) made.addTiles(pictures_[i], i);
    ForeignWall result{.wall = made.take(), .notes = reading_.notes(), .source = source};
    if (const Expected<void> good = checkWall(result.wall); !good) {
        reading_.refuse("", "the wall that it describes cannot be used: " + good.error().message);
        return tl::unexpected(*reading_.fault());
    }
    return result;
}

}  // namespace tessera
