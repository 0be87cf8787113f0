#include "client/ctl/ViewVerbs.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "client/ctl/SceneNames.h"
#include "client/ctl/VerbWords.h"
#include "common/wall/Detail.h"

namespace tessera {

namespace {

using Json = nlohmann::ordered_json;

/// From where the wall stands now, as `move --by` of a node: a way along the world's axes, a turn and a scale on top.
Expected<ViewWish> viewFromHere(Application& application, ViewWish by) {
    const Expected<answer::WallPlan> now = application.plan();
    if (!now) return tl::unexpected(now.error());
    if (!now->position || !now->orientation || !now->worldUnitsPerMetre)
        return fail(ErrorCode::kRefused, "view --by: the wall stands nowhere yet: its scene is not there");
    if (by.position) *by.position += *now->position;
    if (by.orientation) by.orientation = (*by.orientation * *now->orientation).normalized();
    if (by.worldUnitsPerMetre) *by.worldUnitsPerMetre *= *now->worldUnitsPerMetre;
    return by;
}

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
    const Expected<answer::WallPlan> plan = application.plan();
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
        const Expected<Quatd> upright = lookAlong(lookAt - at);  // what --look-at makes of it
        if (!upright || upright->angularDistance(turned.normalized()) > 1e-6)
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

std::string budgetText(const answer::Status& status) {
    if (status.budgetMs == 0) return "none: all of the scene's detail is drawn";
    return fmt::format("{} ms a frame, step {} of {} of detail left away", status.budgetMs, status.detail,
                       kDetailSteps.size() - 1);
}

Expected<Answer> run(Application& application, const verb::View& view) {
    if (wantsNothing(view.view)) return tell(application);
    const Expected<ViewWish> wish = view.by ? viewFromHere(application, view.view) : view.view;
    if (!wish) return tl::unexpected(wish.error());
    const Expected<void> done = application.setView(*wish);
    if (!done) return tl::unexpected(done.error());
    Answer answer{"the view has changed\n", {{"done", true}}, {}};
    if (view.by && wish->position) {
        answer.text += fmt::format("the wall stands at {} now\n", textOf(*wish->position));
        answer.json["position"] = jsonOf(*wish->position);
    }
    return answer;
}

Expected<Answer> run(Application& application, const verb::Show& show) {
    const Expected<void> done = application.show(show.showing);
    if (!done) return tl::unexpected(done.error());
    const std::string what = show.showing == Showing::kScene ? "scene" : "test-picture";
    return Answer{fmt::format("all tiles show the {}\n", show.showing == Showing::kScene ? "scene" : "test picture"),
                  {{"shown", what}},
                  {}};
}

Expected<Answer> run(Application& application, const verb::Budget& budget) {
    if (budget.milliseconds)
        if (const Expected<void> done = application.setBudget(*budget.milliseconds); !done)
            return tl::unexpected(done.error());
    const Expected<answer::Status> status = application.status();
    if (!status) return tl::unexpected(status.error());
    return Answer{fmt::format("budget  {}\n", budgetText(*status)),
                  {{"budget_ms", status->budgetMs}, {"detail", status->detail}},
                  {}};
}

Expected<Answer> run(Application& application, const verb::Exposure& exposure) {
    if (exposure.reset || exposure.wish != ExposureWish())
        if (const Expected<void> done = application.setExposure(exposure.wish, exposure.reset); !done)
            return tl::unexpected(done.error());
    const Expected<answer::Status> status = application.status();
    if (!status) return tl::unexpected(status.error());
    const ExposureWish& wish = status->exposure;
    std::string text = !wish.metered ? "as the scene says" : *wish.metered ? "metered" : "not metered";
    if (wish.stops) text += fmt::format(", {:+g} stops", *wish.stops);
    if (wish.toneMap) text += fmt::format(", tone map {}", kToneMapNames[static_cast<std::size_t>(*wish.toneMap)]);
    // What it has found counts no more, where somebody has just told it not to look.
    const bool meters = status->meteredStops && wish.metered.value_or(true);
    if (meters) text += fmt::format("; the wall has found {:+g} stops", *status->meteredStops);
    Answer answer{fmt::format("exposure  {}\n", text), {{"exposure", nlohmann::json::object()}}, {}};
    if (wish.stops) answer.json["exposure"]["stops"] = *wish.stops;
    if (wish.metered) answer.json["exposure"]["metered"] = *wish.metered;
    if (wish.toneMap) answer.json["exposure"]["tone_map"] = kToneMapNames[static_cast<std::size_t>(*wish.toneMap)];
    if (meters) answer.json["metered_stops"] = *status->meteredStops;
    return answer;
}

Expected<Answer> run(Application& application, const verb::Navigate& navigate) {
    NavigationWish wish = navigate.wish;
    if (!navigate.node.empty()) {
        const Expected<ObjectInfo> node = application.describeNode(navigate.node);
        if (!node) return tl::unexpected(node.error());
        wish.node = node->id;
    }
    const Expected<void> done = application.navigate(wish);
    if (!done) return tl::unexpected(done.error());
    using Deed = NavigationWish::Deed;
    std::string text = wish.deed == Deed::kKeepBookmark ? fmt::format("bookmark {} is here\n", wish.bookmark)
                       : wish.deed == Deed::kNone       ? fmt::format("the mode is {}\n", nameOf(*wish.mode))
                                                        : "the wall is on its way\n";
    return Answer{std::move(text), {{"done", true}}, {}};
}

Expected<Answer> run(Application& application, const verb::Pick& pick) {
    const Expected<answer::Picked> picked =
        pick.wand.empty() ? application.pick(pick.xPx, pick.yPx) : application.pick(pick.wand);
    if (!picked) return tl::unexpected(picked.error());
    if (!picked->hit) return Answer{"nothing is there\n", {{"hit", false}}, {}};
    SceneNames names(application);
    names.learn(std::span(&picked->node, 1));
    const std::string path = names.node(picked->node);
    Answer answer{fmt::format("{}, face {} at {}\n", path, picked->face, textOf(picked->point)),
                  {{"hit", true},
                   {"node", picked->node.value},
                   {"path", path},
                   {"face", picked->face},
                   {"point", jsonOf(picked->point)},
                   {"distance", picked->t},
                   {"normal", jsonOf(picked->normal)},
                   {"barycentric", Json::array({1 - picked->corners.sum(), picked->corners.x(), picked->corners.y()})}},
                  {}};
    answer.text += fmt::format("{} away, normal {}", readable(picked->t), textOf(picked->normal));
    if (picked->texcoord) {
        answer.text +=
            fmt::format(", texture at {} {}", readable(picked->texcoord->x()), readable(picked->texcoord->y()));
        answer.json["texcoord"] = Json::array({picked->texcoord->x(), picked->texcoord->y()});
    }
    answer.text += "\n";
    return answer;
}

}  // namespace tessera
