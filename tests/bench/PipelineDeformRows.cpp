/// Ten balls of 168 faces that deform in every frame within a plant of 357,000 triangles, and whoever is interested
/// wants to know when they first touch: beside the same ten where the plant has one face in a thousand.
#include <fmt/format.h>

#include <cmath>

#include "tests/bench/PipelineMotion.h"
#include "tests/bench/PipelineRace.h"
#include "tests/bench/PipelineRows.h"

namespace tessera {

namespace {

constexpr std::size_t kBalls = 10;
constexpr int kRings = 8, kSegments = 12;  ///< 168 faces

/// About the origin; `swell` is its radius at the equator beside that at the poles.
MeshArrays3 ball(double radius, double swell) {
    constexpr double kPi = 3.14159265358979323846;
    MeshArrays3 out;
    const auto add = [&](double polar, double turn) {
        const Vec3d p(swell * std::sin(polar) * std::cos(turn), std::cos(polar),
                      swell * std::sin(polar) * std::sin(turn));
        for (int a = 0; a < 3; ++a) out.positions.push_back(radius * p[a]);
    };
    add(0, 0);
    for (int r = 1; r < kRings; ++r)
        for (int s = 0; s < kSegments; ++s) add(kPi * r / kRings, 2 * kPi * s / kSegments);
    add(kPi, 0);
    const auto at = [](int r, int s) { return static_cast<std::uint32_t>(1 + (r - 1) * kSegments + s % kSegments); };
    const auto last = static_cast<std::uint32_t>(out.positions.size() / 3 - 1);
    for (int s = 0; s < kSegments; ++s) {
        out.indices.insert(out.indices.end(), {0, at(1, s + 1), at(1, s)});
        for (int r = 1; r + 1 < kRings; ++r)
            out.indices.insert(out.indices.end(),
                               {at(r, s), at(r, s + 1), at(r + 1, s), at(r, s + 1), at(r + 1, s + 1), at(r + 1, s)});
        out.indices.insert(out.indices.end(), {last, at(kRings - 1, s), at(kRings - 1, s + 1)});
    }
    return out;
}

class DeformScene final : public FrameContender {
public:
    DeformScene(const std::vector<TriangleMesh>& plant, double size, const std::vector<Pose>& places)
        : scene_(nullptr, CollisionLimits{}), radius_(0.01 * size) {
        const ObjectId balls = scene_.addGroup(CollisionObject::kDeforming, CollisionObject::kTriangles);
        for (std::size_t i = 0; i < kBalls; ++i) {
            // Geometries are shared, not deformed, where they are alike: each ball has a shape of its own.
            shapes_.push_back(scene_.addShape(ball(radius_, 1 + 1e-3 * static_cast<double>(i))));
            scene_.addBody(balls, shapes_.back(), places[i]);
        }
        const ObjectId hall = scene_.addGroup(CollisionObject::kStatic, CollisionObject::kTriangles);
        for (const TriangleMesh& mesh : plant) scene_.addBody(hall, scene_.addShape(arraysOf(mesh)), Pose());
        scene_.addInterest(balls, hall, {.mode = Interest::kDynamic, .detail = Interest::kYesOrNo});
        scene_.open();
    }
    void start() override {
        for (int f = 0; f < 2; ++f) (void)scene_.frame({}, FrameClock(Clock::kThread));
    }
    FrameTimes frame(std::size_t f, const FrameClock& clock) override {
        for (std::size_t i = 0; i < kBalls; ++i) {
            const double phase = 0.2 * static_cast<double>(f) + static_cast<double>(i);
            scene_.deform(shapes_[i], ball(radius_, 1 + 0.2 * std::sin(phase)).positions);
        }
        return scene_.frame({}, clock);
    }
    void look(std::size_t) override {
        const StepResult& r = scene_.result();
        neighbours += r.counters.neighbours;
        notLookedAt += r.counters.notLookedAt;
        touching += scene_.touching().size();
        for (const PairEvent& event : r.events) onTheWay += event.firstTime < 1;
    }
    std::size_t neighbours = 0, touching = 0, onTheWay = 0, notLookedAt = 0;

private:
    PipelineScene scene_;
    double radius_;
    std::vector<std::uint32_t> shapes_;
};

/// A cloth over a box; some rows of its vertices, or all of them, move in every frame.
class ClothScene final : public FrameContender {
public:
    ClothScene(std::uint32_t side, std::uint32_t rowsMoved, std::int64_t volume)
        : scene_(nullptr, CollisionLimits{}), side_(side), rows_(rowsMoved) {
        MeshArrays3 cloth;
        for (std::uint32_t y = 0; y < side; ++y)
            for (std::uint32_t x = 0; x < side; ++x)
                cloth.positions.insert(cloth.positions.end(), {at(x), 0.02 * std::sin(0.1 * x), at(y)});
        for (std::uint32_t y = 0; y + 1 < side; ++y)
            for (std::uint32_t x = 0; x + 1 < side; ++x) {
                const std::uint32_t i = y * side + x;
                cloth.indices.insert(cloth.indices.end(), {i, i + side, i + 1, i + 1, i + side, i + side + 1});
            }
        const ObjectId cloths = scene_.addGroup(CollisionObject::kDeforming, CollisionObject::kTriangles, volume);
        shape_ = scene_.addShape(cloth);
        scene_.addBody(cloths, shape_, Pose());
        const ObjectId below = scene_.addGroup(CollisionObject::kStatic, CollisionObject::kTriangles, volume);
        scene_.addBody(below, scene_.addShape(ball(0.1, 1)), Pose{.translation = Vec3d(0, -0.11, 0)});
        scene_.addInterest(cloths, below, {.mode = Interest::kPseudoDynamic, .detail = Interest::kYesOrNo});
        scene_.open();
    }
    void start() override {
        for (int f = 0; f < 2; ++f) (void)frame(1, FrameClock(Clock::kThread));
    }
    FrameTimes frame(std::size_t f, const FrameClock& clock) override {
        const std::uint32_t first = side_ / 2 * side_;
        std::vector<float> moved;
        for (std::uint32_t i = 0; i < rows_ * side_; ++i) {
            const std::uint32_t vertex = rows_ == side_ ? i : first + i, x = vertex % side_, y = vertex / side_;
            const double height = 0.02 * std::sin(0.1 * x) + 0.002 * std::sin(0.3 * static_cast<double>(f) + y);
            for (const double value : {at(x), height, at(y)}) moved.push_back(static_cast<float>(value));
        }
        // What a frame does for it: the edit, and the step.
        FrameTimes times;
        times.asked = clock.seconds([&] {
            scene_.deform(shape_, rows_ == side_ ? 0 : first, moved);
            (void)scene_.frame({}, clock);
        });
        return times;
    }
    void look(std::size_t) override { touching += scene_.touching().size(); }
    std::size_t touching = 0;

private:
    [[nodiscard]] double at(std::uint32_t i) const { return static_cast<double>(i) / side_ - 0.5; }
    PipelineScene scene_;
    std::uint32_t side_, rows_, shape_ = 0;
};

void clothRows(const PipelineOptions& options, CollisionTable& table) {
    const std::uint32_t side = options.quick ? 150 : 500;
    const std::size_t frames = options.quick ? 6 : 30;
    struct Named {
        const char* name;
        std::int64_t volume;
    };
    for (const Named& kind : {Named{"14-dop", CollisionObject::kDop14}, Named{"obb", CollisionObject::kObb}}) {
        ClothScene some(side, 1, kind.volume), all(side, side, kind.volume);
        const RaceTimes times = raceFrames(frames, options.passes, {&some, &all});
        table.add({.pair = fmt::format("cloth of {} faces x ball, {}", 2 * (side - 1) * (side - 1), kind.name),
                   .operation = "deforming, one row of vertices",
                   .peer = "ours, all vertices",
                   .ours = summarise(times.asked[0]),
                   .theirs = summarise(times.asked[1]),
                   .remark = fmt::format("{} of {} vertices move; edit and step; touching in {} and {} frames", side,
                                         side * side, some.touching, all.touching)});
    }
}

/// About one face in a thousand, one at least of each mesh.
std::vector<TriangleMesh> thinned(const std::vector<TriangleMesh>& meshes) {
    std::vector<TriangleMesh> out;
    for (const TriangleMesh& mesh : meshes) {
        MeshArrays3 arrays;
        for (std::uint32_t face = 0; face < mesh.faceCount(); face += 1000)
            for (const Vec3d& p : mesh.triangle(face)) {
                arrays.indices.push_back(static_cast<std::uint32_t>(arrays.indices.size()));
                arrays.positions.insert(arrays.positions.end(), {p.x(), p.y(), p.z()});
            }
        out.push_back(meshOf(arrays));
    }
    return out;
}

}  // namespace

void deformRows(const PipelineOptions& options, CollisionTable& table) {
    clothRows(options, table);
    const Expected<std::vector<TriangleMesh>> plant = readPlant(options.plant);
    if (!plant) {
        fmt::print("\nballs in a plant: left out: {}\n", plant.error().message);
        return;
    }
    Box box;
    std::size_t faces = 0;
    for (const TriangleMesh& mesh : *plant) {
        box.extend(mesh.bounds());
        faces += mesh.faceCount();
    }
    const double size = box.size().norm();
    const std::size_t frames = options.quick ? 6 : 40;
    const std::vector<Pose> places = swingingParts(std::vector<double>(kBalls, 0.02 * size), *plant, 1, 7).poses[0];
    DeformScene many(*plant, size, places), few(thinned(*plant), size, places);
    const RaceTimes times = raceFrames(frames, options.passes, {&many, &few});
    const auto mean = [&](std::size_t sum) { return static_cast<double>(sum) / static_cast<double>(frames); };
    table.add({.pair = fmt::format("balls x plant: {} x {}", kBalls, plant->size()),
               .operation = "deforming, dynamic, step",
               .peer = "ours, a thousandth of the faces",
               .ours = summarise(times.asked[0]),
               .theirs = summarise(times.asked[1]),
               .remark = fmt::format(
                   "{} faces; a frame: {:.1f} neighbours, {:.1f} touch, {:.1f} on the way; {} not looked at", faces,
                   mean(many.neighbours), mean(many.touching), mean(many.onTheWay), many.notLookedAt)});
}

}  // namespace tessera
