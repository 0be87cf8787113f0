/// Ten balls of 168 faces that deform in every frame within a plant of 357,000 triangles, and whoever is interested wants to
/// know when they first touch: beside the same ten where the plant has one face in a thousand.
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
        const Vec3d p(swell * std::sin(polar) * std::cos(turn), std::cos(polar), swell * std::sin(polar) * std::sin(turn));
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
               .remark = fmt::format("{} faces; a frame: {:.1f} neighbours, {:.1f} touch, {:.1f} on the way; {} not looked at",
                                     faces, mean(many.neighbours), mean(many.touching), mean(many.onTheWay),
                                     many.notLookedAt)});
}

}  // namespace tessera
