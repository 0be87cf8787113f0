#include "server/sim/frame/Simulation.h"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <unordered_set>
#include <utility>

#include <fmt/format.h>

#include "common/cores/CollisionObject.h"
#include "common/cores/Transform.h"
#include "common/scene/Action.h"
#include "common/scene/ColumnShapes.h"
#include "common/scene/Edits.h"
#include "common/scene/FieldTable.h"
#include "server/collision/pipeline/ScenePicker.h"
#include "server/sim/commit/ServersFields.h"
#include "server/sim/frame/LoadParts.h"
#include "server/sim/frame/PoseFields.h"
#include "server/text/TextFields.h"

namespace tessera {

namespace {

Actor::Incoming::From fromOf(const Edit& edit) {
    if (edit.undoable) return Actor::Incoming::From::kPeople;
    return edit.ofFile ? Actor::Incoming::From::kFiles : Actor::Incoming::From::kServer;
}

}  // namespace

Simulation::Simulation(const SimulationOptions& options)
    : maxObjects_(options.scene.maxObjects),
      committer_(options.scene),
      time_(*options.time),
      workers_(options.threads > 1 ? std::make_unique<Workers>(options.threads) : nullptr),
      pipeline_(options.collision, workers_.get()),
      actors_(actorsOf(*step_, nullptr)) {
    sceneChanged(nullptr);
}

Expected<CommittedFrame> Simulation::load(std::vector<ChangeList> lists) {
    for (std::size_t i = 0; i < lists.size(); ++i) {
        const Expected<void> received = receive(lists[i], {});
        const Expected<Committer::Applied> applied =
            received ? committer_.apply(std::move(lists[i])) : tl::unexpected(received.error());
        if (!applied) return failWith(fmt::format("scene {}", i + 1), applied.error());
    }
    sceneChanged(nullptr);
    return committer_.closeFrame();
}

std::optional<PickHit> Simulation::pick(const Ray& ray, PickPatience* patience) {
    return pipeline_.pickNode(scene(), ray, patience);
}

std::optional<AsidePick> Simulation::pickAside(const Ray& ray) {
    return pipeline_.pickAside(scene(), ray);
}

void Simulation::putShapes(std::vector<MadeShape> made) {
    pipeline_.putShapes(std::move(made));
}

std::optional<AsideNearest> Simulation::nearestAside(const Vec3d& place, ObjectId below) {
    return pipeline_.nearestAside(scene(), place, below);
}

std::optional<NearestSurface> Simulation::nearestSurface(const Vec3d& place, ObjectId below, PickPatience* patience) {
    return pipeline_.nearestSurface(scene(), place, below, patience);
}

void Simulation::goOnFrom(Left left) {
    committer_.goOnFrom(std::move(left.scene), left.sequence);
    history_ = std::move(left.history);
    // Nobody is given an id that is refused as being on its way.
    committer_.skipIds(ObjectId(std::max(history_.idsArriving().end(), history_.idsUnderWay().end())));
    step_->contacts.goOnWith(left.display);
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
    Wishes& wishes = wishes_;
    wishes.clear();
    ServersHand hand = this->hand();
    ActorStage stage{.hand = hand, .seconds = seconds, .wishes = wishes, .remarks = result.remarks};
    actors_.want(stage);
    for (std::size_t i = 0; i < edits.size(); ++i) result.outcomes.push_back(applyEdit(std::move(edits[i]), i, wishes));

    // An edit may have destroyed what a motion or an earlier edit wanted to move.
    wishes.eraseIf([&](ObjectId id) { return !scene().get<Transform>(id); });
    std::vector<TentativeTransform> tentative;
    tentative.reserve(wishes.size());
    for (const auto& [id, wish] : wishes.ascending())
        tentative.push_back({.transform = id,
                             .translation = wish.pose.translation,
                             .rotation = wish.pose.rotation,
                             .scale = wish.pose.scale,
                             .source = static_cast<int>(wish.way ? wishes.lastWay(wish)->edit + 1 : 0)});
    const TimePoint begin = time_.now();
    result.collision = pipeline_.step(scene(), tentative, replies, seconds);
    result.collisionMs = toMilliseconds(time_.now() - begin);
    const auto tellHand = [&](ObjectId id) {
        const Wish* wish = wishes.find(id);
        if (!wish) return;
        for (const Wishes::Way* way = wishes.lastWay(*wish); way; way = wishes.wayBefore(*way))
            result.outcomes[way->edit].result->stopped.push_back(id);
    };
    for (const ObjectId id : result.collision.stopped) tellHand(id);
    // Where a reply has decided, a hand has not got its way either.
    for (const TentativeTransform& accepted : result.collision.accepted)
        if (accepted.source < 0 && !std::ranges::binary_search(result.collision.stopped, accepted.transform))
            tellHand(accepted.transform);
    if (wholeAgain) result.outcomes.push_back(std::move(*wholeAgain));
    commitPoses(wishes, result.collision);
    closeSteps(wishes);
    actors_.settle(stage, result.collision);
    result.commit = committer_.closeFrame();
    for (EditOutcome& outcome : result.outcomes)
        if (outcome.result) outcome.result->sequence = result.commit.sent->sequence;
    result.history = history_.happened();
    result.notes = std::exchange(textNotes_, {});
    return result;
}

EditOutcome Simulation::applyEdit(Edit edit, std::size_t index, Wishes& wishes) {
    if (edit.kind == Edit::Kind::kPart || edit.kind == Edit::Kind::kLastPart) return applyPart(std::move(edit));
    if (isStep(edit.kind)) return applyStep(edit, wishes);
    const auto refused = [&](Error why) {
        return EditOutcome{.ticket = edit.ticket, .result = tl::unexpected(std::move(why))};
    };
    const bool addsUp = edit.move && edit.move->relative;
    if (edit.move) {
        Expected<ChangeList> list = listOf(edit.node, *edit.move, wishes);
        if (!list) return refused(std::move(list.error()));
        edit.list = std::move(*list);
    }
    // From here on the values of each column are those of its field: all below reads them, and adds to them.
    Expected<void> sound = checkColumnShapes(edit.list);
    if (sound) sound = checkHidden(edit);
    // What the server says itself nobody takes back.
    if (edit.undoable && sound) sound = checkServersFields(scene(), edit.list);
    if (edit.undoable && sound) sound = serversNodes_.check(scene(), edit.list);
    if (sound) sound = actors_.receive(scene(), edit.list, {.from = fromOf(edit)});
    if (sound) sound = setTexts(edit.list, scene(), typesetter_, textNotes_);
    if (!sound) return refused(std::move(sound.error()));
    ChangeList list = std::move(edit.list);
    const std::vector<Actor::Driver> drivers = actors_.drivers(list);
    takeTransforms(list, wishes);
    const std::vector<ById<Pose>::Row>& poses = wanted_.ascending();
    std::vector<ObjectId> moved;
    moved.reserve(poses.size());
    for (const auto& [id, pose] : poses) {
        moved.push_back(id);
        if (pose.sound()) continue;
        return refused({ErrorCode::kBadInput,
                        fmt::format("the transform wanted for #{} is not finite, or its rotation cannot be normalised",
                                    id.value)});
    }
    pause(drivers, list);

    EditOutcome outcome{.ticket = edit.ticket};
    OpenStep step{.edit = index, .inverse = {}, .moves = {}, .gesture = edit.gesture};
    if (edit.undoable) step.overlaps = pipeline_.overlaps(scene(), moved);
    if (!list.empty()) {
        ServersHand hand = this->hand();
        const std::vector<Actor::Afterwards> afterwards =
            actors_.before(hand, list, edit.ofFile ? Actor::ListOf::kStep : Actor::ListOf::kEdit);
        Expected<Committer::Applied> applied =
            committer_.apply(std::move(list), edit.undoable ? Committer::Inverse::kMade : Committer::Inverse::kNone);
        if (!applied) return refused(std::move(applied.error()));
        outcome.result->ids = std::move(applied->ids);
        step.inverse = std::move(applied->inverse);
        sceneChanged(applied->list.get());
        follow(afterwards);
    }
    if (saysNothing(scene(), step.inverse)) step.inverse = {};
    for (const auto& [id, pose] : poses) {
        const Transform* now = scene().get<Transform>(id);
        if (!now) continue;  // destroyed by the same edit
        Wish& wish = wishes.add(id).value;
        if (!addsUp) wish.way = 0;
        wishes.addWay(wish, index, wish.way == 0 ? poseOf(*now) : wish.pose);
        wish = {.pose = pose, .way = wish.way};
        step.moves.push_back(id);
    }
    if (edit.undoable) openSteps_.push_back(std::move(step));
    return outcome;
}

EditOutcome Simulation::applyPart(Edit edit) {
    EditOutcome outcome{.ticket = edit.ticket};
    if (Expected<void> begun = beginParts(edit); !begun) {
        outcome.result = tl::unexpected(std::move(begun.error()));
        return outcome;
    }
    Expected<void> wanted = receive(edit.list, {.from = fromOf(edit), .own = arriving_->ids});
    if (wanted && edit.undoable) wanted = serversNodes_.check(scene(), edit.list);
    Expected<Committer::Applied> applied =
        wanted ? committer_.applyReserved(std::move(edit.list), ObjectId(arriving_->ids.first), arriving_->ids.count,
                                          Committer::Inverse::kMade)
               : tl::unexpected(wanted.error());
    if (!applied) {
        outcome.result = tl::unexpected(applied.error());
        arriving_.reset();
        takeOrphansAway();
        return outcome;
    }
    history_.partArrived(std::move(applied->inverse), arriving_->ids);
    sceneChanged(applied->list.get());
    const auto brings = [&](const Placement& placement) {
        return placement.parent && !arriving_->ids.contains(placement.parent);
    };
    arriving_->seen = arriving_->seen || std::ranges::any_of(applied->list->placements, brings);
    if (edit.kind == Edit::Kind::kPart) return outcome;
    outcome.result->ids = {{ObjectId(kFirstPlaceholder), ObjectId(arriving_->ids.first)}};
    edit.undoable ? history_.partsWhole() : history_.partsKept();
    arriving_.reset();
    return outcome;
}

Expected<void> Simulation::receive(ChangeList& list, const Actor::Incoming& incoming) const {
    if (Expected<void> shaped = checkColumnShapes(list); !shaped) return shaped;
    return actors_.receive(scene(), list, incoming);
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
    arriving_ = Arriving{.ticket = edit.ticket,
                         .ids = {.first = committer_.reserveIds(edit.objects).value, .count = edit.objects}};
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
    if (!edit.undoable && actors_.followsWhatIsSeen(edit.ticket)) return {};
    if (history_.arriving())
        if (const std::optional<ObjectId> id = namedIn(edit.list, history_.idsArriving()))
            return fail(ErrorCode::kRefused, fmt::format("#{} is still being loaded", id->value));
    if (history_.underWay())
        if (const std::optional<ObjectId> id = namedIn(edit.list, history_.idsUnderWay()))
            return fail(ErrorCode::kRefused, fmt::format("#{} is still being taken away or brought back", id->value));
    return {};
}

void Simulation::follow(std::span<const Actor::Afterwards> afterwards) {
    ServersHand hand = this->hand();
    for (const Actor::Afterwards& next : afterwards) next(hand);
}

void Simulation::pause(std::span<const Actor::Driver> drivers, ChangeList& list) {
    if (drivers.empty()) return;
    const auto isPlaying = [&](const FieldColumn& column) {
        return std::ranges::any_of(drivers, [&](const Actor::Driver& driver) {
            return column.type == driver.type && column.field == driver.playing;
        });
    };
    std::unordered_set<ObjectId> spokenFor;
    for (const FieldColumn& column : list.columns)
        if (isPlaying(column)) spokenFor.insert(column.ids.begin(), column.ids.end());
    spokenFor.insert(list.destructions.begin(), list.destructions.end());
    ChangeListBuilder pauses;
    for (const Actor::Driver& driver : drivers)
        if (!spokenFor.contains(driver.object)) pauses.set(driver.object, driver.type, driver.playing, false);
    ChangeList pausing = pauses.take();
    for (FieldColumn& column : pausing.columns) mergeColumn(list, std::move(column));
}

void Simulation::takeTransforms(ChangeList& list, const Wishes& wishes) {
    wanted_.clear();
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
            const auto [pose, isNew] = wanted_.add(id);
            if (isNew) pose = poseFor(wishes, id, *now);
            setPart(pose, column, row);
        }
        column = std::move(rest);
    }
    std::erase_if(list.columns, [](const FieldColumn& column) { return isPoseField(column) && column.ids.empty(); });
}

Pose Simulation::poseFor(const Wishes& wishes, ObjectId id, const Transform& now) {
    const Wish* earlier = wishes.find(id);
    return earlier && !earlier->whole ? earlier->pose : poseOf(now);
}

Expected<ChangeList> Simulation::listOf(ObjectId node, const NodeMove& move, const Wishes& wishes) const {
    const Expected<ObjectId> movable = movableNode(scene(), node);
    if (!movable) return tl::unexpected(movable.error());
    const ObjectId core = scene().get<Node>(*movable)->core;
    Transform present = *scene().get<Transform>(core);
    const Pose pose = poseFor(wishes, core, present);
    present.translation = pose.translation;
    present.rotation = pose.rotation;
    present.scale = pose.scale;
    return moveList(core, present, move);
}

void Simulation::commitPoses(Wishes& wishes, const StepResult& step) {
    ChangeListBuilder builder;
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
        if (now->velocity != body.velocity)
            builder.set(body.core, type, fieldId<&CollisionObject::velocity>, toValue(body.velocity));
        if (now->spin != body.spin) builder.set(body.core, type, fieldId<&CollisionObject::spin>, toValue(body.spin));
    }
    WishOutcome outcome;
    for (const auto& [id, wish] : wishes.ascending())
        (std::ranges::binary_search(step.stopped, id) ? outcome.stopped : outcome.granted)
            .insert(wish.actors.begin(), wish.actors.end());
    actors_.hear(scene(), outcome, builder);
    hand().commit(builder.take());
}

std::vector<ObjectId> Simulation::drivingWhat(const ChangeList& list) const {
    std::vector<ObjectId> driving;
    for (const Actor::Driver& driver : actors_.drivers(list)) driving.push_back(driver.object);
    return driving;
}

void Simulation::sceneChanged(const ChangeList* list) {
    pipeline_.sceneChanged(scene(), list);
    othersSceneChanged(list);
}

void Simulation::othersSceneChanged(const ChangeList* list) {
    actors_.follow(Actor::Each::kList, scene(), list);
    serversNodes_.sceneChanged(scene(), list);
}

}  // namespace tessera
