/// What becomes a step of the history, and how steps are taken back and done again.
#include <algorithm>
#include <set>
#include <unordered_set>
#include <utility>

#include <fmt/format.h>

#include "common/cores/Transform.h"
#include "common/scene/Action.h"
#include "common/scene/FieldTable.h"
#include "server/sim/frame/PoseFields.h"
#include "server/sim/frame/Simulation.h"

namespace tessera {
namespace {

/// The step without the objects that it takes away and that have gone by themselves. The server's own nodes go so: they
/// are made anew, with other numbers, whenever they have to look otherwise. Null: all objects are there.
ChangeListPtr withoutWhatHasGone(const Aspect& scene, const ChangeList& step) {
    if (step.destructions.empty()) return nullptr;
    std::unordered_set<ObjectId> destroyed(step.destructions.begin(), step.destructions.end());
    for (const Creation& creation : step.creations) destroyed.erase(creation.id);  // it does both
    const auto gone = [&](ObjectId id) { return destroyed.contains(id) && !scene.find(id); };
    if (std::ranges::none_of(step.destructions, gone)) return nullptr;
    auto rest = std::make_shared<ChangeList>(step);
    std::erase_if(rest->placements, [&](const Placement& placement) { return gone(placement.node); });
    std::erase_if(rest->destructions, gone);
    return rest;
}

/// The same of a list that is one of several: of what has gone since the others it says nothing. Null: all is there.
ChangeListPtr ofWhatIsThere(const Aspect& scene, const ChangeList& part) {
    std::unordered_set<ObjectId> made;
    for (const Creation& creation : part.creations) made.insert(creation.id);
    const auto gone = [&](ObjectId id) { return !scene.find(id) && !made.contains(id); };
    const auto leadsAway = [&](const Placement& placement) { return !placement.parent && gone(placement.node); };
    const bool whole =
        std::ranges::none_of(part.destructions, gone) && std::ranges::none_of(part.placements, leadsAway) &&
        std::ranges::none_of(part.columns,
                             [&](const FieldColumn& column) { return std::ranges::any_of(column.ids, gone); });
    if (whole) return nullptr;
    auto rest = std::make_shared<ChangeList>(part);
    std::erase_if(rest->placements, leadsAway);
    std::erase_if(rest->destructions, gone);
    for (FieldColumn& column : rest->columns) {
        FieldColumn kept = FieldColumn::ofShape(column.type, column.field, column.kind(), column.width);
        for (std::size_t row = 0; row < column.ids.size(); ++row)
            if (!gone(column.ids[row])) kept.append(column.ids[row], column.value(row));
        column = std::move(kept);
    }
    std::erase_if(rest->columns, [](const FieldColumn& column) { return column.ids.empty(); });
    return rest;
}

/// Transforms of the scene that a list puts somewhere, ascending.
std::vector<ObjectId> movedBy(const Aspect& scene, const ChangeList& list) {
    std::set<ObjectId> moved;
    for (const FieldColumn& column : list.columns)
        if (isPoseField(column))
            for (const ObjectId id : column.ids)
                if (scene.get<Transform>(id)) moved.insert(id);
    return {moved.begin(), moved.end()};
}

/// Gives Transforms of the scene the values that a list says.
void takePoses(const Aspect& scene, const ChangeList& list, ById<Pose>& poses) {
    for (const FieldColumn& column : list.columns) {
        if (!isPoseField(column)) continue;
        for (std::size_t row = 0; row < column.ids.size(); ++row)
            if (const Transform* now = scene.get<Transform>(column.ids[row])) {
                const auto [pose, isNew] = poses.add(column.ids[row]);
                if (isNew) pose = poseOf(*now);
                setPart(pose, column, row);
            }
    }
}

/// The first pair that touches now and did not then, or nothing. Nodes that `step` brings back do not count. They are
/// where they were, and while they were gone nobody could say what touched them.
std::optional<Overlaps::value_type> newOverlap(const Aspect& scene, const Overlaps& now, const Overlaps& then,
                                               const ChangeList& step) {
    if (std::ranges::binary_search(then, kAllOverlap)) return std::nullopt;
    std::unordered_set<ObjectId> made;
    for (const Creation& creation : step.creations) made.insert(creation.id);
    const auto comesBack = [&](ObjectId node) {
        for (; node && !made.empty(); node = scene.get<Node>(node)->parent)
            if (made.contains(node)) return true;
        return false;
    };
    const auto fresh = std::ranges::find_if(now, [&](const auto& pair) {
        return !std::ranges::binary_search(then, pair) && !comesBack(pair.first) && !comesBack(pair.second);
    });
    return fresh == now.end() ? std::nullopt : std::optional(*fresh);
}

Overlaps both(const Overlaps& x, const Overlaps& y) {
    Overlaps all;
    std::ranges::set_union(x, y, std::back_inserter(all));
    if (all.size() > kMostOverlaps) all.assign(1, kAllOverlap);
    return all;
}

bool same(const Pose& a, const Pose& b) {
    return a.translation == b.translation && a.rotation.coeffs() == b.rotation.coeffs() && a.scale == b.scale;
}

/// Whether a node has one of these cores, or is below one that has.
bool isCarried(const Aspect& scene, ObjectId node, std::span<const ObjectId> transforms) {
    for (; node; node = scene.get<Node>(node)->parent)
        if (std::ranges::binary_search(transforms, scene.get<Node>(node)->core)) return true;
    return false;
}

}  // namespace

EditOutcome Simulation::applyStep(const Edit& edit, Wishes& wishes) {
    EditOutcome outcome{.ticket = edit.ticket};
    if (Expected<void> free = checkStep(); !free) {
        outcome.result = tl::unexpected(std::move(free.error()));
        return outcome;
    }
    const bool undo = edit.kind == Edit::Kind::kUndo;
    // How far an edit of this frame gets is not known yet, nor what its step is.
    if (std::ranges::any_of(openSteps_, [](const OpenStep& step) { return !step.moves.empty(); })) {
        outcome.result =
            fail(ErrorCode::kRefused, "something is being moved in this very frame; try again in the next one");
        return outcome;
    }
    closeSteps(wishes);
    // A step stays in the history until it has been applied. One that moves nothing is applied as it lies there.
    ChangeListPtr list = listOf(edit.kind);
    if (!list) {
        outcome.result = fail(ErrorCode::kRefused, undo ? "there is nothing to undo" : "there is nothing to redo");
        return outcome;
    }
    const bool inParts = undo ? history_.undoesInParts() : history_.redoesInParts();
    if (ChangeListPtr rest = withoutWhatHasGone(scene(), *list)) {
        list = std::move(rest);
        if (list->empty() && !inParts) {
            forgetStep(edit.kind, "what it takes away has gone already", outcome);
            return outcome;
        }
    }
    // What is led back may be one of several lists; those speak of the poses of what they make themselves only.
    std::vector<ObjectId> moved;
    if (!inParts) {
        moved = movedBy(scene(), *list);
        ChangeList paused = *list;
        pause(actors_.drivers(*list), paused);
        if (paused.changeCount() != list->changeCount()) list = std::make_shared<const ChangeList>(std::move(paused));
    }
    const Overlaps then = undo ? history_.overlapsOfUndo() : history_.overlapsOfRedo();
    Overlaps now = both(pipeline_.overlaps(scene(), moved), {});
    ServersHand hand = this->hand();
    const std::vector<Actor::Afterwards> afterwards = actors_.before(hand, *list, Actor::ListOf::kStep);
    Expected<Committer::Applied> applied = committer_.applyInverse(list, Committer::Inverse::kMade);
    if (!applied) {
        outcome.result = tl::unexpected(applied.error());
        // Worth another try: in the next frame, or once there is room.
        if (applied.error().code != ErrorCode::kLimit && committer_.checkNotDestroyedNow(*list))
            forgetStep(edit.kind, applied.error().message, outcome);
        return outcome;
    }
    pipeline_.sceneChanged(scene(), applied->list.get());
    if (!moved.empty())
        if (const auto blocked = newOverlap(
                scene(), pipeline_.overlaps(scene(), moved, CollisionPipeline::Deforming::kLeftOut), then, *list)) {
            outcome.result = standsThere(edit.kind, *blocked, moved);
            committer_.takeBack(*applied);
            pipeline_.sceneChanged(scene(), &applied->inverse);
            return outcome;
        }
    othersSceneChanged(applied->list.get());
    follow(afterwards);
    wishes.eraseIf([&](ObjectId id) { return std::ranges::binary_search(moved, id); });
    if (undo)
        history_.undone(std::move(applied->inverse), std::move(now));
    else
        history_.redone(std::move(applied->inverse), std::move(now));
    if (undo ? hidesMore() : history_.underWay()) {
        awaited_ = outcome;
        outcome.underWay = true;
    }
    return outcome;
}

tl::unexpected<Error> Simulation::standsThere(Edit::Kind kind, const Overlaps::value_type& pair,
                                              std::span<const ObjectId> moved) const {
    const bool firstMoves = isCarried(scene(), pair.first, moved);
    const ObjectId mine = firstMoves ? pair.first : pair.second, other = firstMoves ? pair.second : pair.first;
    return fail(
        ErrorCode::kRefused,
        fmt::format("{} stands where {} {}; nothing has moved, and the step can be {} once that place is free",
                    pathOf(scene(), other), pathOf(scene(), mine), kind == Edit::Kind::kUndo ? "was" : "would be",
                    kind == Edit::Kind::kUndo ? "undone" : "redone"));
}

/// The way that an edit has moved a Transform. Of several edits of a frame the last one's wish counts. Edits whose ways
/// add up have one way each, if the Transform got all the way. If it did not, nobody can say how far each of them got:
/// the last edit has the whole way.
std::optional<Simulation::Way> Simulation::wayOf(const OpenStep& step, ObjectId transform, const Wishes& wishes) const {
    const Wish* found = wishes.find(transform);
    const Transform* core = scene().get<Transform>(transform);
    if (!found || !found->way || !core) return std::nullopt;
    const Pose now = poseOf(*core);
    const Wishes::Way* way = wishes.lastWay(*found);
    if (!same(now, found->pose)) {
        if (way->edit != step.edit) return std::nullopt;
        while (const Wishes::Way* before = wishes.wayBefore(*way)) way = before;
        return Way{way->from, now};
    }
    Pose to = now;
    for (; way; to = way->from, way = wishes.wayBefore(*way))
        if (way->edit == step.edit) return Way{way->from, to};
    return std::nullopt;
}

ChangeList Simulation::closed(OpenStep step, const Wishes& wishes) const {
    ChangeListBuilder back;
    for (const ObjectId id : step.moves)
        if (const std::optional<Way> way = wayOf(step, id, wishes)) addPose(back, id, way->to, way->from);
    ChangeList poseBack = back.take();
    // The inverse speaks of none of these objects' fields itself: they were taken out before the list was applied.
    for (FieldColumn& column : poseBack.columns) mergeColumn(step.inverse, std::move(column));
    return std::move(step.inverse);
}

void Simulation::closeSteps(const Wishes& wishes) {
    std::vector<OpenStep> steps = std::exchange(openSteps_, {});
    // For each step of this frame that is still to be closed, the newest first: the poses that it leads back to.
    std::vector<CollisionPipeline::PosedTransforms> later;
    for (auto step = steps.rbegin(); step != steps.rend(); ++step) {
        CollisionPipeline::PosedTransforms& before = later.emplace_back();
        if (steps.size() == 1) continue;  // only others of the frame are asked about it
        for (const ObjectId id : step->moves)
            if (const std::optional<Way> way = wayOf(*step, id, wishes)) before.emplace_back(id, way->from);
    }
    addOverlapsAmong(steps, later);
    for (OpenStep& step : steps) {
        later.pop_back();
        const Gesture gesture = step.gesture;
        Overlaps overlaps = both(step.overlaps, {});
        ChangeList inverse = closed(std::move(step), wishes);
        if (inverse.empty()) continue;
        if (mayJoin(gesture, inverse, later, overlaps))
            history_.edited(std::move(inverse), gesture, std::move(overlaps));
        else
            history_.editedAnew(std::move(inverse), gesture, std::move(overlaps));
        // A drag that has come back to where it began, for now at least.
        const std::vector<ChangeListPtr> lists = history_.listsOf(gesture);
        if (lists.empty() || !saysNothing(scene(), *lists.front())) continue;
        const std::vector<ChangeList> whole = compact(std::vector<ChangeListPtr>(lists.rbegin(), lists.rend()));
        if (whole.size() == 1 && saysNothing(scene(), whole.front())) history_.edited({}, gesture);
    }
}

/// Whether an edit of a drag may join the drag's step, below steps of others. Those steps are taken back first. So the
/// thing that the drag has moved must not touch anything new where they lead. Adds to `overlaps` the pairs that touch
/// where the drag's step leads. `later`: the poses that steps of this frame lead to, which are taken back before all
/// others.
bool Simulation::mayJoin(const Gesture& gesture, const ChangeList& inverse,
                         std::span<const CollisionPipeline::PosedTransforms> later, Overlaps& overlaps) {
    const std::vector<EditHistory::Above> above = history_.stepsAbove(gesture, inverse);
    if (above.empty()) return true;
    std::vector<CollisionPipeline::PosedTransforms> back(later.begin(), later.end());
    for (const EditHistory::Above& step : above) {
        ById<Pose> poses;
        for (auto list = step.lists.rbegin(); list != step.lists.rend(); ++list) takePoses(scene(), **list, poses);
        back.push_back(poses.take());
    }
    ById<Pose> poses;
    takePoses(scene(), inverse, poses);
    back.push_back(poses.take());
    if (std::ranges::all_of(back, &CollisionPipeline::PosedTransforms::empty)) return true;
    const std::vector<Overlaps> after = pipeline_.overlapsAfter(scene(), back, CollisionPipeline::Against::kEverything);
    for (std::size_t i = 0; i < above.size(); ++i)
        if (newOverlap(scene(), after[later.size() + i], *above[i].overlaps, {})) return false;
    overlaps = both(overlaps, after.back());
    return true;
}

/// Steps of a frame are taken back one by one, the newest first. In between, things stand together as they never stood
/// in any frame. Adds to each step the pairs that touch then.
void Simulation::addOverlapsAmong(std::vector<OpenStep>& steps,
                                  std::span<const CollisionPipeline::PosedTransforms> back) {
    if (std::ranges::count_if(back, [](const auto& poses) { return !poses.empty(); }) < 2) return;
    std::set<ObjectId> moved;
    bool twice = false;
    for (const CollisionPipeline::PosedTransforms& poses : back)
        for (const auto& [id, pose] : poses) twice = !moved.insert(id).second || twice;
    const std::vector<Overlaps> after = pipeline_.overlapsAfter(
        scene(), back, twice ? CollisionPipeline::Against::kEverything : CollisionPipeline::Against::kThemselves);
    for (std::size_t i = 0; i < steps.size(); ++i) {
        OpenStep& step = steps[steps.size() - 1 - i];
        step.overlaps = both(step.overlaps, after[i]);
    }
}

void Simulation::forgetStep(Edit::Kind kind, const std::string& why, EditOutcome& outcome) {
    kind == Edit::Kind::kUndo ? history_.undoForgotten() : history_.redoForgotten();
    outcome.result = fail(ErrorCode::kRefused,
                          fmt::format("that step speaks of what is not there any more, and is forgotten: {}", why));
}

std::optional<EditOutcome> Simulation::goOn() {
    ChangeListPtr part = history_.nextPart();
    if (!part) return std::nullopt;
    if (ChangeListPtr rest = ofWhatIsThere(scene(), *part)) part = std::move(rest);
    ServersHand hand = this->hand();
    (void)actors_.before(hand, *part, Actor::ListOf::kPartOfStep);
    Expected<Committer::Applied> applied = committer_.applyInverse(part, Committer::Inverse::kMade);
    if (applied) {
        history_.partDone(std::move(applied->inverse));
        sceneChanged(applied->list.get());
    } else {
        if (awaited_) awaited_->result = tl::unexpected(applied.error());
        history_.partRefused();
    }
    const bool ends = !history_.underWay();
    if (ends) takeOrphansAway();
    const bool hidden = awaited_ && history_.takesBack() && awaited_->result && !hidesMore();
    if (!(ends || hidden)) return std::nullopt;
    return std::exchange(awaited_, std::nullopt);
}

/// A list that hides names first what hangs in the scene; those that take away come later, and name what hangs nowhere.
bool Simulation::hidesMore() const {
    const ChangeListPtr next = history_.nextPart();
    if (!next) return false;
    const auto placed = std::ranges::find_if(
        next->placements, [&](const Placement& placement) { return scene().get<Node>(placement.node) != nullptr; });
    if (placed == next->placements.end()) return false;
    ObjectId top = placed->node;
    while (const ObjectId above = scene().get<Node>(top)->parent) top = above;
    return top == kRootNode;
}

std::vector<Blob> Simulation::arraysOf(Edit::Kind kind) const {
    if (kind == Edit::Kind::kUndo) return history_.arraysToUndo();
    return kind == Edit::Kind::kRedo ? history_.arraysToRedo() : std::vector<Blob>();
}

ChangeListPtr Simulation::listOf(Edit::Kind kind) {
    if (kind == Edit::Kind::kUndo) return history_.undoList();
    return kind == Edit::Kind::kRedo ? history_.redoList() : nullptr;
}

}  // namespace tessera
