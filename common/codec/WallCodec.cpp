#include "common/codec/WallCodec.h"

#include <fmt/format.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/stubs/logging.h>

#include <algorithm>

#include "common/codec/MachineMessage.h"
#include "common/codec/NavigationMessage.h"
#include "common/codec/TrackingMessage.h"
#include "common/codec/WallMessage.h"
#include "proto/wall.pb.h"

namespace tessera {

namespace {

void put(proto::Wall::Point& to, const Vec3d& from) {
    to.set_x(from.x());
    to.set_y(from.y());
    to.set_z(from.z());
}

Vec3d pointOf(const proto::Wall::Point& from) {
    return {from.x(), from.y(), from.z()};
}

/// The three corners that the rest of Tessera uses, from any three of four.
std::optional<std::string> readCorners(const proto::Wall::Screen& from, Screen& to) {
    const int given = from.has_lower_left() + from.has_lower_right() + from.has_upper_left() + from.has_upper_right();
    if (given < 3) {
        return fmt::format(
            "screen \"{}\" has {} of its corners: three of lower_left, lower_right, upper_left and upper_right are "
            "needed",
            from.name(), given);
    }
    const Vec3d ll = pointOf(from.lower_left()), lr = pointOf(from.lower_right());
    const Vec3d ul = pointOf(from.upper_left()), ur = pointOf(from.upper_right());
    to.lowerLeft = from.has_lower_left() ? ll : Vec3d(lr + ul - ur);
    to.lowerRight = from.has_lower_right() ? lr : Vec3d(ll + ur - ul);
    to.upperLeft = from.has_upper_left() ? ul : Vec3d(ll + ur - lr);
    if (given == 4) {
        const double gap = (ll + ur - lr - ul).norm();
        const double tolerance = std::max(0.001, 0.001 * std::max((lr - ll).norm(), (ul - ll).norm()));
        if (!(gap <= tolerance)) {
            return fmt::format(
                "the four corners of screen \"{}\" do not close: upper_right is {:.4g} m from where the other three "
                "put it; leave one corner out or correct it",
                from.name(), gap);
        }
    }
    return std::nullopt;
}

Screen::Grid readGrid(const proto::Wall::Grid& from) {
    Screen::Grid grid;
    grid.columns = from.columns();
    grid.rows = from.rows();
    grid.columnWidthsPx.assign(from.column_widths_px().begin(), from.column_widths_px().end());
    grid.rowHeightsPx.assign(from.row_heights_px().begin(), from.row_heights_px().end());
    grid.tileWidthPx = grid.columnWidthsPx.empty() ? from.tile_width_px() : grid.columnWidthsPx.front();
    grid.tileHeightPx = grid.rowHeightsPx.empty() ? from.tile_height_px() : grid.rowHeightsPx.front();
    grid.bezelXPx = from.bezel_x_px();
    grid.bezelYPx = from.bezel_y_px();
    grid.overlapXPx = from.overlap_x_px();
    grid.overlapYPx = from.overlap_y_px();
    return grid;
}

SyncPolicy readSync(const proto::Wall::Sync& from) {
    SyncPolicy sync;
    // Times outside of an int's milliseconds are kept outside of the range that checkWall allows.
    const auto ms = [](std::int64_t value) {
        return std::chrono::milliseconds(std::clamp<std::int64_t>(value, -1, std::int64_t{1} << 40));
    };
    switch (from.late_frame()) {
        case proto::Wall::HOLD:
            sync.lateFrame = LateFramePolicy::kHold;
            break;
        case proto::Wall::DROP:
            sync.lateFrame = LateFramePolicy::kDrop;
            break;
        default:
            sync.lateFrame = LateFramePolicy::kWait;
    }
    if (from.has_frame_deadline_ms()) sync.frameDeadline = ms(from.frame_deadline_ms());
    if (from.has_first_frame_deadline_ms()) sync.firstFrameDeadline = ms(from.first_frame_deadline_ms());
    if (from.has_late_after_ms()) sync.lateAfter = ms(from.late_after_ms());
    if (from.has_heartbeat_ms()) sync.heartbeat = ms(from.heartbeat_ms());
    if (from.has_lost_after_ms()) sync.lostAfter = ms(from.lost_after_ms());
    if (from.has_start_deadline_ms()) sync.startDeadline = ms(from.start_deadline_ms());
    return sync;
}

TileAssignment readTile(const proto::Wall::Tile& from) {
    return {.screen = from.screen(),
            .column = from.column(),
            .row = from.row(),
            .eye = from.eye() == proto::Wall::LEFT    ? Eye::kLeft
                   : from.eye() == proto::Wall::RIGHT ? Eye::kRight
                                                      : Eye::kCenter,
            .user = from.user()};
}

/// Of a tile; nothing where it is on no screen: the check says so.
ScreenPixels sizeOf(const Wall& wall, const TileAssignment& tile) {
    const Screen* const screen = wall.findScreen(tile.screen);
    if (!screen) return {};
    const Screen::Grid& grid = screen->grid;
    const auto within = [](int index, const std::vector<int>& sizes) {
        return index >= 0 && (sizes.empty() || static_cast<std::size_t>(index) < sizes.size());
    };
    if (!within(tile.column, grid.columnWidthsPx) || !within(tile.row, grid.rowHeightsPx)) return {};
    return {.width = grid.columnWidthPx(tile.column), .height = grid.rowHeightPx(tile.row)};
}

}  // namespace

proto::Wall messageOf(const Wall& wall) {
    proto::Wall message;
    message.set_name(wall.name);
    message.set_samples(wall.samples);
    message.set_budget_ms(wall.budgetMs);
    if (wall.nearMetres != kNearPlaneMetres) message.set_near_m(wall.nearMetres);
    message.set_culler(std::string(nameOf(wall.culler)));
    for (const Screen& screen : wall.screens) {
        proto::Wall::Screen& to = *message.add_screens();
        to.set_name(screen.name);
        put(*to.mutable_lower_left(), screen.lowerLeft);
        put(*to.mutable_lower_right(), screen.lowerRight);
        put(*to.mutable_upper_left(), screen.upperLeft);
        const Screen::Grid& g = screen.grid;
        proto::Wall::Grid& grid = *to.mutable_grid();
        grid.set_columns(g.columns);
        grid.set_rows(g.rows);
        grid.set_tile_width_px(g.tileWidthPx);
        grid.set_tile_height_px(g.tileHeightPx);
        for (const int px : g.columnWidthsPx) grid.add_column_widths_px(px);
        for (const int px : g.rowHeightsPx) grid.add_row_heights_px(px);
        grid.set_bezel_x_px(g.bezelXPx);
        grid.set_bezel_y_px(g.bezelYPx);
        grid.set_overlap_x_px(g.overlapXPx);
        grid.set_overlap_y_px(g.overlapYPx);
    }
    for (const User& user : wall.users) {
        proto::Wall::User& to = *message.add_users();
        to.set_name(user.name);
        put(*to.mutable_position(), user.position);
        to.mutable_orientation()->set_w(user.orientation.w());
        to.mutable_orientation()->set_x(user.orientation.x());
        to.mutable_orientation()->set_y(user.orientation.y());
        to.mutable_orientation()->set_z(user.orientation.z());
        to.set_eye_separation_m(user.eyeSeparationMetres);
    }
    for (const WallHost& host : wall.hosts) {
        proto::Wall::Host& to = *message.add_hosts();
        to.set_name(host.name);
        if (host.machine) put(*to.mutable_machine(), *host.machine);
        for (const TileAssignment& tile : host.tiles) {
            proto::Wall::Tile& assigned = *to.add_tiles();
            assigned.set_screen(tile.screen);
            assigned.set_column(tile.column);
            assigned.set_row(tile.row);
            assigned.set_eye(tile.eye == Eye::kLeft    ? proto::Wall::LEFT
                             : tile.eye == Eye::kRight ? proto::Wall::RIGHT
                                                       : proto::Wall::CENTER);
            assigned.set_user(tile.user);
            if (!(tile.output == TileOutput())) putOutput(tile.output, *assigned.mutable_output());
        }
    }
    putNavigation(wall.navigation, *message.mutable_navigation());
    proto::Wall::Sync& sync = *message.mutable_sync();
    sync.set_late_frame(wall.sync.lateFrame == LateFramePolicy::kHold   ? proto::Wall::HOLD
                        : wall.sync.lateFrame == LateFramePolicy::kDrop ? proto::Wall::DROP
                                                                        : proto::Wall::WAIT);
    sync.set_frame_deadline_ms(wall.sync.frameDeadline.count());
    sync.set_first_frame_deadline_ms(wall.sync.firstFrameDeadline.count());
    sync.set_late_after_ms(wall.sync.lateAfter.count());
    sync.set_heartbeat_ms(wall.sync.heartbeat.count());
    sync.set_lost_after_ms(wall.sync.lostAfter.count());
    sync.set_start_deadline_ms(wall.sync.startDeadline.count());
    putTracking(wall, message);
    return message;
}

tl::expected<Wall, WallFault> wallOf(const proto::Wall& message, const WallFiles& files) {
    Wall wall;
    wall.name = message.name();
    if (message.has_samples()) wall.samples = message.samples();
    wall.budgetMs = message.budget_ms();
    if (message.has_near_m()) wall.nearMetres = message.near_m();
    const auto fault = [](WallFault::Part part, int index, std::string text) {
        return tl::unexpected(
            WallFault{.part = part, .index = static_cast<std::size_t>(index), .tile = 0, .message = std::move(text)});
    };
    if (!message.culler().empty()) {
        const auto culler = parseCuller(message.culler());
        if (!culler) return fault(WallFault::Part::kWall, 0, culler.error().message);
        wall.culler = *culler;
    }
    // Enumerations are open in proto3: a number may stand for nothing.
    if (!proto::Wall::LateFrame_IsValid(message.sync().late_frame())) {
        return fault(WallFault::Part::kSync, 0,
                     fmt::format("late_frame cannot be {}: WAIT, HOLD and DROP are known",
                                 static_cast<int>(message.sync().late_frame())));
    }
    wall.sync = readSync(message.sync());
    if (message.has_navigation()) {
        const Expected<Navigation> navigation = readNavigation(message.navigation());
        if (!navigation) return fault(WallFault::Part::kNavigation, 0, navigation.error().message);
        wall.navigation = *navigation;
    }
    for (int i = 0; i < message.screens_size(); ++i) {
        const proto::Wall::Screen& from = message.screens(i);
        Screen screen;
        screen.name = from.name();
        if (auto wrong = readCorners(from, screen)) return fault(WallFault::Part::kScreen, i, std::move(*wrong));
        if (!from.has_grid()) {
            return fault(WallFault::Part::kScreen, i,
                         fmt::format("screen \"{}\" has no grid: add `grid {{ columns: 1 rows: 1 tile_width_px: 1920 "
                                     "tile_height_px: 1080 }}`",
                                     from.name()));
        }
        screen.grid = readGrid(from.grid());
        wall.screens.push_back(std::move(screen));
    }
    for (int i = 0; i < message.users_size(); ++i) {
        const proto::Wall::User& from = message.users(i);
        if (!from.has_position()) {
            return fault(
                WallFault::Part::kUser, i,
                fmt::format("user \"{}\" has no position: add `position {{ x: 0 y: 1.7 z: 2.4 }}`", from.name()));
        }
        User user;
        user.name = from.name();
        user.position = pointOf(from.position());
        if (from.has_orientation()) {
            const proto::Wall::Quaternion& q = from.orientation();
            user.orientation = Quatd(q.w(), q.x(), q.y(), q.z());
        }
        if (from.has_eye_separation_m()) user.eyeSeparationMetres = from.eye_separation_m();
        wall.users.push_back(std::move(user));
    }
    for (int h = 0; h < message.hosts_size(); ++h) {
        const proto::Wall::Host& from = message.hosts(h);
        WallHost host;
        host.name = from.name();
        if (from.has_machine()) host.machine = machineOf(from.machine());
        for (int t = 0; t < from.tiles_size(); ++t) {
            const proto::Wall::Tile& tile = from.tiles(t);
            if (!proto::Wall::Eye_IsValid(tile.eye())) {
                return tl::unexpected(
                    WallFault{.part = WallFault::Part::kTile,
                              .index = static_cast<std::size_t>(h),
                              .tile = static_cast<std::size_t>(t),
                              .message = fmt::format("eye cannot be {}: CENTER, LEFT and RIGHT are known",
                                                     static_cast<int>(tile.eye()))});
            }
            host.tiles.push_back(readTile(tile));
            if (!tile.has_output()) continue;
            const ScreenPixels size = sizeOf(wall, host.tiles.back());
            auto output = outputOf(tile.output(), size.width, size.height, files);
            if (!output)
                return tl::unexpected(WallFault{.part = WallFault::Part::kTile,
                                                .index = static_cast<std::size_t>(h),
                                                .tile = static_cast<std::size_t>(t),
                                                .message = output.error().message});
            host.tiles.back().output = std::move(*output);
        }
        wall.hosts.push_back(std::move(host));
    }
    if (std::optional<WallFault> wrong = readTracking(message, wall)) return tl::unexpected(std::move(*wrong));
    if (std::optional<WallFault> found = findWallFault(wall)) return tl::unexpected(std::move(*found));
    return wall;
}

Bytes encodeWall(const Wall& wall) {
    const proto::Wall message = messageOf(wall);
    Bytes bytes(message.ByteSizeLong());
    const bool written = message.SerializeToArray(bytes.data(), static_cast<int>(bytes.size()));
    TESSERA_CHECK(written, "a wall larger than 2 GiB");
    return bytes;
}

Expected<Wall> decodeWall(ByteSpan bytes) {
    if (bytes.size() > kMaxWallWireBytes) {
        return fail(ErrorCode::kLimit, fmt::format("a wall configuration of {} bytes, at most {} are allowed",
                                                   bytes.size(), kMaxWallWireBytes));
    }
    google::protobuf::io::CodedInputStream in(reinterpret_cast<const std::uint8_t*>(bytes.data()),
                                              static_cast<int>(bytes.size()));
    in.SetRecursionLimit(8);
    proto::Wall message;
    // Protobuf would write to stderr about text that is not UTF-8; what a peer says is no reason to.
    const google::protobuf::LogSilencer silence;
    if (!message.ParseFromCodedStream(&in) || !in.ConsumedEntireMessage()) {
        return fail(ErrorCode::kBadInput,
                    "the wall configuration is not the message it should be: damaged, or of another version");
    }
    tl::expected<Wall, WallFault> wall = wallOf(message);
    if (!wall) return fail(ErrorCode::kBadInput, "wall configuration: " + wall.error().message);
    return std::move(*wall);
}

}  // namespace tessera
