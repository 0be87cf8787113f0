/// Pairs of models in seeded poses, loaded or made once per process.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <sstream>
#include <string>

#include "server/collision/query/TouchQuery.h"
#include "tests/support/MadeModels.h"
#include "tests/support/Models.h"
#include "tests/support/PoseGenerator.h"
#include "tests/support/fcl/FclPeer.h"

namespace tessera {

/// A model of the test data, or a made one ("made/…"), normalised; null where the data is not there. A file that cannot
/// be read fails the test.
inline const TriangleMesh* realModel(const std::string& name) {
    static std::map<std::string, TriangleMesh> known;
    if (const auto at = known.find(name); at != known.end()) return &at->second;
    if (const std::optional<TriangleMesh> made = madeModel(name))
        return &known.emplace(name, normalised(*made)).first->second;
    const std::filesystem::path file = testDataFolder() / name;
    if (!std::filesystem::exists(file)) return nullptr;
    const Expected<TriangleMesh> mesh = loadModel(file);
    if (!mesh) {
        ADD_FAILURE() << mesh.error().message;
        return nullptr;
    }
    return &known.emplace(name, normalised(*mesh)).first->second;
}

struct ModelPair {
    const char* a;
    const char* b;
    std::uint64_t seed = 1;
};

inline void PrintTo(const ModelPair& p, std::ostream* out) {
    *out << p.a << " and " << p.b;
}

inline std::string nameOf(const testing::TestParamInfo<ModelPair>& info) {
    const auto plain = [](std::string name) {
        name = std::filesystem::path(name).stem().string();
        for (char& c : name)
            if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
        return name;
    };
    return plain(info.param.a) + "_x_" + plain(info.param.b);
}

/// As a line of a pose file, to be asked of tessera-collide.
inline std::string describe(const TestPose& pose) {
    const Pose& p = pose.a_T_b;
    std::ostringstream out;
    out.precision(17);
    out << name(pose.closeness) << ": " << p.translation.transpose() << " " << p.rotation.w() << " "
        << p.rotation.vec().transpose();
    return out.str();
}

/// FCL chooses the poses: it is not judged here, and knows nothing of the trees that are. It must outlive what is
/// returned.
inline PoseOracle fclOracle(const FclPair& fcl) {
    return {[&](const Affine3d& a_T_b) { return fcl.any(a_T_b); },
            [&](const Affine3d& a_T_b) { return fcl.distance(a_T_b); }};
}
inline PoseOracle fclOracle(const TriangleMesh& a, const TriangleMesh& b) {
    const auto fcl = std::make_shared<const FclPair>(a, b, FclVolume::kObbRss);
    return {[fcl](const Affine3d& a_T_b) { return fcl->any(a_T_b); },
            [fcl](const Affine3d& a_T_b) { return fcl->distance(a_T_b); }};
}

/// Both bodies as trees of the default kind, and as FCL has them.
struct PosedPair {
    PosedPair(const TriangleMesh& meshA, const TriangleMesh& meshB)
        : a(meshA), b(meshB), fcl(meshA, meshB, FclVolume::kObbRss) {}

    TriangleTree a, b;
    FclPair fcl;
};

}  // namespace tessera
