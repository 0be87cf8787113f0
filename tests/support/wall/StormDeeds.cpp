#include <fmt/format.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <filesystem>
#include <fstream>

#include "common/codec/ChangeCodec.h"
#include "common/cores/Animation.h"
#include "common/cores/CollisionObject.h"
#include "common/cores/Transform.h"
#include "common/scene/Action.h"
#include "common/scene/Edits.h"
#include "tests/support/wall/StormSteps.h"
#include "tests/support/wall/ThreadShortage.h"

namespace tessera::simulation {
namespace {

void propose(SimulatedApplication& speaker, const ChangeList& list) {
    request::ProposeChanges proposal;
    proposal.list = ByteSlice(encodeChangeList(list));
    (void)speaker.say(proposal);
}

}  // namespace

std::span<const Storm::StormDeed> Storm::deeds() {
    static constexpr auto kDeeds = std::to_array<StormDeed>({
        {2, &Storm::hostDies, true},
        {2, &Storm::hostHangs},
        {2, &Storm::hostIsCutOff},
        {1, &Storm::hostFlaps},
        {2, &Storm::hostHasAFault},
        {2, &Storm::applicationComesOrLeaves, true},
        {1, &Storm::clockIsSet, true},
        {2, &Storm::serverIsKilled, true},
        {1, &Storm::journalIsDamaged, true},
        {3, &Storm::somebodyFlies},
        {2, &Storm::arraysAreUploaded},
        {2, &Storm::undo, true},
        {1, &Storm::redo, true},
        {3, &Storm::tallyMoves, true},
        {1, &Storm::diskIsFull},
        {1, &Storm::syncFails},
        {1, &Storm::sceneFileChanges},
        {1, &Storm::modelFileChanges},
        {2, &Storm::fileIsLoaded},
        {2, &Storm::handIsThere},
        {2, &Storm::clockPlaysOrStands},
        {8, &Storm::changesAreProposed, true},
        {2, &Storm::nodeIsMoved, true},
        {3, &Storm::thingIsSetOnAnother, true},
        {1, &Storm::nodeIsCloned, true},
        {1, &Storm::nodeIsRemoved, true},
        {8, &Storm::anythingIsAsked},
        {1, &Storm::threadsAreShort},
    });
    return kDeeds;
}

std::string Storm::anyHost(Random& random) const {
    auto host = wall_->hosts().begin();
    std::advance(host, static_cast<std::ptrdiff_t>(random.below(wall_->hosts().size())));
    return host->first;
}

// ---- hosts

std::string Storm::hostDies(StepUnderWay& step) {
    const std::string name = anyHost(step.random);
    wall_->killHost(name);
    step.world().runFor(step.random.between({}, 2s));
    wall_->startHost(name);
    faulty_.erase(name);
    return "host " + name + " dies and comes back";
}

std::string Storm::hostHangs(StepUnderWay& step) {
    const std::string name = anyHost(step.random);
    wall_->host(name).drawing().hang(true);
    step.world().runFor(step.random.between({}, 4s));
    wall_->host(name).drawing().hang(false);
    return "host " + name + " does not draw for a while";
}

std::string Storm::hostIsCutOff(StepUnderWay& step) {
    const std::string name = anyHost(step.random);
    step.world().network().cutOff(name, true);
    step.world().runFor(step.random.between({}, 3s));
    step.world().network().cutOff(name, false);
    return "host " + name + " is cut off for a while";
}

std::string Storm::hostFlaps(StepUnderWay& step) {
    const std::string name = anyHost(step.random);
    if (options_.draws && step.random.below(2) == 0) return hostFlapsAndHangs(name);
    const std::uint64_t times = 2 + step.random.below(6);
    for (std::uint64_t i = 0; i < times; ++i) {
        wall_->killHost(name);
        step.world().runFor(step.random.between({}, 20ms));
        wall_->startHost(name);
        step.world().runFor(step.random.between({}, step.random.chance(0.5) ? Duration(30ms) : Duration(500ms)));
    }
    faulty_.erase(name);
    return fmt::format("host {} dies and comes back {} times", name, times);
}

/// The wall waits again for a host that held it up when that has proved itself, by twice as many frames each time. Here
/// it draws a few and hangs, again and again.
std::string Storm::hostFlapsAndHangs(const std::string& name) {
    constexpr int kTimes = 8, kMostLate = 5;
    std::string tile;
    for (const Tile& each : layoutTiles(wall_->wall()))
        if (each.host == name) tile = each.name;
    World& world = wall_->world();
    const std::uint64_t late = first().lateFrames();
    for (int i = 0; i < kTimes; ++i) {
        const std::uint64_t before = wall_->shownFrame(tile).value_or(0);
        wall_->killHost(name);
        wall_->startHost(name);
        (void)world.runUntil([&] { return wall_->shownFrame(tile).value_or(0) > before; }, 1s);
        world.runFor(40ms);
        wall_->host(name).drawing().hang(true);
        world.runFor(2500ms);
    }
    const std::uint64_t more = first().lateFrames() - late;
    wall_->killHost(name);
    wall_->startHost(name);
    faulty_.erase(name);
    if (more > kMostLate)
        throw Violation(fmt::format("a host that hangs and comes back {} times delays {} frames", kTimes, more));
    return fmt::format("host {} hangs and comes back {} times, and delays {} frames", name, kTimes, more);
}

std::string Storm::hostHasAFault(StepUnderWay& step) {
    using enum Injection::Kind;
    constexpr std::array kKinds = {kDrawFail, kShowHang, kCorrupt, kLie};  // others sleep by the machine's clock
    const std::string name = anyHost(step.random);
    const Injection fault{.kind = kKinds[step.random.below(kKinds.size())],
                          .frame = first().lastFrame().value + step.random.below(40)};
    wall_->killHost(name);
    wall_->startHost(name, fault);
    faulty_.insert(name);
    step.world().runFor(step.random.between({}, 2s));
    return fmt::format("host {} comes back with fault {} of frame {}", name, static_cast<int>(fault.kind), fault.frame);
}

// ---- people, applications, machines

std::string Storm::applicationComesOrLeaves(StepUnderWay& step) {
    const std::string name = fmt::format("guest{}", step.random.below(4));
    forgetQuestionsOf(name);
    if (wall_->findApplication(name)) {
        wall_->removeApplication(name);
        std::erase(guests_, name);
        return name + " leaves";
    }
    (void)wall_->application(name);
    guests_.push_back(name);
    return name + " comes";
}

std::string Storm::somebodyFlies(StepUnderWay& step) {
    const std::string name = anyHost(step.random);
    InputState& state = inputs_[name];
    if (step.random.below(4) == 0) {
        step.words.fill(state);
    } else {
        // As a window says it: some keys, each pressed once; a drag; a stick.
        for (std::uint64_t i = step.random.below(4); i > 0; --i)
            state.ask(InputAction::kHome, step.random.below(state.asked.size()));
        const auto part = [&](std::int64_t most) {
            return static_cast<std::int64_t>(step.random.below(static_cast<std::uint64_t>(2 * most + 1))) - most;
        };
        state.cursorX = static_cast<std::uint16_t>(step.random.below(65536));
        state.cursorY = static_cast<std::uint16_t>(step.random.below(65536));
        state.lookRight += static_cast<std::uint64_t>(part(InputState::kUnit));
        state.panDown += static_cast<std::uint64_t>(part(InputState::kUnit));
        state.wheel += static_cast<std::uint64_t>(part(3) * InputState::kUnit);
        state.back = static_cast<std::int16_t>(step.random.below(3) == 0 ? part(InputState::kFull) : 0);
        state.turnRight = static_cast<std::int16_t>(step.random.below(3) == 0 ? part(InputState::kFull) : 0);
    }
    state.source = 0;
    wall_->host(name).input(state);
    return "keys, drags and sticks at the window of " + name;
}

std::string Storm::clockIsSet(StepUnderWay& step) {
    step.world().time().ahead += step.random.between(-3600s, 3600s);
    return "the calendar's clock is set";
}

std::string Storm::threadsAreShort(StepUnderWay& step) {
    const ThreadShortage shortage;
    step.world().runFor(step.random.between({}, 1s));
    return "no thread can be started for a while";
}

// ---- the server and its disk

void Storm::killServer() {
    wall_->killServer();
    if (std::string differs = replayFault(); !differs.empty()) throw Violation(differs);
}

void Storm::goOn() {
    wall_->startServer();
    seen_.reset();
    forgetQuestionsOf({});
    follow();
}

std::string Storm::serverIsKilled(StepUnderWay& step) {
    // All that was made until then has come to those who follow.
    if (step.random.below(2) == 0) step.world().runFor(100ms);
    killServer();
    step.world().runFor(step.random.between({}, 1s));
    goOn();
    return "the server is killed and goes on from its journal";
}

std::string Storm::journalIsDamaged(StepUnderWay& step) {
    killServer();
    const std::string journal = folder_ / "journal", copy = folder_ / "journal-copy";
    std::filesystem::remove_all(copy);
    std::filesystem::copy(journal, copy, std::filesystem::copy_options::recursive);
    std::string what = damageSector(journal, step.random);
    if (const Expected<void> begun = wall_->tryToStartServer(); !begun) {
        if (begun.error().message.empty()) throw Violation("a damaged journal is refused without a word");
        restoreFolder(journal, copy);
        what += "; the server refuses it, and goes on from a copy";
        wall_->startServer();
    }
    seen_.reset();
    forgetQuestionsOf({});
    follow();
    return "the server is killed, and the journal is damaged: " + what;
}

std::string Storm::diskIsFull(StepUnderWay& step) {
    disk_->error = step.random.below(2) == 0 ? ENOSPC : EIO;
    step.world().runFor(step.random.between({}, 2s));
    disk_->error = 0;
    return "the journal's disk takes nothing for a while";
}

std::string Storm::syncFails(StepUnderWay& step) {
    disk_->syncError = EIO;
    step.world().runFor(step.random.between({}, 2s));
    disk_->syncError = 0;
    return "a sync of the journal fails";
}

// ---- files

std::string Storm::sceneFileChanges(StepUnderWay&) {
    ++changes_;
    std::ofstream(folder_ / "scene.tsct", std::ios::app)
        << fmt::format("node {{ name: \"change{}\" transform {{ translation {{ y: {} }} }} }}\n", changes_, changes_);
    return "the scene's file is changed";
}

std::string Storm::modelFileChanges(StepUnderWay& step) {
    const std::string model = folder_ / "models/lantern.tsct";
    const std::string whole = std::string(TESSERA_SOURCE_DIR) + "/deploy/scenes/gallery/rooms/lantern.tsct";
    if (step.random.below(2) == 0) {
        std::filesystem::copy_file(whole, model, std::filesystem::copy_options::overwrite_existing);
        return "a model's file is as it was";
    }
    return "a model's file is damaged: " + damageSector(folder_ / "models", step.random);
}

std::string Storm::fileIsLoaded(StepUnderWay& step) {
    request::LoadFile load;
    step.words.fill(load);
    if (step.random.below(8) != 0) load.path = files_[step.random.below(files_.size())];
    if (step.random.below(4) != 0) {
        load.variants.clear();
        load.placing = {};
    }
    (void)step.speaker.say(load);
    return "LoadFile " + std::filesystem::path(load.path).filename().string();
}

// ---- edits

std::string Storm::arraysAreUploaded(StepUnderWay& step) {
    std::vector<Blob> arrays;
    for (std::uint64_t i = step.random.below(3); i > 0; --i) {
        Bytes bytes(step.random.below(5000));
        for (std::byte& each : bytes) each = static_cast<std::byte>(step.random.next());
        arrays.push_back(Blob::of(std::span<const std::byte>(bytes)));
    }
    step.speaker.upload(arrays);
    (void)changesAreProposed(step);
    return fmt::format("an upload of {} arrays, and a proposal", arrays.size());
}

std::string Storm::undo(StepUnderWay& step) {
    tally_->asked(step.speaker.name(), step.speaker.say(request::UndoStep{}), MoveTally::Asked::kStep);
    return "undo";
}

std::string Storm::redo(StepUnderWay& step) {
    tally_->asked(step.speaker.name(), step.speaker.say(request::RedoStep{}), MoveTally::Asked::kStep);
    return "redo";
}

std::string Storm::tallyMoves(StepUnderWay& step) {
    const std::uint64_t times = 1 + step.random.below(3);
    for (std::uint64_t i = 0; i < times; ++i) {
        request::MoveNode move{.node = tally_->node()};
        move.move.translation = Vec3d(1, 0, 0);
        move.move.relative = true;
        tally_->asked(step.speaker.name(), step.speaker.say(move), MoveTally::Asked::kMove);
    }
    return fmt::format("the tally moves {} times", times);
}

std::string Storm::handIsThere(StepUnderWay& step) {
    // At something, and led on: a drag that may end, or not.
    const Aspect& scene = first().scene();
    const auto place = [&] {
        const ObjectId node = step.words.anyNode();
        const auto* core = scene.get<Node>(node) ? scene.get<Transform>(scene.get<Node>(node)->core) : nullptr;
        Vec3d at(step.words.number(-2, 2), step.words.number(0, 2), 0);
        if (core && core->translation.allFinite()) at = core->translation;
        Aim aim;
        aim.ray = Ray{.origin = Vec3d(at.x(), at.y(), 6), .direction = Vec3d(0, 0, -1)};
        return aim;
    };
    (void)step.speaker.say(request::GrabHandle{.aim = place()});
    const std::uint64_t drags = step.random.below(6);
    for (std::uint64_t i = 0; i < drags; ++i) {
        step.world().runFor(step.random.between({}, 40ms));
        (void)step.speaker.say(request::DragHandle{.aim = place()});
    }
    if (step.random.below(3) != 0) (void)step.speaker.say(request::ReleaseHandle{});
    return fmt::format("a hand grabs and drags {} times", drags);
}

std::string Storm::clockPlaysOrStands(StepUnderWay& step) {
    ChangeListBuilder list;
    const std::uint64_t what = step.random.below(5);
    if (what < 2)
        setField<&Animation::playing>(list, clock_, false);
    else if (what < 4)
        setField<&Animation::playing>(list, clock_, true);
    else
        setField<&Animation::time>(list, clock_, static_cast<double>(step.random.below(900)));
    propose(step.speaker, list.take());
    return what < 2 ? "the clock stands" : what < 4 ? "the clock plays" : "the clock is set";
}

std::string Storm::changesAreProposed(StepUnderWay& step) {
    propose(step.speaker, step.words.list());
    return "a proposal";
}

std::string Storm::nodeIsMoved(StepUnderWay& step) {
    request::MoveNode move;
    step.words.fill(move);
    move.node = step.words.anyNode();
    (void)step.speaker.say(move);
    return fmt::format("MoveNode #{}", move.node.value);
}

/// As people do: into another one, or a hand's breadth beside it. Bodies first, where there are some.
std::string Storm::thingIsSetOnAnother(StepUnderWay& step) {
    const Aspect& scene = first().scene();
    std::vector<ObjectId> bodies;
    for (const ObjectId id : scene.ids())
        if (const Node* node = scene.get<Node>(id); node && scene.get<CollisionObject>(node->core))
            bodies.push_back(id);
    const auto any = [&] {
        return bodies.empty() || step.random.below(4) == 0 ? step.words.anyNode()
                                                           : bodies[step.random.below(bodies.size())];
    };
    const Expected<ObjectId> thing = movableNode(scene, any()), other = movableNode(scene, any());
    if (!thing || !other || untouched().contains(*thing)) return "nothing";
    const Vec3d aside = step.random.below(2) == 0 ? Vec3d(step.words.number(-0.3, 0.3), step.words.number(0, 0.3), 0)
                                                  : Vec3d(Vec3d::Zero());
    const Vec3d place = worldTransform(scene, scene.get<Node>(*thing)->parent).inverse() *
                        (worldTransform(scene, *other).translation() + aside);
    request::MoveNode move;
    move.node = *thing;
    move.move.translation = place;
    (void)step.speaker.say(move);
    return fmt::format("#{} is set on #{}", thing->value, other->value);
}

std::string Storm::nodeIsCloned(StepUnderWay& step) {
    request::CloneNode clone;
    step.words.fill(clone);
    clone.wish.node = step.words.anyNode();
    (void)step.speaker.say(clone);
    return fmt::format("CloneNode #{}", clone.wish.node.value);
}

std::string Storm::nodeIsRemoved(StepUnderWay& step) {
    const request::RemoveNode remove{.node = step.words.anyNode()};
    if (remove.node == kRootNode) return "nothing";
    (void)step.speaker.say(remove);
    return fmt::format("RemoveNode #{}", remove.node.value);
}

std::string Storm::anythingIsAsked(StepUnderWay& step) {
    ApplicationRequest request = step.words.request();
    if (auto* news = std::get_if<request::SubscribeNews>(&request); news && step.speaker.name() == kFirst)
        news->wanted.frames = true;
    const std::uint64_t id = step.speaker.say(request);
    if (std::holds_alternative<request::UndoStep>(request) || std::holds_alternative<request::RedoStep>(request))
        tally_->asked(step.speaker.name(), id, MoveTally::Asked::kStep);
    return std::string(infoOf(request).name);
}

}  // namespace tessera::simulation
