/// One awake body beside 1,000 and 100,000 that sleep: blocks on a grid, without gravity, and one that flies over them.
/// Beside each other, and each beside Bullet's dynamics world with the same bodies.
#include <fmt/format.h>

#include <cmath>

#include "common/geometry/Mesh.h"
#include "tests/bench/PipelineBullet.h"
#include "tests/bench/PipelineRace.h"
#include "tests/bench/PipelineRows.h"
#include "tests/bench/PipelineScene.h"

namespace tessera {

namespace {

constexpr double kSeconds = 1.0 / 60;
const Vec3d kFlight(1.5, 0, 0);  ///< over less than two blocks in a second

MeshArrays3 block() {
    const MeshData box = makeBox(Vec3d::Ones());
    return {{box.positions.begin(), box.positions.end()}, box.indices};
}

/// On a square grid about the origin, a unit of space between two.
std::vector<Pose> grid(std::size_t count) {
    const auto side = static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(count))));
    std::vector<Pose> out;
    for (std::size_t i = 0; i < count; ++i) {
        const double x = static_cast<double>(i % side) - 0.5 * static_cast<double>(side),
                     z = static_cast<double>(i / side) - 0.5 * static_cast<double>(side);
        out.push_back({Vec3d(2 * x, 0, 2 * z), Quatd::Identity(), Vec3d::Ones()});
    }
    return out;
}

const Pose kStart{Vec3d(0.3, 1.2, 0.4), Quatd::Identity(), Vec3d::Ones()};

class Sleepers final : public FrameContender {
public:
    explicit Sleepers(std::size_t count) {
        const std::uint32_t shape = scene_.addShape(block());
        const ObjectId folder = scene_.addFolder();
        scene_.addFreeBody(folder, shape, kStart, 1, kFlight);
        for (const Pose& pose : grid(count)) scene_.addFreeBody(folder, shape, pose, 1);
        scene_.addInterest(folder, folder, {.response = Interest::kBounce, .detail = Interest::kYesOrNo});
        scene_.setGravity(Vec3d::Zero());
        scene_.open();
        // Nobody pushes them: a second is enough to fall asleep.
        for (int f = 0; f < 60; ++f) (void)scene_.frame({}, FrameClock(Clock::kThread));
    }
    void start() override {
        TentativeTransform back;
        back.transform = scene_.transformOf(0);
        back.translation = kStart.translation;
        scene_.put({back});
        (void)scene_.frame({}, FrameClock(Clock::kThread));
    }
    FrameTimes frame(std::size_t, const FrameClock& clock) override { return scene_.frame({}, clock); }
    void look(std::size_t) override { counters = scene_.result().counters; }

    StepCounters counters;

private:
    PipelineScene scene_;
};

class BulletSleepers final : public FrameContender {
public:
    explicit BulletSleepers(std::size_t count) : world_(Vec3d::Zero()) {
        const std::uint32_t shape = world_.addHull(block());
        world_.addBody(shape, kStart, 1, kFlight);
        for (const Pose& pose : grid(count)) world_.addBody(shape, pose, 1);
        world_.putToSleep();
        world_.step(kSeconds);
    }
    void start() override {}
    FrameTimes frame(std::size_t, const FrameClock& clock) override {
        const double seconds = clock.seconds([&] { world_.step(kSeconds); });
        return {seconds, seconds};
    }
    void look(std::size_t) override { asleep = world_.asleep(); }

    std::size_t asleep = 0;

private:
    BulletDynamics world_;
};

}  // namespace

void sleepRows(const PipelineOptions& options, CollisionTable& table) {
    const std::size_t fewCount = 1'000, manyCount = options.quick ? 10'000 : 100'000;
    // In a second it passes over as many blocks in either.
    const std::size_t frames = options.quick ? 10 : 60;
    Sleepers few(fewCount), many(manyCount);
    BulletSleepers theirFew(fewCount), theirMany(manyCount);
    const RaceTimes times = raceFrames(frames, options.passes, {&many, &few, &theirMany, &theirFew});
    if (many.counters.asleep != manyCount || few.counters.asleep != fewCount)
        table.complain(fmt::format("{} and {} are asleep", few.counters.asleep, many.counters.asleep));
    const auto add = [&](const std::string& what, const std::string& peer, std::size_t ours, std::size_t theirs,
                         double atMost, const std::string& remark) {
        table.add({.pair = fmt::format("one awake among {} and {} asleep", fewCount, manyCount),
                   .operation = what,
                   .peer = peer,
                   .ours = summarise(times.asked[ours]),
                   .theirs = summarise(times.asked[theirs]),
                   .atMost = atMost,
                   .aim = atMost,
                   .remark = remark});
    };
    add(fmt::format("{} sleepers, step", manyCount), fmt::format("ours, {}", fewCount), 0, 1, 1.05,
        fmt::format("{} and {} neighbours", many.counters.neighbours, few.counters.neighbours));
    add(fmt::format("{} sleepers, step", manyCount), "Bullet, dynamics", 0, 2, 0,
        fmt::format("{} asleep there", theirMany.asleep));
    add(fmt::format("{} sleepers, step", fewCount), "Bullet, dynamics", 1, 3, 0,
        fmt::format("{} asleep there", theirFew.asleep));
}

}  // namespace tessera
