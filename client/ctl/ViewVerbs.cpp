#include "client/ctl/ViewVerbs.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

namespace tessera {
namespace {

bool wantsNothing(const ViewWish& wish) {
    return !wish.position && !wish.orientation && !wish.worldUnitsPerMetre && !wish.head && !wish.reset;
}

/// Of each user, in the wall's order: between the eyes for which tiles are drawn now, else as the wall's file has it.
std::vector<answer::UserPlan> headsOf(const answer::WallPlan& plan) {
    std::map<std::string, Box> eyes;
    for (const answer::TilePlan& tile : plan.tiles) eyes[tile.user].extend(tile.seenFrom);
    std::vector<answer::UserPlan> heads = plan.users;
    for (answer::UserPlan& head : heads)
        if (const auto seen = eyes.find(head.name); seen != eyes.end()) head.position = seen->second.center();
    return heads;
}

std::string wordsOf(const Vec3d& v) {
    const Vec3d plain = withoutNoise(v);
    return fmt::format("{} {} {}", readable(plain.x()), readable(plain.y()), readable(plain.z()));
}

Expected<Answer> tell(Application& application) {
    const Expected<answer::WallPlan> plan = application.wallPlan();
    if (!plan) return tl::unexpected(plan.error());
    Answer answer;
    answer.json = {{"position", nullptr}, {"orientation", nullptr}, {"world_units_per_metre", nullptr}};
    if (plan->position && plan->orientation && plan->worldUnitsPerMetre) {
        const Vec3d& at = *plan->position;
        const Quatd& turned = *plan->orientation;
        // A metre of the wall ahead: any other place on the way says the same.
        const Vec3d lookAt = at - turned * Vec3d::UnitZ() * *plan->worldUnitsPerMetre;
        answer.text = fmt::format("position  {}\nlook-at   {}\nscale     {} world units per metre\n", wordsOf(at),
                                  wordsOf(lookAt), readable(*plan->worldUnitsPerMetre));
        const bool upright = std::abs((turned * Vec3d::UnitX()).y()) < 1e-9;
        if (!upright)
            answer.text += fmt::format("turned    {} {} {} {}, as --orientation takes it\n", readable(turned.w()),
                                       readable(turned.x()), readable(turned.y()), readable(turned.z()));
        answer.json["position"] = jsonOf(at);
        answer.json["orientation"] = Json::array({turned.w(), turned.x(), turned.y(), turned.z()});
        answer.json["world_units_per_metre"] = *plan->worldUnitsPerMetre;
        answer.json["look_at"] = jsonOf(lookAt);
    } else {
        answer.text = "position  none: the camera that the wall is to stand at is not there\n";
    }
    answer.json["heads"] = Json::array();
    for (const answer::UserPlan& head : headsOf(*plan)) {
        answer.text += fmt::format("head      {} at {} m of the wall\n", head.name, wordsOf(head.position));
        answer.json["heads"].push_back({{"user", head.name}, {"position", jsonOf(head.position)}});
    }
    return answer;
}

}  // namespace

Expected<Answer> run(Application& application, const verb::View& view) {
    if (wantsNothing(view.view)) return tell(application);
    if (const Expected<void> done = application.setView(view.view); !done) return tl::unexpected(done.error());
    return Answer{"the view has changed\n", {{"done", true}}, {}};
}

}  // namespace tessera
