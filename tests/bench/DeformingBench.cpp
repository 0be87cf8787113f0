// Two bodies of 20,000 triangles, all vertices of both move in every frame: do they touch? Each frame is an update and
// a yes/no.
//
// Beside FCL's refit and collide (the best of OBB, OBBRSS, AABB by mean), beside our own refit of 14-DOPs and its touch
// query, and beside bounds by spherical Bernstein-Bézier patches. Frames are, in equal parts, separated, near, shallow
// and deep (tests/support/PoseGenerator.h; own trees say which is which): half of them touch. Every answer of everybody
// is compared. All take one Vec3d per vertex and frame.
//
//     bench_deforming [--quick] [--frames N] [--json FILE]
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "server/collision/pairwise/PairTable.h"
#include "server/collision/query/TouchQuery.h"
#include "server/collision/spherical_bezier/DeformingTouch.h"
#include "server/collision/spherical_bezier/SphericalBezierTouch.h"
#include "tests/bench/CollisionTable.h"
#include "tests/bench/DeformingFcl.h"
#include "tests/support/MadeModels.h"
#include "tests/support/Models.h"
#include "tests/support/PoseGenerator.h"
#include "tests/unit/spherical_bezier/FacesOfPatches.h"

namespace tessera {
namespace {

using Frames = std::vector<std::vector<Vec3d>>;

MeshArrays3 withDiagonalOne(const MeshArrays3& arrays) {
    return arraysOf(normalised(meshOf(arrays)));
}

/// About 20,000 faces of a larger mesh: vertices in one cell of a grid become one, faces that collapse go.
MeshArrays3 decimated(const MeshArrays3& in, std::size_t faces) {
    MeshArrays3 best;
    double low = 1e-4, high = 0.1;
    for (int i = 0; i < 20; ++i) {
        const double cell = 0.5 * (low + high);
        std::map<std::array<int, 3>, std::uint32_t> cells;
        std::vector<Vec3d> sums;
        std::vector<double> counts;
        std::vector<std::uint32_t> to;
        for (std::size_t v = 0; v < in.positions.size(); v += 3) {
            std::array<int, 3> key{};
            for (std::size_t k = 0; k < 3; ++k) key[k] = static_cast<int>(std::floor(in.positions[v + k] / cell));
            const auto [at, fresh] = cells.try_emplace(key, static_cast<std::uint32_t>(sums.size()));
            if (fresh) {
                sums.emplace_back(Vec3d::Zero());
                counts.push_back(0);
            }
            sums[at->second] += Vec3d(in.positions[v], in.positions[v + 1], in.positions[v + 2]);
            ++counts[at->second];
            to.push_back(at->second);
        }
        best = {};
        for (std::size_t c = 0; c < sums.size(); ++c)
            for (int k = 0; k < 3; ++k) best.positions.push_back(sums[c][k] / counts[c]);
        for (std::size_t t = 0; t < in.indices.size(); t += 3) {
            const std::uint32_t a = to[in.indices[t]], b = to[in.indices[t + 1]], c = to[in.indices[t + 2]];
            if (a != b && b != c && a != c) best.indices.insert(best.indices.end(), {a, b, c});
        }
        (best.indices.size() / 3 > faces ? low : high) = cell;
    }
    return best;
}

/// Each face into four.
MeshArrays3 refined(const MeshArrays3& in) {
    MeshArrays3 out{in.positions, {}};
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
        const auto [at, fresh] =
            middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(out.positions.size() / 3));
        if (fresh)
            for (std::size_t k = 0; k < 3; ++k)
                out.positions.push_back(0.5 * (in.positions[3 * a + k] + in.positions[3 * b + k]));
        return at->second;
    };
    for (std::size_t t = 0; t < in.indices.size(); t += 3) {
        const std::uint32_t a = in.indices[t], b = in.indices[t + 1], c = in.indices[t + 2];
        const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
        out.indices.insert(out.indices.end(), {a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca});
    }
    return out;
}

/// Star-shaped: a ball with bumps.
MeshArrays3 bumpyBall() {
    constexpr std::uint32_t kAround = 142, kAlong = 71;
    MeshArrays3 out;
    for (std::uint32_t j = 0; j <= kAlong; ++j)
        for (std::uint32_t i = 0; i < kAround; ++i) {
            const double u = 6.283185307179586 * i / kAround, v = 3.141592653589793 * j / kAlong;
            const double r = 1 + 0.15 * std::sin(v) * std::sin(v) * std::sin(5 * u) * std::cos(4 * v);
            out.positions.insert(out.positions.end(),
                                 {r * std::sin(v) * std::cos(u), r * std::sin(v) * std::sin(u), r * std::cos(v)});
        }
    for (std::uint32_t j = 0; j < kAlong; ++j)
        for (std::uint32_t i = 0; i < kAround; ++i) {
            const std::uint32_t a = kAround * j + i, b = kAround * j + (i + 1) % kAround;
            out.indices.insert(out.indices.end(), {a, a + kAround, b, b, a + kAround, b + kAround});
        }
    return out;
}

/// Twisted, bent and waved; then of diagonal 1 about its box' centre, which the poses are made for. Floats, as a scene
/// has them.
std::vector<Vec3d> deformed(const MeshArrays3& arrays, double phase) {
    std::vector<Vec3d> out;
    Box box;
    for (std::size_t v = 0; v < arrays.positions.size(); v += 3) {
        const Vec3d p(arrays.positions[v], arrays.positions[v + 1], arrays.positions[v + 2]);
        Vec3d q = Eigen::AngleAxisd(1.2 * std::sin(phase) * p.y(), Vec3d::UnitY()) * p;
        q += Vec3d(0.03 * std::sin(9 * q.y() + 1.3 * phase), 0.02 * std::sin(7 * q.z() - phase),
                   0.02 * std::sin(12 * q.x() + phase));
        out.push_back(q);
        box.extend(q);
    }
    for (Vec3d& p : out) p = ((p - box.center()) / box.size().norm()).cast<float>().cast<double>();
    return out;
}

struct Sequence {
    TriangleMesh meshA, meshB;
    Frames a, b;
    std::vector<TestPose> poses;
};

Sequence makeSequence(const MeshArrays3& a, const MeshArrays3& b, std::size_t frames) {
    Sequence s{meshOf(a), meshOf(b), {}, {}, {}};
    TriangleTree treeA(s.meshA), treeB(s.meshB);
    for (std::size_t f = 0; f < frames; ++f) {
        s.a.push_back(deformed(a, 0.11 * static_cast<double>(f)));
        s.b.push_back(deformed(b, 2 + 0.13 * static_cast<double>(f)));
        TESSERA_CHECK(treeA.refit(s.a.back()) && treeB.refit(s.b.back()), "a state of a sound mesh");
        // The generator goes through the classes in turn: the last one is this frame's.
        s.poses.push_back(makePoses(ownOracle(treeA, treeB), f % 4 + 1, 1000 + f).back());
    }
    return s;
}

struct Contestant {
    std::string name;
    std::function<void(std::size_t)> update;
    std::function<bool(std::size_t)> touches;
    std::vector<double> updates, queries;  ///< seconds, the least of some passes, per frame

    [[nodiscard]] std::vector<double> of(const Sequence& s, int closeness, bool withUpdate = true,
                                         bool withQuery = true) const {
        std::vector<double> out;
        for (std::size_t f = 0; f < updates.size(); ++f)
            if (closeness < 0 || static_cast<int>(s.poses[f].closeness) == closeness)
                out.push_back((withUpdate ? updates[f] : 0) + (withQuery ? queries[f] : 0));
        return out;
    }
};

std::vector<Contestant> contestants(const Sequence& s) {
    std::vector<Contestant> all;
    {
        auto a = std::make_shared<DeformingSurface>(s.meshA), b = std::make_shared<DeformingSurface>(s.meshB);
        auto touch = std::make_shared<DeformingTouch>();
        all.push_back({"groups",
                       [=, &s](std::size_t f) { (void)(a->move(s.a[f]) && b->move(s.b[f])); },
                       [=, &s](std::size_t f) {
                           QueryWork work;
                           return touch->first(*a, *b, s.poses[f].a_T_b.matrix(), work).touch == Touch::kYes;
                       },
                       {},
                       {}});
    }
    for (const auto& [kind, name] :
         {std::pair{VolumeKind::kDop14, "own 14-DOP"}, std::pair{VolumeKind::kAabb, "own AABB"}}) {
        auto a = std::make_shared<TriangleTree>(s.meshA, TreeOptions{.volume = kind});
        auto b = std::make_shared<TriangleTree>(s.meshB, TreeOptions{.volume = kind});
        all.push_back({name,
                       [=, &s](std::size_t f) { (void)(a->refit(s.a[f]) && b->refit(s.b[f])); },
                       [=, &s](std::size_t f) {
                           QueryWork work;
                           return firstTouching(*a, *b, s.poses[f].a_T_b.matrix(), work).touch == Touch::kYes;
                       },
                       {},
                       {}});
    }
    for (const unsigned levels : {1U, 2U}) {
        auto a = std::make_shared<SphericalBezierBound>(s.meshA, SphericalBezierOptions{.levels = levels});
        auto b = std::make_shared<SphericalBezierBound>(s.meshB, SphericalBezierOptions{.levels = levels});
        all.push_back({fmt::format("spherical, {} patches", a->patches().size()),
                       [=, &s](std::size_t f) { (void)(a->move(s.a[f]) && b->move(s.b[f])); },
                       [=, &s](std::size_t f) {
                           QueryWork work;
                           return patches::firstTouching(*a, *b, s.poses[f].a_T_b.matrix(), work).touch == Touch::kYes;
                       },
                       {},
                       {}});
    }
    for (const auto& [kind, name] :
         {std::pair{DeformingFclVolume::kObb, "FCL OBB"}, std::pair{DeformingFclVolume::kObbRss, "FCL OBBRSS"},
          std::pair{DeformingFclVolume::kAabb, "FCL AABB"}}) {
        const std::shared_ptr<DeformingFclPair> pair = deformingFclPair(kind, s.meshA, s.meshB, s.a, s.b);
        all.push_back({name,
                       [=](std::size_t f) { pair->refit(f); },
                       [=, &s](std::size_t f) { return pair->any(s.poses[f].a_T_b.matrix()); },
                       {},
                       {}});
    }
    {
        // Shapes as the pipeline has them: they choose groups themselves, after the first frames.
        const auto shape = [](const TriangleMesh& mesh) {
            auto made = CollisionShape::ofTriangles(mesh, {.volume = kAutomaticDeformingVolume});
            made->setDeforms();
            (void)made->tree();
            return made;
        };
        const std::shared_ptr<CollisionShape> a = shape(s.meshA), b = shape(s.meshB);
        all.push_back({"pairwise stage",
                       [=, &s](std::size_t f) { (void)(a->move(s.a[f]) && b->move(s.b[f])); },
                       [=, &s](std::size_t f) {
                           QueryWork work;
                           const Affine3d here = Affine3d::Identity(), there = s.poses[f].a_T_b.matrix();
                           return touchOf({*a, here}, {*b, there}, {work}).touch == Touch::kYes;
                       },
                       {},
                       {}});
    }
    return all;
}

void race(std::vector<Contestant>& all, const Sequence& s, int passes, const std::string& pair, CollisionTable& table) {
    const CallTimer timer;
    const std::size_t frames = s.poses.size();
    std::vector<std::vector<bool>> answers(all.size(), std::vector<bool>(frames));
    for (Contestant& c : all)
        c.updates = c.queries = std::vector<double>(frames, std::numeric_limits<double>::infinity());
    for (int pass = 0; pass <= passes; ++pass)
        for (std::size_t c = 0; c < all.size(); ++c)
            for (std::size_t f = 0; f < frames; ++f) {
                bool touches = false;
                const double update = timer.seconds([&] { all[c].update(f); }),
                             query = timer.seconds([&] { touches = all[c].touches(f); });
                answers[c][f] = touches;
                if (pass == 0) continue;
                all[c].updates[f] = std::min(all[c].updates[f], update);
                all[c].queries[f] = std::min(all[c].queries[f], query);
            }
    for (std::size_t c = 1; c < all.size(); ++c)
        for (std::size_t f = 0; f < frames; ++f)
            if (answers[c][f] != answers[0][f])
                table.complain(fmt::format("{}, frame {}: {} and {}", pair, f, all[0].name, all[c].name));
}

void measure(const std::string& pair, const MeshArrays3& a, const MeshArrays3& b, std::size_t frames, int passes,
             CollisionTable& table) {
    const Sequence s = makeSequence(a, b, frames);
    std::vector<Contestant> all = contestants(s);
    race(all, s, passes, pair, table);
    const auto mean = [&](const Contestant& c) { return summarise(c.of(s, -1)).mean; };
    const Contestant& ours = all[0];
    const Contestant* fcl = &all[5];
    for (std::size_t c = 5; c + 1 < all.size(); ++c)
        if (mean(all[c]) < mean(*fcl)) fcl = &all[c];
    const std::string title = fmt::format("{}: {} x {} faces", pair, s.meshA.faceCount(), s.meshB.faceCount());
    const auto row = [&](const std::string& what, const Contestant& mine, const Contestant& other, int closeness,
                         double atMost, double aim) {
        table.add({.pair = title,
                   .operation = what,
                   .peer = other.name,
                   .ours = summarise(mine.of(s, closeness)),
                   .theirs = summarise(other.of(s, closeness)),
                   .atMost = atMost,
                   .aim = aim});
    };
    row("frame", ours, *fcl, -1, 0.05, 0.02);
    row("frame", ours, all[1], -1, 0.5, 0.25);
    for (const Closeness closeness : {Closeness::kSeparated, Closeness::kNear, Closeness::kShallow, Closeness::kDeep}) {
        const int k = static_cast<int>(closeness);
        row("frame, " + std::string(name(closeness)), ours, *fcl, k, 0, 0);
        row("frame, " + std::string(name(closeness)), ours, all[1], k, 0, 0);
    }
    const auto part = [&](const std::string& what, bool update) {
        table.add({.pair = title,
                   .operation = what,
                   .peer = all[1].name,
                   .ours = summarise(ours.of(s, -1, update, !update)),
                   .theirs = summarise(all[1].of(s, -1, update, !update))});
    };
    part("the update alone", true);
    part("the query alone", false);
    row("frame", ours, all[2], -1, 0, 0);
    row("frame, through the pairwise stage", all.back(), all[1], -1, 0, 0);
    for (const std::size_t spherical : {std::size_t{3}, std::size_t{4}}) {
        row("frame, " + all[spherical].name, all[spherical], all[1], -1, 0, 0);
        row("frame, " + all[spherical].name, all[spherical], *fcl, -1, 0, 0);
    }
}

int run(int argc, char** argv) {
    std::string json;
    std::size_t frames = 64;
    int passes = 3;
    for (int i = 1; i < argc; ++i) {
        const std::string word = argv[i];
        if (word == "--quick") {
            frames = 8;
            passes = 1;
        } else if (word == "--frames" && i + 1 < argc) {
            frames = static_cast<std::size_t>(std::clamp(std::atol(argv[++i]), 4L, 10'000L));
        } else if (word == "--json" && i + 1 < argc) {
            json = argv[++i];
        } else {
            fmt::print(stderr, "bench_deforming: {}: [--quick] [--frames N] [--json FILE]\n", word);
            return 2;
        }
    }
    CollisionTable table;
    const MeshArrays3 ball = withDiagonalOne(bumpyBall()),
                      knot = withDiagonalOne(refined(arraysOf(madeModel("made/knot").value())));
    const Expected<TriangleMesh> bunny = loadModel(testDataFolder() / "scan" / "stanford_bun_zipper.ply");
    if (bunny) {
        const MeshArrays3 coarse = withDiagonalOne(decimated(arraysOf(normalised(*bunny)), 20'000));
        measure("bunny x bunny", coarse, coarse, frames, passes, table);
    } else {
        fmt::print("bunny x bunny is left out: {}\n", bunny.error().message);
    }
    measure("ball x ball (star-shaped)", ball, ball, frames, passes, table);
    measure("knot x knot (not star-shaped)", knot, knot, frames, passes, table);
    if (!json.empty() && !table.writeJson(json)) {
        fmt::print(stderr, "bench_deforming: {}: it cannot be written\n", json);
        return 1;
    }
    return table.good() ? 0 : 1;
}

}  // namespace
}  // namespace tessera

int main(int argc, char** argv) {
    return tessera::run(argc, argv);
}
