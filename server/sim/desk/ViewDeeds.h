/// Requests about what the wall shows, and from where. For Deeds.cpp alone.
#pragma once

#include "server/sim/desk/DeedTable.h"
#include "server/sim/desk/WallPlans.h"

namespace tessera::view_deeds {

/// Of more the plan is made and encoded beside the frames: 256 take less than half a millisecond, 4,096 seven.
inline constexpr std::size_t kTilesAtOnce = 256;

inline ServerActions setView(Desk& desk, const Asker& asker, const request::SetView& wish, TimePoint) {
    if (const std::optional<Error> why = desk.around.whyNoEdit()) return desk.refuse(asker, *why);
    return desk.views.ask(asker, wish.wish);
}

inline ServerActions navigate(Desk& desk, const Asker& asker, const request::NavigateView& wish, TimePoint now) {
    if (const std::optional<Error> why = desk.around.whyNoEdit()) return desk.refuse(asker, *why);
    if (!desk.around.steering) return desk.refuse(asker, {ErrorCode::kRefused, "nobody flies here"});
    const auto asked = [&desk, asker, wish](TimePoint at, const Box* fit) {
        const Expected<void> taken = desk.around.steering->asked(asker.connection.value, wish.wish, at, fit);
        return taken ? desk.done(asker) : desk.refuse(asker, taken.error());
    };
    if (wish.wish.deed != NavigationWish::Deed::kFit || !desk.around.lookBeside) return asked(now, nullptr);
    return desk.afterLooking(asker, 0, [asked, node = wish.wish.node](const Aspect& scene, Sequence) -> WorkedOut {
        return [asked, fit = boundsOf(scene, node)](TimePoint at) { return asked(at, &fit); };
    });
}

inline ServerActions show(Desk& desk, const Asker& asker, const request::ShowPicture& wish, TimePoint) {
    if (!desk.around.showing)
        return desk.refuse(asker, {ErrorCode::kUnsupported, "this server shows its scene and nothing else"});
    *desk.around.showing = wish.showing;
    return desk.done(asker);
}

inline ServerActions setBudget(Desk& desk, const Asker& asker, const request::SetBudget& wish, TimePoint) {
    if (!desk.around.budget)
        return desk.refuse(asker, {ErrorCode::kUnsupported, "this server draws all frames with all of their detail"});
    desk.around.budget->set(wish.milliseconds);
    return desk.done(asker);
}

inline ServerActions setExposure(Desk& desk, const Asker& asker, const request::SetExposure& wish, TimePoint) {
    if (!desk.around.exposure)
        return desk.refuse(asker, {ErrorCode::kUnsupported, "this server exposes all frames as the scene says"});
    desk.around.exposure->ask(wish.wish, wish.reset);
    return desk.done(asker);
}

inline ServerActions getImages(Desk& desk, const Asker& asker, const request::GetImages&, TimePoint now) {
    return desk.images.ask(asker, now);
}

inline ServerActions getPreview(Desk& desk, const Asker& asker, const request::GetPreview& wish, TimePoint now) {
    return desk.previews.ask(asker, wish.shrink, wish.after, now);
}

inline ServerActions getWall(Desk& desk, const Asker& asker, const request::GetWall&, TimePoint) {
    const Wall& wall = desk.around.wall;
    const Expected<View> view = desk.around.view.view(desk.around.simulation.scene());
    const std::optional<View> stand = view ? std::optional(*view) : std::nullopt;
    const auto plan = [&wall, stand] { return ApplicationAnswer(planOf(wall, stand ? &*stand : nullptr)); };
    std::size_t tiles = 0;
    for (const WallHost& host : wall.hosts) tiles += host.tiles.size();
    if (tiles <= kTilesAtOnce || !desk.around.lookBeside) return desk.answer(asker, plan());
    return desk.answerBeside(asker, 0, [plan](const Aspect&, Sequence) { return plan(); });
}

inline constexpr DeedTable kRows{&setView,     &navigate,  &show,       &setBudget,
                                 &setExposure, &getImages, &getPreview, &getWall};

}  // namespace tessera::view_deeds
