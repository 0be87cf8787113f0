// What a frame of the server costs by how large the scene is: Simulation::step and the view, no network, no drawing.
// Idle beside the smallest scene, and beside one walk over the whole scene in the same run, which is what a frame used
// to take to find its camera.
//
//     bench_idle [--json FILE] [--nodes N,N,…] [--frames N]
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include "common/cores/Camera.h"
#include "common/cores/Geometry.h"
#include "common/cores/Motion.h"
#include "common/cores/Transform.h"
#include "common/geometry/Mesh.h"
#include "common/scene/Action.h"
#include "common/scene/FieldTable.h"
#include "server/sim/frame/Simulation.h"
#include "server/sim/view/ViewSource.h"

namespace tessera {
namespace {

using Clock = std::chrono::steady_clock;

double microsecondsOf(const std::function<void()>& what) {
    const Clock::time_point begin = Clock::now();
    what();
    return std::chrono::duration<double, std::micro>(Clock::now() - begin).count();
}

double medianOf(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::ranges::nth_element(values, middle);
    return *middle;
}

Wall oneScreen() {
    Wall wall;
    Screen screen;
    screen.name = "front";
    screen.lowerLeft = Vec3d(-1, 0, 0);
    screen.lowerRight = Vec3d(1, 0, 0);
    screen.upperLeft = Vec3d(-1, 1, 0);
    wall.screens = {screen};
    wall.users = {User{.name = "viewer", .position = Vec3d(0, 0.5, 2)}};
    return wall;
}

/// So many nodes: groups of ten Transforms, each with a box below; a thousandth as many motions that do not play, and a
/// camera, last in document order.
ChangeList sceneOf(std::uint64_t nodes) {
    ChangeListBuilder builder;
    std::uint64_t next = 0;
    const auto create = [&](ObjectType type) {
        const ObjectId id{kFirstPlaceholder + next++};
        builder.create(id, type);
        return id;
    };
    std::uint64_t placed = 1;  // the root
    const auto node = [&](ObjectId parent, ObjectId core) {
        const ObjectId id = create(typeOf<Node>());
        if (core) builder.set(id, typeOf<Node>(), fieldId<&Node::core>, core);
        builder.place(id, parent);
        ++placed;
        return id;
    };
    const MeshArrays arrays = makeBox(Vec3d::Constant(0.4)).toArrays();
    const ObjectId box = create(typeOf<Geometry>());
    builder.set(box, typeOf<Geometry>(), fieldId<&Geometry::positions>, arrays.positions);
    builder.set(box, typeOf<Geometry>(), fieldId<&Geometry::indices>, arrays.indices);
    std::vector<double> keys;
    for (const double time : {0.0, 1.0, 2.0})
        for (const double v : {time, time, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0}) keys.push_back(v);
    const Blob motion = Blob::of(std::span<const double>(keys));
    std::uint64_t transforms = 0;
    ObjectId group;
    while (placed + 2 < nodes) {
        if (transforms % 10 == 0) group = node(kRootNode, {});
        const ObjectId transform = create(typeOf<Transform>());
        const double at = static_cast<double>(transforms);
        builder.set(transform, typeOf<Transform>(), fieldId<&Transform::translation>,
                    toValue(Vec3d(std::fmod(at, 1000), 0, std::floor(at / 1000))));
        node(node(group, transform), box);
        if (transforms++ % 1000 != 0) continue;
        const ObjectId paused = create(typeOf<Motion>());
        builder.set(paused, typeOf<Motion>(), fieldId<&Motion::target>, transform);
        builder.set(paused, typeOf<Motion>(), fieldId<&Motion::keys>, motion);
        builder.set(paused, typeOf<Motion>(), fieldId<&Motion::playing>, false);
    }
    node(kRootNode, create(typeOf<Camera>()));
    return builder.take();
}

struct Row {
    std::uint64_t nodes = 0;
    double idleUs = 0, collisionUs = 0, viewUs = 0, moveUs = 0, manyUs = 0, walkUs = 0;
};

Row measure(std::uint64_t nodes, int frames) {
    Simulation simulation;
    ViewSource view(oneScreen(), "");
    const Expected<CommittedFrame> loaded = simulation.load({sceneOf(nodes)});
    TESSERA_CHECK(loaded.has_value(), loaded ? std::string() : loaded.error().message);
    view.update(simulation.scene(), nullptr);
    const auto frame = [&](std::vector<Edit> edits) {
        FrameResult made = simulation.step(false, std::move(edits));
        if (made.commit.list) view.update(simulation.scene(), made.commit.list.get());
        TESSERA_CHECK(view.view(simulation.scene()).has_value(), "there is a view");
        return made;
    };
    frame({});
    std::vector<double> idle, collision, looks, moves, many, walks;
    for (int i = 0; i < frames; ++i) {
        double inPipeline = 0;
        idle.push_back(microsecondsOf([&] { inPipeline = 1000 * frame({}).collisionMs; }));
        collision.push_back(inPipeline);
        looks.push_back(microsecondsOf([&] { (void)view.view(simulation.scene()); }));
    }
    std::vector<ObjectId> transforms;
    for (const ObjectId id : simulation.scene().ids())
        if (simulation.scene().get<Transform>(id) && transforms.size() < 10'000) transforms.push_back(id);
    const auto moved = [&](std::size_t count, int i) {
        ChangeListBuilder builder;
        for (std::size_t t = 0; t < count; ++t)
            builder.set(transforms[t], typeOf<Transform>(), fieldId<&Transform::translation>,
                        toValue(Vec3d(0.1 * i, 3, 0)));
        std::vector<Edit> edits;
        edits.push_back({.ticket = 1, .list = builder.take()});
        return edits;
    };
    for (int i = 0; i < std::min(frames, 100); ++i) {
        std::vector<Edit> edits = moved(1, i);
        moves.push_back(microsecondsOf([&] { (void)frame(std::move(edits)); }));
    }
    for (int i = 0; i < std::min(frames, 20); ++i) {
        std::vector<Edit> edits = moved(transforms.size(), i);
        many.push_back(microsecondsOf([&] { (void)frame(std::move(edits)); }) / static_cast<double>(transforms.size()));
    }
    for (int i = 0; i < 5; ++i)
        walks.push_back(microsecondsOf([&] {
            std::size_t cameras = 0;
            Action action;
            action.on<Camera>([&](const Visit&, const Camera&) { return ++cameras, Descend::kInto; });
            action.run(simulation.scene());
            TESSERA_CHECK(cameras == 1, "one camera");
        }));
    return {.nodes = simulation.nodeCount(),
            .idleUs = medianOf(idle),
            .collisionUs = medianOf(collision),
            .viewUs = medianOf(looks),
            .moveUs = medianOf(moves),
            .manyUs = medianOf(many),
            .walkUs = medianOf(walks)};
}

int run(int argc, char** argv) {
    std::vector<std::uint64_t> sizes{1'000, 100'000, 1'000'000};
    int frames = 2000;
    std::string json;
    for (int i = 1; i + 1 < argc; i += 2) {
        if (std::strcmp(argv[i], "--json") == 0) json = argv[i + 1];
        if (std::strcmp(argv[i], "--frames") == 0) frames = std::max(1, std::atoi(argv[i + 1]));
        if (std::strcmp(argv[i], "--nodes") != 0) continue;
        sizes.clear();
        for (char* at = argv[i + 1]; *at;) {
            sizes.push_back(std::strtoull(at, &at, 10));
            if (*at) ++at;
        }
    }
    fmt::print("{:>9}  {:>9} {:>9} {:>9}  {:>9} {:>9} {:>9}  {:>11}\n", "nodes", "idle us", "× first", "collision",
               "view us", "1 moves", "10k, each", "a walk us");
    std::vector<Row> rows;
    for (const std::uint64_t size : sizes) {
        rows.push_back(measure(size, frames));
        const Row& row = rows.back();
        fmt::print("{:>9}  {:>9.2f} {:>9.2f} {:>9.2f}  {:>9.3f} {:>9.2f} {:>9.3f}  {:>11.0f}\n", row.nodes, row.idleUs,
                   row.idleUs / rows.front().idleUs, row.collisionUs, row.viewUs, row.moveUs, row.manyUs, row.walkUs);
        std::fflush(stdout);
    }
    if (json.empty()) return 0;
    std::string text = "[";
    for (const Row& row : rows)
        text += fmt::format(
            "{}\n  {{\"nodes\": {}, \"idle_us\": {}, \"times_the_first\": {}, \"collision_us\": {}, \"view_us\": {}, "
            "\"one_moves_us\": {}, \"each_of_10000_moves_us\": {}, \"walk_us\": {}}}",
            text.size() > 1 ? "," : "", row.nodes, row.idleUs, row.idleUs / rows.front().idleUs, row.collisionUs,
            row.viewUs, row.moveUs, row.manyUs, row.walkUs);
    text += "\n]\n";
    std::FILE* file = std::fopen(json.c_str(), "w");
    const bool written = file && std::fwrite(text.data(), 1, text.size(), file) == text.size();
    return file && std::fclose(file) == 0 && written ? 0 : 1;
}

}  // namespace
}  // namespace tessera

int main(int argc, char** argv) {
    return tessera::run(argc, argv);
}
