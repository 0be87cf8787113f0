#include "tests/support/wall/Storm.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <fstream>

#include "common/cores/Animation.h"
#include "tests/support/wall/StormSteps.h"

namespace tessera::simulation {
namespace {

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
        for (const CullerKind culler : kCullersCompared) text += screen(screenOf(culler), 1, 48, 28);
    text += "users { name: \"viewer\" position { x: 0 y: 1.7 z: 2.4 } eye_separation_m: 0.065 }\n";
    for (int i = 0; i < (draws ? 4 : 1); ++i) text += host(fmt::format("tile{}", i), "front", i % 2, i / 2);
    if (draws)
        for (const CullerKind culler : kCullersCompared)
            text += host(std::string(nameOf(culler)), screenOf(culler), 0, 0);
    return text + "sync { late_frame: WAIT frame_deadline_ms: 2000 heartbeat_ms: 100 lost_after_ms: 800 }\n";
}

/// Nodes of each scene that the laws look at.
std::string witnesses(bool still) {
    return fmt::format(
        "\nnode {{ name: \"tally\" transform {{}} }}\n"
        "node {{ name: \"hand\" transform {{}} }}\n"
        "node {{ name: \"clock\" animation {{ {} mode: ONCE channel {{ target: \"/hand\" field: \"translation\" "
        "time: [0, 1000] value: [0, 0, 0, 1000, 0, 0] }} }} }}\n"
        "node {{ name: \"kept\" transform {{ translation {{ x: 40 y: 3 z: 1.5 }} }} "
        "node {{ name: \"stone\" box {{ size {{ x: 1 y: 2 z: 3 }} }} }} }}\n",
        still ? "paused: true" : "");
}

void addAllBelow(const Aspect& scene, ObjectId id, std::set<ObjectId>& to) {
    to.insert(id);
    if (const Node* node = scene.get<Node>(id)) {
        if (node->core.value != 0) to.insert(node->core);
        for (const ObjectId child : node->children) addAllBelow(scene, child, to);
    }
}

ObjectId coreAt(const Aspect& scene, const std::string& path) {
    const Expected<ObjectId> node = findNode(scene, path);
    if (!node) throw Violation("no witness: " + node.error().message);
    return scene.get<Node>(*node)->core;
}

}  // namespace

Storm::Storm(StormOptions options) : options_(std::move(options)) {
    const std::string wall = folder_ / "storm.wall", scene = folder_ / "scene.tsct", models = folder_ / "models";
    std::ofstream(wall) << wallText(options_.draws);
    std::filesystem::copy_file(options_.scene, scene);
    std::ofstream(scene, std::ios::app) << witnesses(options_.still);
    const std::string gallery = std::string(TESSERA_SOURCE_DIR) + "/deploy/scenes/gallery/";
    for (const char* file : {"film.avi", "film.png", "rooms/lantern.tsct"})
        std::filesystem::copy_file(gallery + file, folder_ / std::filesystem::path(file).filename().string());
    std::filesystem::create_directory(models);
    std::filesystem::copy_file(gallery + "rooms/lantern.tsct", models + "/lantern.tsct");
    std::ofstream(models + "/box.obj") << "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nf 1 2 3 4\nf 1 2 5\nf 2 3 5\n";
    files_ = {scene, models + "/lantern.tsct", models + "/box.obj", models, models + "/none.ply"};
    WallOptions wanted{.scene = scene,
                       .wall = wall,
                       .widthPx = 0,
                       .draws = options_.draws,
                       .journal = folder_ / "journal",
                       .journalFiles = disk_ = std::make_shared<StormDisk>(),
                       .record = folder_ / "recording",
                       .reload = true,
                       .server = {"--allow", models},
                       .seed = options_.seed};
    for (const CullerKind culler : kCullersCompared) wanted.cullers[std::string(nameOf(culler))] = culler;
    wall_ = std::make_unique<SimulatedWall>(std::move(wanted));
    SimulatedApplication& application = wall_->application(kFirst);
    const Aspect& there = application.scene();
    tally_ = std::make_unique<MoveTally>(application);
    clock_ = coreAt(there, "/clock");
    hand_ = coreAt(there, "/hand");
    addAllBelow(there, findNode(there, "/kept").value(), kept_);
    follow();
    keptHash_ = hashOfKept();
    begun_ = there.stateHash();
}

Storm::~Storm() = default;

SimulatedApplication& Storm::first() {
    return wall_->application(kFirst);
}

void Storm::follow() {
    SimulatedApplication& application = first();
    tally_->look(application, true);
    application.onList = [this, &application](bool whole) { tally_->look(application, whole); };
    (void)application.say(request::SubscribeNews{.wanted = {.frames = true}});
    framesTold_ = 0;
    frameAt_ = wall_->world().now();
    clockOffSince_.reset();
}

std::set<ObjectId> Storm::untouched() const {
    std::set<ObjectId> all = kept_;
    all.insert({tally_->node(), tally_->core(), clock_, hand_});
    const SimulatedApplication* const application = wall_->findApplication(kFirst);
    for (const char* path : {"/clock", "/hand"})
        if (const Expected<ObjectId> node = findNode(application->scene(), path)) all.insert(*node);
    if (const auto* clock = application->scene().get<Animation>(clock_))
        all.insert(clock->channels.begin(), clock->channels.end());
    return all;
}

std::string Storm::step(std::uint64_t seed) {
    Random random(seed);
    try {
        said_ = doOne(random);
        wall_->world().runFor(random.between(1ms, random.chance(0.1) ? Duration(3s) : Duration(200ms)));
        std::string broken = findBroken();
        if (broken.empty() && ++steps_ % 25 == 0) broken = lookClosely();
        return broken;
    } catch (const std::exception& violation) {
        return violation.what();
    }
}

std::string Storm::doOne(Random& random) {
    // A host that has given up is started again, as a service is.
    for (const auto& [name, host] : wall_->hosts())
        if (host->ended()) {
            const std::string again = name;
            wall_->killHost(again);
            wall_->startHost(again);
            faulty_.erase(again);
            return "host " + again + ", which has ended, is started again";
        }
    const SimulatedApplication* const there = wall_->findApplication(kFirst);
    if (!there || there->ended()) {
        forgetQuestionsOf(kFirst);
        follow();
        return "the first application comes back";
    }
    SimulatedApplication* speaker = &first();
    if (!guests_.empty() && random.below(3) == 0) {
        if (auto* other = wall_->findApplication(guests_[random.below(guests_.size())]); other && !other->ended())
            speaker = other;
    }
    StepUnderWay step{
        random, *speaker,
        RandomWords(random, there->scene(), {.files = files_, .untouched = untouched(), .still = options_.still}),
        *wall_};
    unsigned all = 0;
    for (const StormDeed& deed : deeds()) all += deed.still || !options_.still ? deed.weight : 0;
    std::uint64_t drawn = random.below(all);
    for (const StormDeed& deed : deeds()) {
        if (options_.still && !deed.still) continue;
        if (drawn < deed.weight) return (this->*deed.does)(step);
        drawn -= deed.weight;
    }
    return {};
}

StormOptions Storm::optionsOf(std::uint64_t seed, bool draws) {
    constexpr std::array kScenes = {"tests/data/scenes/storm",      "tests/data/scenes/yard",
                                    "tests/data/scenes/bin",        "tests/data/scenes/still",
                                    "tests/data/scenes/collisions", "tests/data/scenes/freeform",
                                    "tests/data/scenes/surface",    "tests/data/scenes/distance",
                                    "deploy/scenes/groups",         "deploy/scenes/emitters"};
    const std::string_view scene = kScenes[seed % kScenes.size()];
    return {.scene = fmt::format("{}/{}.tsct", TESSERA_SOURCE_DIR, scene),
            .seed = seed,
            .draws = draws,
            .still = scene.ends_with("/still")};
}

std::vector<std::uint64_t> Storm::stepsOf(std::uint64_t seed, std::size_t count) {
    Random random(seed);
    std::vector<std::uint64_t> steps;
    for (std::size_t i = 0; i < count; ++i) steps.push_back(random.next() >> 16);
    return steps;
}

std::optional<Storm::Broken> Storm::run(const StormOptions& options, std::span<const std::uint64_t> steps,
                                        const OnStep& onStep) {
    Storm storm(options);
    for (std::size_t i = 0; i < steps.size(); ++i) {
        std::string law = storm.step(steps[i]);
        if (onStep) onStep(i, storm);
        if (!law.empty()) return Broken{i, std::move(law)};
    }
    std::string law = storm.end();
    return law.empty() ? std::nullopt : std::optional(Broken{steps.size(), std::move(law)});
}

std::vector<std::uint64_t> Storm::shortened(std::vector<std::uint64_t> steps, const Runner& runner, Duration atMost) {
    const auto end = std::chrono::steady_clock::now() + atMost;
    const auto cut = [](std::vector<std::uint64_t>& list, const Broken& broken) {
        list.resize(std::min(list.size(), broken.step + 1));
    };
    if (const auto broken = runner(steps)) cut(steps, *broken);
    for (std::size_t part = std::max<std::size_t>(1, steps.size() / 2); part > 0; part /= 2)
        for (std::size_t at = 0; at + part <= steps.size() && std::chrono::steady_clock::now() < end;) {
            std::vector<std::uint64_t> fewer = steps;
            fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(at),
                        fewer.begin() + static_cast<std::ptrdiff_t>(at + part));
            if (const auto broken = runner(fewer)) {
                cut(fewer, *broken);
                steps = std::move(fewer);
            } else {
                at += part;
            }
        }
    return steps;
}

}  // namespace tessera::simulation
