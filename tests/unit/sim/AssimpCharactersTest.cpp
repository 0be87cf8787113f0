/// Models that assimp reads, with bones and animations, from the file through frames to vertices, beside an evaluator of assimp's own scene.
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <gtest/gtest.h>

#include <assimp/Importer.hpp>
#include <cmath>
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

/// What assimp's data structures say of a file at a time, as anim.h and mesh.h describe them: world = parent · (translation · rotation · scale) of the keys,
/// vertices Σ weight · world(bone) · offset, and nothing of Tessera's reader.
class SceneEvaluator {
public:
    explicit SceneEvaluator(const std::string& path) {
        importer_.SetPropertyFloat(AI_CONFIG_PP_GSN_MAX_SMOOTHING_ANGLE, 60.0f);
        scene_ = importer_.ReadFile(path, aiProcess_Triangulate | aiProcess_SortByPType | aiProcess_GenSmoothNormals | aiProcess_GenUVCoords |
                                              aiProcess_JoinIdenticalVertices | aiProcess_FlipUVs);
    }
    [[nodiscard]] const aiScene* scene() const { return scene_; }

    /// Of all triangles' vertices, in the order of nodes and meshes. `known`: of those that at most four bones move.
    std::vector<Real3> positionsAt(Real seconds, std::vector<bool>& known) {
        channels_.clear();
        worlds_.clear();
        known.clear();
        if (scene_->mNumAnimations > 0) {
            const aiAnimation& animation = *scene_->mAnimations[0];
            ticks_ = seconds * (animation.mTicksPerSecond != 0 ? animation.mTicksPerSecond : 25);
            for (unsigned c = 0; c < animation.mNumChannels; ++c) channels_.emplace(animation.mChannels[c]->mNodeName.C_Str(), animation.mChannels[c]);
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
    void place(const aiNode& node, const Real4& above) {
        Real4 local = realOf(node.mTransformation);
        if (const auto channel = channels_.find(node.mName.C_Str()); channel != channels_.end()) {
            const aiNodeAnim& keys = *channel->second;
            local.setIdentity();
            const Real3 scale = vectorOf(keys.mScalingKeys, keys.mNumScalingKeys);
            local.topLeftCorner<3, 3>() = turnOf(keys.mRotationKeys, keys.mNumRotationKeys).toRotationMatrix() * scale.asDiagonal();
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
                const Real4 matrix = world == worlds_.end() ? worlds_[node.mName.C_Str()] : Real4(world->second * realOf(bone.mOffsetMatrix));
                for (unsigned w = 0; w < bone.mNumWeights; ++w) {
                    sums[bone.mWeights[w].mVertexId] += static_cast<Real>(bone.mWeights[w].mWeight) * matrix;
                    weights[bone.mWeights[w].mVertexId] += static_cast<Real>(bone.mWeights[w].mWeight);
                    counts[bone.mWeights[w].mVertexId] += bone.mWeights[w].mWeight > 0;
                }
            }
            for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
                const Eigen::Matrix<Real, 4, 1> at(mesh.mVertices[v].x, mesh.mVertices[v].y, mesh.mVertices[v].z, 1);
                all.emplace_back((weights[v] > 0 ? Real4(sums[v] / weights[v]) : worlds_[node.mName.C_Str()]).topRows<3>() * at);
                known.push_back(counts[v] <= 4);
            }
        }
        for (unsigned i = 0; i < node.mNumChildren; ++i) collect(*node.mChildren[i], all, known);
    }

    Assimp::Importer importer_;
    const aiScene* scene_ = nullptr;
    std::map<std::string, const aiNodeAnim*> channels_;
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
            if (arrays.primitive != Primitive::kTriangles) return Descend::kInto;
            skins += visit.core.is<Skin>();
            const auto p = arrays.positions.as<float>();
            for (std::size_t i = 0; i + 2 < p.size(); i += 3) all.emplace_back(visit.world_T_node * Vec3d(p[i], p[i + 1], p[i + 2]));
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
    const int frames = std::min(90, static_cast<int>(std::ceil(length * 60)) - 1);  // at its very end a loop begins again
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
        // Floats in offset matrices, in `pose` and in the vertices: some 2^-24 of the coordinates each, with the joints' own lengths in between.
        ASSERT_LT(off, 1e-5L * std::max(size, Real(1e-3))) << "frame " << frame;
    }
    EXPECT_GT(moved, 0u) << "or nothing was played";
}

TEST(AssimpCharacters, AreWhereAssimpsOwnSceneSaysInEveryFrame) {
    const std::string folder = "/usr/share/assimp/models/";
    for (const auto& [file, skins] : std::initializer_list<std::pair<const char*, std::size_t>>{
             {"FBX/animation_with_skeleton.fbx", 1}, {"FBX/huesitos.fbx", 1}, {"BVH/01_01.bvh", 1}, {"X/Testwuson.X", 1}, {"X/BCN_Epileptic.X", 3},
             {"Collada/box_nested_animation.dae", 1}, {"Collada/anims_with_full_rotations_between_keys.DAE", 0}, {"CSM/ThomasFechten.csm", 1},
             {"X/anim_test.x", 1}, {"ASE/RotatingCube.ASE", 0}, {"3DS/RotatingCube.3DS", 0}})
        expectAsAssimpSays(folder + file, skins);
}

}  // namespace
}  // namespace tessera
