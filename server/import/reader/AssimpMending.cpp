#include "server/import/reader/AssimpMending.h"

#include <assimp/anim.h>
#include <assimp/material.h>
#include <assimp/mesh.h>
#include <assimp/scene.h>

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

#include "server/import/reader/SoundParts.h"

namespace tessera {
namespace {

class Mending {
public:
    explicit Mending(aiScene& scene) : scene_(scene) {}

    std::set<std::string> mend() {
        std::vector<int> places(scene_.mMeshes != nullptr ? scene_.mNumMeshes : 0, -1);  // where each mesh gets to
        unsigned kept = 0;
        for (unsigned m = 0; m < places.size(); ++m) {
            if (!mendMesh(scene_.mMeshes[m])) continue;
            scene_.mMeshes[kept] = scene_.mMeshes[m];
            places[m] = static_cast<int>(kept++);
        }
        scene_.mNumMeshes = kept;
        if (scene_.mNumMaterials == 0 || scene_.mMaterials == nullptr) {
            scene_.mMaterials = new aiMaterial* [1] { new aiMaterial };
            scene_.mNumMaterials = 1;
        }
        for (unsigned m = 0; m < kept; ++m)
            if (unsigned& material = scene_.mMeshes[m]->mMaterialIndex; material >= scene_.mNumMaterials) {
                material = 0;
                say("materials that do not exist");
            }
        mendNodes(places);
        keep(scene_.mAnimations, scene_.mNumAnimations, "animations that are none",
             [](const aiAnimation* animation) { return animation != nullptr; });
        for (aiAnimation* animation : std::span(scene_.mAnimations, scene_.mNumAnimations)) {
            const auto sound = [](const auto* channel) { return channel != nullptr; };
            keep(animation->mChannels, animation->mNumChannels, "channels that are none", sound);
            keep(animation->mMorphMeshChannels, animation->mNumMorphMeshChannels, "channels that are none", sound);
            keep(animation->mMeshChannels, animation->mNumMeshChannels, "channels that are none", sound);
            for (aiNodeAnim* channel : std::span(animation->mChannels, animation->mNumChannels)) {
                if (channel->mPositionKeys == nullptr) channel->mNumPositionKeys = 0;
                if (channel->mRotationKeys == nullptr) channel->mNumRotationKeys = 0;
                if (channel->mScalingKeys == nullptr) channel->mNumScalingKeys = 0;
            }
            for (aiMeshMorphAnim* channel : std::span(animation->mMorphMeshChannels, animation->mNumMorphMeshChannels))
                if (channel->mKeys == nullptr) channel->mNumKeys = 0;
        }
        return std::move(said_);
    }

private:
    void say(const char* what) { said_.insert(what); }

    template <typename Item, typename Sound>
    void keep(Item*& items, unsigned& count, const char* others, Sound&& sound) {
        if (items == nullptr) count = 0;
        Item* const end = std::remove_if(items, items + count, [&](const Item& item) { return !sound(item); });
        if (end != items + count) say(others);
        count = static_cast<unsigned>(end - items);
    }

    /// Whether there is anything of it to keep.
    bool mendMesh(aiMesh* mesh) {
        if (mesh == nullptr || mesh->mVertices == nullptr || mesh->mNumVertices == 0) {
            say("meshes without vertices");
            return false;
        }
        const unsigned vertices = mesh->mNumVertices;
        const bool had = mesh->mNumFaces > 0;
        keep(mesh->mFaces, mesh->mNumFaces, "faces of vertices that do not exist", [&](const aiFace& face) {
            return face.mIndices != nullptr && face.mNumIndices > 0 &&
                   std::all_of(face.mIndices, face.mIndices + face.mNumIndices,
                               [&](unsigned vertex) { return vertex < vertices; });
        });
        if (had && mesh->mNumFaces == 0) return false;
        keep(mesh->mBones, mesh->mNumBones, "bones that are none", [](const aiBone* bone) { return bone != nullptr; });
        for (aiBone* bone : std::span(mesh->mBones, mesh->mNumBones))
            keep(bone->mWeights, bone->mNumWeights, "weights of bones for vertices that do not exist",
                 [&](const aiVertexWeight& weight) { return weight.mVertexId < vertices; });
        keep(mesh->mAnimMeshes, mesh->mNumAnimMeshes, "morph targets of another number of vertices than their mesh",
             [&](const aiAnimMesh* target) { return target != nullptr && target->mNumVertices == vertices; });
        return true;
    }

    void mendNodes(const std::vector<int>& places) {
        std::vector<aiNode*> open = {scene_.mRootNode};
        std::set<const aiNode*> seen = {scene_.mRootNode};
        while (!open.empty() && open.back() != nullptr) {
            aiNode* const node = open.back();
            open.pop_back();
            keep(node->mMeshes, node->mNumMeshes, "places of meshes that do not exist",
                 [&](unsigned mesh) { return mesh < places.size() && places[mesh] >= 0; });
            for (unsigned& mesh : std::span(node->mMeshes, node->mNumMeshes))
                mesh = static_cast<unsigned>(places[mesh]);
            keep(node->mChildren, node->mNumChildren, "nodes that are none, or there twice",
                 [&](const aiNode* child) { return child != nullptr && seen.insert(child).second; });
            open.insert(open.end(), node->mChildren, node->mChildren + node->mNumChildren);
        }
    }

    aiScene& scene_;
    std::set<std::string> said_;
};

}  // namespace

std::vector<std::string> leaveOutUnsound(aiScene& scene) {
    std::vector<std::string> said;
    bool gone = false;
    for (unsigned m = 0; m < scene.mNumMeshes && scene.mMeshes != nullptr; ++m) {
        aiMesh*& mesh = scene.mMeshes[m];
        if (mesh == nullptr || mesh->mVertices == nullptr || mesh->mFaces == nullptr || mesh->mNumFaces == 0) continue;
        const std::span<aiVector3D> vertices(mesh->mVertices, mesh->mNumVertices);
        const auto stood = [&](std::size_t vertex) { return stands(&vertices[vertex].x); };
        LeftOutParts leftOut(fmt::format("mesh {}{}{}", m, mesh->mName.length > 0 ? " " : "", mesh->mName.C_Str()),
                             "faces");
        const std::span<aiFace> faces(mesh->mFaces, mesh->mNumFaces);
        const auto end = std::remove_if(faces.begin(), faces.end(), [&](const aiFace& face) {
            return face.mIndices != nullptr &&
                   !leftOut.keeps(std::span(face.mIndices, face.mNumIndices), vertices.size(), stood);
        });
        mesh->mNumFaces = static_cast<unsigned>(end - faces.begin());
        if (const std::string text = leftOut.text(); !text.empty()) said.push_back(text);
        const auto sound = std::ranges::find_if(vertices, [](const aiVector3D& vertex) { return stands(&vertex.x); });
        for (aiVector3D& vertex : vertices)
            if (!stands(&vertex.x)) vertex = sound == vertices.end() ? aiVector3D() : *sound;
        if (mesh->mNumFaces > 0) continue;
        mesh = nullptr;  // the scene is never deleted, nor is this
        gone = true;
    }
    if (gone) (void)mendScene(scene);
    return said;
}

std::set<std::string> mendScene(aiScene& scene) {
    return Mending(scene).mend();
}

}  // namespace tessera
