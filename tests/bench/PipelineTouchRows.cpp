/// What goes on touching: blocks on a floor, side by side and in touch with four others each, of interest to each other
/// and to the floor. Ten thousand beside a hundred, at rest and with one that is moved in each frame.
#include <fmt/format.h>

#include <cmath>

#include "common/geometry/Mesh.h"
#include "tests/bench/PipelineRace.h"
#include "tests/bench/PipelineRows.h"
#include "tests/bench/PipelineScene.h"

namespace tessera {

namespace {

MeshArrays3 arraysOf(const MeshData& mesh) {
    return {{mesh.positions.begin(), mesh.positions.end()}, mesh.indices};
}

enum class Moves { kNobody, kOne };

class TouchScene final : public FrameContender {
public:
    TouchScene(std::size_t count, Moves moves, std::int64_t mode, std::int64_t detail)
        : scene_(nullptr, CollisionLimits{}), moves_(moves) {
        const auto side = static_cast<std::size_t>(std::sqrt(static_cast<double>(count)));
        const double width = static_cast<double>(side);
        const std::uint32_t block = scene_.addShape(arraysOf(makeBox(Vec3d::Ones())));
        const std::uint32_t floor = scene_.addShape(arraysOf(makeBox(Vec3d(width + 1, 1, width + 1))));
        const ObjectId blocks = scene_.addGroup(CollisionObject::kRigid, CollisionObject::kTriangles);
        const ObjectId ground = scene_.addGroup(CollisionObject::kStatic, CollisionObject::kTriangles);
        for (std::size_t i = 0; i < side * side; ++i) {
            const Vec3d at(static_cast<double>(i % side), 0.5, static_cast<double>(i / side));
            scene_.addBody(blocks, block, {at, Quatd::Identity(), Vec3d::Ones()});
        }
        scene_.addBody(ground, floor, {Vec3d(0.5 * width, -0.5, 0.5 * width), Quatd::Identity(), Vec3d::Ones()});
        scene_.addInterest(blocks, kRootNode, {.mode = mode, .detail = detail});
        scene_.open();
        mover_ = static_cast<std::uint32_t>(side * (side / 2) + side / 2);
    }
    void start() override {
        for (int f = 0; f < 3; ++f) (void)scene_.frame({}, FrameClock(Clock::kThread));
    }
    FrameTimes frame(std::size_t f, const FrameClock& clock) override {
        if (moves_ == Moves::kNobody) return scene_.frame({}, clock);
        // Up and down: off the floor, along its neighbours.
        Pose pose = scene_.poseOf(mover_);
        pose.translation.y() = f % 2 == 0 ? 0.5 : 0.6;
        TentativeTransform wish;
        wish.transform = scene_.transformOf(mover_);
        wish.translation = pose.translation;
        return scene_.frame({wish}, clock);
    }
    void look(std::size_t) override { neighbours = scene_.result().counters.neighbours; }

    std::size_t neighbours = 0;

private:
    PipelineScene scene_;
    Moves moves_;
    std::uint32_t mover_ = 0;
};

void touchRow(const std::string& what, Moves moves, std::int64_t mode, std::int64_t detail,
              const PipelineOptions& options, CollisionTable& table) {
    const std::size_t frames = options.quick ? 6 : 60;
    TouchScene few(100, moves, mode, detail), many(10'000, moves, mode, detail);
    const RaceTimes times = raceFrames(frames, options.passes, {&many, &few});
    table.add({.pair = "in touch: 10,000 beside 100",
               .operation = what + ", step",
               .peer = "ours, a hundredth of them",
               .ours = summarise(times.asked[0]),
               .theirs = summarise(times.asked[1]),
               .remark = fmt::format("{} and {} pairs of neighbours", many.neighbours, few.neighbours)});
}

}  // namespace

void touchRows(const PipelineOptions& options, CollisionTable& table) {
    for (const auto& [name, detail] :
         {std::pair("yes or no", Interest::kYesOrNo), std::pair("contacts", Interest::kAllFaces)}) {
        touchRow(std::string(name) + ", at rest", Moves::kNobody, Interest::kPseudoDynamic, detail, options, table);
        touchRow(std::string(name) + ", one moves", Moves::kOne, Interest::kPseudoDynamic, detail, options, table);
    }
    touchRow("distances, one moves", Moves::kOne, Interest::kDistance, Interest::kYesOrNo, options, table);
}

}  // namespace tessera
