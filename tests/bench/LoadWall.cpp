#include "tests/bench/LoadWall.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>

#include <fmt/format.h>

#include "common/codec/WallCodec.h"
#include "common/cores/Geometry.h"
#include "common/cores/Transform.h"
#include "common/geometry/Mesh.h"
#include "common/scenefile/SceneFile.h"

namespace tessera::bench {

double milliseconds(Duration duration) {
    return std::chrono::duration<double, std::milli>(duration).count();
}

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

namespace {

/// Something moves in every frame, so that every frame has a list.
constexpr const char* kMover =
    "node { name: \"mover\" transform {} node { box { size { x: 1 y: 1 z: 1 } } } }\n"
    "node { motion { target: \"mover\" mode: PING_PONG key { time: 0 } key { time: 1 transform { translation { x: 1 } "
    "} } } }\n";

}  // namespace

Wall4::Wall4(std::vector<std::string> scenes, const std::string& allowed, double rateHz,
             std::vector<std::string> lastHost)
    : log_("bench_load"), lastHost_(std::move(lastHost)) {
    const std::string path =
        test::wallWithSync(folder_, "lost_after_ms: 10000 frame_deadline_ms: 60000 start_deadline_ms: 300000");
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
    for (const std::string& host : test::kFourHosts) startHost(host);
}

std::unique_ptr<Application> Wall4::connect() const {
    auto application = Application::connect(
        {.address = address_, .name = "bench", .followScene = false, .timeout = std::chrono::minutes(2)});
    return application ? std::move(*application) : nullptr;
}

void Wall4::waitForFrames(Application& application, std::uint64_t frames) const {
    for (int i = 0; i < 12'000; ++i) {
        const auto status = application.status();
        if (status && status->frame.value >= frames && status->hosts.size() == 4) return;
        std::this_thread::sleep_for(10ms);
    }
}

void Wall4::startHost(const std::string& host) {
    std::vector<std::string> command = {
        test::program("tessera-client"), "--server", address_, "--host", host, "--surface", "none"};
    if (host == test::kFourHosts.back()) command.insert(command.end(), lastHost_.begin(), lastHost_.end());
    hosts_.push_back(std::make_unique<test::Process>(folder_.path(), fmt::format("{}-{}", host, started_++), command));
}

FrameSpan spanOf(const std::vector<Instant>& released, const std::vector<StandstillWatch::Standstill>& standstills,
                 Instant from, Instant to, const std::vector<Instant>& without, double* left) {
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
        if (std::ranges::any_of(standstills, [&](const auto& still) {
                return still.from < released[i] && released[i - 1] < still.to;
            })) {
            span.worstStandstill = std::max(span.worstStandstill, ms);
            ++span.standstills;
            continue;
        }
        span.ms.push_back(ms);
        span.worst = std::max(span.worst, ms);
    }
    return span;
}

}  // namespace tessera::bench
