/// Models that assimp reads, with bones and animations, from the file through frames to vertices, beside an evaluator
/// of assimp's own scene.
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>

#include "common/drawable/Drawable.h"
#include "common/scene/Action.h"
#include "server/import/Importer.h"
#include "server/sim/frame/Simulation.h"
#include "tests/unit/Sanitized.h"

namespace tessera {
namespace {

using Real = long double;
using Real3 = Eigen::Matrix<Real, 3, 1>;
using Real4 = Eigen::Matrix<Real, 4, 4>;

Real4 realOf(const aiMatrix4x4& m) {
    Real4 real;
    for (unsigned r = 0; r < 4; ++r)
        for (unsigned c = 0; c < 4; ++c) real(r, c) = static_cast<Real>(m[r][c]);
    return real;
}

/// What assimp's data structures say of a file at a time, as anim.h and mesh.h describe them: world = parent ·
/// (translation · rotation · scale) of the keys, vertices Σ weight · world(bone) · offset, and nothing of Tessera's
/// reader.
class SceneEvaluator {
public:
    explicit SceneEvaluator(const std::string& path) {
        importer_.SetPropertyFloat(AI_CONFIG_PP_GSN_MAX_SMOOTHING_ANGLE, 60.0f);
        scene_ =
            importer_.ReadFile(path, aiProcess_Triangulate | aiProcess_SortByPType | aiProcess_GenSmoothNormals |
                                         aiProcess_GenUVCoords | aiProcess_JoinIdenticalVertices | aiProcess_FlipUVs);
    }
    [[nodiscard]] const aiScene* scene() const { return scene_; }

    /// Of all triangles' vertices, in the order of nodes and meshes. `known`: of those that at most four bones move.
    std::vector<Real3> positionsAt(Real seconds, std::vector<bool>& known) {
        channels_.clear();
        morphs_.clear();
        worlds_.clear();
        known.clear();
        if (scene_->mNumAnimations > 0) {
            const aiAnimation& animation = *scene_->mAnimations[0];
            ticks_ = seconds * (animation.mTicksPerSecond != 0 ? animation.mTicksPerSecond : 25);
            for (unsigned c = 0; c < animation.mNumChannels; ++c)
                channels_.emplace(animation.mChannels[c]->mNodeName.C_Str(), animation.mChannels[c]);
            for (unsigned c = 0; c < animation.mNumMorphMeshChannels; ++c) {
                const std::string named = animation.mMorphMeshChannels[c]->mName.C_Str();
                morphs_.emplace(named.substr(0, named.rfind('*')), animation.mMorphMeshChannels[c]);
            }
        }
        place(*scene_->mRootNode, Real4::Identity());
        std::vector<Real3> all;
        collect(*scene_->mRootNode, all, known);
        return all;
    }
    [[nodiscard]] Real length() const {
        const aiAnimation& animation = *scene_->mAnimations[0];
        return animation.mDuration / (animation.mTicksPerSecond != 0 ? animation.mTicksPerSecond : 25);
    }

private:
    /// The last key at or before now, and how far the next one is gone to.
    template <typename Key>
    std::pair<unsigned, Real> where(const Key* keys, unsigned count) const {
        unsigned k = 0;
        while (k + 1 < count && keys[k + 1].mTime <= ticks_) ++k;
        if (k + 1 == count || ticks_ < keys[k].mTime) return {k, 0};
        return {k, (ticks_ - keys[k].mTime) / (keys[k + 1].mTime - keys[k].mTime)};
    }
    Real3 vectorOf(const aiVectorKey* keys, unsigned count) const {
        const auto [k, t] = where(keys, count);
        const auto at = [&](unsigned i) { return Real3(keys[i].mValue.x, keys[i].mValue.y, keys[i].mValue.z); };
        return t == 0 ? at(k) : Real3(at(k) * (1 - t) + at(k + 1) * t);
    }
    Eigen::Quaternion<Real> turnOf(const aiQuatKey* keys, unsigned count) const {
        const auto [k, t] = where(keys, count);
        const auto at = [&](unsigned i) -> Eigen::Matrix<Real, 4, 1> {
            const aiQuaternion& q = keys[i].mValue;
            return Eigen::Matrix<Real, 4, 1>(q.w, q.x, q.y, q.z).normalized();
        };
        Eigen::Matrix<Real, 4, 1> q = at(k);
        if (t != 0) {
            Eigen::Matrix<Real, 4, 1> next = at(k + 1);
            if (q.dot(next) < 0) next = -next;
            const Real angle = std::acos(std::min<Real>(1, q.dot(next)));
            if (angle > 1e-9L) q = (std::sin((1 - t) * angle) * q + std::sin(t * angle) * next) / std::sin(angle);
        }
        return Eigen::Quaternion<Real>(q[0], q[1], q[2], q[3]);
    }
    /// Between the keys that speak of the target; of one that none speaks of, 0.
    Real weightOf(const aiMeshMorphAnim& channel, unsigned target) const {
        Real before = -1, after = -1, from = 0, to = 0;
        for (unsigned k = 0; k < channel.mNumKeys; ++k)
            for (unsigned i = 0; i < channel.mKeys[k].mNumValuesAndWeights; ++i) {
                if (channel.mKeys[k].mValues[i] != target) continue;
                const Real time = channel.mKeys[k].mTime, weight = channel.mKeys[k].mWeights[i];
                if (time <= ticks_ && time >= before) before = time, from = weight;
                if (time > ticks_ && (after < 0 || time < after)) after = time, to = weight;
            }
        if (before < 0) return after < 0 ? 0 : to;
        return after < 0 ? from : from + (to - from) * (ticks_ - before) / (after - before);
    }
    void place(const aiNode& node, const Real4& above) {
        Real4 local = realOf(node.mTransformation);
        if (const auto channel = channels_.find(node.mName.C_Str()); channel != channels_.end()) {
            const aiNodeAnim& keys = *channel->second;
            local.setIdentity();
            const Real3 scale = vectorOf(keys.mScalingKeys, keys.mNumScalingKeys);
            local.topLeftCorner<3, 3>() =
                turnOf(keys.mRotationKeys, keys.mNumRotationKeys).toRotationMatrix() * scale.asDiagonal();
            local.topRightCorner<3, 1>() = vectorOf(keys.mPositionKeys, keys.mNumPositionKeys);
        }
        worlds_[node.mName.C_Str()] = above * local;
        for (unsigned i = 0; i < node.mNumChildren; ++i) place(*node.mChildren[i], above * local);
    }
    void collect(const aiNode& node, std::vector<Real3>& all, std::vector<bool>& known) {
        for (unsigned i = 0; i < node.mNumMeshes; ++i) {
            const aiMesh& mesh = *scene_->mMeshes[node.mMeshes[i]];
            if ((mesh.mPrimitiveTypes & aiPrimitiveType_TRIANGLE) == 0) continue;
            std::vector<Real4> sums(mesh.mNumVertices, Real4::Zero());
            std::vector<Real> weights(mesh.mNumVertices, 0);
            std::vector<unsigned> counts(mesh.mNumVertices, 0);
            for (unsigned b = 0; b < mesh.mNumBones; ++b) {
                const aiBone& bone = *mesh.mBones[b];
                const auto world = worlds_.find(bone.mName.C_Str());
                const Real4 matrix = world == worlds_.end() ? worlds_[node.mName.C_Str()]
                                                            : Real4(world->second * realOf(bone.mOffsetMatrix));
                for (unsigned w = 0; w < bone.mNumWeights; ++w) {
                    sums[bone.mWeights[w].mVertexId] += static_cast<Real>(bone.mWeights[w].mWeight) * matrix;
                    weights[bone.mWeights[w].mVertexId] += static_cast<Real>(bone.mWeights[w].mWeight);
                    counts[bone.mWeights[w].mVertexId] += bone.mWeights[w].mWeight > 0;
                }
            }
            for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
                Eigen::Matrix<Real, 4, 1> at(mesh.mVertices[v].x, mesh.mVertices[v].y, mesh.mVertices[v].z, 1);
                if (const auto morph = morphs_.find(node.mName.C_Str()); morph != morphs_.end())
                    for (unsigned t = 0; t < mesh.mNumAnimMeshes; ++t) {
                        const aiVector3D to = mesh.mAnimMeshes[t]->mVertices[v], from = mesh.mVertices[v];
                        at.head<3>() +=
                            weightOf(*morph->second, t) * (Real3(to.x, to.y, to.z) - Real3(from.x, from.y, from.z));
                    }
                all.emplace_back(
                    (weights[v] > 0 ? Real4(sums[v] / weights[v]) : worlds_[node.mName.C_Str()]).topRows<3>() * at);
                known.push_back(counts[v] <= 4);
            }
        }
        for (unsigned i = 0; i < node.mNumChildren; ++i) collect(*node.mChildren[i], all, known);
    }

    Assimp::Importer importer_;
    const aiScene* scene_ = nullptr;
    std::map<std::string, const aiNodeAnim*> channels_;
    std::map<std::string, const aiMeshMorphAnim*> morphs_;
    std::map<std::string, Real4> worlds_;
    Real ticks_ = 0;
};

/// Of what Tessera's scene shows below its first node, seen from there: where the file's own coordinates are.
std::vector<Vec3d> shownTriangleCorners(const Aspect& scene, std::size_t& skins) {
    std::vector<Vec3d> all;
    skins = 0;
    Action action;
    action.onNode([&](const Visit& visit) {
        if (const Drawable drawable = drawableOf(scene, visit.node)) {
            const MeshArrays arrays = drawable.arrays();
            if (arrays.kind != MeshKind::kTriangles) return Descend::kInto;
            skins += visit.core.is<Skin>();
            const auto p = arrays.positions.as<float>();
            for (std::size_t i = 0; i + 2 < p.size(); i += 3)
                all.emplace_back(visit.world_T_node * Vec3d(p[i], p[i + 1], p[i + 2]));
        }
        return Descend::kInto;
    });
    action.run(scene);
    return all;
}

void expectAsAssimpSays(const std::string& path, std::size_t skins) {
    SCOPED_TRACE(path);
    SceneEvaluator file(path);
    ASSERT_NE(file.scene(), nullptr);
    ImportOptions options;
    options.importerProgram = std::string(TESSERA_BIN_DIR) + "/tessera-import";
    Expected<ImportedScene> imported = importScene(path, kRootNode, options);
    ASSERT_TRUE(imported) << imported.error().message;
    Simulation simulation;
    const Expected<CommittedFrame> loaded = simulation.load({std::move(imported->list)});
    ASSERT_TRUE(loaded) << loaded.error().message;
    const double length = static_cast<double>(file.length());
    const int frames =
        std::min(90, static_cast<int>(std::ceil(length * 60)) - 1);  // at its very end a loop begins again
    ASSERT_GT(frames, 20);
    std::vector<Real3> first;
    std::size_t moved = 0;
    for (int frame = 0; frame <= frames; ++frame) {
        const FrameResult result = simulation.step(frame == 0, {});
        EXPECT_TRUE(result.remarks.empty()) << result.remarks.front();
        if (frame % 15 != 0 && frame != 1) continue;
        std::vector<bool> known;
        const std::vector<Real3> right = file.positionsAt(frame / 60.0L, known);
        std::size_t shownSkins = 0;
        const std::vector<Vec3d> shown = shownTriangleCorners(simulation.scene(), shownSkins);
        ASSERT_EQ(shown.size(), right.size());
        EXPECT_EQ(shownSkins, skins);
        if (first.empty()) first = right;
        Real size = 0, off = 0;
        for (std::size_t i = 0; i < right.size(); ++i) {
            size = std::max(size, right[i].norm());
            if (known[i]) off = std::max(off, (shown[i].cast<Real>() - right[i]).norm());
            moved += (right[i] - first[i]).norm() > 1e-3L * size;
        }
        // Floats in offset matrices, in `pose` and in the vertices: some 2^-24 of the coordinates each, with the
        // joints' own lengths in between.
        ASSERT_LT(off, 1e-5L * std::max(size, Real(1e-3))) << "frame " << frame;
    }
    EXPECT_GT(moved, 0u) << "or nothing was played";
}

TEST(AssimpCharacters, AreWhereAssimpsOwnSceneSaysInEveryFrame) {
    const std::string folder = "/usr/share/assimp/models/";
    for (const auto& [file, skins] : std::initializer_list<std::pair<const char*, std::size_t>>{
             {"FBX/animation_with_skeleton.fbx", 1},
             {"FBX/huesitos.fbx", 1},
             {"BVH/01_01.bvh", 1},
             {"X/Testwuson.X", 1},
             {"X/BCN_Epileptic.X", 3},
             {"Collada/box_nested_animation.dae", 1},
             {"Collada/anims_with_full_rotations_between_keys.DAE", 0},
             {"CSM/ThomasFechten.csm", 1},
             {"X/anim_test.x", 1},
             {"ASE/RotatingCube.ASE", 0},
             {"3DS/RotatingCube.3DS", 0}})
        expectAsAssimpSays(folder + file, skins);
}

/// FBX in text: a square, bent by one bone, with three morph targets whose curves have keys at times of their own.
/// `steps`: the second target has a step between at half its way.
std::string morphingFbx(bool skinned, bool steps) {
    std::string objects, connections;
    constexpr std::int64_t kSecond = 46186158000;
    const auto connect = [&](const char* kind, int from, int to, const std::string& field) {
        connections += fmt::format(" C: \"{}\",{},{}{}\n", kind, from, to, field.empty() ? "" : ",\"" + field + "\"");
    };
    const auto shape = [&](int id, int vertex, const char* by) {
        objects += fmt::format(
            " Geometry: {}, \"Geometry::s{}\", \"Shape\" {{\n  Version: 100\n  Indexes: *1 {{\n   a: {}\n  }}\n  "
            "Vertices: *3 {{\n   a: {}\n  }}\n"
            "  Normals: *3 {{\n   a: 0,0,0\n  }}\n }}\n",
            id, id, vertex, by);
    };
    const auto curve = [&](int id, int node, const char* field, std::vector<std::pair<double, double>> keys) {
        std::string times, values;
        for (const auto& [time, value] : keys) {
            times += fmt::format("{}{}", times.empty() ? "" : ",", static_cast<std::int64_t>(time * kSecond));
            values += fmt::format("{}{}", values.empty() ? "" : ",", value);
        }
        objects += fmt::format(
            " AnimationCurve: {0}, \"AnimCurve::\", \"\" {{\n  Default: 0\n  KeyVer: 4008\n  KeyTime: *{1} {{\n   a: "
            "{2}\n  }}\n  KeyValueFloat: *{1} {{\n"
            "   a: {3}\n  }}\n  KeyAttrFlags: *1 {{\n   a: 24836\n  }}\n  KeyAttrDataFloat: *4 {{\n   a: "
            "0,0,255790911,0\n  }}\n"
            "  KeyAttrRefCount: *1 {{\n   a: {1}\n  }}\n }}\n",
            id, keys.size(), times, values);
        connect("OP", id, node, field);
    };
    objects +=
        " Geometry: 100, \"Geometry::Face\", \"Mesh\" {\n  Vertices: *12 {\n   a: 0,0,0,1,0,0,1,1,0,0,1,0\n  }\n  "
        "PolygonVertexIndex: *6 {\n   a: 0,1,-3,0,2,-4\n  }\n"
        "  GeometryVersion: 124\n }\n Model: 200, \"Model::face\", \"Mesh\" {\n  Version: 232\n }\n Deformer: 300, "
        "\"Deformer::Shapes\", \"BlendShape\" {\n  Version: 100\n }\n"
        " AnimationStack: 400, \"AnimStack::Take\", \"\" {\n  Properties70:  {\n   P: \"LocalStop\", \"KTime\", "
        "\"Time\", \"\",92372316000\n  }\n }\n"
        " AnimationLayer: 401, \"AnimLayer::Base\", \"\" {\n }\n";
    connect("OO", 200, 0, "");
    connect("OO", 100, 200, "");
    connect("OO", 300, 100, "");
    connect("OO", 401, 400, "");
    shape(110, 2, "0,0,2");
    shape(120, 3, "0,1,0");
    shape(130, 1, "3,0,0");
    if (steps) shape(121, 3, "0,0.2,0");
    const std::vector<std::vector<std::pair<double, double>>> keys = {
        {{0, 0}, {2, 100}}, {{0, 50}, {0.5, 0}, {1.25, 80}}, {{0.75, 0}, {1.5, -40}}};
    for (int c = 0; c < 3; ++c) {
        const int id = 301 + c;
        const bool two = steps && c == 1;
        objects += fmt::format(
            " Deformer: {}, \"SubDeformer::c{}\", \"BlendShapeChannel\" {{\n  Version: 100\n  DeformPercent: 25\n  "
            "FullWeights: *{} {{\n   a: {}\n  }}\n }}\n",
            id, c, two ? 2 : 1, two ? "50,100" : "100");
        connect("OO", id, 300, "");
        if (two) connect("OO", 121, id, "");
        connect("OO", 110 + 10 * c, id, "");
        objects += fmt::format(" AnimationCurveNode: {}, \"AnimCurveNode::DeformPercent\", \"\" {{\n }}\n", 410 + c);
        connect("OO", 410 + c, 401, "");
        connect("OP", 410 + c, id, "DeformPercent");
        curve(420 + c, 410 + c, "d|DeformPercent", keys[static_cast<std::size_t>(c)]);
    }
    if (skinned) {
        const char* unit = "1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1";
        objects += fmt::format(
            " Model: 210, \"Model::bone\", \"LimbNode\" {{\n  Version: 232\n }}\n Deformer: 310, \"Deformer::Skin\", "
            "\"Skin\" {{\n  Version: 101\n }}\n"
            " Deformer: 311, \"SubDeformer::bone\", \"Cluster\" {{\n  Version: 100\n  Indexes: *4 {{\n   a: 0,1,2,3\n  "
            "}}\n  Weights: *4 {{\n   a: 1,1,1,1\n  }}\n"
            "  Transform: *16 {{\n   a: {0}\n  }}\n  TransformLink: *16 {{\n   a: {0}\n  }}\n }}\n"
            " AnimationCurveNode: 430, \"AnimCurveNode::R\", \"\" {{\n }}\n",
            unit);
        connect("OO", 210, 0, "");
        connect("OO", 310, 100, "");
        connect("OO", 311, 310, "");
        connect("OO", 210, 311, "");
        connect("OO", 430, 401, "");
        connect("OP", 430, 210, "Lcl Rotation");
        curve(431, 430, "d|X", {{0, 0}, {2, 90}});
        curve(432, 430, "d|Y", {{0, 0}, {2, 0}});
        curve(433, 430, "d|Z", {{0, 0}, {2, 30}});
    }
    return "; FBX 7.4.0 project file\nFBXHeaderExtension:  {\n FBXHeaderVersion: 1003\n FBXVersion: "
           "7400\n}\nGlobalSettings:  {\n Version: 1000\n Properties70:  {\n"
           "  P: \"UpAxis\", \"int\", \"Integer\", \"\",1\n }\n}\nObjects:  {\n" +
           objects + "}\nConnections:  {\n" + connections + "}\n";
}

struct FbxFile {
    explicit FbxFile(const std::string& text) {
        char pattern[] = "/tmp/tessera-fbx-XXXXXX";
        folder = ::mkdtemp(pattern);
        path = folder + "/face.fbx";
        std::ofstream(path) << text;
    }
    ~FbxFile() { std::filesystem::remove_all(folder); }
    FbxFile(const FbxFile&) = delete;
    FbxFile& operator=(const FbxFile&) = delete;
    std::string folder, path;
};

TEST(AssimpCharacters, MorphTargetsOfFbxWithCurvesOfTheirOwnAreWhereAssimpSaysInEveryFrame) {
    const FbxFile face(morphingFbx(false, false));
    expectAsAssimpSays(face.path, 1);
}

TEST(AssimpCharacters, MorphTargetsOfASkinnedFbxMeshAreWhereAssimpSaysInEveryFrame) {
    const FbxFile face(morphingFbx(true, false));
    expectAsAssimpSays(face.path, 1);
}

TEST(AssimpCharacters, StepsBetweenMorphTargetsOfFbxAreSaidAndStandStill) {
    const FbxFile face(morphingFbx(false, true));
    ImportOptions options;
    options.importerProgram = std::string(TESSERA_BIN_DIR) + "/tessera-import";
    const Expected<ImportedScene> imported = importScene(face.path, kRootNode, options);
    ASSERT_TRUE(imported) << imported.error().message;
    EXPECT_TRUE(std::ranges::any_of(imported->notes, [](const std::string& note) {
        return note.find("morph targets have steps between") != std::string::npos;
    }));
    EXPECT_EQ(imported->triangles, 2u);
}

}  // namespace
}  // namespace tessera
