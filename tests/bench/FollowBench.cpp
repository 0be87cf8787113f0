/// What following changes costs a render host, beside what it was to be independent of: one changed object of each kind
/// in a scene of 100,000 beside the same in one of 1,000; many beside all of them, and culling in what has come to be
/// by edits beside culling in what was built at once.
#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <cstdio>
#include <fstream>

#include "client/replica/RenderHost.h"
#include "common/codec/ChangeCodec.h"
#include "common/codec/FrameCodec.h"
#include "common/codec/WallCodec.h"
#include "tests/unit/TestFolder.h"
#include "tests/unit/render/EditStage.h"

namespace tessera {
namespace {

double threadUs() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return 1e6 * static_cast<double>(t.tv_sec) + 1e-3 * static_cast<double>(t.tv_nsec);
}

double median(std::vector<double> values) {
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
    return values[values.size() / 2];
}

/// Leaves the caches as a frame of drawing leaves them.
void forget() {
    static std::vector<std::uint64_t> other(std::size_t{4} << 20);
    for (std::size_t i = 0; i < other.size(); i += 8) other[i] += i;
}

/// Time of RenderScene::update alone.
double follow(EditStage& stage) {
    const ChangeList list = stage.scene.apply();
    forget();
    const double start = threadUs();
    stage.all.update(stage.scene.aspect, &list);
    return threadUs() - start;
}

struct Row {
    std::string name, peer;
    double ours, theirs;
    std::string unit;
};

std::string nameOf(Layout layout) {
    return layout == Layout::kBushy ? "bushy" : layout == Layout::kFlat ? "flat" : "deep";
}

void measureKinds(Layout layout, int edits, std::vector<Row>& rows) {
    EditStage small(layout, 1'000), large(layout, 100'000);
    for (const EditKind& kind : editKinds()) {
        std::vector<double> ours, theirs;
        // In turns: the machine is shared.
        for (int turn = 0; turn < edits; ++turn) {
            kind.edit(large, turn);
            ours.push_back(follow(large));
            kind.edit(small, turn);
            theirs.push_back(follow(small));
        }
        rows.push_back({nameOf(layout) + ": " + kind.name, "in 1,000", median(ours), median(theirs), "us"});
    }
}

void measureMany(std::vector<Row>& rows) {
    EditStage stage(Layout::kBushy, 100'000);
    std::vector<ObjectId> poses;
    for (const ObjectId id : stage.scene.aspect.ids())
        if (stage.scene.aspect.get<Transform>(id)) poses.push_back(id);
    const auto move = [&](std::size_t count) {
        for (std::size_t i = 0; i < count; ++i) {
            const ObjectId id = poses[i * 7919 % poses.size()];
            const Vec3d at = stage.scene.aspect.get<Transform>(id)->translation;
            stage.set<Transform>(id, fieldId<&Transform::translation>, Vec3d(at + Vec3d(0.01, 0, 0)));
        }
        return follow(stage) / 1e3;
    };
    std::vector<double> anew, all, hundred, thousand;
    for (int turn = 0; turn < 7; ++turn) {
        RenderScene fresh;
        const double start = threadUs();
        fresh.update(stage.scene.aspect, nullptr);
        anew.push_back((threadUs() - start) / 1e3);
        all.push_back(move(poses.size()));
        thousand.push_back(move(1000));
        hundred.push_back(move(100));
    }
    rows.push_back({"100,000 items: all move", "anew", median(all), median(anew), "ms"});
    rows.push_back({"100,000 items: 1,000 subtrees move", "anew", median(thousand), median(anew), "ms"});
    rows.push_back({"100,000 items: 100 subtrees move", "anew", median(hundred), median(anew), "ms"});
}

void measureCulling(std::vector<Row>& rows) {
    // The same things: built at once, and after everything has come one by one, moved far, and partly gone.
    constexpr int kCount = 100'000;
    EditStage stage(Layout::kFlat, kCount);
    std::mt19937 random(4);
    const double side = 4 * std::cbrt(kCount);
    std::uniform_real_distribution<double> place(-side, side);
    for (int turn = 0; turn < 300; ++turn) {
        for (int i = 0; i < 200; ++i) {
            const ObjectId group = stage.groups[1 + random() % (stage.groups.size() - 1)];
            const Vec3d at(place(random), place(random), place(random));
            if (i % 3 == 0)
                stage.scene.put(stage.otherCore, at);
            else if (i % 3 == 1)
                stage.set<Transform>(stage.scene.aspect.get<Node>(group)->core, fieldId<&Transform::translation>, at);
            else
                stage.scene.edit.detach(group);
        }
        static_cast<void>(follow(stage));
    }
    RenderScene anew;
    anew.update(stage.scene.aspect, nullptr);
    const TestCamera camera(960, 540);
    for (const CullerKind kind : {CullerKind::kFrustum, CullerKind::kMasked}) {
        RenderAction ours(kind), theirs(kind);
        std::vector<double> followed, built;
        for (int turn = 0; turn < 40; ++turn) {
            const auto one = [&](RenderAction& action, const RenderScene& scene) {
                const double start = threadUs();
                static_cast<void>(action.run(scene, camera.camera(), camera.tile(), nullptr));
                return (threadUs() - start) / 1e3;
            };
            followed.push_back(one(ours, stage.all));
            built.push_back(one(theirs, anew));
        }
        rows.push_back({fmt::format("100,000 items, 60,000 edits: {}", nameOf(kind)), "built at once", median(followed),
                        median(built), "ms"});
    }
}

/// A host with one tile of 960×540 that keeps what it shows in a file: microseconds of a frame in which nothing
/// changes, and of one that is drawn.
struct HostFrames {
    double idle = 0, drawn = 0;
};
HostFrames measureHost(int count) {
    const test::TestFolder folder;
    Log log("bench_follow");
    BlobStore store;
    std::vector<Blob> kept;
    const auto surface = makeSurface("osmesa").value();
    std::size_t frames = 0;
    RenderHost host({.name = "left", .output = folder.path()}, surface.get(), store, log, [&](const Outcome& outcome) {
        frames += std::holds_alternative<outcome::Drawn>(outcome.what) ? 1 : 0;
    });
    static_cast<void>(host.probe());
    Wall wall;
    wall.name = "bench";
    Screen screen;
    screen.name = "front";
    screen.lowerLeft = {-1.6, 0.6, 0};
    screen.lowerRight = {1.6, 0.6, 0};
    screen.upperLeft = {-1.6, 2.4, 0};
    wall.screens = {screen};
    wall.users = {User{.name = "viewer"}};
    wall.hosts = {{.name = "left", .tiles = {{.screen = "front", .column = 0, .row = 0, .user = "viewer"}}}};
    host.perform({Attempt{1}, work::Configure{Epoch(1), share(encodeWall(wall))}});

    const EditStage stage(Layout::kFlat, count);
    const ChangeList list = snapshot(stage.scene.aspect);
    for (const Blob& blob : blobsOf(list)) kept.push_back(store.add(blob));
    host.perform(
        {Attempt{1}, work::ApplySnapshot{{.list = share(CommittedList{Sequence(1), {}, encodeChangeList(list), {}})}}});
    FrameNumber frame;
    const auto show = [&](const View& view) {
        const message::Begin begin{.frame = frame, .payload = encodeFrame({.view = view}), .list = nothingCommitted()};
        const double start = threadUs();
        host.perform({Attempt{1}, work::Draw{begin}});
        host.perform({Attempt{1}, work::Shown{frame}});
        frame = frame.next();
        return threadUs() - start;
    };
    std::vector<double> idle, drawn;
    View view;
    for (int turn = 0; turn < 12; ++turn) {
        view.position.x() = 0.01 * turn;
        drawn.push_back(show(view));
        for (int still = 0; still < 20; ++still) {
            const double took = show(view);
            if (still > 0) idle.push_back(took);  // in the first one the picture is copied into the other slot
        }
    }
    if (frames != frame.value) {
        std::fprintf(stderr, "bench_follow: %zu frames of %zu\n", frames, static_cast<std::size_t>(frame.value));
        std::exit(1);
    }
    return {median(idle), median(drawn)};
}

void measureHosts(std::vector<Row>& rows) {
    const HostFrames small = measureHost(1'000);
    const HostFrames large = measureHost(100'000);
    rows.push_back({"idle frame of a host, 100,000 items", "1,000 items", large.idle, small.idle, "us"});
    rows.push_back({"idle frame of a host, 100,000 items", "drawn frame", large.idle, large.drawn, "us"});
}

int bench(int argc, char** argv) {
    std::string json;
    int edits = 200;
    for (int i = 1; i + 1 < argc; i += 2) {
        const std::string option = argv[i];
        if (option == "--json") json = argv[i + 1];
        if (option == "--edits") edits = std::clamp(std::atoi(argv[i + 1]), 1, 400);
    }
    std::vector<Row> rows;
    for (const Layout layout : {Layout::kBushy, Layout::kFlat, Layout::kDeep}) measureKinds(layout, edits, rows);
    measureMany(rows);
    measureCulling(rows);
    measureHosts(rows);
    std::printf("%-44s %-16s %10s %10s %8s\n", "case", "peer", "ours", "theirs", "ratio");
    std::string cases;
    for (const Row& row : rows) {
        const double ratio = row.theirs > 0 ? row.ours / row.theirs : 0;
        std::printf("%-44s %-16s %10.3f %10.3f %8.3f  %s\n", row.name.c_str(), row.peer.c_str(), row.ours, row.theirs,
                    ratio, row.unit.c_str());
        cases +=
            fmt::format(R"({}{{"case":"{}","peer":"{}","ours":{:.17g},"theirs":{:.17g},"unit":"{}","ratio":{:.17g}}})",
                        cases.empty() ? "\n" : ",\n", row.name, row.peer, row.ours, row.theirs, row.unit, ratio);
    }
    if (!json.empty()) std::ofstream(json) << "{\"cases\":[" << cases << "\n]}\n";
    return 0;
}

}  // namespace
}  // namespace tessera

int main(int argc, char** argv) {
    return tessera::bench(argc, argv);
}
