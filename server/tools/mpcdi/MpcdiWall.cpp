#include "server/tools/mpcdi/MpcdiWall.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <set>

#include "common/codec/WallCodec.h"
#include "common/output/MeshFile.h"

namespace tessera {
namespace {

constexpr double kPlaneMetres = 3.2, kDistanceMetres = 2, kEyeHeightMetres = 1.7, kNearPx = 0.1;

/// A place that a warp map says, between its pixels' centres and half a pixel beyond the outer ones.
struct MapPlace {
    double u = 0, v = 0;
};
MapPlace mapAt(const FloatPicture& map, double x, double y) {
    const int x0 = std::clamp(static_cast<int>(std::floor(x)), 0, map.widthPx - 2),
              y0 = std::clamp(static_cast<int>(std::floor(y)), 0, map.heightPx - 2);
    const double fx = x - x0, fy = y - y0;
    const auto mix = [&](std::size_t c) {
        return (1 - fy) * ((1 - fx) * map.at(x0, y0)[c] + fx * map.at(x0 + 1, y0)[c]) +
               fy * ((1 - fx) * map.at(x0, y0 + 1)[c] + fx * map.at(x0 + 1, y0 + 1)[c]);
    };
    return {mix(0), mix(1)};
}

WarpMesh meshOf(const FloatPicture& map, int columns, int rows) {
    WarpMesh mesh{.columns = columns, .rows = rows, .nodes = {}};
    for (int row = 0; row < rows; ++row) {
        for (int column = 0; column < columns; ++column) {
            const double across = static_cast<double>(column) / (columns - 1),
                         up = static_cast<double>(row) / (rows - 1);
            const MapPlace place = mapAt(map, across * map.widthPx - 0.5, (1 - up) * map.heightPx - 0.5);
            mesh.nodes.push_back({.x = static_cast<float>(2 * across - 1),
                                  .y = static_cast<float>(2 * up - 1),
                                  .u = static_cast<float>(place.u),
                                  .v = static_cast<float>(1 - place.v),
                                  .intensity = 1});
        }
    }
    return mesh;
}

/// The farthest that a mesh shows from what the map says, at the map's pixels, in pixels of a tile.
double farthestOf(const WarpMesh& mesh, const FloatPicture& map, int widthPx, int heightPx) {
    double farthest = 0;
    for (int y = 0; y < map.heightPx; ++y) {
        for (int x = 0; x < map.widthPx; ++x) {
            const double across = (x + 0.5) / map.widthPx * (mesh.columns - 1),
                         up = (1 - (y + 0.5) / map.heightPx) * (mesh.rows - 1);
            const int column = std::min(static_cast<int>(across), mesh.columns - 2),
                      row = std::min(static_cast<int>(up), mesh.rows - 2);
            const double s = across - column, t = up - row;
            const auto mix = [&](float WarpNode::*part) {
                return (1 - t) * ((1 - s) * mesh.at(column, row).*part + s * mesh.at(column + 1, row).*part) +
                       t * ((1 - s) * mesh.at(column, row + 1).*part + s * mesh.at(column + 1, row + 1).*part);
            };
            farthest = std::max({farthest, widthPx * std::abs(mix(&WarpNode::u) - map.at(x, y)[0]),
                                 heightPx * std::abs(1 - mix(&WarpNode::v) - map.at(x, y)[1])});
        }
    }
    return farthest;
}

std::string fileName(const std::string& id, std::set<std::string>& taken) {
    std::string name;
    for (const char c : id.substr(0, 40))
        name += std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_' ? c : '-';
    for (std::string base = name; !taken.insert(name).second;) name = fmt::format("{}-{}", base, taken.size());
    return name;
}

/// A rectangle of a plane, by its lower left corner and its edges.
Screen screenOf(const std::string& name, const Vec3d& corner, const Vec3d& right, const Vec3d& up) {
    Screen screen{.name = name};
    screen.lowerLeft = corner;
    screen.lowerRight = corner + right;
    screen.upperLeft = corner + up;
    return screen;
}

Screen frustumScreen(const std::string& name, const MpcdiFrustum& f) {
    const auto radians = [](double degrees) { return degrees * std::numbers::pi / 180; };
    const Quatd turn = Quatd(Eigen::AngleAxisd(-radians(f.yaw), Vec3d::UnitY())) *
                       Quatd(Eigen::AngleAxisd(radians(f.pitch), Vec3d::UnitX())) *
                       Quatd(Eigen::AngleAxisd(-radians(f.roll), Vec3d::UnitZ()));
    const auto across = [&](double angle) { return kDistanceMetres * std::tan(radians(angle)); };
    const Vec3d corner = Vec3d(0, kEyeHeightMetres, 0) + turn * Vec3d(across(f.left), across(f.down), -kDistanceMetres);
    return screenOf(name, corner, turn * Vec3d(across(f.right) - across(f.left), 0, 0),
                    turn * Vec3d(0, across(f.up) - across(f.down), 0));
}

}  // namespace

Expected<MpcdiWall> wallOfMpcdi(const MpcdiFile& file) {
    MpcdiWall made{.wall = {}, .notes = file.notes};
    Wall& wall = made.wall;
    User user{.name = "viewer"};
    user.position = Vec3d(0, kEyeHeightMetres, file.threeD ? 0 : kDistanceMetres);
    wall.users = {user};
    std::set<std::string> names;
    double left = -0.5 * kPlaneMetres;
    for (const MpcdiBuffer& buffer : file.buffers) {
        const double shape = buffer.widthPx > 0 ? static_cast<double>(buffer.heightPx) / buffer.widthPx : 9.0 / 16;
        for (const MpcdiRegion& region : buffer.regions) {
            const std::string name = fileName(region.id, names);
            const bool sized = !file.threeD && buffer.widthPx > 0;
            Screen screen;
            if (file.threeD) {
                screen = frustumScreen(name, *region.frustum);
            } else {
                const double height = kPlaneMetres * shape, top = kEyeHeightMetres + 0.5 * height;
                screen = screenOf(name, {left + region.x * kPlaneMetres, top - (region.y + region.height) * height, 0},
                                  {region.width * kPlaneMetres, 0, 0}, {0, region.height * height, 0});
            }
            screen.grid.tileWidthPx =
                sized ? std::max(1, static_cast<int>(std::lround(region.width * buffer.widthPx))) : region.widthPx;
            screen.grid.tileHeightPx =
                sized ? std::max(1, static_cast<int>(std::lround(region.height * buffer.heightPx))) : region.heightPx;

            for (int y = 0; y < region.warp.heightPx; ++y)
                for (int x = 0; x < region.warp.widthPx; ++x)
                    for (const std::size_t c : {std::size_t{0}, std::size_t{1}})
                        if (!(region.warp.at(x, y)[c] >= -4 && region.warp.at(x, y)[c] <= 5))
                            return fail(ErrorCode::kBadInput,
                                        fmt::format("{}: a hole at column {} row {} ({:.6g} {:.6g})", region.warpName,
                                                    x, y, region.warp.at(x, y)[0], region.warp.at(x, y)[1]));
            WarpMesh mesh;
            double farthest = 0;
            for (const int faces : {4, 8, 16, 32, 64, 128, 256, 511}) {
                mesh = meshOf(region.warp, faces + 1, faces + 1);
                farthest = farthestOf(mesh, region.warp, screen.grid.tileWidthPx, screen.grid.tileHeightPx);
                if (farthest <= kNearPx) break;
            }
            if (const auto fault = findWarpFault(mesh))
                return fail(ErrorCode::kBadInput, fmt::format("{}: a warp map that {}", region.warpName, *fault));
            made.farthestPx = std::max(made.farthestPx, farthest);
            made.notes.push_back(
                fmt::format("region \"{}\": a mesh of {} x {} nodes shows what its warp map says to {:.3f} pixels{}",
                            region.id, mesh.columns, mesh.rows, farthest,
                            farthest > kNearPx ? ", more than a tenth: the map is finer than meshes may be" : ""));

            TileAssignment tile{.screen = name, .user = user.name};
            tile.output.widthPx = region.widthPx;
            tile.output.heightPx = region.heightPx;
            tile.output.warpFile = name + ".warp";
            tile.output.warp = std::make_shared<const WarpMesh>(std::move(mesh));
            if (!region.alpha.empty()) {
                tile.output.blendFile = name + ".png";
                tile.output.blendPicture = share(region.alpha);
                tile.output.blendPictureGamma = region.alphaGamma;
            }
            wall.screens.push_back(std::move(screen));
            wall.hosts.push_back({.name = name, .tiles = {std::move(tile)}});
        }
        left += 1.1 * kPlaneMetres;
    }
    if (!file.threeD)
        made.notes.push_back(
            fmt::format("profile 2d knows no metres: the picture lies on a plane {} m wide, {} m from the eyes; "
                        "correct the corners",
                        kPlaneMetres, kDistanceMetres));
    made.notes.push_back("each region is a host; join them where one machine drives several projectors");
    if (auto good = checkWall(wall); !good) return tl::unexpected(good.error());
    return made;
}

Expected<void> saveMpcdiWall(const MpcdiWall& made, const std::string& path) {
    const std::filesystem::path out(path);
    const auto write = [](const std::filesystem::path& to, std::string_view bytes) -> Expected<void> {
        std::ofstream file(to, std::ios::binary);
        file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
        file.close();
        if (file) return {};
        return fail(ErrorCode::kFailed, to.string() + ": cannot be written");
    };
    Wall named = made.wall;
    for (WallHost& host : named.hosts) {
        for (TileAssignment& tile : host.tiles) {
            TileOutput& output = tile.output;
            for (std::string* name : {&output.warpFile, &output.blendFile})
                if (!name->empty()) *name = out.stem().string() + "-" + *name;
            const std::string mesh = meshText(*output.warp, static_cast<double>(output.widthPx) / output.heightPx);
            if (auto ok = write(out.parent_path() / output.warpFile, mesh); !ok) return ok;
            if (!output.blendPicture) continue;
            if (auto ok = write(out.parent_path() / output.blendFile, asText(*output.blendPicture)); !ok) return ok;
        }
    }
    std::string text = "# From an MPCDI file, by tessera-convert.\n";
    // A note quotes the archive: whatever that says must not end the comment.
    for (std::string note : made.notes) {
        std::ranges::replace_if(
            note, [](unsigned char c) { return c < 0x20 || c == 0x7f; }, ' ');
        text += "# " + note + "\n";
    }
    return write(out, text + wallText(named));
}

}  // namespace tessera
