#include "tests/bench/CollisionPairs.h"

#include <fmt/format.h>

#include <filesystem>
#include <fstream>

#include "server/collision/query/DistanceQuery.h"
#include "server/tools/PoseFile.h"
#include "tests/support/Models.h"
#include "tests/support/PoseGenerator.h"

namespace tessera {
namespace {

std::string nameOf(const ModelFiles& files, const BenchPair& pair) {
    const auto stem = [](const std::string& file) { return std::filesystem::path(file).stem().string(); };
    return fmt::format("{} ({}) x {} ({})", stem(files.first), pair.a.faceCount(), stem(files.second),
                       pair.b.faceCount());
}

std::string textOf(const Pose& p) {
    return fmt::format("{:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g}", p.translation.x(), p.translation.y(),
                       p.translation.z(), p.rotation.w(), p.rotation.x(), p.rotation.y(), p.rotation.z());
}

Expected<void> saveLines(const std::filesystem::path& file, const std::vector<std::string>& lines) {
    std::ofstream out(file);
    for (const std::string& line : lines) out << line << "\n";
    if (!out) return fail(ErrorCode::kFailed, file.string() + ": it cannot be written");
    return {};
}

std::vector<ModelFiles> inTestData(const std::vector<ModelFiles>& names) {
    std::vector<ModelFiles> out;
    for (const auto& [a, b] : names) out.emplace_back(testDataFolder() / a, testDataFolder() / b);
    return out;
}

}  // namespace

std::vector<ModelFiles> standardPairs() {
    return inTestData({{"scan/stanford_bun_zipper.ply", "scan/stanford_bun_zipper.ply"},
                       {"plant/EZ_Control_valve.obj", "plant/Painted_gray.obj"}});
}

std::vector<ModelFiles> heldBackPairs() {
    return inTestData({{"cad/gears.stl", "cad/cycloidal.ply"},
                       {"cad/ADIS16480.STL", "meshes/koala/koala_low_resolution.obj"},
                       {"meshes/penguin/penguin.obj", "meshes/goathead/goathead.obj"},
                       {"plant/Brass.obj", "plant/Gasket.obj"},
                       {"collision/fcl_env.obj", "collision/fcl_rob.obj"}});
}

Expected<BenchPair> posedPair(const ModelFiles& files, const PairWishes& wishes) {
    const Expected<TriangleMesh> meshA = loadModel(files.first), meshB = loadModel(files.second);
    if (!meshA || !meshB) return tl::unexpected((!meshA ? meshA : meshB).error());
    BenchPair pair;
    pair.a = normalised(*meshA);
    pair.b = normalised(*meshB);
    pair.name = nameOf(files, pair);
    const TriangleTree a(pair.a), b(pair.b);
    std::vector<std::string> poseLines, motionLines;
    if (wishes.poses > 0)
        for (const TestPose& pose : makePoses(ownOracle(a, b), wishes.poses, wishes.seed)) {
            if (pose.closeness == Closeness::kNear) pair.near.push_back(pair.poses.size());
            pair.poses.push_back(pose.a_T_b.matrix());
            poseLines.push_back(textOf(pose.a_T_b));
        }
    if (wishes.motions > 0) pair.motions = makeMotions(ownOracle(a, b), wishes.motions, wishes.seed + 1);
    for (const BodyMotion& m : pair.motions) motionLines.push_back(textOf(m.start) + " " + textOf(m.end));
    if (wishes.saveTo.empty()) return pair;
    const std::filesystem::path folder(wishes.saveTo);
    const std::string stem =
        std::filesystem::path(files.first).stem().string() + "-" + std::filesystem::path(files.second).stem().string();
    for (const auto& [ending, lines] : {std::pair(".poses", &poseLines), std::pair(".motions", &motionLines)})
        if (const Expected<void> saved = saveLines(folder / (stem + ending), *lines); !saved)
            return tl::unexpected(saved.error());
    return pair;
}

Expected<BenchPair> pairFromPoseFile(const ModelFiles& files, const std::string& poses) {
    Expected<TriangleMesh> meshA = loadModel(files.first), meshB = loadModel(files.second);
    if (!meshA || !meshB) return tl::unexpected((!meshA ? meshA : meshB).error());
    const Expected<std::vector<PoseLine>> lines = readPoses(poses);
    if (!lines) return tl::unexpected(lines.error());
    BenchPair pair;
    pair.a = std::move(*meshA);
    pair.b = std::move(*meshB);
    pair.name = nameOf(files, pair);
    const TriangleTree a(pair.a), b(pair.b);
    const double nearly = 0.01 * pair.a.bounds().size().norm();
    for (const PoseLine& line : *lines) {
        const Affine3d a_T_b = line.start.matrix();
        QueryWork work;
        const Distance distance = distanceBetween(a, b, a_T_b, work, {.upperBound = nearly});
        if (distance.distance > 0 && !distance.farther) pair.near.push_back(pair.poses.size());
        pair.poses.push_back(a_T_b);
        if (line.end) pair.motions.push_back({line.start, *line.end});
    }
    if (pair.poses.empty()) return fail(ErrorCode::kBadInput, poses + ": there is no pose in it");
    return pair;
}

}  // namespace tessera
