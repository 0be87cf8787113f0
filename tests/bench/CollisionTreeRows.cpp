/// Build, refit, memory.
#include <fmt/format.h>

#include <cmath>
#include <cstdlib>

#include "tests/bench/CollisionBullet.h"
#include "tests/bench/CollisionRows.h"
#include "tests/support/Models.h"

namespace tessera {

namespace {

/// A wave through the body.
std::vector<double> deformed(const std::vector<double>& positions, double phase, double size) {
    std::vector<double> out = positions;
    for (std::size_t v = 0; v + 2 < out.size(); v += 3)
        out[v + 2] += 0.02 * size * std::sin(12 * positions[v] / size + phase);
    return out;
}

void buildRows(const BenchPair& pair, const BenchOptions& options, CollisionTable& table) {
    // What is built is kept to the end, and what it is built from is made before: neither counts.
    const auto runs = static_cast<std::size_t>(options.passes + 1);
    const auto meshOfRun = [&](std::size_t i) -> const TriangleMesh& { return i == 0 ? pair.a : pair.b; };
    const auto race = [&](VolumeKind kind) {
        std::vector<std::vector<TriangleMesh>> meshes(2);
        std::vector<std::vector<BulletGImpactModel>> theirs(2);
        for (std::size_t i = 0; i < 2; ++i)
            for (std::size_t r = 0; r < runs; ++r) {
                meshes[i].push_back(meshOfRun(i));
                theirs[i].emplace_back(meshOfRun(i));
            }
        std::vector<TriangleTree> built;
        built.reserve(2 * runs);
        return raceInTurns(2, options.passes,
                           {[&](std::size_t i) {
                                built.emplace_back(std::move(meshes[i].back()), TreeOptions{.volume = kind});
                                meshes[i].pop_back();
                            },
                            [&](std::size_t i) { theirs[i].back().build(); },
                            // The next pass builds the next; freeing it is not theirs to pay.
                            [&](std::size_t i) { theirs[i].pop_back(); }});
    };
    const struct {
        VolumeKind kind;
        const char* name;
        bool claim;
    } kinds[] = {{TreeOptions{}.volume, "build", true},
                 {VolumeKind::kAabb, "build, AABB", false},
                 {VolumeKind::kDop18, "build, 18-DOP", false}};
    for (const auto& kind : kinds) {
        const auto times = race(kind.kind);
        table.add({.pair = pair.name,
                   .operation = kind.name,
                   .peer = "Bullet GImpact",
                   .ours = summarise(times[0]),
                   .theirs = summarise(times[1]),
                   .atMost = kind.claim ? 1.0 : 0,
                   .aim = kind.claim ? 0.4 : 0});
    }
}

void refitRow(const BenchPair& pair, const BenchOptions& options, CollisionTable& table) {
    const MeshArrays3 arrays = arraysOf(pair.a);
    TESSERA_CHECK(arrays.positions.size() == 3 * pair.a.vertexCount(), "vertices that are alike, or unused");
    TriangleTree tree(pair.a, {.volume = VolumeKind::kDop18});
    FclDeformingModel fcl(pair.a);
    const double size = pair.a.bounds().size().norm();
    std::vector<std::vector<Vec3d>> ours;
    std::vector<std::vector<double>> theirs;
    for (std::size_t i = 0; i < 10; ++i) {
        theirs.push_back(deformed(arrays.positions, 0.3 * static_cast<double>(i), size));
        ours.emplace_back();
        for (std::size_t v = 0; v < theirs.back().size(); v += 3)
            ours.back().emplace_back(theirs.back()[v], theirs.back()[v + 1], theirs.back()[v + 2]);
    }
    fcl.prepare(theirs);
    const auto times = raceInTurns(ours.size(), options.passes,
                                   {[&](std::size_t i) {
                                        if (!tree.refit(ours[i])) std::abort();
                                    },
                                    [&](std::size_t i) { fcl.refit(i); }});
    table.add({.pair = pair.name,
               .operation = "refit, 18-DOP",
               .peer = "FCL KDOP18, bottom up",
               .ours = summarise(times[0]),
               .theirs = summarise(times[1]),
               .atMost = 0.09,
               .aim = 0.045,
               .remark = fmt::format("decay {:.2f} in the last state", tree.decay())});
}

}  // namespace

void memoryRows(const BenchPair& pair, CollisionTable& table) {
    const auto faces = static_cast<double>(pair.a.faceCount());
    const double theirs = static_cast<double>(fclObbBytes(pair.a)) / faces;
    const auto row = [&](const char* operation, VolumeKind kind, bool claim) {
        const double ours = static_cast<double>(TriangleTree(pair.a, {.volume = kind}).memoryBytes()) / faces;
        table.add({.pair = pair.name,
                   .operation = operation,
                   .peer = "FCL OBB",
                   .ours = {ours, ours, ours},
                   .theirs = {theirs, theirs, theirs},
                   .unit = "bytes",
                   .atMost = claim ? 0.3 : 0,
                   .aim = claim ? 0.15 : 0});
    };
    row("memory per triangle", TreeOptions{}.volume, true);
    row("memory per triangle, AABB", VolumeKind::kAabb, false);
    row("memory per triangle, 18-DOP", VolumeKind::kDop18, false);
}

void treeRows(const BenchPair& pair, const BenchOptions& options, CollisionTable& table) {
    buildRows(pair, options, table);
    refitRow(pair, options, table);
    memoryRows(pair, table);
}

}  // namespace tessera
