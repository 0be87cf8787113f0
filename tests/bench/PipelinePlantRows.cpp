/// A hundred parts of an engine, 1,000 to 10,000 triangles each, that swing in and out of the surfaces of a plant of
/// 357,000 triangles: our frame beside the same loop over FCL.
///
/// Where motions are stopped or timed, the parts are those that begin free, and FCL's loop advances each of them from
/// where our scene has it to where it is wanted, so that both are asked the same.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <optional>

#include "common/base/Workers.h"
#include "common/cores/Geometry.h"
#include "common/scene/Action.h"
#include "server/collision/query/TimeOfImpact.h"
#include "server/import/Importer.h"
#include "tests/bench/PipelineFcl.h"
#include "tests/bench/PipelineMotion.h"
#include "tests/bench/PipelineRace.h"
#include "tests/bench/PipelineRows.h"

namespace tessera {

namespace {

constexpr std::size_t kMovers = 100;
constexpr double kFrameMs = 4;  ///< what a frame may take on one core

/// What stands, and the parts that move, each centred on its box and of a diagonal of a fraction of the plant's.
struct Hall {
    std::vector<TriangleMesh> plant, parts;
    double size = 0;  ///< the plant's diagonal
};

/// Every geometry of a file that has so many triangles.
Expected<std::vector<TriangleMesh>> readParts(const std::string& file, std::size_t least, std::size_t most) {
    ImportOptions options;
    options.importerProgram = TESSERA_BIN_DIR "/tessera-import";
    options.allowUnconfined = true;
    options.verbatim = true;
    Expected<ImportedScene> imported = importScene(file, kRootNode, options);
    if (!imported) return tl::unexpected(imported.error());
    replaceIds(imported->list, [](ObjectId id) {
        return isPlaceholder(id) ? ObjectId{id.value - kFirstPlaceholder + kRootNode.value + 1} : id;
    });
    Aspect aspect;
    if (const Expected<void> applied = aspect.apply(imported->list); !applied) return tl::unexpected(applied.error());
    std::vector<TriangleMesh> out;
    Action collect;
    collect.on<Geometry>([&](const Visit& visit, const Geometry& geometry) {
        const std::span<const float> positions = geometry.positions.as<float>();
        const std::span<const std::uint32_t> indices = geometry.indices.as<std::uint32_t>();
        if (indices.size() / 3 < least || indices.size() / 3 > most) return Descend::kInto;
        MeshArrays3 arrays;
        for (std::size_t v = 0; v < positions.size(); v += 3) {
            const Vec3d p = visit.world_T_node * Vec3d(positions[v], positions[v + 1], positions[v + 2]);
            arrays.positions.insert(arrays.positions.end(), {p.x(), p.y(), p.z()});
        }
        arrays.indices.assign(indices.begin(), indices.end());
        out.push_back(normalised(meshOf(arrays)));
        return Descend::kInto;
    });
    collect.run(aspect);
    if (out.empty())
        return fail(ErrorCode::kBadInput, fmt::format("{}: no part of {} to {} triangles", file, least, most));
    return out;
}

/// Floats, as a scene's geometry has them.
TriangleMesh scaled(const TriangleMesh& mesh, double factor) {
    MeshArrays3 arrays = arraysOf(mesh);
    for (double& x : arrays.positions) x = static_cast<float>(factor * x);
    return meshOf(arrays);
}

std::optional<Hall> readHall(const PipelineOptions& options) {
    Expected<std::vector<TriangleMesh>> plant = readPlant(options.plant);
    Expected<std::vector<TriangleMesh>> parts = readParts(options.parts, 1'000, 10'000);
    if (!plant || !parts) {
        fmt::print("\nparts x plant: left out: {}\n", (!plant ? plant.error() : parts.error()).message);
        return {};
    }
    Hall hall;
    Box box;
    for (const TriangleMesh& mesh : *plant) box.extend(mesh.bounds());
    hall.size = box.size().norm();
    hall.plant = std::move(*plant);
    for (const TriangleMesh& part : *parts) hall.parts.push_back(scaled(part, 0.04 * hall.size));
    return hall;
}

struct Swarm {
    std::vector<std::uint32_t> partOf;  ///< per mover
    BodyFrames frames;
};

Swarm makeSwarm(const Hall& hall, std::size_t movers, std::size_t frames) {
    Swarm out;
    std::vector<double> sizes;
    for (std::size_t i = 0; i < movers; ++i) {
        out.partOf.push_back(static_cast<std::uint32_t>(i % hall.parts.size()));
        sizes.push_back(hall.parts[out.partOf.back()].bounds().size().norm());
    }
    out.frames = swingingParts(sizes, hall.plant, frames, 3);
    return out;
}

void fill(FclWorld& world, const Hall& hall, const Swarm& swarm) {
    std::vector<std::uint32_t> models;
    for (const TriangleMesh& part : hall.parts) models.push_back(world.addModel(part));
    for (const std::uint32_t part : swarm.partOf) world.addMover(models[part]);
    for (const TriangleMesh& mesh : hall.plant) world.addStanding(world.addModel(mesh));
    world.open();
}

/// Movers that touch nothing as they begin; half of them are wanted where they would touch, in some frame.
Swarm makeFreeSwarm(const Hall& hall, std::size_t frames) {
    const Swarm all = makeSwarm(hall, 8 * kMovers, frames);
    FclWorld world;
    fill(world, hall, all);
    std::vector<std::size_t> firstTouch(all.partOf.size(), frames + 1);
    for (std::size_t f = frames + 1; f-- > 0;) {
        world.collide(all.frames.poses[f], FclWorld::Detail::kYesOrNo);
        for (const auto& [mover, standing] : world.touching()) firstTouch[mover] = f;
    }
    Swarm out;
    out.frames.poses.resize(frames + 1);
    std::array<std::size_t, 2> left{kMovers / 2, kMovers / 2};
    for (std::size_t i = 0; i < all.partOf.size(); ++i) {
        std::size_t& room = left[firstTouch[i] <= frames];
        if (firstTouch[i] == 0 || room == 0) continue;
        --room;
        out.frames.movers.push_back(static_cast<std::uint32_t>(out.partOf.size()));
        out.partOf.push_back(all.partOf[i]);
        for (std::size_t f = 0; f <= frames; ++f) out.frames.poses[f].push_back(all.frames.poses[f][i]);
    }
    return out;
}

/// Where each mover was before a frame and after it.
struct Ways {
    std::vector<std::vector<Pose>> from, accepted;  ///< by frame
};

class OurHall final : public FrameContender {
public:
    OurHall(const Hall& hall, const Swarm& swarm, const SceneQuestion& question, unsigned threads = 1)
        : workers_(threads), scene_(threads > 1 ? &workers_ : nullptr) {
        std::vector<std::uint32_t> shapes;
        for (const TriangleMesh& part : hall.parts) shapes.push_back(scene_.addShape(arraysOf(part)));
        const ObjectId movers = scene_.addGroup(CollisionObject::kRigid, CollisionObject::kTriangles);
        for (std::size_t i = 0; i < swarm.partOf.size(); ++i)
            scene_.addBody(movers, shapes[swarm.partOf[i]], swarm.frames.poses[0][i]);
        const ObjectId plant = scene_.addGroup(CollisionObject::kStatic, CollisionObject::kTriangles);
        for (const TriangleMesh& mesh : hall.plant) scene_.addBody(plant, scene_.addShape(arraysOf(mesh)), Pose());
        scene_.addInterest(movers, plant, question);
        scene_.open();
        wishes_ = swarm.frames.wishes(scene_);
        ways_.from.resize(wishes_.size());
        ways_.accepted.resize(wishes_.size());
    }
    void start() override {
        scene_.put(wishes_[0]);
        (void)scene_.frame(wishes_[0], FrameClock(Clock::kThread));
        for (std::uint32_t i = 0; i < wishes_[0].size(); ++i) present_.push_back(scene_.poseOf(i));
    }
    FrameTimes frame(std::size_t f, const FrameClock& clock) override { return scene_.frame(wishes_[f], clock); }
    void look(std::size_t f) override {
        std::vector<Pose> after;
        for (std::uint32_t i = 0; i < wishes_[f].size(); ++i) after.push_back(scene_.poseOf(i));
        ways_.from[f] = f == 1 ? present_ : ways_.accepted[f - 1];
        ways_.accepted[f] = std::move(after);
        found.push_back(scene_.touching());
        contacts += scene_.result().contacts.size();
        stopped += scene_.result().stopped.size();
        notLookedAt += scene_.result().counters.notLookedAt;
        neighbours += scene_.result().counters.neighbours;
    }
    [[nodiscard]] const Ways& ways() const { return ways_; }

    std::vector<BodyPairs> found;
    std::size_t contacts = 0, stopped = 0, notLookedAt = 0, neighbours = 0;

private:
    Workers workers_;
    PipelineScene scene_;
    std::vector<std::vector<TentativeTransform>> wishes_;
    std::vector<Pose> present_;
    Ways ways_;
};

enum class FclLoop { kYesOrNo, kAllContacts, kAdvance };

class FclHall final : public FrameContender {
public:
    /// kAdvance: along the ways that ours went.
    FclHall(const Hall& hall, const Swarm& swarm, FclLoop loop, FclVolume volume, const Ways* ways = nullptr)
        : swarm_(swarm), loop_(loop), ways_(ways), world_(volume) {
        fill(world_, hall, swarm);
        tolerance_ = 1e-4 * hall.parts.front().bounds().size().norm();
    }
    void start() override {}
    FrameTimes frame(std::size_t f, const FrameClock& clock) override {
        const std::vector<Pose>& wanted = swarm_.frames.poses[f];
        const double seconds = clock.seconds([&] {
            if (loop_ == FclLoop::kAdvance) {
                ends_ = world_.advance(ways_->from[f], wanted, tolerance_);
                reached_.clear();
                for (std::size_t i = 0; i < wanted.size(); ++i)
                    reached_.push_back(BodyMotion{ways_->from[f][i], wanted[i]}.at(ends_[i]));
                world_.collide(reached_, FclWorld::Detail::kYesOrNo);
            } else {
                world_.collide(
                    wanted, loop_ == FclLoop::kYesOrNo ? FclWorld::Detail::kYesOrNo : FclWorld::Detail::kAllContacts);
            }
        });
        return {seconds, seconds};
    }
    void look(std::size_t f) override {
        found.push_back(world_.touching());
        contacts += world_.contacts();
        distances += world_.distances();
        if (loop_ != FclLoop::kAdvance) return;
        const std::vector<Pose>& wanted = swarm_.frames.poses[f];
        for (std::size_t i = 0; i < wanted.size(); ++i) {
            blocked += ends_[i] < 1;
            atStart += ends_[i] == 0;
            if (ends_[i] == 0) continue;  // in touch as it begins: theirs stays, ours may slide and part
            const double length = (wanted[i].translation - ways_->from[f][i].translation).norm();
            const double ours = (ways_->accepted[f][i].translation - ways_->from[f][i].translation).norm();
            const double ahead = (ours - ends_[i] * length) / tolerance_;
            further = std::max(further, ahead);
            shorter = std::max(shorter, -ahead);
        }
    }

    std::vector<BodyPairs> found;
    std::size_t contacts = 0, distances = 0, blocked = 0, atStart = 0;
    double further = 0, shorter = 0;  ///< how much further, and less far, ours went, in tolerances

private:
    const Swarm& swarm_;
    FclLoop loop_;
    const Ways* ways_;
    FclWorld world_;
    double tolerance_ = 0;
    std::vector<double> ends_;
    std::vector<Pose> reached_;
};

double meanOf(std::size_t sum, std::size_t frames) {
    return static_cast<double>(sum) / static_cast<double>(frames);
}

/// Of the hundred movers, how many touch something, on average.
double touchingMovers(const std::vector<BodyPairs>& found) {
    std::size_t sum = 0;
    for (const BodyPairs& frame : found)
        for (std::size_t k = 0; k < frame.size(); ++k) sum += k == 0 || frame[k].first != frame[k - 1].first;
    return meanOf(sum, std::max<std::size_t>(1, found.size()));
}

std::size_t differing(const std::vector<BodyPairs>& x, const std::vector<BodyPairs>& y) {
    std::size_t out = 0;
    for (std::size_t f = 0; f < x.size(); ++f) {
        BodyPairs only;
        std::set_symmetric_difference(x[f].begin(), x[f].end(), y[f].begin(), y[f].end(), std::back_inserter(only));
        out += only.size();
    }
    return out;
}

struct Bench {
    const Hall& hall;
    const PipelineOptions& options;
    CollisionTable& table;

    /// A frame is good within 4 ms, or within a fifth of FCL's.
    void add(const std::string& what, const std::string& peer, const std::vector<double>& ours,
             const std::vector<double>& theirs, bool claim, const std::string& remark) const {
        const Summary mine = summarise(ours);
        const bool inTime = mine.p99 <= 1e3 * kFrameMs;
        table.add({.pair = fmt::format("parts x plant: {} x {}", kMovers, hall.plant.size()),
                   .operation = what,
                   .peer = peer,
                   .ours = mine,
                   .theirs = summarise(theirs),
                   .atMost = claim ? 0.2 : 0,
                   .aim = claim ? 0.1 : 0,
                   .remark = fmt::format("{}p99 {:.2f} ms ({} 4 ms)", remark.empty() ? "" : remark + "; ",
                                         mine.p99 / 1e3, inTime ? "within" : "beyond")});
    }

    void report(const std::string& what, const Swarm& swarm, std::int64_t detail, FclLoop loop) const {
        OurHall ours(hall, swarm, {.detail = detail});
        FclHall fcl(hall, swarm, loop, FclVolume::kObbRss), boxes(hall, swarm, loop, FclVolume::kObb);
        const RaceTimes times = raceFrames(swarm.frames.last(), options.passes, {&ours, &fcl, &boxes});
        const bool boxesWin = summarise(times.asked[2]).mean < summarise(times.asked[1]).mean;
        const std::vector<double>& theirs = times.asked[boxesWin ? 2 : 1];
        const std::string peer = boxesWin ? "FCL OBB, same loop" : "FCL OBBRSS, same loop";
        const std::size_t others = differing(ours.found, fcl.found);
        // FCL rounds where ours is exact.
        if (others > swarm.frames.last()) table.complain(fmt::format("{}: {} pairs found by one alone", what, others));
        const std::size_t frames = swarm.frames.last();
        add(what + ", step", peer, times.asked[0], theirs, true,
            fmt::format(
                "{:.0f} parts touch; {:.0f} neighbours; contacts {:.0f}, FCL {:.0f}; {} pairs known to one alone",
                touchingMovers(ours.found), meanOf(ours.neighbours, frames), meanOf(ours.contacts, frames),
                meanOf(fcl.contacts, frames), others));
        add(what + ", with commit", peer, times.whole[0], theirs, false, "");
    }

    void impact(const std::string& what, const Swarm& swarm, const SceneQuestion& question) const {
        OurHall ours(hall, swarm, question);
        FclHall fcl(hall, swarm, FclLoop::kAdvance, FclVolume::kObbRss, &ours.ways());
        const RaceTimes times = raceFrames(swarm.frames.last(), options.passes, {&ours, &fcl});
        const std::size_t frames = swarm.frames.last();
        std::string remark = fmt::format(
            "a frame: {:.0f} parts touch, FCL: {:.0f} of 100 are blocked, {:.0f} as they begin, {:.0f} distances; "
            "{:.0f} neighbours, {} not looked at",
            touchingMovers(ours.found), meanOf(fcl.blocked, frames), meanOf(fcl.atStart, frames),
            meanOf(fcl.distances, frames), meanOf(ours.neighbours, frames), ours.notLookedAt);
        if (question.response == Interest::kStop)
            remark += fmt::format("; ours stopped {:.0f}, went at most {:.2g} tolerances further, {:.2g} less far",
                                  meanOf(ours.stopped, frames), fcl.further, fcl.shorter);
        add(what + ", step", "FCL OBBRSS, advancement", times.asked[0], times.asked[1], true, remark);
    }
};

void plantThreads(const Hall& hall, const Swarm& swarm, const PipelineOptions& options, CollisionTable& table) {
    const auto row = [&](const std::string& what, const SceneQuestion& question, bool claim) {
        OurHall one(hall, swarm, question), two(hall, swarm, question, 2);
        const RaceTimes times = raceFrames(swarm.frames.last(), 3 * options.passes, {&two, &one}, Clock::kWall);
        if (one.found != two.found) table.complain("plant: two threads find others than one");
        table.add({.pair = "parts x plant",
                   .operation = what + ", step, two threads",
                   .peer = "one thread",
                   .ours = summarise(times.asked[0]),
                   .theirs = summarise(times.asked[1]),
                   .atMost = claim ? 0.56 : 0,
                   .aim = claim ? 0.52 : 0,
                   .remark = "wall time"});
    };
    row("all contacts", {}, false);
    // None of the hundred is in another one's way.
    row("100 independent movers, stop", {.response = Interest::kStop, .detail = Interest::kYesOrNo}, true);
    row("100 independent movers, slide", {.response = Interest::kSlide, .detail = Interest::kYesOrNo}, true);
}

}  // namespace

Expected<std::vector<TriangleMesh>> readPlant(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> files;
    std::error_code none;
    for (const auto& entry : std::filesystem::directory_iterator(folder, none)) {
        const std::string stem = entry.path().stem().string();
        const bool lamp = stem == "background" || stem.ends_with("light") || stem.starts_with("light");
        if (entry.path().extension() == ".obj" && !lamp) files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    std::vector<TriangleMesh> out;
    for (const auto& file : files) {
        Expected<TriangleMesh> mesh = loadModel(file);
        if (!mesh) return tl::unexpected(mesh.error());
        out.push_back(std::move(*mesh));
    }
    if (out.empty()) return fail(ErrorCode::kNotFound, folder.string() + ": no models (--plant FOLDER)");
    return out;
}

void plantRows(const PipelineOptions& options, CollisionTable& table) {
    const std::optional<Hall> hall = readHall(options);
    if (!hall) return;
    const std::size_t frames = options.quick ? 4 : 60;
    const Swarm any = makeSwarm(*hall, kMovers, frames);
    const Swarm free = makeFreeSwarm(*hall, options.quick ? 4 : 20);
    const Bench bench{*hall, options, table};
    if (options.wants("plant")) {
        bench.report("yes or no", any, Interest::kYesOrNo, FclLoop::kYesOrNo);
        bench.report("all contacts", any, Interest::kAllFaces, FclLoop::kAllContacts);
        bench.impact("stop", free, {.response = Interest::kStop, .detail = Interest::kYesOrNo});
        bench.impact("dynamic", free, {.mode = Interest::kDynamic, .detail = Interest::kYesOrNo});
    }
    if (options.wants("threads")) plantThreads(*hall, free, options, table);
}

}  // namespace tessera
