/// What frames take while somebody asks for much.
#include <time.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <optional>

#include <fmt/format.h>

#include "common/cores/Animation.h"
#include "common/cores/Geometry.h"
#include "common/cores/Interest.h"
#include "common/cores/Transform.h"
#include "common/geometry/Mesh.h"
#include "common/scene/FieldTable.h"
#include "common/scenefile/SceneFile.h"
#include "server/sim/frame/Simulation.h"
#include "tests/bench/LoadWall.h"

namespace tessera::bench {
namespace {

double quantile(std::vector<double> values, double share) {
    if (values.empty()) return 0;
    std::ranges::sort(values);
    return values[std::min(values.size() - 1, static_cast<std::size_t>(share * static_cast<double>(values.size())))];
}

/// What one of the four hosts does.
enum class LastHost : std::uint8_t {
    kDraws,
    kLies,        ///< says a wrong hash in each frame, until it is sent away
    kLiesAgain,   ///< the same, and is started again each time
    kKilledAgain  ///< killed as soon as it draws, and started again: what joining costs, with nobody who lies
};

struct LastHostSpan {
    FrameSpan frames;
    int started = 0;  ///< again
};

/// Frames of a wall that has shown so many, for so long.
LastHostSpan framesOf(const std::string& file, LastHost last, Duration length) {
    constexpr std::uint64_t kBegin = 300;  // everybody is there and at work by then
    const bool lies = last == LastHost::kLies || last == LastHost::kLiesAgain,
               again = last == LastHost::kLiesAgain || last == LastHost::kKilledAgain;
    StandstillWatch watch;
    Wall4 wall({file}, std::filesystem::path(file).parent_path(), 60,
               lies ? std::vector<std::string>{"--inject", fmt::format("lie@{}", kBegin)} : std::vector<std::string>());
    const auto application = wall.connect();
    LastHostSpan span;
    if (!application) return span;
    wall.waitForFrames(*application, kBegin);
    const Instant from = Clock::now(), until = from + length;
    while (Clock::now() < until) {
        if (last == LastHost::kKilledAgain)
            if (const auto status = application->status(); status)
                for (const answer::HostInfo& host : status->hosts)
                    if (host.name == test::kFourHosts.back() && host.state == "live") wall.killLastHost();
        if (again) span.started += wall.keepLastHost();
        std::this_thread::sleep_for(20ms);
    }
    const std::vector<Instant> released = wall.finish();
    span.frames = spanOf(released, watch.take(), from, until);
    return span;
}

void lyingRows(SceneTable& table, const std::string& file, bool quick) {
    const auto row = [&](LastHost ours, LastHost theirs, const std::string& what, const std::string& peer) {
        std::vector<double> p99, peerP99;
        double worst = 0, peerWorst = 0;
        int started = 0, peerStarted = 0;
        for (int round = 0; round < (quick ? 1 : 3); ++round) {
            const Duration length = quick ? 10s : 20s;
            const LastHostSpan other = framesOf(file, theirs, length), one = framesOf(file, ours, length);
            p99.push_back(quantile(one.frames.ms, 0.99));
            peerP99.push_back(quantile(other.frames.ms, 0.99));
            worst = std::max(worst, one.frames.worst);
            peerWorst = std::max(peerWorst, other.frames.worst);
            started += one.started;
            peerStarted += other.started;
        }
        table.add({.operation = "60 Hz: p99 of a frame while " + what,
                   .peer = peer,
                   .ours = medianOf(p99),
                   .theirs = medianOf(peerP99),
                   .unit = "ms",
                   .atMost = 1.2,
                   .remark = fmt::format("worst {:.1f}, {:.1f} ms; started again {}, {} times", worst, peerWorst,
                                         started, peerStarted)});
    };
    row(LastHost::kLies, LastHost::kDraws, "a host lies in each", "while none does");
    row(LastHost::kLiesAgain, LastHost::kKilledAgain, "one lies, and is started again each time",
        "one killed as soon as it draws");
}

/// Makes a scene file by hand.
class FileMaker {
public:
    template <typename T>
    ObjectId create() {
        const ObjectId id(next_++);
        list.create(id, typeOf<T>());
        return id;
    }
    ObjectId node(const std::string& name, ObjectId parent, ObjectId core = {}) {
        const ObjectId id = create<Node>();
        setField<&Node::name>(list, id, name);
        if (core) setField<&Node::core>(list, id, core);
        list.place(id, parent);
        return id;
    }
    ObjectId transform(const Vec3d& at) {
        const ObjectId id = create<Transform>();
        setField<&Transform::translation>(list, id, at);
        return id;
    }
    ObjectId box(double side) {
        const MeshArrays arrays = makeBox(Vec3d::Constant(side)).toArrays();
        const ObjectId id = create<Geometry>();
        setField<&Geometry::positions>(list, id, arrays.positions);
        setField<&Geometry::normals>(list, id, arrays.normals);
        setField<&Geometry::indices>(list, id, arrays.indices);
        return id;
    }
    void save(const std::string& path) {
        if (!scene.apply(list.take()) || !saveScene(path, scene)) std::abort();
    }
    Aspect scene;  ///< once it is saved
    ChangeListBuilder list;

private:
    std::uint64_t next_ = kRootNode.value + 1;
};

/// The frames of a wall with that scene at 60 Hz while `course` is at work; nothing where something failed.
std::optional<FrameSpan> framesWhile(SceneTable& table, const std::string& file,
                                     const std::function<bool(Application&, const Wall4&)>& course) {
    StandstillWatch watch;
    Wall4 wall({file}, std::filesystem::path(file).parent_path(), 60);
    const auto application = wall.connect();
    if (!application) {
        table.complain("no application can connect");
        return std::nullopt;
    }
    wall.waitForFrames(*application, 60);
    const Instant from = Clock::now();
    const bool good = course(*application, wall);
    std::this_thread::sleep_for(200ms);
    const Instant until = Clock::now();
    const std::vector<Instant> released = wall.finish();
    FrameSpan span = spanOf(released, watch.take(), from, until);
    for (std::size_t i = 1; i < released.size(); ++i)
        if (from <= released[i] && released[i] < until) span.workMs.push_back(wall.worked()[i] - wall.worked()[i - 1]);
    if (!good) table.complain("an application was refused");
    return good ? std::optional(span) : std::nullopt;
}

void addWorst(SceneTable& table, const std::string& what, const std::optional<FrameSpan>& span, double limit,
              const std::string& remark = "") {
    if (!span) return;
    table.add(
        {.operation = "60 Hz: the worst frame while " + what,
         .peer = fmt::format("{:.0f} ms above the median", limit),
         .ours = {span->worst - span->median().value, 0, span->ms.size()},
         .theirs = {limit, 0, 1},
         .unit = "ms",
         .atMost = 1,
         .remark = fmt::format("median {:.2f}, p99 {:.1f}{}; the frame thread's processor time: median {:.2f}, p99 "
                               "{:.2f}, worst {:.2f}; {} frames left out in which the machine "
                               "stood still (up to {:.0f} ms)",
                               span->median().value, quantile(span->ms, 0.99), remark, medianOf(span->workMs).value,
                               quantile(span->workMs, 0.99), span->workMs.empty() ? 0 : std::ranges::max(span->workMs),
                               span->standstills, span->worstStandstill)});
}

/// Processor time of the frames in which a Transform is put elsewhere, that is undone and done again; whatever else
/// runs here.
std::vector<double> stepsOfUndo(const Aspect& scene, ObjectId transform, int times) {
    const auto processorMs = [] {
        timespec now{};
        clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
        return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
    };
    Simulation simulation;
    ChangeList all = snapshot(scene);
    all.nextFreeId = 0;
    replaceIds(all, [](ObjectId id) {
        return id.value > kRootNode.value ? ObjectId(kFirstPlaceholder + id.value - kRootNode.value - 1) : id;
    });
    if (!simulation.load({std::move(all)})) std::abort();
    (void)simulation.step(true, {});
    std::vector<double> ms;
    for (int i = 0; i < times; ++i)
        for (const Edit::Kind kind : {Edit::Kind::kChange, Edit::Kind::kUndo, Edit::Kind::kRedo, Edit::Kind::kUndo}) {
            std::vector<Edit> edits(1);
            edits[0].kind = kind;
            ChangeListBuilder list;
            if (kind == Edit::Kind::kChange) setField<&Transform::translation>(list, transform, Vec3d(0, 0.5, 0));
            edits[0].list = list.take();
            const double before = processorMs();
            const FrameResult frame = simulation.step(false, std::move(edits));
            if (!frame.outcomes.front().result) std::abort();
            if (kind != Edit::Kind::kChange) ms.push_back(processorMs() - before);
        }
    return ms;
}

/// Many parts below one Transform, with an interest, among some that stand; another application moves something all the
/// time.
void undoRows(SceneTable& table, const std::string& folder, bool quick) {
    constexpr int kParts = 10'000;
    FileMaker make;
    const ObjectId box = make.box(1);
    const ObjectId carrier = make.transform(Vec3d::Zero()), carried = make.node("carried", kRootNode, carrier);
    for (int i = 0; i < kParts; ++i)
        make.node("part", make.node("place", carried, make.transform(Vec3d(2 * (i % 100), 0, 2 * (i / 100)))), box);
    for (int i = 0; i < kParts / 10; ++i)
        make.node("part", make.node("stands", kRootNode, make.transform(Vec3d(2 * (i % 100), 3, 20 * (i / 100)))), box);
    make.node("box", make.node("other", kRootNode, make.transform(Vec3d(-50, 0, 0))), box);
    const ObjectId interest = make.create<Interest>();
    setField<&Interest::object>(make.list, interest, carried);
    make.node("interest", kRootNode, interest);
    make.save(folder + "/carried.tsc");
    const std::vector<double> steps = stepsOfUndo(make.scene, carrier, quick ? 3 : 20);
    table.add({.operation = "processor time of a frame that undoes what moved 10,000 parts",
               .peer = "20 ms",
               .ours = medianOf(steps),
               .theirs = {20, 0, 1},
               .unit = "ms",
               .atMost = 1,
               .remark = fmt::format("worst {:.1f}", *std::ranges::max_element(steps))});
    const auto course = [&](bool dragged) {
        return [=](Application& application, const Wall4& wall) {
            std::atomic<bool> stop{false}, edits{true}, good{true};
            std::thread others([&] {
                const auto other = wall.connect();
                for (int i = 0; other && !stop; ++i) {
                    if (edits)
                        good =
                            good &&
                            other->moveNode("/other", {.translation = Vec3d(-50, 0.01 * (i % 100 + 1), 0)}).has_value();
                    std::this_thread::sleep_for(5ms);
                }
            });
            const Expected<ObjectInfo> node = application.describeNode("/carried");
            for (int i = 0; node && i < (quick ? 5 : 40); ++i) {
                const auto before = application.status();
                ChangeListBuilder list;
                setField<&Transform::translation>(list, node->core, Vec3d(0, dragged ? 0.01 * (i + 1) : 0.5, 0));
                good = good && before && application.propose(list.take(), dragged ? 7 : 0).has_value();
                if (dragged) continue;
                std::this_thread::sleep_for(50ms);
                edits = false;  // its steps lie above, and go first
                for (auto now = application.status(); good && now && now->undoDepth > before->undoDepth;
                     now = application.status())
                    good = good && application.undo().has_value();
                edits = true;
            }
            stop = true;
            others.join();
            return good.load();
        };
    };
    addWorst(table, "10,000 parts are moved and undone, and somebody else edits",
             framesWhile(table, folder + "/carried.tsc", course(false)), 20);
    addWorst(table, "10,000 parts are dragged, and somebody else edits",
             framesWhile(table, folder + "/carried.tsc", course(true)), 20);
}

/// One animation of many keys moves many boxes.
void resetRows(SceneTable& table, const std::string& folder, bool quick) {
    FileMaker make;
    const ObjectId place = make.transform(Vec3d::Zero()), top = make.node("far", kRootNode, place), box = make.box(1);
    for (int i = 0; i < 200'000; ++i) make.node("b", top, box);
    std::vector<double> times, values;
    for (int k = 0; k < 20'000; ++k) {
        times.push_back(k * 0.1);
        for (const double x : {10 * std::sin(k * 0.01), 0.0, 0.0}) values.push_back(x);
    }
    const ObjectId frames = make.create<KeyFrames>(), player = make.create<Animation>();
    setField<&KeyFrames::target>(make.list, frames, place);
    setField<&KeyFrames::field>(make.list, frames, std::string("translation"));
    setField<&KeyFrames::times>(make.list, frames, Blob::of(std::span<const double>(times)));
    setField<&KeyFrames::values>(make.list, frames, Blob::of(std::span<const double>(values)));
    setField<&Animation::channels>(make.list, player, RefList{frames});
    make.node("take", kRootNode, player);
    make.save(folder + "/animated.tsc");
    int asked = 0;
    const auto span = framesWhile(table, folder + "/animated.tsc", [&](Application& application, const Wall4&) {
        bool good = true;
        for (const Instant until = Clock::now() + (quick ? 3s : 10s); Clock::now() < until; ++asked)
            good = good && application.setView({.reset = true}).has_value();
        return good;
    });
    addWorst(table, "`view --reset` is asked without a pause", span, 2, fmt::format("; asked {} times", asked));
}

void copyRows(SceneTable& table, const std::string& folder, bool quick) {
    writeForest(folder + "/copied.tsc", 40'000, false);
    const auto span = framesWhile(table, folder + "/copied.tsc", [&](Application& application, const Wall4&) {
        const Expected<ObjectInfo> node = application.describeNode("/forest");
        bool good = node.has_value();
        for (int i = 0; good && i < (quick ? 3 : 20); ++i)
            good =
                application.cloneNode({.node = node->id, .name = fmt::format("copy {}", i), .deep = true}).has_value();
        return good;
    });
    addWorst(table, "40,000 nodes are copied deep, again and again", span, 50);
}

/// Whoever only looks: names among very many siblings, and what is nearest on a ray through geometry that nobody has
/// asked about.
void questionRows(SceneTable& table, const std::string& folder, bool quick) {
    constexpr int kSiblings = 300'000;
    FileMaker make;
    const ObjectId hall = make.node("hall", kRootNode);
    for (int i = 0; i < kSiblings; ++i) make.node(fmt::format("n{}", i), hall);
    make.save(folder + "/crowd.tsc");
    const Duration length = quick ? 3s : 10s;
    int asked = 0;
    const auto names = framesWhile(table, folder + "/crowd.tsc", [&](Application& application, const Wall4&) {
        std::vector<std::string> paths;
        for (int i = 0; i < 256; ++i) paths.push_back(fmt::format("/hall/n{}", kSiblings - 1 - 37 * i));
        bool good = true;
        for (const Instant until = Clock::now() + length; good && Clock::now() < until; ++asked)
            good = application.describe(paths).has_value();
        return good;
    });
    addWorst(table, fmt::format("256 paths among {} siblings are asked for without a pause", kSiblings), names, 20,
             fmt::format("; asked {} times", asked));

    constexpr int kSide = 500, kWalls = 4;
    FileMaker walls;
    for (int wall = 0; wall < kWalls; ++wall) {
        std::vector<float> places;
        std::vector<std::uint32_t> corners;
        for (int y = 0; y <= kSide; ++y)
            for (int x = 0; x <= kSide; ++x) {
                for (const int v : {x, y, wall}) places.push_back(static_cast<float>(v));
                const auto at = static_cast<std::uint32_t>(y * (kSide + 1) + x);
                if (x < kSide && y < kSide)
                    for (const std::uint32_t c : {0u, 1u, kSide + 1u, 1u, kSide + 2u, kSide + 1u})
                        corners.push_back(at + c);
            }
        const ObjectId shape = walls.create<Geometry>();
        setField<&Geometry::positions>(walls.list, shape, Blob::of(std::span<const float>(places)));
        setField<&Geometry::indices>(walls.list, shape, Blob::of(std::span<const std::uint32_t>(corners)));
        walls.node("wall", walls.node("place", kRootNode, walls.transform(Vec3d(1000 * wall, 0, 0))), shape);
    }
    walls.save(folder + "/walls.tsc");
    const auto picks = framesWhile(table, folder + "/walls.tsc", [&](Application& application, const Wall4&) {
        bool good = true;
        for (int wall = 0; good && wall < kWalls; ++wall) {
            const auto hit = application.pick(Aim{.ray = Ray{Vec3d(1000 * wall + 20.3, 30.2, 100), -Vec3d::UnitZ()}});
            good = hit && hit->hit;
        }
        return good;
    });
    addWorst(table, fmt::format("{} meshes of {} triangles are picked for the first time", kWalls, 2 * kSide * kSide),
             picks, 20);
}

}  // namespace

void guestRows(SceneTable& table, const std::string& forest, const std::string& rows, bool quick) {
    const std::string folder = std::filesystem::path(forest).parent_path();
    const auto wanted = [&](const char* name) { return isWanted(rows, name); };
    if (wanted("lies")) lyingRows(table, forest, quick);
    if (wanted("undo")) undoRows(table, folder, quick);
    if (wanted("reset")) resetRows(table, folder, quick);
    if (wanted("copies")) copyRows(table, folder, quick);
    if (wanted("questions")) questionRows(table, folder, quick);
}

}  // namespace tessera::bench
