#include "server/sim/frame/Simulation.h"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <set>
#include <unordered_set>
#include <utility>

#include <fmt/format.h>

#include "common/cores/CollisionObject.h"
#include "common/cores/LoadWords.h"
#include "common/cores/Motion.h"
#include "common/cores/Transform.h"
#include "common/scene/Action.h"
#include "common/scene/Edits.h"
#include "common/scene/FieldTable.h"
#include "server/collision/pipeline/ScenePicker.h"
#include "server/programs/ProgramTrials.h"
#include "server/sim/commit/ServersFields.h"
#include "server/sim/frame/HandleSizes.h"
#include "server/sim/frame/InlineLoading.h"
#include "server/sim/frame/LevelChoice.h"
#include "server/sim/frame/LoadParts.h"
#include "server/sim/frame/PoseFields.h"
#include "server/text/TextFields.h"

namespace tessera {
namespace {

/// What the server says in each frame of nodes that are in the scene, some of which may still be on their way.
bool followsWhatIsSeen(const Edit& edit) {
    return !edit.undoable && (edit.ticket == LevelChoice::kTicket || edit.ticket == HandleSizes::kTicket || edit.ticket == InlineLoading::kTicket);
}

}  // namespace

Simulation::Simulation(const SimulationOptions& options)
    : maxObjects_(options.scene.maxObjects),
      committer_(options.scene),
      workers_(options.threads > 1 ? std::make_unique<Workers>(options.threads) : nullptr),
      pipeline_(options.collision, workers_.get()) {
    sceneChanged(nullptr);
}

Expected<CommittedFrame> Simulation::load(std::vector<ChangeList> lists) {
    for (std::size_t i = 0; i < lists.size(); ++i) {
        resetVerdicts(lists[i], scene());
        const Expected<Committer::Applied> applied = committer_.apply(std::move(lists[i]));
        if (!applied) return failWith(fmt::format("scene {}", i + 1), applied.error());
    }
    sceneChanged(nullptr);
    return committer_.closeFrame();
}

std::optional<PickHit> Simulation::pick(const Ray& ray) {
    return pipeline_.pickNode(scene(), ray);
}

std::optional<NearestSurface> Simulation::nearestSurface(const Vec3d& place, ObjectId below, QueryWork& work) {
    return pipeline_.nearestSurface(scene(), place, below, work);
}

void Simulation::goOnFrom(Left left) {
    committer_.goOnFrom(std::move(left.scene), left.sequence);
    history_ = std::move(left.history);
    // Nobody is given an id that is refused as being on its way.
    committer_.skipIds(ObjectId(std::max(history_.idsArriving().end(), history_.idsUnderWay().end())));
    display_.goOnWith(left.display);
    sceneChanged(nullptr);
    takeOrphansAway();
}

void Simulation::skipNumbers(std::uint64_t nextId, Sequence behind) {
    committer_.skipIds(ObjectId(nextId));
    committer_.skipLists(behind);
}

void Simulation::takeOrphansAway() {
    if (history_.arriving() && !arriving_ && !history_.underWay()) history_.partsTakenAway();
}

FrameResult Simulation::step(bool firstFrame, std::vector<Edit> edits, std::span<const Reply> replies) {
    FrameResult result;
    const double seconds = firstFrame ? 0.0 : kSecondsPerFrame;
    std::ranges::move(history_.sweep(), std::back_inserter(result.unneeded));
    std::optional<EditOutcome> wholeAgain = goOn();
    Wishes wishes;
    for (const MotionStep& m : motions_.advance(scene(), seconds))
        wishes[m.target] = {.pose = m.pose, .motion = m.motion, .motionTime = m.time};
    const std::vector<AnimationStep> animations = playAnimations(seconds, wishes, result.remarks);
    for (std::size_t i = 0; i < edits.size(); ++i) result.outcomes.push_back(applyEdit(std::move(edits[i]), i, wishes));

    // An edit may have destroyed what a motion or an earlier edit wanted to move.
    std::erase_if(wishes, [&](const auto& wish) { return !scene().get<Transform>(wish.first); });
    std::vector<TentativeTransform> tentative;
    for (const auto& [id, wish] : wishes)
        tentative.push_back({.transform = id,
                             .translation = wish.pose.translation,
                             .rotation = wish.pose.rotation,
                             .scale = wish.pose.scale,
                             .source = static_cast<int>(wish.ofAnEdit() ? wish.edit + 1 : 0)});
    const auto begin = std::chrono::steady_clock::now();
    result.collision = pipeline_.step(scene(), tentative, replies, seconds);
    result.collisionMs = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
    const auto tellHand = [&](ObjectId id) {
        const auto wish = wishes.find(id);
        if (wish == wishes.end() || !wish->second.ofAnEdit()) return;
        for (const auto& [edit, from] : wish->second.ways) result.outcomes[edit].stopped.push_back(id);
    };
    for (const ObjectId id : result.collision.stopped) tellHand(id);
    // Where a reply has decided, a hand has not got its way either.
    for (const TentativeTransform& accepted : result.collision.accepted)
        if (accepted.source < 0 && !std::ranges::binary_search(result.collision.stopped, accepted.transform))
            tellHand(accepted.transform);
    if (wholeAgain) result.outcomes.push_back(std::move(*wholeAgain));
    commitPoses(wishes, animations, result.collision);
    closeSteps(wishes);
    commitSkinPoses(result.remarks);
    commitHandles(manipulators_.update(scene()));
    if (const ChangeListPtr marks = display_.commit(committer_, result.collision)) {
        pipeline_.sceneChanged(scene(), marks.get());
        serversNodes_.sceneChanged(scene(), marks.get());
    }
    result.commit = committer_.closeFrame();
    result.history = history_.happened();
    result.notes = std::exchange(textNotes_, {});
    return result;
}

EditOutcome Simulation::applyEdit(Edit edit, std::size_t index, Wishes& wishes) {
    if (edit.kind == Edit::Kind::kPart || edit.kind == Edit::Kind::kLastPart) return applyPart(std::move(edit));
    if (isStep(edit.kind)) return applyStep(edit, wishes);
    EditOutcome outcome{.ticket = edit.ticket, .result = {}, .ids = {}, .stopped = {}};
    const bool addsUp = edit.move && edit.move->move.relative;
    if (edit.move) {
        Expected<ChangeList> list = listOf(*edit.move, wishes);
        if (!list) {
            outcome.result = tl::unexpected(list.error());
            return outcome;
        }
        edit.list = std::move(*list);
    }
    outcome.result = checkHidden(edit);
    // What the server says itself nobody takes back.
    if (edit.undoable && outcome.result) outcome.result = checkServersFields(scene(), edit.list);
    if (edit.undoable && outcome.result) outcome.result = serversNodes_.check(scene(), edit.list);
    if (edit.undoable) resetVerdicts(edit.list, scene());
    if (outcome.result) outcome.result = inlines_.check(scene(), edit.list, !edit.undoable);
    if (outcome.result) outcome.result = setTexts(edit.list, scene(), typesetter_, textNotes_);
    if (!outcome.result) return outcome;
    ChangeList list = std::move(edit.list);
    std::vector<ObjectId> driving;
    animations_.appendDriving(list, driving);
    const std::vector<std::pair<ObjectId, Pose>> poses = takeTransforms(list, wishes);
    std::vector<ObjectId> moved;
    for (const auto& [id, pose] : poses) {
        moved.push_back(id);
        if (pose.sound()) continue;
        outcome.result = fail(
            ErrorCode::kBadInput,
            fmt::format("the transform wanted for #{} is not finite, or its rotation cannot be normalised", id.value));
        return outcome;
    }
    pauseWhatDrives(moved, driving, list);

    OpenStep step{.edit = index, .inverse = {}, .before = {}, .gesture = edit.gesture};
    if (edit.undoable) step.overlaps = pipeline_.overlaps(scene(), moved);
    if (!list.empty()) {
        const std::vector<InlineContents::Change> wants = inlines_.changesBy(scene(), list);
        commitHandles(manipulators_.inTheWayOf(scene(), list));
        Expected<Committer::Applied> applied =
            committer_.apply(std::move(list), edit.undoable ? Committer::Inverse::kMade : Committer::Inverse::kNone);
        if (!applied) {
            outcome.result = tl::unexpected(applied.error());
            return outcome;
        }
        outcome.ids = std::move(applied->ids);
        step.inverse = std::move(applied->inverse);
        sceneChanged(applied->list.get());
        commitInlines(inlines_.following(scene(), wants));
    }
    if (saysNothing(scene(), step.inverse)) step.inverse = {};
    for (const auto& [id, pose] : poses) {
        const Transform* now = scene().get<Transform>(id);
        if (!now) continue;  // destroyed by the same edit
        Wish& wish = wishes[id];
        if (!addsUp || !wish.ofAnEdit()) wish.ways.clear();
        wish.ways.emplace_back(index, wish.ways.empty() ? poseOf(*now) : wish.pose);
        wish = {.pose = pose, .motion = {}, .motionTime = 0, .edit = index, .ways = std::move(wish.ways)};
        step.before.emplace_back(id, poseOf(*now));
    }
    if (edit.undoable) openSteps_.push_back(std::move(step));
    return outcome;
}

void Simulation::commitInlines(const std::vector<InlineContents::Consequence>& consequences) {
    for (const InlineContents::Consequence& one : consequences) {
        const Expected<Committer::Applied> applied = committer_.apply(one.list);
        if (applied) {
            sceneChanged(applied->list.get());
            continue;
        }
        ChangeListBuilder state;
        setLoadState(state, one.core, one.type, LoadWords::kFailed,
                     fmt::format("what it holds cannot be taken away, and stays: {}; remove it and set wanted", applied.error().message));
        commit(state.take());
    }
}

EditOutcome Simulation::applyPart(Edit edit) {
    EditOutcome outcome{.ticket = edit.ticket, .result = beginParts(edit), .ids = {}, .stopped = {}};
    if (!outcome.result) return outcome;
    resetVerdicts(edit.list, scene());
    Expected<void> wanted = inlines_.check(scene(), edit.list, !edit.undoable, arriving_->ids);
    if (wanted && edit.undoable) wanted = serversNodes_.check(scene(), edit.list);
    Expected<Committer::Applied> applied =
        wanted ? committer_.applyReserved(std::move(edit.list), ObjectId(arriving_->ids.first), arriving_->ids.count, Committer::Inverse::kMade)
               : tl::unexpected(wanted.error());
    if (!applied) {
        outcome.result = tl::unexpected(applied.error());
        arriving_.reset();
        takeOrphansAway();
        return outcome;
    }
    history_.partArrived(std::move(applied->inverse), arriving_->ids);
    sceneChanged(applied->list.get());
    const auto brings = [&](const Placement& placement) { return placement.parent && !arriving_->ids.contains(placement.parent); };
    arriving_->seen = arriving_->seen || std::ranges::any_of(applied->list->placements, brings);
    if (edit.kind == Edit::Kind::kPart) return outcome;
    outcome.ids = {{ObjectId(kFirstPlaceholder), ObjectId(arriving_->ids.first)}};
    edit.undoable ? history_.partsWhole() : history_.partsKept();
    arriving_.reset();
    return outcome;
}

Expected<void> Simulation::beginParts(const Edit& edit) {
    if (const Expected<void> still = checkStill(); !still) return still;
    if (arriving_ ? arriving_->ticket != edit.ticket : history_.arriving())
        return fail(ErrorCode::kRefused, "another scene is still being loaded");
    if (arriving_) return {};
    const std::size_t present = std::min(scene().objectCount(), maxObjects_);
    if (edit.objects > maxObjects_ - present)
        return fail(ErrorCode::kLimit, fmt::format("the scene would hold {} + {} objects, more than its limit of {}",
                                                   scene().objectCount(), edit.objects, maxObjects_));
    arriving_ = Arriving{
        .ticket = edit.ticket, .ids = {.first = committer_.reserveIds(edit.objects).value, .count = edit.objects}};
    return {};
}

Expected<void> Simulation::checkStill() const {
    if (!history_.underWay()) return {};
    return fail(ErrorCode::kRefused, "a large step is still being taken back or done again; try again when it is");
}

Expected<void> Simulation::checkStep() const {
    if (Expected<void> still = checkStill(); !still) return still;
    if (!appearing()) return {};
    return fail(ErrorCode::kRefused, "a large scene or copy is just appearing; try again when it is there");
}

Expected<void> Simulation::checkHidden(const Edit& edit) const {
    if (followsWhatIsSeen(edit)) return {};
    if (history_.arriving())
        if (const std::optional<ObjectId> id = namedIn(edit.list, history_.idsArriving()))
            return fail(ErrorCode::kRefused, fmt::format("#{} is still being loaded", id->value));
    if (history_.underWay())
        if (const std::optional<ObjectId> id = namedIn(edit.list, history_.idsUnderWay()))
            return fail(ErrorCode::kRefused, fmt::format("#{} is still being taken away or brought back", id->value));
    return {};
}

void Simulation::pauseWhatDrives(std::span<const ObjectId> moved, std::span<const ObjectId> animations, ChangeList& list) const {
    std::vector<ObjectId> taken;
    for (const ObjectId target : moved) motions_.appendPlaying(target, taken);
    if (taken.empty() && animations.empty()) return;
    std::ranges::sort(taken);
    const auto isPlaying = [](const FieldColumn& column) {
        return (column.type == typeOf<Motion>() && column.field == fieldId<&Motion::playing>) ||
               (column.type == typeOf<Animation>() && column.field == fieldId<&Animation::playing>);
    };
    std::unordered_set<ObjectId> spokenFor;
    for (const FieldColumn& column : list.columns)
        if (isPlaying(column)) spokenFor.insert(column.ids.begin(), column.ids.end());
    spokenFor.insert(list.destructions.begin(), list.destructions.end());
    ChangeListBuilder pauses;
    for (const ObjectId id : taken)
        if (!spokenFor.contains(id)) pauses.set(id, typeOf<Motion>(), fieldId<&Motion::playing>, false);
    for (const ObjectId id : animations)
        if (!spokenFor.contains(id)) pauses.set(id, typeOf<Animation>(), fieldId<&Animation::playing>, false);
    ChangeList pausing = pauses.take();
    for (FieldColumn& column : pausing.columns) mergeColumn(list, std::move(column));
}

std::vector<std::pair<ObjectId, Pose>> Simulation::takeTransforms(ChangeList& list, const Wishes& wishes) const {
    std::map<ObjectId, Pose> wanted;
    for (FieldColumn& column : list.columns) {
        if (!isPoseField(column) || column.kind() != FieldKind::kDouble) continue;
        const std::size_t width = column.field == fieldId<&Transform::rotation> ? 4 : 3;
        if (column.width != width) continue;  // the scene refuses it in words
        FieldColumn rest{.type = column.type,
                         .field = column.field,
                         .width = column.width,
                         .ids = {},
                         .values = std::vector<double>{}};
        for (std::size_t row = 0; row < column.ids.size(); ++row) {
            const ObjectId id = column.ids[row];
            const Transform* now = scene().get<Transform>(id);
            if (!now) {
                rest.append(id, column.value(row));
                continue;
            }
            // Fields that this edit does not write keep what an earlier one wants.
            setPart(wanted.try_emplace(id, poseFor(wishes, id, *now)).first->second, column, row);
        }
        column = std::move(rest);
    }
    std::erase_if(list.columns, [](const FieldColumn& column) { return isPoseField(column) && column.ids.empty(); });
    return {wanted.begin(), wanted.end()};
}

Pose Simulation::poseFor(const Wishes& wishes, ObjectId id, const Transform& now) {
    const auto earlier = wishes.find(id);
    return earlier != wishes.end() && earlier->second.keptByEdits() ? earlier->second.pose : poseOf(now);
}

Expected<ChangeList> Simulation::listOf(const MoveWish& move, const Wishes& wishes) const {
    const Expected<ObjectId> movable = movableNode(scene(), move.node);
    if (!movable) return tl::unexpected(movable.error());
    const ObjectId core = scene().get<Node>(*movable)->core;
    Transform present = *scene().get<Transform>(core);
    const Pose pose = poseFor(wishes, core, present);
    present.translation = pose.translation;
    present.rotation = pose.rotation;
    present.scale = pose.scale;
    return moveList(core, present, move.move);
}

std::vector<AnimationStep> Simulation::playAnimations(double seconds, Wishes& wishes, std::vector<std::string>& remarks) {
    AnimationWishes wanted = animations_.advance(scene(), seconds);
    for (auto& [id, transform] : wanted.transforms) {
        const auto [wish, fresh] = wishes.try_emplace(id);
        if (fresh) wish->second.pose = poseOf(*scene().get<Transform>(id));
        transform.overlay(wish->second.pose);
        wish->second.animations = std::move(transform.animations);
    }
    if (wanted.values.empty()) return std::move(wanted.steps);
    ChangeListBuilder all;
    for (const AnimatedValue& value : wanted.values) addTo(all, value);
    if (const Expected<Committer::Applied> applied = committer_.apply(all.take())) {
        sceneChanged(applied->list.get());
        return std::move(wanted.steps);
    }
    // One of them is not to be: each by itself, and who wants it is paused.
    for (const AnimatedValue& value : wanted.values) {
        ChangeListBuilder one;
        addTo(one, value);
        const Expected<Committer::Applied> applied = committer_.apply(one.take());
        if (applied) {
            sceneChanged(applied->list.get());
            continue;
        }
        const Animation* animation = scene().get<Animation>(value.animation);
        if (!animation->playing) continue;  // its earlier value has paused it
        remarks.push_back(fmt::format("animation #{} is paused: {}", value.animation.value, applied.error().message));
        one.set(value.animation, typeOf<Animation>(), fieldId<&Animation::playing>, false);
        commit(one.take());
    }
    return std::move(wanted.steps);
}

void Simulation::commit(ChangeList list) {
    if (list.empty()) return;
    const Expected<Committer::Applied> applied = committer_.apply(std::move(list));
    TESSERA_CHECK(applied.has_value(), applied ? std::string() : applied.error().message);
    sceneChanged(applied->list.get());
}

void Simulation::commitPoses(const Wishes& wishes, std::span<const AnimationStep> animations, const StepResult& step) {
    ChangeListBuilder builder;
    std::unordered_set<ObjectId> stopped;  // animations
    for (const TentativeTransform& accepted : step.accepted) {
        const Transform* now = scene().get<Transform>(accepted.transform);
        if (!now) continue;
        addPose(builder, accepted.transform, poseOf(*now),
                {.translation = accepted.translation, .rotation = accepted.rotation, .scale = accepted.scale});
    }
    for (const BodyVelocity& body : step.velocities) {
        const CollisionObject* now = scene().get<CollisionObject>(body.core);
        if (!now) continue;
        const ObjectType type = typeOf<CollisionObject>();
        if (now->velocity != body.velocity) builder.set(body.core, type, fieldId<&CollisionObject::velocity>, toValue(body.velocity));
        if (now->spin != body.spin) builder.set(body.core, type, fieldId<&CollisionObject::spin>, toValue(body.spin));
    }
    for (const auto& [id, wish] : wishes) {
        if (std::ranges::binary_search(step.stopped, id)) {  // the time of what is stopped stands
            stopped.insert(wish.animations.begin(), wish.animations.end());
            continue;
        }
        if (!wish.motion) continue;
        const Motion* motion = scene().get<Motion>(wish.motion);
        if (motion && motion->time != wish.motionTime)
            builder.set(wish.motion, typeOf<Motion>(), fieldId<&Motion::time>, toValue(wish.motionTime));
    }
    for (const AnimationStep& went : animations) {
        const Animation* now = scene().get<Animation>(went.animation);
        // A hand may have paused it, or set its time.
        if (now && now->playing && now->time == went.from && now->time != went.time && !stopped.contains(went.animation))
            builder.set(went.animation, typeOf<Animation>(), fieldId<&Animation::time>, toValue(went.time));
    }
    commit(builder.take());
}

void Simulation::commitSkinPoses(std::vector<std::string>& remarks) {
    ChangeListBuilder builder;
    skinPoses_.write(scene(), builder, remarks);
    if (builder.empty()) return;
    if (const Expected<Committer::Applied> applied = committer_.apply(builder.take()))
        sceneChanged(applied->list.get());
    else
        remarks.push_back(fmt::format("skins stay as they were: {}", applied.error().message));
}

void Simulation::commitHandles(ChangeList list) {
    if (list.empty()) return;
    if (const Expected<Committer::Applied> applied = committer_.apply(std::move(list))) sceneChanged(applied->list.get());
}

std::vector<ObjectId> Simulation::drivingWhat(const ChangeList& list) const {
    std::vector<ObjectId> driving;
    animations_.appendDriving(list, driving);
    std::set<ObjectId> targets;
    for (const FieldColumn& column : list.columns)
        if (isPoseField(column)) targets.insert(column.ids.begin(), column.ids.end());
    for (const ObjectId target : targets) motions_.appendPlaying(target, driving);
    return driving;
}

void Simulation::sceneChanged(const ChangeList* list) {
    pipeline_.sceneChanged(scene(), list);
    othersSceneChanged(list);
}

void Simulation::othersSceneChanged(const ChangeList* list) {
    motions_.update(scene(), list);
    animations_.update(scene(), list);
    skinPoses_.update(scene(), list);
    inlines_.update(scene(), list);
    display_.sceneChanged(scene(), list);
    manipulators_.sceneChanged(scene(), list);
    serversNodes_.sceneChanged(scene(), list);
}

}  // namespace tessera
