#include "server/tools/mpcdi/MpcdiWall.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace tessera {
namespace {

constexpr double kPlaneMetres = 3.2, kDistanceMetres = 2, kEyeHeightMetres = 1.7, kNearPx = 0.1, kFlatMetres = 0.0005;

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

Screen frustumScreen(const std::string& name, const MpcdiFrustum& f, const Vec3d& eyes) {
    const Quatd turn = Quatd(Eigen::AngleAxisd(-radiansOf(f.yaw), Vec3d::UnitY())) *
                       Quatd(Eigen::AngleAxisd(radiansOf(f.pitch), Vec3d::UnitX())) *
                       Quatd(Eigen::AngleAxisd(-radiansOf(f.roll), Vec3d::UnitZ()));
    const auto across = [&](double angle) { return kDistanceMetres * std::tan(radiansOf(angle)); };
    const Vec3d corner = eyes + turn * Vec3d(across(f.left), across(f.down), -kDistanceMetres);
    return screenOf(name, corner, turn * Vec3d(across(f.right) - across(f.left), 0, 0),
                    turn * Vec3d(0, across(f.up) - across(f.down), 0));
}

/// A surface that a projector's pixels hit, as a screen and a map into it.
struct SurfaceScreen {
    Screen screen;
    FloatPicture map;
    double offPlaneM = 0;  ///< the farthest that the surface is from the screen's plane
};

/// Square to the ways from its left edge to its right one, and from its lower to its upper one; towards the eyes. Zero
/// where these have no area.
Vec3d normalOf(const std::vector<Vec3d>& places, int widthPx, int heightPx, const Vec3d& middle, const Vec3d& eyes) {
    const auto at = [&](int x, int y) {
        return places[static_cast<std::size_t>(y) * static_cast<std::size_t>(widthPx) + static_cast<std::size_t>(x)];
    };
    Vec3d across = Vec3d::Zero(), up = Vec3d::Zero();
    for (int y = 0; y < heightPx; ++y) across += (at(widthPx - 1, y) - at(0, y)) / heightPx;
    for (int x = 0; x < widthPx; ++x) up += (at(x, 0) - at(x, heightPx - 1)) / widthPx;
    const Vec3d normal = across.cross(up);
    if (!(normal.norm() > 1e-9)) return Vec3d::Zero();
    return normal.normalized() * (normal.dot(eyes - middle) < 0 ? -1 : 1);
}

Expected<SurfaceScreen> surfaceScreen(const std::string& name, const MpcdiRegion& region, const Vec3d& eyes,
                                      const Vec3d& origin) {
    const auto bad = [&](std::string what) {
        return fail(ErrorCode::kBadInput, fmt::format("{}: {}", region.warpName, what));
    };
    const MpcdiFrame frame = region.frame.value_or(MpcdiFrame());
    SurfaceScreen made{.screen = {}, .map = region.warp};
    std::vector<Vec3d> places;
    places.reserve(region.warp.pixels.size());
    Vec3d middle = Vec3d::Zero();
    for (const std::array<float, 3>& at : region.warp.pixels) {
        const Vec3d place = origin + region.unitMetres * frame.here({at[0], at[1], at[2]});
        const auto index = static_cast<int>(places.size());
        // Zeroes, and what is no number, are how writers say that a pixel hits nothing.
        if (!place.allFinite() || place.norm() > 1000 || (at[0] == 0 && at[1] == 0 && at[2] == 0))
            return bad(fmt::format("a hole at column {} row {}: each pixel has to hit the surface, within 1000 m",
                                   index % region.warp.widthPx, index / region.warp.widthPx));
        places.push_back(place);
        middle += place;
    }
    middle /= static_cast<double>(places.size());
    Vec3d normal = normalOf(places, made.map.widthPx, made.map.heightPx, middle, eyes);
    if (normal.isZero()) return bad("the surface that its pixels hit has no area");
    for (const Vec3d& place : places) made.offPlaneM = std::max(made.offPlaneM, std::abs(normal.dot(place - middle)));
    const bool flat = made.offPlaneM <= kFlatMetres;
    // What is bent is looked at: no plane is its own.
    if (!flat && (eyes - middle).norm() > 0.01) normal = (eyes - middle).normalized();
    const double eyesAwayM = normal.dot(eyes - middle);
    if (!(eyesAwayM > 0.01)) return bad("the eyes are in the plane of the surface");
    // A floor's upper edge is the one ahead.
    const Vec3d above = normal.cross(Vec3d::UnitY()).norm() > 0.1 ? Vec3d(Vec3d::UnitY()) : Vec3d(-Vec3d::UnitZ());
    const Vec3d right = above.cross(normal).normalized(), up = normal.cross(right);
    for (std::size_t i = 0; i < places.size(); ++i) {
        Vec3d seen = places[i];
        if (!flat) {
            const double depth = -normal.dot(places[i] - eyes);
            if (!(depth > 0.01 * eyesAwayM))
                return bad("the surface reaches behind the eyes: cut the wall into more regions");
            seen = eyes + (places[i] - eyes) * (eyesAwayM / depth);
        }
        made.map.pixels[i] = {static_cast<float>(right.dot(seen - middle)), static_cast<float>(up.dot(seen - middle)),
                              0};
    }
    // The projector's own edges are half a pixel beyond the outer ones.
    Eigen::AlignedBox2d box;
    for (int y = 0; y < made.map.heightPx; ++y) {
        for (int x = 0; x < made.map.widthPx; ++x) {
            for (const double aside : {-0.5, 0.0, 0.5}) {
                const MapPlace at = mapAt(made.map, x + aside, y + aside);
                box.extend(Eigen::Vector2d(at.u, at.v));
                const MapPlace other = mapAt(made.map, x + aside, y - aside);
                box.extend(Eigen::Vector2d(other.u, other.v));
            }
        }
    }
    const Eigen::Vector2d size = box.sizes();
    if (!(size.minCoeff() > 1e-3)) return bad("the surface that its pixels hit has no area");
    for (std::array<float, 3>& at : made.map.pixels)
        at = {static_cast<float>((at[0] - box.min().x()) / size.x()),
              static_cast<float>(1 - (at[1] - box.min().y()) / size.y()), 0};
    made.screen = screenOf(name, middle + box.min().x() * right + box.min().y() * up, size.x() * right, size.y() * up);
    // Square pixels, as fine as the projector's.
    const double pixelsPerMetre = std::max(region.widthPx / size.x(), region.heightPx / size.y());
    made.screen.grid.tileWidthPx = static_cast<int>(std::clamp(std::lround(size.x() * pixelsPerMetre), 1L, 16384L));
    made.screen.grid.tileHeightPx = static_cast<int>(std::clamp(std::lround(size.y() * pixelsPerMetre), 1L, 16384L));
    return made;
}

/// Where an a3's places begin: their eyes are the wall's, or the floor's middle is.
Expected<Vec3d> originOf(const MpcdiFile& file) {
    std::set<bool> atEyes;
    for (const MpcdiBuffer& buffer : file.buffers)
        for (const MpcdiRegion& region : buffer.regions) atEyes.insert(region.origin == "idealEyePoint");
    if (atEyes.size() > 1)
        return fail(ErrorCode::kBadInput,
                    "some regions count from idealEyePoint and some from elsewhere: give all the same originof3DData");
    return atEyes.contains(true) ? Vec3d(0, kEyeHeightMetres, 0) : Vec3d(0, 0, 0);
}

}  // namespace

Expected<MpcdiWall> wallOfMpcdi(const MpcdiFile& file) {
    MpcdiWall made;
    made.notes = file.notes;
    made.source = "MPCDI";
    Wall& wall = made.wall;
    const bool flat = file.profile == MpcdiProfile::k2d, lamps = file.profile == MpcdiProfile::kSl;
    const Expected<Vec3d> origin = originOf(file);
    if (!origin) return tl::unexpected(origin.error());
    User user{.name = "viewer"};
    user.position = Vec3d(0, kEyeHeightMetres, flat ? kDistanceMetres : 0);
    if (!lamps) wall.users = {user};
    std::set<std::string> names;
    double left = -0.5 * kPlaneMetres;
    for (const MpcdiBuffer& buffer : file.buffers) {
        const double shape = buffer.widthPx > 0 ? static_cast<double>(buffer.heightPx) / buffer.widthPx : 9.0 / 16;
        for (const MpcdiRegion& region : buffer.regions) {
            const std::string name = wallName(region.id, names);
            const bool sized = flat && buffer.widthPx > 0;
            Screen screen;
            FloatPicture map = region.warp;
            if (file.profile == MpcdiProfile::k3d) {
                screen = frustumScreen(name, *region.frustum, user.position);
            } else if (lamps) {
                user = {.name = name, .position = region.unitMetres * region.frame->here(region.frame->position)};
                user.eyeSeparationMetres = 0;
                wall.users.push_back(user);
                screen = frustumScreen(name, *region.frustum, user.position);
            } else if (file.profile == MpcdiProfile::kA3) {
                Expected<SurfaceScreen> surface = surfaceScreen(name, region, user.position, *origin);
                if (!surface) return tl::unexpected(surface.error());
                if (surface->offPlaneM > kFlatMetres)
                    made.notes.push_back(
                        fmt::format("region \"{}\": its surface is up to {:.3g} m off a plane: right from the eyes' "
                                    "place alone, not with a tracker or in stereo",
                                    region.id, surface->offPlaneM));
                screen = surface->screen;
                map = std::move(surface->map);
            } else {
                const double height = kPlaneMetres * shape, top = kEyeHeightMetres + 0.5 * height;
                screen = screenOf(name, {left + region.x * kPlaneMetres, top - (region.y + region.height) * height, 0},
                                  {region.width * kPlaneMetres, 0, 0}, {0, region.height * height, 0});
            }
            if (file.profile != MpcdiProfile::kA3) {
                screen.grid.tileWidthPx =
                    sized ? std::max(1, static_cast<int>(std::lround(region.width * buffer.widthPx))) : region.widthPx;
                screen.grid.tileHeightPx =
                    sized ? std::max(1, static_cast<int>(std::lround(region.height * buffer.heightPx)))
                          : region.heightPx;
            }

            for (int y = 0; y < map.heightPx; ++y)
                for (int x = 0; x < map.widthPx; ++x)
                    for (const std::size_t c : {std::size_t{0}, std::size_t{1}})
                        if (!(map.at(x, y)[c] >= -4 && map.at(x, y)[c] <= 5))
                            return fail(ErrorCode::kBadInput,
                                        fmt::format("{}: a hole at column {} row {} ({:.6g} {:.6g})", region.warpName,
                                                    x, y, map.at(x, y)[0], map.at(x, y)[1]));
            TileAssignment tile{.screen = name, .user = user.name};
            tile.output.widthPx = region.widthPx;
            tile.output.heightPx = region.heightPx;
            if (!map.pixels.empty()) {
                WarpMesh mesh;
                double farthest = 0;
                for (const int faces : {4, 8, 16, 32, 64, 128, 256, 511}) {
                    mesh = meshOf(map, faces + 1, faces + 1);
                    farthest = farthestOf(mesh, map, screen.grid.tileWidthPx, screen.grid.tileHeightPx);
                    if (farthest <= kNearPx) break;
                }
                if (const auto fault = findWarpFault(mesh))
                    return fail(ErrorCode::kBadInput, fmt::format("{}: a warp map that {}", region.warpName, *fault));
                made.farthestPx = std::max(made.farthestPx, farthest);
                made.notes.push_back(fmt::format(
                    "region \"{}\": a mesh of {} x {} nodes shows what its warp map says to {:.3f} pixels{}", region.id,
                    mesh.columns, mesh.rows, farthest,
                    farthest > kNearPx ? ", more than a tenth: the map is finer than meshes may be" : ""));
                tile.output.warpFile = name + ".warp";
                tile.output.warp = std::make_shared<const WarpMesh>(std::move(mesh));
            }
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
    if (flat)
        made.notes.push_back(
            fmt::format("profile 2d knows no metres: the picture lies on a plane {} m wide, {} m from the eyes; "
                        "correct the corners",
                        kPlaneMetres, kDistanceMetres));
    if (lamps)
        made.notes.push_back(
            "shader lamps: the scene holds a model of the object, where and as large as that is before the projectors");
    made.notes.push_back("each region is a host; join them where one machine drives several projectors");
    if (auto good = checkWall(wall); !good) return tl::unexpected(good.error());
    return made;
}

Expected<ForeignWall> wallOfMpcdiFile(const std::string& path) {
    const Expected<MpcdiFile> file = readMpcdi(path);
    if (!file) return tl::unexpected(file.error());
    Expected<MpcdiWall> made = wallOfMpcdi(*file);
    if (!made) return failWith(path, made.error());
    return ForeignWall(std::move(*made));
}

}  // namespace tessera
