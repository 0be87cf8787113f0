/// Spherical fields beside our own trees and FCL, model by model: bench_spherical [--quick] [--count N] [--passes N]
/// [--only NAME]
/// [--json FILE].
///
/// One thread. Poses as shared/design/collision.md says (section 7): every closeness in equal parts, uniform rotations;
/// a scaled row has B at 0.7 of its size. Yes and no, and numbers of pairs, are compared as they are measured. Ends
/// with the comparison of spherical techniques with hierarchies, model by model, as a table for
/// server/collision/spherical/README.md.
#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "server/collision/query/DistanceQuery.h"
#include "server/collision/query/TouchQuery.h"
#include "server/collision/spherical/DistanceLattice.h"
#include "server/collision/spherical/FieldTouch.h"
#include "server/collision/spherical_bezier/DeformingTouch.h"
#include "tests/bench/CollisionTable.h"
#include "tests/bench/CollisionTimer.h"
#include "tests/support/MadeModels.h"
#include "tests/support/Models.h"
#include "tests/support/PoseGenerator.h"
#include "tests/support/fcl/FclPeer.h"

namespace tessera {
namespace {

struct Arguments {
    std::size_t count = 400;
    int passes = 3;
    std::string only, json;
};

[[noreturn]] void stop(int code, const std::string& why) {
    std::fprintf(stderr, "bench_spherical: %s\n", why.c_str());
    std::exit(code);
}

Arguments parse(int argc, char** argv) {
    Arguments out;
    const std::vector<std::string> words(argv + 1, argv + argc);
    for (std::size_t i = 0; i < words.size(); ++i) {
        const auto next = [&]() -> const std::string& {
            if (++i >= words.size()) stop(2, words[i - 1] + " needs another word");
            return words[i];
        };
        const auto number = [&] {
            const std::string& word = next();
            int value = 0;
            const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
            if (error != std::errc() || end != word.data() + word.size() || value < 1)
                stop(2, "'" + word + "' is not a count");
            return value;
        };
        if (words[i] == "--quick")
            out.count = 40, out.passes = 1;
        else if (words[i] == "--count")
            out.count = static_cast<std::size_t>(number());
        else if (words[i] == "--passes")
            out.passes = number();
        else if (words[i] == "--only")
            out.only = next();
        else if (words[i] == "--json")
            out.json = next();
        else
            stop(2, "unknown option '" + words[i] +
                        "'; options: --quick, --count N, --passes N, --only NAME, --json FILE");
    }
    return out;
}

/// A closed surface around the origin, radius by direction; rings · rings · 4 faces.
template <typename Radius>
TriangleMesh around(unsigned rings, const Vec3d& stretch, const Radius& radius) {
    MeshArrays3 mesh;
    const auto add = [&](unsigned i, unsigned j) {
        const double a = std::numbers::pi * i / rings, b = std::numbers::pi * j / rings;
        const Vec3d d(std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a));
        const Vec3d p = (radius(d) * d).cwiseProduct(stretch);
        mesh.positions.insert(mesh.positions.end(), {p[0], p[1], p[2]});
    };
    add(0, 0);
    for (unsigned i = 1; i < rings; ++i)
        for (unsigned j = 0; j < 2 * rings; ++j) add(i, j);
    add(rings, 0);
    const auto at = [&](unsigned i, unsigned j) {
        if (i == 0) return 0U;
        if (i == rings) return 1 + (rings - 1) * 2 * rings;
        return 1 + (i - 1) * 2 * rings + j % (2 * rings);
    };
    for (unsigned i = 0; i < rings; ++i)
        for (unsigned j = 0; j < 2 * rings; ++j) {
            if (i > 0) mesh.indices.insert(mesh.indices.end(), {at(i, j), at(i + 1, j), at(i, j + 1)});
            if (i + 1 < rings) mesh.indices.insert(mesh.indices.end(), {at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)});
        }
    return meshOf(mesh);
}

double bumps(const Vec3d& d) {
    return 1 + 0.08 * std::sin(9 * d[0]) * std::cos(8 * d[1]) + 0.03 * std::sin(25 * d[2] + 3 * d[0]);
}

struct Model {
    std::string name;
    TriangleMesh mesh;
};

std::vector<Model> models(const Arguments& arguments) {
    std::vector<Model> out;
    const auto add = [&](const std::string& name, const auto& make) {
        if (arguments.only.empty() || name.find(arguments.only) != name.npos) out.push_back({name, normalised(make())});
    };
    add("star-shaped", [] { return around(112, Vec3d::Ones(), bumps); });
    add("thin", [] { return around(112, Vec3d(1, 1, 0.01), bumps); });
    add("long", [] { return around(112, Vec3d(10, 1, 1), bumps); });
    add("handles (knot)", [] { return *madeModel("made/knot"); });
    for (const auto& [name, file] :
         {std::pair("scan (bunny)", "scan/stanford_bun_zipper.ply"), std::pair("cad (gears)", "cad/gears.stl")}) {
        if (!arguments.only.empty() && std::string(name).find(arguments.only) == std::string::npos) continue;
        const Expected<TriangleMesh> mesh = loadModel(testDataFolder() / file);
        if (mesh)
            out.push_back({name, normalised(*mesh)});
        else
            fmt::print("left out: {}\n", mesh.error().message);
    }
    return out;
}

struct Class {
    std::string name;
    std::vector<Affine3d> poses;
};

std::vector<Class> posesOf(const TriangleTree& a, const TriangleTree& b, double scale, std::size_t count) {
    std::vector<Class> out{{"apart", {}}, {"nearly touching", {}}, {"touching", {}}};
    for (const TestPose& pose : makePoses(ownOracle(a, b), count, 1)) {
        Affine3d m = pose.a_T_b.matrix();
        m.linear() *= scale;
        out[pose.closeness == Closeness::kSeparated ? 0
            : pose.closeness == Closeness::kNear    ? 1
                                                    : 2]
            .poses.push_back(m);
    }
    return out;
}

TriangleMesh scaledMesh(const TriangleMesh& mesh, double scale) {
    MeshArrays3 arrays = arraysOf(mesh);
    for (double& x : arrays.positions) x *= scale;
    return meshOf(arrays);
}

/// A model's line in the comparison: who takes what share of our exact tree's time. 0: not measured.
struct Verdict {
    std::string name;
    double touch = 0, scaledTouch = 0, all = 0, apart = 0, near = 0, depth = 0, rebuild = 0, deforming = 0, groups = 0;
    bool closed = false;
};

void touchRows(const Model& model, const TriangleTree& tree, const SphericalField& field, const Arguments& arguments,
               CollisionTable& table, Verdict& verdict) {
    const FclPair fcl(model.mesh, model.mesh, FclVolume::kObb);
    constexpr double kScale = 0.7;
    const TriangleTree smaller(scaledMesh(model.mesh, kScale));
    for (const bool scaled : {false, true})
        for (const Class& c : posesOf(tree, scaled ? smaller : tree, scaled ? kScale : 1, arguments.count)) {
            const std::size_t n = c.poses.size();
            std::vector<int> ofTree(n), ofField(n), ofFcl(n);
            std::vector<Contender> contenders{
                [&](std::size_t i) {
                    QueryWork w;
                    ofField[i] = firstTouching(field, field, c.poses[i], w).touch == Touch::kYes;
                },
                [&](std::size_t i) {
                    QueryWork w;
                    ofTree[i] = firstTouching(tree, tree, c.poses[i], w).touch == Touch::kYes;
                }};
            if (!scaled) contenders.emplace_back([&](std::size_t i) { ofFcl[i] = fcl.any(c.poses[i]); });
            const auto times = raceInTurns(n, arguments.passes, contenders);
            if (ofTree != ofField || (!scaled && ofTree != ofFcl))
                table.complain(model.name + ", " + c.name + ": answers differ");
            const bool row = c.name == "nearly touching";
            const std::string what = fmt::format("yes/no, {}{}", c.name, scaled ? ", scaled" : "");
            if (!scaled)
                table.add(
                    {.pair = model.name,
                     .operation = what,
                     .peer = "FCL OBB",
                     .ours = summarise(times[0]),
                     .theirs = summarise(times[2]),
                     .atMost = row ? 0.08 : 0,
                     .aim = row ? 0.04 : 0,
                     .remark = fmt::format("tree / FCL {:.3f}", summarise(times[1]).mean / summarise(times[2]).mean)});
            table.add({.pair = model.name,
                       .operation = what,
                       .peer = "our tree",
                       .ours = summarise(times[0]),
                       .theirs = summarise(times[1]),
                       .atMost = row ? (scaled ? 1.0 : 1.2) : 0,
                       .aim = row ? (scaled ? 0.5 : 0.7) : 0});
            if (row)
                (scaled ? verdict.scaledTouch : verdict.touch) = summarise(times[0]).mean / summarise(times[1]).mean;
            if (scaled || c.name != "touching") continue;
            std::vector<std::size_t> pairsTree(n), pairsField(n);
            const auto all = raceInTurns(n, arguments.passes,
                                         {[&](std::size_t i) {
                                              QueryWork w;
                                              pairsField[i] = allTouching(field, field, c.poses[i], w).pairs.size();
                                          },
                                          [&](std::size_t i) {
                                              QueryWork w;
                                              pairsTree[i] = allTouching(tree, tree, c.poses[i], w).pairs.size();
                                          }});
            if (pairsTree != pairsField) table.complain(model.name + ": numbers of pairs differ");
            verdict.all = summarise(all[0]).mean / summarise(all[1]).mean;
            table.add({.pair = model.name,
                       .operation = "all pairs, touching",
                       .peer = "our tree",
                       .ours = summarise(all[0]),
                       .theirs = summarise(all[1])});
        }
}

void distanceRows(const Model& model, const TriangleTree& tree, const Arguments& arguments, CollisionTable& table,
                  Verdict& verdict) {
    const CallTimer timer;
    std::optional<Expected<DistanceLattice>> lattice;
    const double build = timer.seconds([&] { lattice.emplace(DistanceLattice::make(tree)); });
    if (!*lattice) return table.complain(model.name + ": " + lattice->error().message);
    const DistanceLattice& l = **lattice;
    const std::vector<Class> classes = posesOf(tree, tree, 1, arguments.count);
    std::vector<double> exactApart;
    for (const Class& c : classes) {
        const std::size_t n = c.poses.size();
        std::vector<double> exact(n);
        std::vector<SignedDistance> about(n);
        const auto times = raceInTurns(n, arguments.passes,
                                       {[&](std::size_t i) {
                                            QueryWork w;
                                            about[i] = *signedDistance(l, l, c.poses[i], w);
                                        },
                                        [&](std::size_t i) {
                                            QueryWork w;
                                            exact[i] = distanceBetween(tree, tree, c.poses[i], w).distance;
                                        }});
        double most = 0, deepest = 0;
        std::size_t beyond = 0;
        for (std::size_t i = 0; i < n; ++i) {
            most = std::max(most, about[i].error);
            deepest = std::max(deepest, -about[i].distance);
            if (exact[i] > 0 && std::abs(about[i].distance - exact[i]) > about[i].error + 1e-5) ++beyond;
        }
        if (beyond > 0) table.complain(fmt::format("{}: {} distances beyond their stated error", model.name, beyond));
        if (c.name != "touching") exactApart.insert(exactApart.end(), times[1].begin(), times[1].end());
        const bool apart = c.name != "touching";
        const double share = summarise(times[0]).mean / summarise(apart ? times[1] : exactApart).mean;
        (c.name == "apart" ? verdict.apart : apart ? verdict.near : verdict.depth) = share;
        verdict.closed = l.isSigned();
        table.add({.pair = model.name,
                   .operation = apart ? "distance, " + c.name : "depth",
                   .peer = apart ? "exact distance" : "exact distance of those apart",
                   .ours = summarise(times[0]),
                   .theirs = apart ? summarise(times[1]) : summarise(exactApart),
                   .atMost = 0.1,
                   .aim = 0.03,
                   .remark = fmt::format("error {:.4f} at most{}", most,
                                         apart          ? ""
                                         : l.isSigned() ? fmt::format(", {:.3f} deep", deepest)
                                                        : ", encloses nothing: no depth")});
    }
    fmt::print("  lattice: {:.0f} ms, {} places, {:.2f} MB\n", 1e3 * build, l.placeCount(),
               1e-6 * static_cast<double>(l.memoryBytes()));
}

void buildRow(const Model& model, TriangleTree& tree, SphericalField& field, const Arguments& arguments,
              CollisionTable& table, Verdict& verdict) {
    const auto times =
        raceInTurns(3, arguments.passes, {[&](std::size_t) { field.rebuild(); }, [&](std::size_t) { tree.rebuild(); }});
    field.rebuild();
    verdict.rebuild = summarise(times[0]).mean / summarise(times[1]).mean;
    table.add(
        {.pair = model.name,
         .operation = "rebuild of the field",
         .peer = "our tree's build",
         .ours = summarise(times[0]),
         .theirs = summarise(times[1]),
         .atMost = 3,
         .aim = 1,
         .remark = fmt::format("looseness {:.2f}, {} centres, {:.0f} bytes a triangle, {:.1f} entries",
                               field.looseness(), field.centreCount(),
                               static_cast<double>(field.memoryBytes()) / static_cast<double>(model.mesh.faceCount()),
                               static_cast<double>(field.entryCount()) / static_cast<double>(model.mesh.faceCount()))});
}

/// All vertices move, then yes or no. The field is rebuilt over a tree that is refitted; groups are moved; beside a
/// 14-DOP tree that is refitted, which is what `auto` takes of what deforms.
void deformingRow(const Model& model, const Arguments& arguments, CollisionTable& table, Verdict& verdict) {
    TriangleTree moving(model.mesh), refitted(model.mesh, {.volume = VolumeKind::kDop14});
    const TriangleTree still(model.mesh), stillDop(model.mesh, {.volume = VolumeKind::kDop14});
    SphericalField field(moving);
    const SphericalField other(still);
    DeformingSurface groups(model.mesh);
    const DeformingSurface stillGroups(model.mesh);
    DeformingTouch walk;
    const std::vector<Affine3d> poses = posesOf(still, still, 1, std::min<std::size_t>(arguments.count, 16))[1].poses;
    std::vector<std::vector<Vec3d>> states;
    for (int k = 0; k < 4; ++k) {
        std::vector<Vec3d> state(model.mesh.positions().begin(), model.mesh.positions().end());
        for (Vec3d& p : state) p[0] += 0.003 * std::sin(20 * p[1] + k);
        states.push_back(std::move(state));
    }
    const auto follow = [&](auto& body, std::size_t i) {
        const std::vector<Vec3d>& state = states[i % states.size()];
        const auto good = [&] {
            if constexpr (requires { body.refit(state); })
                return body.refit(state);
            else
                return body.move(state);
        }();
        if (!good) table.complain(good.error().message);
    };
    const std::size_t n = poses.size();
    std::vector<int> ofField(n), ofTree(n), ofGroups(n);
    const auto times = raceInTurns(n, arguments.passes,
                                   {[&](std::size_t i) {
                                        follow(moving, i);
                                        field.rebuild();
                                        QueryWork w;
                                        ofField[i] = firstTouching(field, other, poses[i], w).touch == Touch::kYes;
                                    },
                                    [&](std::size_t i) {
                                        follow(groups, i);
                                        QueryWork w;
                                        ofGroups[i] = walk.first(groups, stillGroups, poses[i], w).touch == Touch::kYes;
                                    },
                                    [&](std::size_t i) {
                                        follow(refitted, i);
                                        QueryWork w;
                                        ofTree[i] = firstTouching(refitted, stillDop, poses[i], w).touch == Touch::kYes;
                                    }});
    if (ofField != ofTree || ofGroups != ofTree) table.complain(model.name + ", deforming: answers differ");
    const auto row = [&](const char* who, std::size_t k, double& share) {
        share = summarise(times[k]).mean / summarise(times[2]).mean;
        table.add({.pair = model.name,
                   .operation = fmt::format("deforming, {}: update and yes/no", who),
                   .peer = "our 14-DOPs, refitted",
                   .ours = summarise(times[k]),
                   .theirs = summarise(times[2])});
    };
    row("field", 0, verdict.deforming);
    row("groups", 1, verdict.groups);
}

/// Spherical techniques beside hierarchies: shares of the time of our own trees.
void compare(const std::vector<Verdict>& verdicts) {
    fmt::print(
        "\n| share of our tree's time | yes/no near | scaled | all pairs | distance at 1 %, apart, near | depth at 1 % "
        "| rebuild | deforming: "
        "field, groups | so |\n|---|---|---|---|---|---|---|---|---|\n");
    for (const Verdict& v : verdicts) {
        const bool field = v.touch < 1 && v.scaledTouch < 1, lattice = v.apart < 0.5 && v.near < 1;
        fmt::print(
            "| {} | {:.1f} | {:.1f} | {:.1f} | {:.2f}, {:.2f} | {} | {:.1f} | {:.1f}, {:.2f} | {} yes/no; {} "
            "approximate distances; {} while it deforms |\n",
            v.name, v.touch, v.scaledTouch, v.all, v.apart, v.near,
            v.closed ? fmt::format("{:.2f}", v.depth) : "none: open", v.rebuild, v.deforming, v.groups,
            field ? "field" : "tree", lattice ? "lattice" : "tree", v.groups < 1 ? "groups" : "tree");
    }
}

int bench(int argc, char** argv) {
    const Arguments arguments = parse(argc, argv);
    fmt::print("Instruction set {}. Means over poses of the least of {} passes, one thread.\n", name(instructionSet()),
               arguments.passes);
    CollisionTable table;
    std::vector<Verdict> verdicts;
    for (const Model& model : models(arguments)) {
        TriangleTree tree(model.mesh);
        SphericalField field(tree);
        fmt::print("{}: {} triangles\n", model.name, model.mesh.faceCount());
        Verdict& verdict = verdicts.emplace_back();
        verdict.name = model.name;
        buildRow(model, tree, field, arguments, table, verdict);
        touchRows(model, tree, field, arguments, table, verdict);
        distanceRows(model, tree, arguments, table, verdict);
        deformingRow(model, arguments, table, verdict);
    }
    compare(verdicts);
    if (!arguments.json.empty() && !table.writeJson(arguments.json)) stop(1, arguments.json + ": it cannot be written");
    return table.good() ? 0 : 1;
}

}  // namespace
}  // namespace tessera

int main(int argc, char** argv) {
    return tessera::bench(argc, argv);
}
