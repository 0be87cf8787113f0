#include <fmt/format.h>
#include <fmt/ranges.h>

#include <chrono>
#include <cmath>
#include <filesystem>

#include "common/cores/Animation.h"
#include "common/cores/Transform.h"
#include "server/sim/recording/RecordingReplay.h"
#include "tests/support/wall/StormSteps.h"

namespace tessera::simulation {
namespace {

constexpr auto kMostBetweenFrames = 8s, kMostUntilTheFirst = 20s;  // which films are waited for

}  // namespace

std::string Storm::findBroken() {
    for (const auto& [name, application] : wall_->applications())
        for (const auto& [id, answer] : application->takeAnswers()) {
            ++(answer ? answers_.granted : answers_.refused);
            tally_->answered(name, id, answer);
        }
    if (!wall_->serverLives()) return "the server has ended: " + wall_->serverError() + "\n" + wall_->logs();
    const SimulatedApplication* const there = wall_->findApplication(kFirst);
    if (!there || there->ended() || !there->hasScene()) return {};
    const Grants now{there->sequence(), there->scene().stateHash()};
    if (seen_ && now.sequence == seen_->sequence && now.state != seen_->state)
        return "a list that was seen is another one now";
    seen_ = now;
    if (hashOfKept() != keptHash_) return "what nobody touches is changed";
    if (std::string stopped = framesStopped(); !stopped.empty()) return stopped;
    return clockFault();
}

std::uint64_t Storm::hashOfKept() const {
    const Aspect& scene = wall_->findApplication(kFirst)->scene();
    std::uint64_t hash = 0;
    for (const ObjectId id : kept_) {
        const Object object = scene.find(id);
        if (!object) throw Violation("what nobody touches is gone");
        hash = object.info().hash(object.data(), hash);
    }
    return hash;
}

std::string Storm::framesStopped() {
    const SimulatedApplication& application = *wall_->findApplication(kFirst);
    const TimePoint now = wall_->world().now();
    if (application.framesTold() != framesTold_) {
        framesTold_ = application.framesTold();
        frameAt_ = now;
    }
    if (now - frameAt_ <= (framesTold_ == 0 ? kMostUntilTheFirst : kMostBetweenFrames)) return {};
    return fmt::format("no frame for {} s\n{}",
                       std::chrono::duration_cast<std::chrono::seconds>(now - frameAt_).count(), wall_->logs());
}

/// One that stands has the time of what is shown. A seek is shown in the next frame.
std::string Storm::clockFault() {
    const SimulatedApplication& application = *wall_->findApplication(kFirst);
    const auto* clock = application.scene().get<Animation>(clock_);
    const auto* hand = application.scene().get<Transform>(hand_);
    if (!clock || !hand) return "what nobody touches is gone: the clock";
    const bool right = clock->playing || std::abs(hand->translation.x() - clock->time) < 1e-6;
    if (right)
        clockOffSince_.reset();
    else if (!clockOffSince_)
        clockOffSince_ = application.framesTold();
    if (right || application.framesTold() < *clockOffSince_ + 4) return {};
    return fmt::format("a clock that stands says {}, and its hand {}", clock->time, hand->translation.x());
}

std::string Storm::lookClosely() {
    World& world = wall_->world();
    // Moves that were granted are there: looked at when nothing waits for an answer.
    (void)world.runUntil(
        [&] {
            for (const auto& [name, application] : wall_->applications())
                if (application->ended()) forgetQuestionsOf(name);
            if (std::string broken = findBroken(); !broken.empty()) throw Violation(broken);
            return !tally_->waits();
        },
        60s);
    forgetQuestionsOf({});
    if (std::string fault = tally_->fault(); !fault.empty()) return fault;
    if (std::string fault = pictureFault(); !fault.empty()) return fault;
    return newcomerFault();
}

std::string Storm::pictureFault() {
    if (!options_.draws) return {};
    World& world = wall_->world();
    for (const std::string& name : std::exchange(faulty_, {})) {
        wall_->killHost(name);
        wall_->startHost(name);
    }
    // Test pictures name their tiles.
    (void)first().ask(request::ShowPicture{Showing::kScene});
    // Frames go on: all hosts show the same one again, sooner or later, and it is a new one.
    const std::optional<std::uint64_t> before = wall_->shownFrame();
    world.runFor(500ms);
    const bool goesOn = world.runUntil(
        [&] {
            const auto now = wall_->shownFrame();
            return now && (!before || *now > *before);
        },
        60s);
    if (!goesOn) return "the wall stands still\n" + wall_->logs();
    const std::optional<Picture> tiles = wall_->picture("front");
    for (const CullerKind culler : kCullersCompared) {
        const std::optional<Picture> whole = wall_->picture(screenOf(culler));
        if (whole == tiles) continue;
        const std::string path = std::filesystem::temp_directory_path() / "storm-";
        (void)writeFile(path + "front.png", encodePng(*tiles, 0));
        (void)writeFile(path + screenOf(culler) + ".png", encodePng(*whole, 0));
        return fmt::format("frame {}: 2x2 and {} show different pictures ({}*.png)", *wall_->shownFrame(),
                           screenOf(culler), path);
    }
    return {};
}

/// A newcomer sees what those see who have followed all along.
std::string Storm::newcomerFault() {
    SimulatedApplication& newcomer = wall_->application("newcomer");
    const SimulatedApplication& application = first();
    const bool same =
        wall_->world().runUntil([&] { return newcomer.sequence() == application.sequence() || newcomer.ended(); }, 30s);
    const bool equal = newcomer.scene().stateHash() == application.scene().stateHash();
    const bool ended = newcomer.ended();
    wall_->removeApplication("newcomer");
    if (ended) return {};  // the server was asked to end it, or it was slow: it comes in again
    if (!same) return "a newcomer does not come into step";
    return equal ? std::string() : "a newcomer has another scene";
}

/// Undo of everything leads to the first state, and redo of everything back.
std::string Storm::undoFault() {
    constexpr int kMostSteps = 4000;
    World& world = wall_->world();
    // Steps one after the other, each with its answer.
    const auto all = [&](const auto& request) {
        int count = 0;
        for (; count < kMostSteps; ++count) {
            const Expected<answer::Committed> done = first().ask(request);
            if (!done) break;
            (void)world.runUntil([&] { return first().sequence() >= done->sequence; }, 10s);
        }
        return count;
    };
    (void)all(request::RedoStep{});
    const StateHash before = first().scene().stateHash();
    const int undone = all(request::UndoStep{});
    if (first().scene().stateHash() != begun_)
        return fmt::format("undo of all {} steps leads to another state", undone);
    const int redone = all(request::RedoStep{});
    if (redone != undone) return fmt::format("of {} steps that were undone {} can be done again", undone, redone);
    return first().scene().stateHash() == before ? std::string() : "undo and redo of everything lead to another state";
}

std::string Storm::end() {
    try {
        std::string law = lookClosely();
        if (law.empty() && options_.still) law = undoFault();
        if (law.empty()) {
            wall_->killServer();
            law = replayFault();
        }
        return law;
    } catch (const Violation& violation) {
        return violation.what();
    }
}

std::string Storm::replayFault() {
    if (std::exchange(recorded_, true)) return {};
    Expected<RecordingReader> reader = RecordingReader::open(folder_ / "recording");
    if (!reader) return "the recording cannot be read: " + reader.error().message;
    const ReplayResult again = replay(*reader);
    if (again.end == ReplayResult::End::kDamaged) return "the recording is damaged: " + again.error.message;
    if (!again.firstDifference) return {};
    return fmt::format("the replay differs in frame {}: {}",
                       again.firstDifference->frame ? again.firstDifference->frame->value : 0,
                       fmt::join(again.firstDifference->what, "; "));
}

}  // namespace tessera::simulation
