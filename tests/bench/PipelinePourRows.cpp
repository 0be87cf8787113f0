/// Free bodies poured into a bin: milliseconds per frame while they fall, as they pile up and at the end, beside
/// Bullet's dynamics world (its usual solver of ten iterations, hulls with the margin that it gives them, and without)
/// with the same hulls and the same bin.
///
/// They take turns frame by frame. What they simulate is not the same to the last digit: the piles differ.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <random>

#include "common/geometry/Mesh.h"
#include "tests/bench/PipelineBullet.h"
#include "tests/bench/PipelineMotion.h"
#include "tests/bench/PipelineRows.h"

namespace tessera {

namespace {

const Vec3d kGravity(0, -9.81, 0);
constexpr double kSeconds = 1.0 / 60;

/// A floor and four walls, open above; the inside has this side.
MeshArrays3 makeBin(double side) {
    MeshData bin;
    const double thick = 1, height = 40;
    const auto wall = [&](const Vec3d& size, const Vec3d& at) {
        bin.append(makeBox(size), Affine3d(Eigen::Translation3d(at)));
    };
    const double out = side + 2 * thick, off = 0.5 * (side + thick);
    wall({out, thick, out}, {0, -0.5 * thick, 0});
    wall({thick, height, out}, {off, 0.5 * height, 0});
    wall({thick, height, out}, {-off, 0.5 * height, 0});
    wall({side, height, thick}, {0, 0.5 * height, off});
    wall({side, height, thick}, {0, 0.5 * height, -off});
    return {{bin.positions.begin(), bin.positions.end()}, bin.indices};
}

std::vector<Pose> pourPlaces(std::size_t count, double side) {
    std::mt19937_64 random(7);
    const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-53 - 0.5; };
    const int perRow = static_cast<int>(side / 1.3);
    std::vector<Pose> out;
    for (std::size_t i = 0; i < count; ++i) {
        const int k = static_cast<int>(i);
        const Vec3d cell(k % perRow, k / (perRow * perRow), (k / perRow) % perRow);
        Vec3d at = 1.3 * (cell - Vec3d(0.5 * (perRow - 1), 0, 0.5 * (perRow - 1)));
        at += Vec3d(0.2 * uniform(), 2, 0.2 * uniform());
        out.push_back({at, Quatd(uniform(), uniform(), uniform(), uniform() + 1).normalized(), Vec3d::Ones()});
    }
    return out;
}

void pour(std::size_t count, const PipelineOptions& options, CollisionTable& table) {
    const double side = 1.5 * std::cbrt(static_cast<double>(count));
    const std::vector<MeshArrays3> hulls = makeHulls(50, 1);
    const MeshArrays3 bin = makeBin(side);
    PipelineScene scene;
    BulletDynamics bullet(kGravity), bare(kGravity, 0);
    std::vector<std::uint32_t> ourShapes, theirShapes;
    for (const MeshArrays3& hull : hulls) {
        ourShapes.push_back(scene.addShape(hull));
        theirShapes.push_back(bullet.addHull(hull));
        (void)bare.addHull(hull);
    }
    const ObjectId folder = scene.addFolder();
    const ObjectId ground = scene.addGroup(CollisionObject::kStatic, CollisionObject::kTriangles);
    const std::vector<Pose> places = pourPlaces(count, side);
    for (std::size_t i = 0; i < count; ++i) {
        scene.addFreeBody(folder, ourShapes[i % hulls.size()], places[i], 1);
        for (BulletDynamics* world : {&bullet, &bare}) world->addBody(theirShapes[i % hulls.size()], places[i], 1);
    }
    scene.addBody(ground, scene.addShape(bin), Pose());
    for (BulletDynamics* world : {&bullet, &bare}) world->addGround(bin);
    const SceneQuestion question{.response = Interest::kBounce, .detail = Interest::kYesOrNo};
    scene.addInterest(folder, folder, question);
    scene.addInterest(folder, ground, question);
    scene.setGravity(kGravity);
    scene.open();

    const FrameClock clock(Clock::kThread);
    (void)scene.frame({}, clock);
    if (scene.result().counters.freeBodies == 0) {
        fmt::print("  pour {}: left out, the pipeline knows no free bodies\n", count);
        return;
    }
    struct Stage {
        std::string name;
        int end;  ///< the last frame
        std::vector<double> ours, whole, theirs, without;
    };
    const std::array<int, 4> ends =
        options.quick ? std::array<int, 4>{5, 10, 15, 20} : std::array<int, 4>{30, 300, 900, 960};
    std::vector<Stage> stages{{.name = "falling", .end = ends[0]},
                              {.name = "piling up", .end = ends[1]},
                              {.name = "settling", .end = ends[2]},
                              {.name = "at the end", .end = ends[3]}};
    int frame = 0;
    for (Stage& stage : stages) {
        const std::string name = fmt::format("{} ({} to {})", stage.name, frame + 1, stage.end);
        for (; frame < stage.end; ++frame) {
            const FrameTimes taken = scene.frame({}, clock);
            stage.ours.push_back(taken.asked);
            stage.whole.push_back(taken.whole);
            stage.theirs.push_back(clock.seconds([&] { bullet.step(kSeconds); }));
            stage.without.push_back(clock.seconds([&] { bare.step(kSeconds); }));
        }
        const StepCounters& c = scene.result().counters;
        double lowest = 0;
        for (std::uint32_t i = 0; i < count; ++i) lowest = std::min(lowest, scene.poseOf(i).translation.y());
        const auto add = [&](const char* what, const std::vector<double>& seconds, const std::string& remark,
                             bool margin = true) {
            table.add({.pair = fmt::format("pour: {} bodies", count),
                       .operation = name + what,
                       .peer = margin ? "Bullet, dynamics" : "Bullet without margin",
                       .ours = summarise(seconds),
                       .theirs = summarise(margin ? stage.theirs : stage.without),
                       .remark = remark});
        };
        add(", step", stage.ours,
            fmt::format("{} neighbours, {} asleep, lowest at {:.2f}; Bullet: {} manifolds, {} asleep", c.neighbours,
                        c.asleep, lowest, bullet.manifolds(), bullet.asleep()));
        add(", step", stage.ours, fmt::format("{} manifolds, {} asleep", bare.manifolds(), bare.asleep()), false);
        add(", with commit", stage.whole, "");
    }
}

}  // namespace

void pourRows(const PipelineOptions& options, CollisionTable& table) {
    if (options.wants("pour")) pour(options.quick ? 100 : 1'000, options, table);
    if (options.asksFor("pour-large")) pour(options.quick ? 300 : 10'000, options, table);
}

}  // namespace tessera
