/// What a wall's frames take while a large scene is loaded at run time, taken back and brought again: a server in this
/// process, four render hosts that do not draw (`tessera-client --surface none`), an application that asks.
///
/// Before that: what they take while an application sends large arrays (`--uploads`: that alone).
///
///     bench_load [--json FILE] [--nodes N] [--wide] [--uploads] [--quick]
#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include "common/application/Application.h"
#include "common/base/Channel.h"
#include "common/codec/WallCodec.h"
#include "common/cores/ApplicationData.h"
#include "common/cores/Geometry.h"
#include "common/cores/Node.h"
#include "common/cores/Transform.h"
#include "common/geometry/Mesh.h"
#include "common/scenefile/SceneFile.h"
#include "server/sim/FrameLoop.h"
#include "tests/bench/SceneTable.h"
#include "tests/integration/LiveWall.h"

namespace tessera::bench {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using Instant = Clock::time_point;

double milliseconds(Duration duration) {
    return std::chrono::duration<double, std::milli>(duration).count();
}

/// Places with ten places below each, every one a Transform with a box of sixteen sizes in a node below it: half of the nodes
/// are places. `wide`: all places stand below one node.
void writeForest(const std::string& path, std::uint64_t nodes, bool wide) {
    ChangeListBuilder list;
    std::uint64_t next = kRootNode.value + 1;
    const auto create = [&](ObjectType type) {
        const ObjectId id(next++);
        list.create(id, type);
        return id;
    };
    const auto createNode = [&](const std::string& name, ObjectId core, ObjectId parent) {
        const ObjectId id = create(typeOf<Node>());
        setField<&Node::name>(list, id, name);
        if (core) setField<&Node::core>(list, id, core);
        list.place(id, parent);
        return id;
    };
    std::vector<ObjectId> boxes;
    for (int i = 0; i < 16; ++i) {
        const MeshArrays arrays = makeBox(Vec3d::Constant(0.2 + 0.05 * i)).toArrays();
        boxes.push_back(create(typeOf<Geometry>()));
        setField<&Geometry::positions>(list, boxes.back(), arrays.positions);
        setField<&Geometry::normals>(list, boxes.back(), arrays.normals);
        setField<&Geometry::indices>(list, boxes.back(), arrays.indices);
    }
    std::vector<ObjectId> places;
    for (std::uint64_t i = 0; 2 * i < nodes; ++i) {
        const ObjectId transform = create(typeOf<Transform>());
        const double turn = 0.1 * static_cast<double>(i % 60);
        setField<&Transform::translation>(list, transform, Vec3d(static_cast<double>(i % 10) - 4.5, 0.1 + turn, -1.3));
        setField<&Transform::rotation>(list, transform, Quatd(std::cos(turn / 2), 0, std::sin(turn / 2), 0));
        const ObjectId parent = i == 0 ? kRootNode : wide ? places.front() : places[(i - 1) / 10];
        places.push_back(createNode(i == 0 ? "forest" : fmt::format("tree number {}", i), transform, parent));
        createNode("shape", boxes[i % boxes.size()], places.back());
    }
    Aspect scene;
    if (!scene.apply(list.take()) || !saveScene(path, scene)) std::abort();
}

/// Something moves in every frame, so that every frame has a list.
constexpr const char* kMover =
    "node { name: \"mover\" transform {} node { box { size { x: 1 y: 1 z: 1 } } } }\n"
    "node { motion { target: \"mover\" mode: PING_PONG key { time: 0 } key { time: 1 transform { translation { x: 1 } } } } }\n";

/// Sees when the whole machine stands still (a shared one may be stopped for tenths of a second): a thread that does nothing
/// but sleep for two milliseconds wakes much later then.
class StandstillWatch {
public:
    StandstillWatch() : thread_([this] { run(); }) {}
    ~StandstillWatch() { (void)take(); }
    struct Standstill {
        Instant from, to;
    };
    std::vector<Standstill> take() {
        stop_ = true;
        if (thread_.joinable()) thread_.join();
        return seen_;
    }

private:
    void run() {
        for (Instant before = Clock::now(); !stop_;) {
            std::this_thread::sleep_for(2ms);
            const Instant now = Clock::now();
            if (now - before > 25ms) seen_.push_back({before, now});
            before = now;
        }
    }
    std::vector<Standstill> seen_;
    std::atomic<bool> stop_{false};
    std::thread thread_;
};

/// The wall at work on threads and processes of its own, and when it has released its frames.
class Wall4 {
public:
    /// Applications may load what lies in folder `allowed`.
    Wall4(std::vector<std::string> scenes, const std::string& allowed, double rateHz) : log_("bench_load") {
        const std::string path = test::wallWithSync(folder_, "lost_after_ms: 10000 frame_deadline_ms: 60000 start_deadline_ms: 300000");
        ServerOptions options;
        options.wall = loadWall(path).value();
        options.scenes = {folder_.write("mover.tsct", kMover)};
        options.scenes.insert(options.scenes.end(), scenes.begin(), scenes.end());
        options.allowed = {allowed};
        options.rateHz = rateHz;
        options.onProgress = [this](std::uint64_t, std::uint64_t) {
            released_.push_back(Clock::now());
            timespec time{};
            clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
            worked_.push_back(1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec));
        };
        options.onListening = [this](const Address& address) { listening_.push(toString(address)); };
        loop_ = std::make_unique<FrameLoop>(std::move(options), log_);
        thread_ = std::thread([this] {
            if (const Expected<void> done = loop_->run(); !done) log_.error(done.error().message);
            listening_.close();
        });
        address_ = listening_.pop().value_or("");
        for (const std::string& host : test::kFourHosts)
            hosts_.push_back(std::make_unique<test::Process>(
                folder_.path(), host,
                std::vector<std::string>{test::program("tessera-client"), "--server", address_, "--host", host, "--surface", "none"}));
    }
    ~Wall4() { (void)finish(); }
    [[nodiscard]] std::unique_ptr<Application> connect() const {
        auto application = Application::connect({.address = address_, .name = "bench", .followScene = false, .timeout = std::chrono::minutes(2)});
        return application ? std::move(*application) : nullptr;
    }
    /// Ends it: the instants of all releases.
    std::vector<Instant> finish() {
        if (thread_.joinable()) {
            loop_->stop();
            thread_.join();
        }
        return released_;
    }
    /// Processor time of the frame thread up to each release, ms. Once it has ended.
    [[nodiscard]] const std::vector<double>& worked() const { return worked_; }

private:
    test::TemporaryFolder folder_;
    Log log_;
    std::vector<Instant> released_;  ///< the frame thread's until it has ended
    std::vector<double> worked_;     ///< likewise
    Channel<std::string> listening_{1};
    std::unique_ptr<FrameLoop> loop_;
    std::thread thread_;
    std::string address_;
    std::vector<std::unique_ptr<test::Process>> hosts_;
};

/// Frames in a span of time, by how long after the one before they were released.
struct FrameSpan {
    std::vector<double> ms;
    double worst = 0;
    double worstStandstill = 0;  ///< of frames, left out here, during which the machine stood still
    std::size_t standstills = 0;
    [[nodiscard]] Median median() const { return medianOf(ms); }
};

/// Of the frames released in [from, to), but for those whose time holds one of `without`, and the ones before them: of these `left`
/// gets the longest, whenever they were released.
FrameSpan spanOf(const std::vector<Instant>& released, const std::vector<StandstillWatch::Standstill>& standstills, Instant from, Instant to, const std::vector<Instant>& without = {},
            double* left = nullptr) {
    FrameSpan span;
    for (std::size_t i = 1; i < released.size(); ++i) {
        const double ms = milliseconds(released[i] - released[i - 1]);
        bool isLeft = false;
        for (const Instant at : without) {
            const bool holds = released[i - 1] <= at && at < released[i];
            const bool justBefore = i + 1 < released.size() && released[i] <= at && at < released[i + 1];
            isLeft = isLeft || holds || justBefore;
        }
        if (!isLeft && (released[i] < from || released[i] >= to)) continue;
        if (isLeft) {
            if (left) *left = std::max(*left, ms);
            continue;
        }
        if (std::ranges::any_of(standstills, [&](const auto& still) { return still.from < released[i] && released[i - 1] < still.to; })) {
            span.worstStandstill = std::max(span.worstStandstill, ms);
            ++span.standstills;
            continue;
        }
        span.ms.push_back(ms);
        span.worst = std::max(span.worst, ms);
    }
    return span;
}

struct LoadCourse {
    Instant begun, ordered, shown, rested, undoing, undone, gone, redoing, back, over;
    std::string trouble;
};

bool waitForObjects(Application& application, std::uint64_t atMost, std::string& trouble) {
    for (int i = 0; i < 3000; ++i) {
        const auto status = application.status();
        if (!status) {
            trouble = status.error().message;
            return false;
        }
        if (status->objects <= atMost) return true;
        std::this_thread::sleep_for(20ms);
    }
    trouble = "what was undone does not go";
    return false;
}

LoadCourse visit(Application& application, const std::string& file, Duration rest) {
    LoadCourse v;
    const auto pause = [&] { std::this_thread::sleep_for(rest); };
    // Until all hosts are there and frames go by.
    for (int i = 0; i < 1000; ++i) {
        const auto status = application.status();
        if (status && status->frame.value > 30 && status->hosts.size() == 4) break;
        std::this_thread::sleep_for(20ms);
    }
    const auto first = application.status();
    v.begun = Clock::now();
    pause();
    v.ordered = Clock::now();
    const auto loaded = application.load(file, {}, std::chrono::minutes(5));
    v.shown = Clock::now();
    if (!loaded || !first) {
        v.trouble = loaded ? first.error().message : loaded.error().message;
        return v;
    }
    std::this_thread::sleep_for(500ms);
    v.rested = Clock::now();
    pause();
    v.undoing = Clock::now();
    const auto undone = application.undo();
    v.undone = Clock::now();
    if (!undone) v.trouble = undone.error().message;
    if (!v.trouble.empty() || !waitForObjects(application, first->objects, v.trouble)) return v;
    v.gone = Clock::now();
    std::this_thread::sleep_for(500ms);
    v.redoing = Clock::now();
    const auto redone = application.redo();
    v.back = Clock::now();
    if (!redone) v.trouble = redone.error().message;
    std::this_thread::sleep_for(500ms);
    v.over = Clock::now();
    return v;
}

void loadRows(SceneTable& table, const std::string& file, double rateHz, bool quick) {
    const std::string how = rateHz > 0 ? fmt::format("{:.0f} Hz", rateHz) : "no pause";
    StandstillWatch watch;
    const std::string folder = std::filesystem::path(file).parent_path();
    Wall4 wall({}, folder, rateHz);
    const auto application = wall.connect();
    if (!application) return table.complain("no application can connect");
    const LoadCourse v = visit(*application, file, quick ? 1s : 3s);
    const std::vector<Instant> released = wall.finish();
    const std::vector<StandstillWatch::Standstill> still = watch.take();
    if (!v.trouble.empty()) table.complain(v.trouble);
    if (v.over == Instant()) return;

    double showing = 0, hiding = 0, bringing = 0;
    const FrameSpan before = spanOf(released, still, v.begun, v.ordered);
    const FrameSpan during = spanOf(released, still, v.ordered, v.shown, {v.shown}, &showing);
    const FrameSpan after = spanOf(released, still, v.rested, v.undoing);
    const FrameSpan undoing = spanOf(released, still, v.undoing, v.gone, {v.undone}, &hiding);
    const FrameSpan redoing = spanOf(released, still, v.redoing, v.back, {v.back}, &bringing);
    const double median = before.median().value;
    const auto worst = [&](const std::string& what, const FrameSpan& span, const std::string& remark) {
        table.add({.operation = how + ": " + what,
                   .peer = "50 ms above the median before",
                   .ours = {span.worst - median, 0, span.ms.size()},
                   .theirs = {50, 0, 1},
                   .unit = "ms",
                   .atMost = 1,
                   .remark = span.standstills == 0 ? remark
                                                   : fmt::format("{}; without {} frames (up to {:.0f} ms) in which the machine stood still",
                                                                 remark, span.standstills, span.worstStandstill)});
    };
    const auto alone = [&](const std::string& what, double ms, const std::string& remark = "") {
        table.add({.operation = how + ": " + what, .peer = "", .ours = {ms, 0, 1}, .theirs = {}, .unit = "ms", .remark = remark});
    };
    alone("a frame before", median, fmt::format("worst {:.1f}", before.worst));
    worst("the worst while it is loaded", during,
          fmt::format("{} frames, median {:.2f}; {:.1f} s until it is seen", during.ms.size(), during.median().value,
                      std::chrono::duration<double>(v.shown - v.ordered).count()));
    alone("the frame that shows it", showing);
    alone("a frame after", after.median().value, fmt::format("worst {:.1f}", after.worst));
    alone("the frame that undo hides it in", hiding);
    worst("the worst while undo takes it away", undoing,
          fmt::format("{:.1f} s", std::chrono::duration<double>(v.gone - v.undone).count()));
    worst("the worst while redo brings it again", redoing,
          fmt::format("{:.1f} s", std::chrono::duration<double>(v.back - v.redoing).count()));
    alone("the frame that redo shows it in", bringing);

    Wall4 other({file}, folder, rateHz);
    const auto second = other.connect();
    if (!second) return table.complain("no application can connect");
    for (int i = 0; i < 6000; ++i) {
        const auto status = second->status();
        if (status && status->frame.value > 30) break;
        std::this_thread::sleep_for(20ms);
    }
    std::this_thread::sleep_for(500ms);
    const Instant from = Clock::now();
    std::this_thread::sleep_for(quick ? 1s : 3s);
    const FrameSpan start = spanOf(other.finish(), {}, from, Instant::max());
    table.add({.operation = how + ": a frame after",
               .peer = "the same loaded at the start",
               .ours = after.median(),
               .theirs = start.median(),
               .unit = "ms",
               .atMost = 1.5,
               .remark = fmt::format("worst {:.1f}, {:.1f}", after.worst, start.worst)});
}

constexpr std::size_t kUploadBytes = std::size_t{256} << 20;

/// Adds one node that keeps this array. `sound`: else the server refuses it once the array is there.
ChangeList keeping(const Blob& array, bool sound) {
    ChangeListBuilder edits;
    const ObjectId data{kFirstPlaceholder}, node{kFirstPlaceholder + 1};
    edits.create(data, typeOf<ApplicationData>());
    setField<&ApplicationData::data>(edits, data, array);
    edits.create(node, typeOf<Node>());
    setField<&Node::core>(edits, node, data);
    edits.place(node, sound ? kRootNode : ObjectId(~std::uint64_t{0} >> 2));
    return edits.take();
}

double percentile99(std::vector<double> ms) {
    if (ms.empty()) return 0;
    std::ranges::sort(ms);
    return ms[std::min(ms.size() - 1, ms.size() * 99 / 100)];
}

/// An application sends arrays of 256 MiB, one after the other, for so many frames: first such as are refused in the end, so that only
/// their coming costs anything; then such as all hosts fetch.
void uploadRows(SceneTable& table, bool quick) {
    const std::size_t frames = quick ? 120 : 600;
    const auto span = std::chrono::duration_cast<Duration>(std::chrono::duration<double>(static_cast<double>(frames) / 60));
    StandstillWatch watch;
    Wall4 wall({}, "/nowhere", 60);
    const auto application = wall.connect();
    if (!application) return table.complain("no application can connect");
    std::array<Blob, 2> arrays;
    for (std::size_t i = 0; i < arrays.size(); ++i) {
        Bytes bytes(kUploadBytes);
        for (std::size_t at = 0; at < bytes.size(); at += 64) bytes[at] = static_cast<std::byte>((at >> 6) * 31 + i);
        arrays[i] = Blob(std::move(bytes));
    }
    for (int i = 0; i < 1000; ++i) {
        const auto status = application->status();
        if (status && status->frame.value > 60 && status->hosts.size() == 4) break;
        std::this_thread::sleep_for(20ms);
    }
    const auto send = [&](bool sound) {
        const Instant from = Clock::now();
        std::size_t sent = 0;
        while (Clock::now() < from + span) {
            const auto answer = application->propose(keeping(arrays[sent % arrays.size()], sound));
            if (answer.has_value() != sound) table.complain(answer ? "what is not sound is taken" : answer.error().message);
            if (sound && answer) {
                std::vector<ObjectId> node;
                for (const auto& [placeholder, id] : answer->ids)
                    if (placeholder.value == kFirstPlaceholder + 1) node.push_back(id);
                if (node.empty() || !application->removeNode(node.front())) table.complain("it cannot be removed");
            }
            ++sent;
        }
        return std::pair(from, sent);
    };
    const Instant begun = Clock::now();
    std::this_thread::sleep_for(span);
    const Instant idle = Clock::now();
    const auto [coming, came] = send(false);
    const Instant cameAll = Clock::now();
    const auto [fetching, fetched] = send(true);
    const Instant fetchedAll = Clock::now();
    const std::vector<Instant> released = wall.finish();
    const std::vector<StandstillWatch::Standstill> still = watch.take();
    const FrameSpan before = spanOf(released, still, begun, idle), during = spanOf(released, still, coming, cameAll),
                    shared = spanOf(released, still, fetching, fetchedAll);
    // Whatever else this machine does: how long the frame thread itself works in a frame.
    const auto workOf = [&](Instant from, Instant to) {
        std::vector<double> ms;
        for (std::size_t i = 1; i < released.size(); ++i)
            if (from <= released[i - 1] && released[i] < to) ms.push_back(wall.worked()[i] - wall.worked()[i - 1]);
        return ms;
    };
    const std::vector<double> idling = workOf(begun, idle), taking = workOf(coming, cameAll), sharing = workOf(fetching, fetchedAll);
    const double quiet = percentile99(before.ms);
    const auto words = [&](const FrameSpan& of, std::size_t arrays_) {
        return fmt::format("p99 {:.2f}, before {:.2f}; {} frames, median {:.2f}, worst {:.1f}; {} arrays; without {} frames in which the machine stood still",
                           percentile99(of.ms), quiet, of.ms.size(), of.median().value, of.worst, arrays_, of.standstills);
    };
    table.begin("arrays of 256 MiB that an application sends, one after the other, 60 Hz, four hosts that do not draw");
    table.add({.operation = "p99 of the frame thread's processor time in a frame while they come, above that before",
               .peer = "2 ms",
               .ours = {percentile99(taking) - percentile99(idling), 0, taking.size()},
               .theirs = {2, 0, 1},
               .unit = "ms",
               .atMost = 1,
               .remark = fmt::format("p99 {:.2f}, before {:.2f}; worst {:.2f}, before {:.2f}; while hosts fetch them p99 {:.2f}, worst {:.2f}", percentile99(taking),
                                     percentile99(idling), taking.empty() ? 0 : std::ranges::max(taking), idling.empty() ? 0 : std::ranges::max(idling), percentile99(sharing),
                                     sharing.empty() ? 0 : std::ranges::max(sharing))});
    table.add({.operation = "p99 of frames while they come, above the p99 before",
               .peer = "2 ms",
               .ours = {percentile99(during.ms) - quiet, 0, during.ms.size()},
               .theirs = {2, 0, 1},
               .unit = "ms",
               .atMost = 1,
               .remark = words(during, came)});
    table.add({.operation = "the same while four hosts on this machine fetch each of them too",
               .peer = "",
               .ours = {percentile99(shared.ms) - quiet, 0, shared.ms.size()},
               .theirs = {},
               .unit = "ms",
               .remark = words(shared, fetched)});
}

int bench(const std::vector<std::string>& arguments) {
    std::string json;
    std::uint64_t nodes = 1'000'000;
    bool quick = false, wide = false, uploadsAlone = false;
    for (std::size_t i = 0; i < arguments.size(); ++i) {
        if (arguments[i] == "--quick") {
            quick = true;
        } else if (arguments[i] == "--wide") {
            wide = true;
        } else if (arguments[i] == "--uploads") {
            uploadsAlone = true;
        } else if (i + 1 < arguments.size() && arguments[i] == "--json") {
            json = arguments[++i];
        } else if (i + 1 < arguments.size() && arguments[i] == "--nodes") {
            nodes = std::strtoull(arguments[++i].c_str(), nullptr, 10);
        } else {
            std::fputs("usage: bench_load [--json FILE] [--nodes N] [--wide] [--uploads] [--quick]\n", stderr);
            return 2;
        }
    }
    SceneTable table;
    uploadRows(table, quick);
    if (!uploadsAlone) {
        const test::TemporaryFolder folder;
        const std::string file = folder.path() + "/forest.tsc";
        writeForest(file, nodes, wide);
        table.begin(fmt::format("loading {} nodes at run time ({:.1f} MB{}), four hosts that do not draw", nodes,
                                static_cast<double>(std::filesystem::file_size(file)) * 1e-6, wide ? ", half of them below one node" : ""));
        loadRows(table, file, 60, quick);
        loadRows(table, file, 0, quick);
    }
    table.summarise();
    if (!json.empty() && !table.writeJson(json)) {
        std::fprintf(stderr, "bench_load: %s cannot be written\n", json.c_str());
        return 1;
    }
    return table.good() ? 0 : 1;
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
    return tessera::bench::bench({argv + 1, argv + argc});
}
