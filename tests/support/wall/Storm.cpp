#include "tests/support/wall/Storm.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "common/codec/ChangeCodec.h"
#include "common/cores/Transform.h"
#include "server/sim/journal/FileSystem.h"
#include "server/sim/recording/RecordingReplay.h"

namespace tessera::simulation {
namespace {

constexpr std::array kCullers = {CullerKind::kNone, CullerKind::kMasked, CullerKind::kTwoPhase};
constexpr const char* kFirst = "first";

/// The shipped 2x2 wall, and the same screen once more, whole, for each culler.
std::string wallText(bool draws) {
    const std::string corners =
        " lower_left { x: -1.6 y: 0.6 z: 0 } lower_right { x: 1.6 y: 0.6 z: 0 } upper_left { x: -1.6 y: 2.4 z: 0 }";
    const auto screen = [&](const std::string& name, int tiles, int width, int height) {
        return fmt::format(
            "screens {{ name: \"{}\"{} grid {{ columns: {} rows: {} tile_width_px: {} tile_height_px: {} }} }}\n", name,
            corners, tiles, tiles, width, height);
    };
    const auto host = [](const std::string& name, const std::string& on, int column, int row) {
        return fmt::format(
            "hosts {{ name: \"{}\" tiles {{ screen: \"{}\" column: {} row: {} eye: CENTER user: \"viewer\" }} }}\n",
            name, on, column, row);
    };
    std::string text = screen("front", draws ? 2 : 1, draws ? 24 : 48, draws ? 14 : 28);
    if (draws)
        for (const CullerKind culler : kCullers) text += screen("whole-" + std::string(nameOf(culler)), 1, 48, 28);
    text += "users { name: \"viewer\" position { x: 0 y: 1.7 z: 2.4 } eye_separation_m: 0.065 }\n";
    for (int i = 0; i < (draws ? 4 : 1); ++i) text += host(fmt::format("tile{}", i), "front", i % 2, i / 2);
    if (draws)
        for (const CullerKind culler : kCullers)
            text += host(std::string(nameOf(culler)), "whole-" + std::string(nameOf(culler)), 0, 0);
    return text + "sync { late_frame: WAIT frame_deadline_ms: 2000 heartbeat_ms: 100 lost_after_ms: 800 }\n";
}

}  // namespace

/// One that may be full, or fail.
class Storm::Disk final : public FileSystem {
public:
    int error = 0;  ///< errno of whatever is written; 0: none
    int syncError = 0;
    [[nodiscard]] int create(const std::string& path, int& file) override {
        return error != 0 ? error : FileSystem::create(path, file);
    }
    [[nodiscard]] int append(int file, ByteSpan first, ByteSpan second) override {
        return error != 0 ? error : FileSystem::append(file, first, second);
    }
    [[nodiscard]] int overwrite(int file, ByteSpan bytes) override {
        return error != 0 ? error : FileSystem::overwrite(file, bytes);
    }
    [[nodiscard]] int sync(int file) override { return syncError != 0 ? syncError : FileSystem::sync(file); }
};

Storm::Storm(StormOptions options) : options_(std::move(options)) {
    const std::string wall = folder_ / "storm.wall", scene = folder_ / "scene.tsct";
    std::ofstream(wall) << wallText(options_.draws);
    std::filesystem::copy_file(options_.scene, scene);
    std::ofstream(scene, std::ios::app) << "\nnode { name: \"tally\" transform {} }\n";
    WallOptions wanted{.scene = scene,
                       .wall = wall,
                       .widthPx = 0,
                       .draws = options_.draws,
                       .journal = folder_ / "journal",
                       .journalFiles = disk_ = std::make_shared<Disk>(),
                       .record = folder_ / "recording",
                       .reload = true,
                       .seed = options_.seed};
    for (const CullerKind culler : kCullers) wanted.cullers[std::string(nameOf(culler))] = culler;
    wall_ = std::make_unique<SimulatedWall>(std::move(wanted));
    beginTally();
}

void Storm::beginTally() {
    const Aspect& scene = wall_->application(kFirst).scene();
    const Expected<ObjectId> node = findNode(scene, "/tally");
    if (!node) throw Violation("no tally: " + node.error().message);
    tally_.node = *node;
    tally_.core = scene.get<Node>(*node)->core;
    follow();
}

void Storm::follow() {
    SimulatedApplication& first = wall_->application(kFirst);
    const auto look = [this, &first](bool whole) {
        const auto* core = first.scene().get<Transform>(tally_.core);
        if (!core) throw Violation("what nobody touches is gone: the tally");
        tally_.looks.push_back({first.sequence(), core->translation.x(), whole});
    };
    look(true);
    first.onList = look;
}

void Storm::forgetQuestionsOf(const std::string& application) {
    std::erase_if(tally_.asked, [&](const auto& entry) {
        if (!application.empty() && entry.first.first != application) return false;
        if (entry.second == Tally::Asked::kMove)
            ++tally_.unknown;
        else
            tally_.stepUnknown = true;
        return true;
    });
}

std::string Storm::tallyFault() {
    // Answers to the edits of these lists were awaited, so they are known.
    std::string fault;
    for (std::size_t i = 1; i < tally_.looks.size() && fault.empty(); ++i) {
        const Tally::TallyReading &before = tally_.looks[i - 1], &now = tally_.looks[i];
        int granted = 0;
        for (auto at = tally_.granted.upper_bound(before.sequence);
             at != tally_.granted.end() && at->first <= now.sequence; ++at)
            granted += at->second;
        const auto step = tally_.steps.upper_bound(before.sequence);
        if (tally_.stepUnknown || (step != tally_.steps.end() && *step <= now.sequence)) continue;
        const double more = now.at - before.at - granted;
        if (more < 0 || more > tally_.unknown || more != std::floor(more))
            fault = fmt::format(
                "relative moves: {} were granted in lists {} to {}, {} are not known of, and the node moved by {}",
                granted, before.sequence.value + 1, now.sequence.value, tally_.unknown, now.at - before.at);
    }
    if (!tally_.looks.empty()) {
        const Tally::TallyReading last = tally_.looks.back();
        std::erase_if(tally_.granted, [&](const auto& entry) { return entry.first <= last.sequence; });
        std::erase_if(tally_.steps, [&](Sequence each) { return each <= last.sequence; });
        tally_.looks = {last};
    }
    tally_.unknown = 0;
    tally_.stepUnknown = false;
    return fault;
}

Storm::~Storm() = default;

std::string Storm::step(std::uint64_t seed) {
    Random random(seed);
    try {
        said_ = doOne(random);
        wall_->world().runFor(random.between(1ms, random.chance(0.1) ? Duration(3s) : Duration(200ms)));
        std::string broken = findBroken();
        if (broken.empty() && ++steps_ % 25 == 0) broken = lookClosely();
        return broken;
    } catch (const Violation& violation) {
        return violation.what();
    }
}

std::string Storm::doOne(Random& random) {
    World& world = wall_->world();
    SimulatedApplication* const first = wall_->findApplication(kFirst);
    if (!first || first->ended()) {
        forgetQuestionsOf(kFirst);
        follow();
        return "the first application comes back";
    }
    SimulatedApplication* speaker = first;
    if (!programs_.empty() && random.below(3) == 0) {
        if (auto* other = wall_->findApplication(programs_[random.below(programs_.size())]); other && !other->ended())
            speaker = other;
    }
    RandomWords words(random, first->scene(), {options_.scene, folder_ / "scene.tsct"}, {tally_.node, tally_.core});
    const std::string speaks = speaker->name();
    const auto anyHost = [&] {
        auto host = wall_->hosts().begin();
        std::advance(host, static_cast<std::ptrdiff_t>(random.below(wall_->hosts().size())));
        return host->first;
    };
    switch (random.below(24)) {
        case 0: {
            const std::string name = anyHost();
            wall_->killHost(name);
            world.runFor(random.between({}, 2s));
            wall_->startHost(name);
            return "host " + name + " dies and comes back";
        }
        case 1: {
            const std::string name = anyHost();
            wall_->host(name).drawing().hang(true);
            world.runFor(random.between({}, 4s));
            wall_->host(name).drawing().hang(false);
            return "host " + name + " does not draw for a while";
        }
        case 2: {
            const std::string name = anyHost();
            world.network().cutOff(name, true);
            world.runFor(random.between({}, 3s));
            world.network().cutOff(name, false);
            return "host " + name + " is cut off for a while";
        }
        case 3: {
            const std::string name = fmt::format("guest{}", random.below(4));
            if (auto* there = wall_->findApplication(name)) {
                (void)there;
                wall_->removeApplication(name);
                forgetQuestionsOf(name);
                std::erase(programs_, name);
                return name + " leaves";
            }
            forgetQuestionsOf(name);
            (void)wall_->application(name);
            programs_.push_back(name);
            return name + " comes";
        }
        case 4:
            world.time().ahead += random.between(-3600s, 3600s);
            return "the calendar's clock is set";
        case 5:
            return killAndGoOn(random);
        case 6: {
            InputState state;
            words.fill(state);
            state.source = 0;
            wall_->host(anyHost()).input(state);
            return "a key, a button or a stick at a window";
        }
        case 7: {
            std::vector<Blob> arrays;
            for (std::uint64_t i = random.below(3); i > 0; --i) {
                Bytes bytes(random.below(5000));
                for (std::byte& each : bytes) each = static_cast<std::byte>(random.next());
                arrays.push_back(Blob::of(std::span<const std::byte>(bytes)));
            }
            speaker->upload(arrays);
            (void)speaker->say(request::ProposeChanges{.list = ByteSlice(encodeChangeList(words.list()))});
            return fmt::format("an upload of {} arrays, and a proposal", arrays.size());
        }
        case 8:
            tally_.asked[{speaks, speaker->say(request::UndoStep{})}] = Tally::Asked::kStep;
            return "undo";
        case 15:
        case 16: {
            request::MoveNode move{.node = tally_.node, .move = {.translation = Vec3d(1, 0, 0), .relative = true}};
            tally_.asked[{speaks, speaker->say(move)}] = Tally::Asked::kMove;
            return "the tally moves";
        }
        case 18: {
            disk_->error = ENOSPC;
            world.runFor(random.between({}, 2s));
            disk_->error = 0;
            return "the journal's disk is full for a while";
        }
        case 19: {
            if (random.below(2) == 0) {
                ++changes_;
                std::ofstream(folder_ / "scene.tsct", std::ios::app) << fmt::format(
                    "node {{ name: \"change{}\" transform {{ translation {{ y: {} }} }} }}\n", changes_, changes_);
                return "the scene's file is changed";
            }
            disk_->syncError = EIO;
            world.runFor(random.between({}, 2s));
            disk_->syncError = 0;
            return "a sync of the journal fails";
        }
        case 9:
        case 10:
        case 11:
        case 12:
        case 13:
            (void)speaker->say(request::ProposeChanges{.list = ByteSlice(encodeChangeList(words.list()))});
            return "a proposal";
        case 14: {
            request::MoveNode move;
            words.fill(move);
            move.node = words.anyNode();
            (void)speaker->say(move);
            return fmt::format("MoveNode #{}", move.node.value);
        }
        default: {
            const ApplicationRequest request = words.request();
            const std::uint64_t id = speaker->say(request);
            if (std::holds_alternative<request::UndoStep>(request) ||
                std::holds_alternative<request::RedoStep>(request))
                tally_.asked[{speaks, id}] = Tally::Asked::kStep;
            return std::string(infoOf(request).name);
        }
    }
}

std::string Storm::findBroken() {
    for (const auto& [name, application] : wall_->applications())
        for (const auto& [id, answer] : application->takeAnswers()) {
            ++(answer ? answers_.granted : answers_.refused);
            const auto asked = tally_.asked.find({name, id});
            if (asked == tally_.asked.end()) continue;
            // The journal has ended: the edit stands, and its author is told that it may be lost.
            if (!answer && answer.error().message.starts_with("it is done"))
                asked->second == Tally::Asked::kMove ? (void)++tally_.unknown : (void)(tally_.stepUnknown = true);
            const auto* committed = answer ? std::get_if<answer::Committed>(&*answer) : nullptr;
            if (committed && asked->second == Tally::Asked::kStep) tally_.steps.insert(committed->sequence);
            if (committed && asked->second == Tally::Asked::kMove) ++tally_.granted[committed->sequence];
            tally_.asked.erase(asked);
        }
    if (!wall_->serverLives()) return "the server has ended: " + wall_->serverError() + "\n" + wall_->logs();
    const SimulatedApplication* const first = wall_->findApplication(kFirst);
    if (first && !first->ended() && first->hasScene()) {
        if (seen_ && first->sequence() == seen_->sequence && first->scene().stateHash() != seen_->state)
            return "a list that was seen is another one now";
        seen_ = {first->sequence(), first->scene().stateHash()};
    }
    return {};
}

std::string Storm::killAndGoOn(Random& random) {
    World& world = wall_->world();
    // All that was made until then has come to those who follow.
    if (random.below(2) == 0) world.runFor(100ms);
    wall_->killServer();
    if (std::string differs = replayed(); !differs.empty()) throw Violation(differs);
    world.runFor(random.between({}, 1s));
    wall_->startServer();
    seen_.reset();
    forgetQuestionsOf({});
    follow();
    return "the server is killed and goes on from its journal";
}

std::string Storm::replayed() {
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

std::string Storm::lookClosely() {
    World& world = wall_->world();
    if (options_.draws) {
        // Test pictures name their tiles.
        (void)wall_->application(kFirst).ask(request::ShowPicture{Showing::kScene});
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
        for (const CullerKind culler : kCullers)
            if (const std::string screen = "whole-" + std::string(nameOf(culler)); wall_->picture(screen) != tiles) {
                const std::string path = std::filesystem::temp_directory_path() / "storm-";
                (void)writeFile(path + "front.png", encodePng(*tiles, 0));
                (void)writeFile(path + screen + ".png", encodePng(*wall_->picture(screen), 0));
                return fmt::format("frame {}: 2x2 and {} show different pictures ({}*.png)", *wall_->shownFrame(),
                                   screen, path);
            }
    }
    // Moves that were granted are there: looked at when nothing waits for an answer.
    (void)world.runUntil(
        [&] {
            for (const auto& [name, application] : wall_->applications())
                if (application->ended()) forgetQuestionsOf(name);
            if (std::string broken = findBroken(); !broken.empty()) throw Violation(broken);
            return tally_.asked.empty();
        },
        60s);
    forgetQuestionsOf({});
    if (std::string fault = tallyFault(); !fault.empty()) return fault;
    // A newcomer sees what those see who have followed all along.
    SimulatedApplication& newcomer = wall_->application("newcomer");
    const SimulatedApplication& first = wall_->application(kFirst);
    const bool same = world.runUntil([&] { return newcomer.sequence() == first.sequence() || newcomer.ended(); }, 30s);
    const bool equal = newcomer.scene().stateHash() == first.scene().stateHash();
    const bool ended = newcomer.ended();
    wall_->removeApplication("newcomer");
    if (ended) return {};  // the server was asked to end it, or it was slow: it comes in again
    if (!same) return "a newcomer does not come into step";
    return equal ? std::string() : "a newcomer has another scene";
}

std::string Storm::sceneOf(std::uint64_t seed) {
    constexpr std::array kScenes = {"tests/data/scenes/yard",       "tests/data/scenes/bin",
                                    "tests/data/scenes/collisions", "tests/data/scenes/freeform",
                                    "tests/data/scenes/surface",    "tests/data/scenes/distance",
                                    "deploy/scenes/groups",         "deploy/scenes/emitters"};
    return fmt::format("{}/{}.tsct", TESSERA_SOURCE_DIR, kScenes[seed % kScenes.size()]);
}

std::vector<std::uint64_t> Storm::stepsOf(std::uint64_t seed, std::size_t count) {
    Random random(seed);
    std::vector<std::uint64_t> steps;
    for (std::size_t i = 0; i < count; ++i) steps.push_back(random.next() >> 16);
    return steps;
}

std::optional<Storm::Broken> Storm::run(const StormOptions& options, const std::vector<std::uint64_t>& steps,
                                        std::vector<std::string>* said, Answers* answers) {
    Storm storm(options);
    for (std::size_t i = 0; i < steps.size(); ++i) {
        std::string law = storm.step(steps[i]);
        if (said) said->push_back(storm.said());
        if (answers) *answers = storm.answers();
        if (!law.empty()) return Broken{i, std::move(law)};
    }
    std::string law = storm.lookClosely();
    if (law.empty()) {
        storm.wall_->killServer();
        law = storm.replayed();
    }
    if (!law.empty()) return Broken{steps.size(), std::move(law)};
    return std::nullopt;
}

std::vector<std::uint64_t> Storm::shortened(const StormOptions& options, std::vector<std::uint64_t> steps,
                                            Duration atMost) {
    const auto end = std::chrono::steady_clock::now() + atMost;
    if (const auto broken = run(options, steps); broken && broken->step < steps.size()) steps.resize(broken->step + 1);
    for (std::size_t part = std::max<std::size_t>(1, steps.size() / 2); part > 0; part /= 2)
        for (std::size_t at = 0; at + part <= steps.size() && std::chrono::steady_clock::now() < end;) {
            std::vector<std::uint64_t> fewer = steps;
            fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(at),
                        fewer.begin() + static_cast<std::ptrdiff_t>(at + part));
            if (const auto broken = run(options, fewer)) {
                fewer.resize(std::min(fewer.size(), broken->step + 1));
                steps = std::move(fewer);
            } else {
                at += part;
            }
        }
    return steps;
}

}  // namespace tessera::simulation
