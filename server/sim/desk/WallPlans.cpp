#include "server/sim/desk/WallPlans.h"

namespace tessera {
namespace {

std::uint32_t pixels(int count) {
    return static_cast<std::uint32_t>(count);
}

answer::TilePlan planOf(const Tile& tile, const Screen& screen) {
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
            .upperLeft = corner + rect.height * up};
}

}  // namespace

answer::WallPlan planOf(const Wall& wall) {
    answer::WallPlan plan{.name = wall.name, .screens = {}, .tiles = {}, .users = {}};
    for (const Screen& screen : wall.screens) {
        const ScreenPixels whole = screenPixels(screen);
        plan.screens.push_back({.name = screen.name,
                                .lowerLeft = screen.lowerLeft,
                                .lowerRight = screen.lowerRight,
                                .upperLeft = screen.upperLeft,
                                .width = pixels(whole.width),
                                .height = pixels(whole.height)});
    }
    for (const Tile& tile : layoutTiles(wall)) plan.tiles.push_back(planOf(tile, *wall.findScreen(tile.screen)));
    for (const User& user : wall.users) plan.users.push_back({.name = user.name, .position = user.position});
    return plan;
}

}  // namespace tessera
