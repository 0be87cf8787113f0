#include "server/sim/desk/WallPlans.h"

namespace tessera {
namespace {

std::uint32_t pixels(int count) {
    return static_cast<std::uint32_t>(count);
}

answer::TilePlan planOf(const Wall& wall, const Tile& tile, const View& room) {
    const Screen& screen = *wall.findScreen(tile.screen);
    const ScreenPixels whole = screenPixels(screen);
    const PixelRect& rect = tile.rect;
    const Vec3d right = (screen.lowerRight - screen.lowerLeft) / whole.width;
    const Vec3d up = (screen.upperLeft - screen.lowerLeft) / whole.height;
    const Vec3d corner = screen.lowerLeft + rect.x * right + rect.y * up;
    return {.name = tile.name,
            .screen = tile.screen,
            .host = tile.host,
            .user = tile.user,
            .eye = tile.eye,
            .x = pixels(rect.x),
            .y = pixels(whole.height - rect.y - rect.height),
            .width = pixels(rect.width),
            .height = pixels(rect.height),
            .lowerLeft = corner,
            .lowerRight = corner + rect.width * right,
            .upperLeft = corner + rect.height * up,
            .seenFrom = tileCamera(wall, tile, room).eyeWorld,
            .mosaicX = pixels(tile.mosaicRect.x),
            .mosaicY = pixels(mosaicPixels(screen).height - tile.mosaicRect.y - tile.mosaicRect.height)};
}

}  // namespace

answer::WallPlan planOf(const Wall& wall, const View* view) {
    answer::WallPlan plan{.name = wall.name};
    View room;  // the wall's own frame, as if it were the world
    room.users = view ? view->users : wall.users;
    if (view) {
        plan.position = view->position;
        plan.orientation = view->orientation.normalized();
        plan.worldUnitsPerMetre = view->worldUnitsPerMetre;
    }
    for (const Screen& screen : wall.screens) {
        const ScreenPixels whole = screenPixels(screen), mosaic = mosaicPixels(screen);
        plan.screens.push_back({.name = screen.name,
                                .lowerLeft = screen.lowerLeft,
                                .lowerRight = screen.lowerRight,
                                .upperLeft = screen.upperLeft,
                                .width = pixels(whole.width),
                                .height = pixels(whole.height),
                                .mosaicWidth = pixels(mosaic.width),
                                .mosaicHeight = pixels(mosaic.height)});
    }
    for (const Tile& tile : layoutTiles(wall)) plan.tiles.push_back(planOf(wall, tile, room));
    for (const User& user : wall.users) plan.users.push_back({.name = user.name, .position = user.position});
    return plan;
}

}  // namespace tessera
