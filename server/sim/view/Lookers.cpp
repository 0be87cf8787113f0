#include "server/sim/view/Lookers.h"

#include <algorithm>

#include "common/wall/Detail.h"

namespace tessera {

Lookers::Lookers(const Wall& wall) : wall_(wall), screensOf_(wall.users.size()), lookers_(wall.users.size()) {
    for (const Tile& tile : layoutTiles(wall)) {
        const auto user =
            static_cast<std::size_t>(std::ranges::find(wall.users, tile.user, &User::name) - wall.users.begin());
        const auto screen = static_cast<std::size_t>(std::ranges::find(wall.screens, tile.screen, &Screen::name) -
                                                     wall.screens.begin());
        if (user == wall.users.size() || screen == wall.screens.size()) continue;
        if (std::ranges::find(screensOf_[user], screen) == screensOf_[user].end()) screensOf_[user].push_back(screen);
    }
    for (std::size_t user = 0; user < screensOf_.size(); ++user)
        if (!screensOf_[user].empty()) usersOf_[user % kLevelUsers].push_back(user);
    for (std::size_t byte = 0; byte < kLevelUsers; ++byte)
        if (!usersOf_[byte].empty()) used_.push_back(byte);
}

bool Lookers::lookFrom(const View& view) {
    bool moved = false;
    for (std::size_t user = 0; user < lookers_.size(); ++user) {
        if (screensOf_[user].empty()) continue;
        const User* known = view.findUser(wall_.users[user].name);
        Looker now{.coarser = detailStep(view.detail).coarser};
        for (const std::size_t screen : screensOf_[user]) {
            const ScreenCamera camera =
                screenCamera(wall_.screens[screen], known ? *known : wall_.users[user], Eye::kCenter, view);
            now.head = camera.headWorld;
            now.pixels = std::max({now.pixels, 0.5 * camera.clip_T_eye(0, 0) * camera.pixels.width,
                                   0.5 * camera.clip_T_eye(1, 1) * camera.pixels.height});
        }
        moved = moved || now.head != lookers_[user].head || now.pixels != lookers_[user].pixels ||
                now.coarser != lookers_[user].coarser;
        lookers_[user] = now;
    }
    return moved;
}

}  // namespace tessera
