#include "server/sim/frame/Actors.h"

#include <algorithm>
#include <iterator>
#include <memory>

#include <fmt/format.h>

#include "server/sim/frame/Emitters.h"
#include "server/sim/frame/OutsideActors.h"

namespace tessera {
namespace {

using From = Actor::Incoming::From;

using Consequences = std::vector<InlineContents::Consequence>;

/// States of Inlines, and the way their content goes. What is refused is named in the state, and stays.
///
/// One may lie within what another one holds: it goes with that, or what goes of the other is less once it has gone.
/// `now` says what follows in the scene as it has become.
void commitAll(const Consequences& consequences, ServersHand& hand, const std::function<Consequences()>& now) {
    for (const InlineContents::Consequence& one : consequences) {
        if (!hand.scene().find(one.core)) continue;
        Expected<void> applied = hand.apply(one.list);
        if (!applied) {
            const Consequences newer = now();
            const auto same = std::ranges::find(newer, one.core, &InlineContents::Consequence::core);
            if (same != newer.end()) applied = hand.apply(same->list);
        }
        if (applied) continue;
        ChangeListBuilder state;
        setLoadState(state, one.core, one.type, LoadWords::kFailed,
                     fmt::format("what it holds cannot be taken away, and stays: {}; remove it and set wanted",
                                 applied.error().message));
        hand.commit(state.take());
    }
}

/// As one of a list of lists.
std::vector<ChangeList> alone(ChangeList list) {
    std::vector<ChangeList> lists;
    if (!list.empty()) lists.push_back(std::move(list));
    return lists;
}

Actor motionsRow(Motions& motions) {
    return {.name = "motions",
            .follow = [&](const Aspect& scene, const ChangeList* list) { motions.update(scene, list); },
            .want = [&](ActorStage& stage) { motions.want(stage); },
            .hear = [&](const Aspect& scene, const WishOutcome& outcome,
                        ChangeListBuilder& list) { motions.hear(scene, outcome, list); },
            .drivers = [&](const ChangeList& list,
                           std::vector<Actor::Driver>& drivers) { motions.appendDrivers(list, drivers); }};
}

Actor animationsRow(Animations& animations) {
    return {.name = "animations",
            .follow = [&](const Aspect& scene, const ChangeList* list) { animations.update(scene, list); },
            .want = [&](ActorStage& stage) { animations.want(stage); },
            .settle = [&](ActorStage& stage, const StepResult&) { animations.settle(stage); },
            .hear = [&](const Aspect& scene, const WishOutcome& outcome,
                        ChangeListBuilder& list) { animations.hear(scene, outcome, list); },
            .drivers = [&](const ChangeList& list,
                           std::vector<Actor::Driver>& drivers) { animations.appendDrivers(list, drivers); }};
}

/// Nobody asks them anything: they live in their row.
Actor emittersRow() {
    const auto emitters = std::make_shared<Emitters>();
    return {.name = "emitters",
            .follow = [emitters](const Aspect& scene, const ChangeList* list) { emitters->update(scene, list); },
            .want = [emitters](ActorStage& stage) { emitters->want(stage); }};
}

/// What Inlines hold, and which file is read next.
Actor inlinesRow(InlineContents& contents, OutsideActors* outside) {
    Actor row{.name = "inlines",
              .follow = [&](const Aspect& scene, const ChangeList* list) { contents.update(scene, list); },
              .ticket = InlineLoading::kTicket,
              .followsWhatIsSeen = true};
    row.receive = [&](const Aspect& scene, ChangeList& list, const Actor::Incoming& incoming) -> Expected<void> {
        if (incoming.from == From::kFiles) return {};
        return contents.check(scene, list, incoming.from == From::kServer, incoming.own);
    };
    row.before = [&](ServersHand& hand, const ChangeList& list, Actor::ListOf of) -> Actor::Afterwards {
        std::vector<InlineContents::Change> wants;
        if (of != Actor::ListOf::kPartOfStep) wants = contents.changesBy(hand.scene(), list);
        const auto inTheWay = [&] { return contents.inTheWayOf(hand.scene(), list); };
        if (of != Actor::ListOf::kEdit) commitAll(inTheWay(), hand, inTheWay);
        if (wants.empty()) return {};
        return [&contents, wants = std::move(wants)](ServersHand& after) {
            const auto following = [&] { return contents.following(after.scene(), wants); };
            commitAll(following(), after, following);
        };
    };
    if (outside)
        row.say = [&contents, outside](const Occasion& occasion) {
            // Nothing is read for a node from below which something is just being taken away.
            return occasion.stepUnderWay ? std::vector<ChangeList>()
                                         : alone(outside->inlines.advance(occasion.scene, contents, occasion.view));
        };
    return row;
}

/// Trials of programs: a text that is new has no verdict, until somebody has tried it.
Actor programsRow(OutsideActors* outside) {
    Actor row{.name = "programs", .each = Actor::Each::kFrame, .ticket = ProgramTrials::kTicket};
    row.receive = [](const Aspect& scene, ChangeList& list, const Actor::Incoming& incoming) -> Expected<void> {
        // What the server says itself are verdicts, but for what it loads.
        if (incoming.from != From::kServer || incoming.own.count > 0) resetVerdicts(list, scene);
        return {};
    };
    if (!outside) return row;
    row.follow = [outside](const Aspect& scene, const ChangeList* list) {
        outside->programs.update(scene, list, list ? outside->frame : FrameNumber());
    };
    row.say = [outside](const Occasion& occasion) {
        outside->frame = occasion.frame;
        std::vector<ChangeList> lists = std::exchange(outside->earlyVerdicts, {});
        lists.push_back(outside->programs.verdicts(occasion.scene));
        return lists;
    };
    row.remarks = [outside] { return outside->programs.takeRemarks(); };
    row.awaited = [outside](const Aspect& scene, TimePoint) -> Actor::Awaited {
        outside->earlyVerdicts.push_back(outside->programs.verdicts(scene));
        return {.count = outside->programs.pending(),
                .missing = "of the scene's programs are not tried yet; the first frames are drawn without them"};
    };
    return row;
}

Actor noticesRow(OutsideActors* outside) {
    Actor row{.name = "notices", .each = Actor::Each::kFrame, .ticket = ProgramNotices::kTicket};
    if (!outside || !outside->saysNotices) return row;
    row.follow = [outside](const Aspect& scene, const ChangeList* list) { outside->notices.update(scene, list); };
    row.say = [outside](const Occasion& occasion) {
        return alone(outside->notices.notices(occasion.scene, occasion.view));
    };
    return row;
}

Actor filmsRow(OutsideActors* outside) {
    Actor row{.name = "films", .each = Actor::Each::kFrame, .ticket = Movies::kTicket};
    if (!outside) return row;
    row.follow = [outside](const Aspect& scene, const ChangeList* list) { outside->films.update(scene, list); };
    row.say = [outside](const Occasion& occasion) {
        // One each: what is refused of one leaves the others. The newest film is the first.
        std::vector<ChangeList> lists =
            outside->films.advance(occasion.scene, occasion.first ? 0.0 : kSecondsPerFrame, occasion.now);
        std::ranges::reverse(lists);
        return lists;
    };
    row.remarks = [outside] { return outside->films.takeRemarks(); };
    row.awaited = [outside](const Aspect& scene, TimePoint now) -> Actor::Awaited {
        outside->films.attend(scene, now);
        return {.count = outside->films.awaited()};
    };
    return row;
}

Actor handleSizesRow(StepActors& step, OutsideActors* outside) {
    Actor row{
        .name = "handle sizes", .each = Actor::Each::kFrame, .ticket = HandleSizes::kTicket, .followsWhatIsSeen = true};
    if (!outside) return row;
    row.follow = [outside](const Aspect&, const ChangeList*) { outside->handleSizes.sceneChanged(); };
    row.say = [outside, &step](const Occasion& occasion) {
        return alone(outside->handleSizes.choose(occasion.scene, step.handles, occasion.view));
    };
    return row;
}

Actor levelsRow(OutsideActors* outside) {
    Actor row{.name = "levels", .each = Actor::Each::kFrame, .ticket = LevelChoice::kTicket, .followsWhatIsSeen = true};
    if (!outside) return row;
    row.follow = [outside](const Aspect& scene, const ChangeList* list) { outside->levels.update(scene, list); };
    row.say = [outside](const Occasion& occasion) {
        return alone(outside->levels.choose(occasion.scene, occasion.view));
    };
    return row;
}

Actor skinsRow(SkinPoses& skins) {
    return {.name = "skins",
            .follow = [&](const Aspect& scene, const ChangeList* list) { skins.update(scene, list); },
            .settle =
                [&](ActorStage& stage, const StepResult&) {
                    ChangeListBuilder poses;
                    skins.write(stage.scene(), poses, stage.remarks);
                    if (poses.empty()) return;
                    if (const Expected<void> applied = stage.hand.apply(poses.take()); !applied)
                        stage.remarks.push_back(fmt::format("skins stay as they were: {}", applied.error().message));
                }};
}

/// Handles follow what they belong to. A scene that is full has none.
Actor handlesRow(ManipulatorDisplay& handles) {
    Actor row{.name = "handles",
              .follow = [&](const Aspect& scene, const ChangeList* list) { handles.sceneChanged(scene, list); }};
    row.settle = [&](ActorStage& stage, const StepResult&) {
        if (ChangeList list = handles.update(stage.scene()); !list.empty()) (void)stage.hand.apply(std::move(list));
    };
    row.before = [&](ServersHand& hand, const ChangeList& list, Actor::ListOf of) -> Actor::Afterwards {
        if (of == Actor::ListOf::kPartOfStep) return {};
        if (ChangeList way = handles.inTheWayOf(hand.scene(), list); !way.empty()) (void)hand.apply(std::move(way));
        return {};
    };
    return row;
}

Actor contactsRow(ContactDisplay& contacts) {
    return {.name = "contacts",
            .follow = [&](const Aspect& scene, const ChangeList* list) { contacts.sceneChanged(scene, list); },
            .settle =
                [&](ActorStage& stage, const StepResult& collisions) {
                    if (const ChangeListPtr marks = contacts.commit(stage.hand.committer(), collisions))
                        stage.hand.applied(marks.get());
                }};
}

Actor budgetRow(OutsideActors* outside) {
    Actor row{.name = "budget"};
    if (outside) row.look = [outside](View& view) { view.detail = outside->budget.step(); };
    return row;
}

Actor exposureRow(OutsideActors* outside) {
    Actor row{.name = "exposure"};
    if (outside) row.look = [outside](View& view) { view.exposure = outside->exposure.exposure(); };
    return row;
}

}  // namespace

std::vector<Actor> actorsOf(StepActors& step, OutsideActors* outside) {
    return {
        // First in the step.
        motionsRow(step.motions),
        emittersRow(),
        animationsRow(step.animations),
        // As edits, before those of people.
        inlinesRow(step.inlines, outside),
        programsRow(outside),
        noticesRow(outside),
        filmsRow(outside),
        handleSizesRow(step, outside),
        levelsRow(outside),
        // Last in the step, behind the values of animations that were stopped.
        skinsRow(step.skins),
        handlesRow(step.handles),
        contactsRow(step.contacts),
        // Of the view.
        budgetRow(outside),
        exposureRow(outside),
    };
}

}  // namespace tessera
