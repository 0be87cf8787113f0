/// Ten times more that stands still: a frame of a hundred moving rings among 1,000 standing bodies, beside the same
/// frame where 9,000 more stand farther away. What moves meets the same bodies in both.
#include <fmt/format.h>

#include <cmath>

#include "common/geometry/Mesh.h"
#include "tests/bench/PipelineMotion.h"
#include "tests/bench/PipelineRace.h"
#include "tests/bench/PipelineRows.h"

namespace tessera {

namespace {

constexpr std::size_t kMovers = 100;
constexpr double kSpacing = 2;  ///< of what stands, on a grid
constexpr int kNearSide = 10;   ///< the nearest 1,000 are a cube of this many bodies

MeshArrays3 arraysOf(const MeshData& mesh) {
    return {{mesh.positions.begin(), mesh.positions.end()}, mesh.indices};
}

/// Cubes of the grid in shells about the middle, the near cube first, so that more bodies are farther ones.
std::vector<Vec3d> standingPlaces(std::size_t count) {
    std::vector<Vec3d> out;
    for (int side = kNearSide; out.size() < count; side += 2) {
        const int from = (kNearSide - side) / 2, to = from + side;
        for (int x = from; x < to; ++x)
            for (int y = from; y < to; ++y)
                for (int z = from; z < to; ++z) {
                    const bool within =
                        side > kNearSide && x > from && x < to - 1 && y > from && y < to - 1 && z > from && z < to - 1;
                    if (!within && out.size() < count) out.push_back(kSpacing * Vec3d(x, y, z));
                }
    }
    return out;
}

enum class Standing { kStatic, kAsleep };

class RestScene final : public FrameContender {
public:
    RestScene(const BodyFrames& frames, std::size_t standing, Standing kind, std::int64_t detail) {
        const std::uint32_t ring = scene_.addShape(arraysOf(makeTorus(0.7, 0.25, 40, 20)));
        const std::uint32_t block = scene_.addShape(arraysOf(makeCylinder(0.5, 1, 24)));
        const ObjectId movers = scene_.addGroup(CollisionObject::kRigid, CollisionObject::kTriangles);
        for (const Pose& pose : frames.poses[0]) scene_.addBody(movers, ring, pose);
        const bool free = kind == Standing::kAsleep;
        const ObjectId others =
            free ? scene_.addFolder() : scene_.addGroup(CollisionObject::kStatic, CollisionObject::kTriangles);
        for (const Vec3d& place : standingPlaces(standing)) {
            const Pose pose{place, Quatd::Identity(), Vec3d::Ones()};
            free ? scene_.addFreeBody(others, block, pose, 1) : scene_.addBody(others, block, pose);
        }
        scene_.addInterest(movers, others, {.detail = detail});
        scene_.open();
        wishes_ = frames.wishes(scene_);
    }
    /// Without gravity and pushes nobody needs more than a second to fall asleep.
    void settle() {
        for (int f = 0; f < 60; ++f) (void)scene_.frame(wishes_[0], FrameClock(Clock::kThread));
    }
    void start() override {
        scene_.put(wishes_[0]);
        (void)scene_.frame(wishes_[0], FrameClock(Clock::kThread));
    }
    FrameTimes frame(std::size_t f, const FrameClock& clock) override { return scene_.frame(wishes_[f], clock); }
    void look(std::size_t) override {
        const StepResult& r = scene_.result();
        contacts += r.contacts.size();
        touching += scene_.touching().size();
        neighbours += r.counters.neighbours;
        asleep = r.counters.asleep;
        freeBodies = r.counters.freeBodies;
    }

    std::size_t contacts = 0, touching = 0, neighbours = 0, asleep = 0, freeBodies = 0;

private:
    PipelineScene scene_;
    std::vector<std::vector<TentativeTransform>> wishes_;
};

void restRow(const std::string& what, Standing kind, std::int64_t detail, const PipelineOptions& options,
             CollisionTable& table) {
    const std::size_t frames = options.quick ? 10 : 60;
    // Within the near cube, a little from its sides, where the farther bodies are not met.
    BodyFrames flight = flyingBodies(kMovers, 1, 1, frames, 5);
    const double flightSide = std::cbrt(static_cast<double>(kMovers));
    const double innerSide = kSpacing * (kNearSide - 1) - 4;
    for (std::vector<Pose>& poses : flight.poses)
        for (Pose& pose : poses) pose.translation = Vec3d::Constant(2) + innerSide / flightSide * pose.translation;
    RestScene few(flight, 1'000, kind, detail), many(flight, 10'000, kind, detail);
    if (kind == Standing::kAsleep) {
        few.settle();
        many.settle();
        few.start();
        (void)few.frame(1, FrameClock(Clock::kThread));
        few.look(1);
        if (few.freeBodies == 0) {
            fmt::print("  {}: left out, the pipeline knows no free bodies\n", what);
            return;
        }
        few.contacts = few.touching = few.neighbours = 0;
    }
    const RaceTimes times = raceFrames(frames, 4 * options.passes, {&many, &few});
    if (few.contacts != many.contacts || few.touching != many.touching)
        table.complain(fmt::format("{}: {} pairs and {} contacts among few, {} and {} among many", what, few.touching,
                                   few.contacts, many.touching, many.contacts));
    const std::string remark =
        fmt::format("{:.0f} pairs touch, {:.0f} contacts, {:.0f} neighbours a frame; asleep {} and {}",
                    static_cast<double>(few.touching) / static_cast<double>(frames),
                    static_cast<double>(few.contacts) / static_cast<double>(frames),
                    static_cast<double>(few.neighbours) / static_cast<double>(frames), many.asleep, few.asleep);
    const auto add = [&](const std::string& name, const RaceTimes& t, bool whole, double atMost) {
        const auto& s = whole ? t.whole : t.asked;
        table.add({.pair = "at rest: 10,000 beside 1,000",
                   .operation = what + name,
                   .peer = "ours, a tenth of them",
                   .ours = summarise(s[0]),
                   .theirs = summarise(s[1]),
                   .atMost = atMost,
                   .aim = atMost,
                   .remark = whole ? "" : remark});
    };
    add(", step", times, false, 1.05);
    add(", with commit", times, true, 1.05);
}

}  // namespace

void restRows(const PipelineOptions& options, CollisionTable& table) {
    restRow("static, yes or no", Standing::kStatic, Interest::kYesOrNo, options, table);
    restRow("static, contacts", Standing::kStatic, Interest::kAllFaces, options, table);
    restRow("asleep, yes or no", Standing::kAsleep, Interest::kYesOrNo, options, table);
}

}  // namespace tessera
