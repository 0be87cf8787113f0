// Catmull-Clark bodies as they are, beside OpenSubdiv's tessellations of them in our own triangle trees: do they touch,
// to 1e-4 of their size, and how far apart are they? Rigid, where trees are there already, and deforming, where they
// are built anew in each frame.
//
// Tessellations are grids of limit points (OpenSubdiv's Bfr), the same in every ptex face, the first power of two of
// which 99 facets in a hundred are within the tolerance. The others lie at irregular vertices, where an adaptive
// tessellation would divide further: in the peer's favour. Deformations are affine maps of all control points, so that
// the tessellation of a frame is the map of the first one: what OpenSubdiv's evaluation would cost is not counted, in
// the peer's favour. Poses: separated, near, shallow and deep in equal parts.
//
//     bench_freeform [--rows collision|tessellation] [--quick] [--count N] [--json FILE]
#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "common/freeform/subdivision/LimitEvaluator.h"
#include "server/collision/freeform/FreeformQuery.h"
#include "server/collision/query/DistanceQuery.h"
#include "server/collision/query/TouchQuery.h"
#include "server/tools/evaluate/ObjControlMesh.h"
#include "tests/bench/CollisionTable.h"
#include "tests/bench/FreeformTessellationRows.h"
#include "tests/support/Models.h"
#include "tests/support/PoseGenerator.h"
#include "tests/truth/subdivision/SubdivisionOracle.h"

namespace tessera {
namespace {

constexpr double kTolerance = 1e-4;  // of bodies of diagonal 1

/// About its origin, of diagonal 1.
Expected<ControlMesh> loadControlMesh(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    if (!in) return fail(ErrorCode::kNotFound, file.string() + ": it cannot be opened");
    std::stringstream text;
    text << in.rdbuf();
    Expected<ObjControlMesh> mesh = parseObjControlMesh(text.str(), file.string(), SubdivisionScheme::kCatmullClark);
    if (!mesh) return tl::unexpected(mesh.error());
    Box box;
    for (const Vec3d& p : mesh->mesh.positions) box.extend(p);
    for (Vec3d& p : mesh->mesh.positions) p = (p - box.center()) / box.size().norm();
    return std::move(mesh->mesh);
}

struct Grid {
    std::vector<double> positions;
    std::vector<std::uint32_t> indices;
    int perSide = 0;
    double error = 0, usualError = 0;  ///< of the worst facet, and of 99 in a hundred at most
};

/// Where OpenSubdiv is not there, our own limit points: the same to 1e-6.
Grid tessellate(const ControlMesh& mesh) {
    const SubdivisionTopology topology = SubdivisionTopology::build(mesh).value();
    LimitEvaluator ours(topology);
    std::unique_ptr<test::SubdivisionOracle> theirs;
    if (test::hasOpenSubdiv()) theirs = std::make_unique<test::SubdivisionOracle>(mesh, 8);
    const auto at = [&](std::uint32_t f, double u, double v) {
        if (theirs)
            if (const auto p = theirs->bfr(f, u, v)) return p->point;
        return ours.evaluate(mesh.positions, {f, u, v}).value().point;
    };
    for (int n = 4;; n *= 2) {
        Grid grid;
        grid.perSide = n;
        std::vector<double> errors;
        for (std::uint32_t f = 0; f < topology.ptexFaceCount(); ++f) {
            if (!topology.hasSurface(topology.ptexFace(f).face)) continue;
            const auto base = static_cast<std::uint32_t>(grid.positions.size() / 3);
            std::vector<Vec3d> points;
            for (int j = 0; j <= n; ++j)
                for (int i = 0; i <= n; ++i)
                    points.push_back(at(f, static_cast<double>(i) / n, static_cast<double>(j) / n));
            for (int j = 0; j < n; ++j)
                for (int i = 0; i < n; ++i) {
                    const auto a = static_cast<std::uint32_t>(j * (n + 1) + i), b = a + 1,
                               d = a + static_cast<std::uint32_t>(n) + 1, c = d + 1;
                    for (const std::uint32_t v : {a, b, c, a, c, d}) grid.indices.push_back(base + v);
                    // The middle of the diagonal is where a facet is farthest off.
                    errors.push_back((at(f, (i + 0.5) / n, (j + 0.5) / n) - 0.5 * (points[a] + points[c])).norm());
                }
            for (const Vec3d& p : points) grid.positions.insert(grid.positions.end(), {p.x(), p.y(), p.z()});
        }
        std::sort(errors.begin(), errors.end());
        grid.error = errors.back();
        grid.usualError = errors[errors.size() * 99 / 100];
        if (grid.usualError <= kTolerance || n >= 64) return grid;
    }
}

struct Body {
    ControlMesh control;
    Grid grid;
    FreeformShape shape;
    std::size_t heldBytes;  // by the shape, its topology and what it knows of neighbourhoods
    TriangleTree tree;
};
Body bodyOf(const ControlMesh& control) {
    Grid grid = tessellate(control);
    const auto before = mallinfo2();
    FreeformShape shape = FreeformShape::ofSubdivision(control).value();
    const auto after = mallinfo2();
    TriangleMesh mesh = TriangleMesh::make(std::span<const double>(grid.positions), grid.indices).value();
    return {control, std::move(grid), std::move(shape), after.uordblks - before.uordblks,
            TriangleTree(std::move(mesh))};
}

/// All control points move: stretched and sheared, a little more in each frame.
Affine3d deformation(std::size_t frame) {
    Affine3d m = Affine3d::Identity();
    const double phase = 0.3 * static_cast<double>(frame);
    m.linear() << 1 + 0.1 * std::sin(phase), 0.1 * std::cos(phase), 0, 0, 1 - 0.1 * std::cos(phase), 0.05,
        0.05 * std::sin(phase), 0, 1;
    return m;
}

Summary inKibibytes(std::size_t bytes) {
    return {static_cast<double>(bytes) / 1024, static_cast<double>(bytes) / 1024, static_cast<double>(bytes) / 1024};
}

void measure(const std::string& nameA, const std::string& nameB, const ControlMesh& controlA,
             const ControlMesh& controlB, std::size_t count, int passes, CollisionTable& table) {
    Body a = bodyOf(controlA), b = bodyOf(controlB);
    const std::string title = fmt::format("{} x {}: {} x {} faces, {} x {} triangles (off by {:.2g}, {:.2g})", nameA,
                                          nameB, a.shape.faceCount(), b.shape.faceCount(), a.tree.mesh().faceCount(),
                                          b.tree.mesh().faceCount(), a.grid.error, b.grid.error);
    const std::vector<TestPose> poses = makePoses(ownOracle(a.tree, b.tree), count, 7);
    FreeformPair pair(a.shape, b.shape);
    std::vector<Touch> touches(count), treeTouches(count);
    std::vector<FreeformDistance> distances(count);
    std::vector<double> treeDistances(count);
    std::size_t most = 0;
    const auto rigid = raceInTurns(
        count, passes,
        {[&](std::size_t i) {
             QueryWork work;
             touches[i] = pair.touch(poses[i].a_T_b.matrix(), kTolerance, work).touch;
             most = std::max(most, pair.memoryBytes());
         },
         [&](std::size_t i) {
             QueryWork work;
             treeTouches[i] = firstTouching(a.tree, b.tree, poses[i].a_T_b.matrix(), work).touch;
         },
         [&](std::size_t i) {
             QueryWork work;
             distances[i] = pair.distance(poses[i].a_T_b.matrix(), work, {.tolerance = kTolerance});
         },
         [&](std::size_t i) {
             QueryWork work;
             treeDistances[i] =
                 distanceBetween(a.tree, b.tree, poses[i].a_T_b.matrix(), work, {.tolerance = kTolerance}).distance;
         }});
    const double off = 2 * (a.grid.error + b.grid.error) + kTolerance;  // between samples it may be more
    for (std::size_t i = 0; i < count; ++i) {
        const bool apart = treeDistances[i] > 2 * off;
        if (apart == (touches[i] == Touch::kYes) && (apart || treeTouches[i] == Touch::kYes))
            table.complain(fmt::format("{}, pose {}: we touch {}, triangles are {} apart", title, i,
                                       static_cast<int>(touches[i]), treeDistances[i]));
        if (std::abs(distances[i].distance - treeDistances[i]) > 2 * off)
            table.complain(
                fmt::format("{}, pose {}: distance {} and {}", title, i, distances[i].distance, treeDistances[i]));
    }
    const auto ofClass = [&](const std::vector<double>& seconds, int closeness) {
        std::vector<double> out;
        for (std::size_t i = 0; i < count; ++i)
            if (closeness < 0 || static_cast<int>(poses[i].closeness) == closeness) out.push_back(seconds[i]);
        return summarise(out);
    };
    const std::string peer = "own tree", builds = "own tree, built";
    const auto row = [&](const std::string& what, std::size_t k, int closeness, double atMost, double aim) {
        table.add({.pair = title,
                   .operation = what,
                   .peer = peer,
                   .ours = ofClass(rigid[k], closeness),
                   .theirs = ofClass(rigid[k + 1], closeness),
                   .atMost = atMost,
                   .aim = aim});
    };
    row("rigid, touch at 1e-4", 0, -1, 1.0, 0.5);
    row("rigid, distance", 2, -1, 1.0, 0.5);
    for (const Closeness closeness : {Closeness::kSeparated, Closeness::kNear, Closeness::kShallow, Closeness::kDeep}) {
        row("rigid, touch, " + std::string(name(closeness)), 0, static_cast<int>(closeness), 0, 0);
        row("rigid, distance, " + std::string(name(closeness)), 2, static_cast<int>(closeness), 0, 0);
    }
    const std::size_t trees = a.tree.memoryBytes() + b.tree.memoryBytes(),
                      shapes = a.shape.memoryBytes() + b.shape.memoryBytes();
    table.add({.pair = title,
               .operation = "memory: control points and boxes",
               .peer = peer,
               .ours = inKibibytes(shapes),
               .theirs = inKibibytes(trees),
               .unit = "KiB"});
    table.add({.pair = title,
               .operation = "memory: with topology",
               .peer = peer,
               .ours = inKibibytes(a.heldBytes + b.heldBytes),
               .theirs = inKibibytes(trees),
               .unit = "KiB",
               .atMost = 0.02});
    table.add({.pair = title,
               .operation = "memory: parts kept",
               .peer = peer,
               .ours = inKibibytes(most),
               .theirs = inKibibytes(trees),
               .unit = "KiB"});

    // Deforming: a frame is the new positions and the question.
    const std::size_t frames = std::min<std::size_t>(count, 8);
    const auto mapped = [](std::span<const Vec3d> points, const Affine3d& m) {
        std::vector<Vec3d> out;
        for (const Vec3d& p : points) out.push_back(m * p);
        return out;
    };
    const auto meshOfFrame = [](const Grid& grid, const Affine3d& m) {
        std::vector<double> positions;
        for (std::size_t i = 0; i < grid.positions.size(); i += 3) {
            const Vec3d p = m * Vec3d(grid.positions[i], grid.positions[i + 1], grid.positions[i + 2]);
            positions.insert(positions.end(), {p.x(), p.y(), p.z()});
        }
        return TriangleMesh::make(std::span<const double>(positions), grid.indices).value();
    };
    const auto oursOfFrame = [&](std::size_t i) {
        const Affine3d m = deformation(i);
        (void)(a.shape.move(mapped(a.control.positions, m)) && b.shape.move(mapped(b.control.positions, m)));
    };
    for (const bool distance : {false, true}) {
        std::vector<double> ours(frames), theirs(frames);
        const CallTimer timer;
        std::vector<double> ourTime(frames, 1e9), theirTime(frames, 1e9);
        for (int pass = 0; pass < std::max(1, passes - 1); ++pass)
            for (std::size_t i = 0; i < frames; ++i) {
                const Affine3d a_T_b = poses[i].a_T_b.matrix();
                QueryWork work;
                ourTime[i] = std::min(ourTime[i], timer.seconds([&] {
                    oursOfFrame(i);
                    ours[i] = distance ? pair.distance(a_T_b, work, {.tolerance = kTolerance}).distance
                                       : pair.touch(a_T_b, kTolerance, work).touch == Touch::kYes;
                }));
                TriangleMesh ma = meshOfFrame(a.grid, deformation(i)), mb = meshOfFrame(b.grid, deformation(i));
                theirTime[i] = std::min(theirTime[i], timer.seconds([&] {
                    const TriangleTree ta(std::move(ma)), tb(std::move(mb));
                    theirs[i] = distance ? distanceBetween(ta, tb, a_T_b, work, {.tolerance = kTolerance}).distance
                                         : firstTouching(ta, tb, a_T_b, work).touch == Touch::kYes;
                }));
                if (distance && std::abs(ours[i] - theirs[i]) > 3 * off)
                    table.complain(fmt::format("{}, frame {}: distance {} and {}", title, i, ours[i], theirs[i]));
            }
        table.add({.pair = title,
                   .operation = distance ? "deforming, distance" : "deforming, touch at 1e-4",
                   .peer = builds,
                   .ours = summarise(ourTime),
                   .theirs = summarise(theirTime),
                   .atMost = 0.1,
                   .aim = 0.03});
    }
}

int run(int argc, char** argv) {
    std::string json, rows;
    std::size_t count = 200;
    int passes = 3;
    for (int i = 1; i < argc; ++i) {
        const std::string word = argv[i];
        if (word == "--quick") {
            count = 16;
            passes = 1;
        } else if (word == "--count" && i + 1 < argc) {
            count = static_cast<std::size_t>(std::clamp(std::atol(argv[++i]), 4L, 10'000L));
        } else if (word == "--rows" && i + 1 < argc) {
            rows = argv[++i];
        } else if (word == "--json" && i + 1 < argc) {
            json = argv[++i];
        } else {
            fmt::print(stderr,
                       "bench_freeform: {}: [--rows collision|tessellation] [--quick] [--count N] [--json FILE]\n",
                       word);
            return 2;
        }
    }
    if (!test::hasOpenSubdiv())
        fmt::print("OpenSubdiv is missing (./deploy/set-up unpacks it): tessellations are of our own limit points\n");
    CollisionTable table;
    const std::filesystem::path data = testDataFolder();
    const std::pair<std::string, std::filesystem::path> models[] = {
        {"spot", data / "meshes/spot/spot_control_mesh.obj"},
        {"fish", data / "meshes/fish/fish_control_mesh.obj"},
        {"penguin", data / "meshes/penguin/penguin_control_mesh.obj"},
        {"torus", data / "subdiv/catmark_torus.obj"},
        {"cube", data / "subdiv/catmark_cube.obj"}};
    for (const auto& [name, file] : models) {
        if (!rows.empty() && rows != "tessellation") break;
        if (const Expected<ControlMesh> mesh = loadControlMesh(file)) addTessellationRows(name, *mesh, passes, table);
    }
    for (const auto& [x, y] : {std::pair{0, 1}, std::pair{3, 4}, std::pair{2, 2}}) {
        if (!rows.empty() && rows != "collision") break;
        const Expected<ControlMesh> a = loadControlMesh(models[x].second), b = loadControlMesh(models[y].second);
        if (!a || !b) {
            fmt::print("{} x {} is left out: {}\n", models[x].first, models[y].first, (a ? b : a).error().message);
            continue;
        }
        measure(models[x].first, models[y].first, *a, *b, count, passes, table);
    }
    if (!json.empty() && !table.writeJson(json)) {
        fmt::print(stderr, "bench_freeform: {}: it cannot be written\n", json);
        return 1;
    }
    return table.good() ? 0 : 1;
}

}  // namespace
}  // namespace tessera

int main(int argc, char** argv) {
    return tessera::run(argc, argv);
}
