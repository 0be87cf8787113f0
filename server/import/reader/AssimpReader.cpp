// OBJ, PLY, STL and the many others, by assimp.

#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <span>

#include "common/base/LowerCase.h"
#include "server/import/reader/AssimpFiles.h"
#include "server/import/reader/AssimpMaterials.h"
#include "server/import/reader/AssimpMending.h"
#include "server/import/reader/AssimpMotion.h"
#include "server/import/reader/AssimpSights.h"
#include "server/import/reader/FolderFiles.h"
#include "server/import/reader/ObjMaterials.h"
#include "server/import/reader/ReadScene.h"
#include "server/import/reader/SmoothNormals.h"
#include "server/import/reader/SoundParts.h"
#include "server/import/reader/VolumeFiles.h"

namespace tessera {
namespace {

/// Points that no face names.
bool isBarePoints(const aiMesh& mesh) {
    return mesh.mNumFaces == 0 && mesh.mNumVertices > 0 && mesh.mPrimitiveTypes == aiPrimitiveType_POINT;
}

/// Its vertices are named by number: none may become several.
bool isDeformed(const aiMesh& mesh) {
    return mesh.HasBones() || mesh.mNumAnimMeshes > 0;
}

class AssimpConverter {
public:
    AssimpConverter(const aiScene& scene, const FolderFiles& files, const ReadLimits& limits, bool sidesUnknown,
                    const std::string& lowerEnding)
        : source_(scene),
          limits_(limits),
          materials_(scene, files, limits, sidesUnknown, scene_),
          motion_(scene, scene_, lowerEnding),
          sights_(scene, scene_, lowerEnding) {}

    Expected<PlainScene> convert() {
        for (unsigned i = 0; i < source_.mNumMeshes; ++i) convertMesh(i);
        // A root that does nothing but hold the rest is not worth a level.
        const aiNode& root = *source_.mRootNode;
        if (root.mTransformation.IsIdentity() && root.mNumMeshes == 0 && !motion_.isNamed(root) &&
            !sights_.isNamed(root)) {
            for (unsigned i = 0; i < root.mNumChildren; ++i)
                if (Expected<void> done = convertNode(
                        *root.mChildren[i], [this] { return scene_.file.add_node(); }, Affine3d::Identity(), 1);
                    !done)
                    return tl::unexpected(done.error());
        } else if (Expected<void> done = convertNode(
                       root, [this] { return scene_.file.add_node(); }, Affine3d::Identity(), 1);
                   !done) {
            return tl::unexpected(done.error());
        }
        motion_.finish();
        sights_.finish();
        materials_.finish();
        return std::move(scene_);
    }

private:
    Expected<void> convertNode(const aiNode& node, const std::function<proto::scene::Node*()>& make,
                               const Affine3d& world_T_parent, std::size_t depth) {
        if (depth > limits_.maxDepth)
            return fail(ErrorCode::kLimit, fmt::format("nodes are nested deeper than {} levels", limits_.maxDepth));
        if (++nodes_ > limits_.maxNodes)
            return fail(ErrorCode::kLimit, fmt::format("the scene has more than {} nodes", limits_.maxNodes));
        const Affine3d map = affineOf(node.mTransformation);
        if (!map.matrix().allFinite()) return fail(ErrorCode::kBadInput, "a node has a transform that is not finite");
        proto::scene::Node* placed = motion_.place(make, foreignName(node.mName.C_Str(), "node"), node, map);
        const Affine3d world_T_node = world_T_parent * map;
        sights_.add(node, world_T_node, *placed);
        for (unsigned i = 0; i < node.mNumMeshes; ++i) {
            const unsigned mesh = node.mMeshes[i];
            if (usable_.count(mesh) == 0) continue;
            proto::scene::Node* child = placed->add_node();
            child->set_name(foreignName(source_.mMeshes[mesh]->mName.C_Str(), "part"));
            if (motion_.deforms(*source_.mMeshes[mesh])) {
                motion_.addSkin(*child, *placed, node, mesh, fmt::format("mesh {}", mesh));
                child->mutable_skin()->set_material(materials_.name(source_.mMeshes[mesh]->mMaterialIndex));
                continue;
            }
            child->mutable_geometry()->set_mesh(fmt::format("mesh {}", mesh));
            child->mutable_geometry()->set_material(materials_.name(source_.mMeshes[mesh]->mMaterialIndex));
        }
        for (unsigned i = 0; i < node.mNumChildren; ++i)
            if (Expected<void> done = convertNode(
                    *node.mChildren[i], [placed] { return placed->add_node(); }, world_T_node, depth + 1);
                !done)
                return done;
        return {};
    }

    void convertMesh(unsigned index) {
        const aiMesh& mesh = *source_.mMeshes[index];
        MeshData data;
        data.indices.reserve(std::size_t{3} * mesh.mNumFaces);
        std::vector<unsigned> vertices;  // of the mesh, in the order of ours
        // Polygons come here only where fans are wanted.
        for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
            if (mesh.mFaces[f].mNumIndices == 1) vertices.push_back(mesh.mFaces[f].mIndices[0]);
            if (mesh.mFaces[f].mNumIndices == 2)
                data.lines.insert(data.lines.end(), {mesh.mFaces[f].mIndices[0], mesh.mFaces[f].mIndices[1]});
            for (unsigned i = 2; i < mesh.mFaces[f].mNumIndices; ++i) {
                const unsigned* corners = mesh.mFaces[f].mIndices;
                data.indices.insert(data.indices.end(), {corners[0], corners[i - 1], corners[i]});
            }
        }
        if (mesh.mVertices == nullptr) return;
        const bool facesOfPoints = data.indices.empty() && data.lines.empty() && !vertices.empty();
        if (data.indices.empty() && !data.lines.empty()) {
            data.primitive = Primitive::kLines;
        } else if (!data.lines.empty()) {  // as the file has it, unsorted
            scene_.note(fmt::format("{} lines among triangles are left out", data.lines.size() / 2));
            data.lines.clear();
        }
        if (facesOfPoints || isBarePoints(mesh)) data.primitive = Primitive::kPoints;
        if (!facesOfPoints) {
            vertices.resize(mesh.mNumVertices);
            std::iota(vertices.begin(), vertices.end(), 0u);
        }
        for (const unsigned v : vertices) {
            const aiVector3D& p = mesh.mVertices[v];
            data.positions.insert(data.positions.end(), {p.x, p.y, p.z});
        }
        if (data.empty()) return;
        noteLeftOut(mesh);
        if (mesh.HasNormals() && data.primitive != Primitive::kLines) appendNormals(mesh, vertices, data);
        for (const auto& [set, texcoords] : {std::pair(0u, &data.texcoords), std::pair(1u, &data.texcoords1)})
            if (mesh.HasTextureCoords(set))
                for (const unsigned v : vertices)
                    texcoords->insert(texcoords->end(), {mesh.mTextureCoords[set][v].x, mesh.mTextureCoords[set][v].y});
        if (mesh.HasVertexColors(0))
            for (const unsigned v : vertices) {
                const aiColor4D& c = mesh.mColors[0][v];
                for (const float part : {c.r, c.g, c.b, c.a})
                    data.colors.push_back(
                        static_cast<std::uint8_t>(std::lround(std::clamp(part, 0.0f, 1.0f) * 255.0f)));
            }
        // Faces have been looked at; bare points have none.
        if (data.primitive == Primitive::kPoints)
            if (const std::string leftOut = keepSoundParts(data, fmt::format("mesh {}", index)); !leftOut.empty())
                scene_.noteMissing(leftOut);
        if (data.empty()) return;
        // Assimp's own have edges where a mesh has a vertex for each corner, and of some formats it has not.
        if (data.normals.empty() && data.primitive == Primitive::kTriangles && !limits_.verbatim && !isDeformed(mesh))
            setSmoothNormals(data);
        usable_.insert(index);
        scene_.addModelMesh(fmt::format("mesh {}", index), std::move(data), limits_);
    }

    void noteLeftOut(const aiMesh& mesh) {
        if (mesh.HasVertexColors(1)) scene_.note("vertex colours beyond the first set are left out");
    }

    /// Files hold normals of length zero or none; such a vertex gets some unit vector.
    static void appendNormals(const aiMesh& mesh, std::span<const unsigned> vertices, MeshData& data) {
        for (const unsigned v : vertices) {
            Vec3f normal(mesh.mNormals[v].x, mesh.mNormals[v].y, mesh.mNormals[v].z);
            const float length = normal.norm();
            normal = length > 1e-20f && std::isfinite(length) ? Vec3f(normal / length) : Vec3f(Vec3f::UnitY());
            data.normals.insert(data.normals.end(), normal.begin(), normal.end());
        }
    }

    const aiScene& source_;
    const ReadLimits& limits_;
    PlainScene scene_;
    AssimpMaterials materials_;
    AssimpMotion motion_;
    AssimpSights sights_;
    std::set<unsigned> usable_;
    std::size_t nodes_ = 0;
};

std::string firstLine(std::string text) {
    text = text.substr(0, std::min(text.find('\n'), std::size_t{400}));
    while (!text.empty() && (text.back() == '.' || text.back() == ' ')) text.pop_back();
    return text;
}

/// Never deleted: the process ends soon, and what hangUnderParents moves would be deleted twice.
Assimp::Importer& newImporter(const FolderFiles& files, BeforeAssimp& before) {
    Assimp::Importer& importer = *new Assimp::Importer;
    importer.SetIOHandler(new FolderIo(files, &before));  // the importer owns and deletes it
    importer.SetPropertyFloat(AI_CONFIG_PP_GSN_MAX_SMOOTHING_ANGLE, 60.0f);
    return importer;
}

/// Of a Half-Life model assimp 5.2.5 lists all bones below one node, and says by mParent alone whose child each is:
/// here each comes below its parent, as long as that leads up to the root. The scene is never deleted (see below), so
/// neither are the lists that it had.
void hangUnderParents(const aiScene& scene) {
    struct Hung {
        aiNode* node;
        aiNode* lister;
    };
    std::vector<Hung> all = {{scene.mRootNode, nullptr}};
    std::map<const aiNode*, aiNode*> parents = {{scene.mRootNode, nullptr}};
    for (std::size_t i = 0; i < all.size(); ++i) {
        aiNode* const node = all[i].node;
        for (unsigned c = 0; c < node->mNumChildren; ++c)
            if (parents.emplace(node->mChildren[c], node).second) all.push_back({node->mChildren[c], node});
    }
    bool moved = false;
    for (const auto& [node, lister] : all) {
        if (node->mParent == lister || !parents.contains(node->mParent)) continue;
        parents[node] = node->mParent;
        std::size_t steps = 0;
        for (const aiNode* up = node; up != nullptr && steps <= all.size(); up = parents[up]) ++steps;
        if (steps > all.size())
            parents[node] = lister;
        else
            moved = true;
    }
    if (!moved) return;
    std::map<aiNode*, std::vector<aiNode*>> children;
    for (const auto& [node, lister] : all)
        if (aiNode* const parent = parents[node]) children[parent].push_back(node);
    for (const auto& [node, lister] : all) {
        const std::vector<aiNode*>& own = children[node];
        node->mNumChildren = static_cast<unsigned>(own.size());
        node->mChildren = own.empty() ? nullptr : new aiNode*[own.size()];
        std::ranges::copy(own, node->mChildren);
    }
}

bool lacksNormalsOfDeformed(const aiScene& scene) {
    return std::ranges::any_of(std::span(scene.mMeshes, scene.mNumMeshes),
                               [](const aiMesh* mesh) { return isDeformed(*mesh) && !mesh->HasNormals(); });
}

/// As proto/scene.proto has it, once assimp has read the file.
std::uint32_t upAxisOf(const aiScene& scene, const std::string& lowerEnding) {
    constexpr std::uint32_t kUnknown = 0, kY = 2, kZ = 3;
    // FBX counts its axes from 0, and assimp leaves them as they are.
    if (int axis = 0; scene.mMetaData != nullptr && scene.mMetaData->Get("UpAxis", axis))
        return axis == 2 ? kZ : axis == 1 ? kY : kUnknown;
    // Assimp turns these until Y is up, and not those, whose Z always is.
    static const std::set<std::string> turned = {".dae", ".3ds", ".ase", ".ask"}, notTurned = {".blend"};
    return turned.contains(lowerEnding) ? kY : notTurned.contains(lowerEnding) ? kZ : kUnknown;
}

/// The least power of two that brings a mesh's coordinates above 2^59; 0: it needs none.
int raiseOf(const aiMesh& mesh) {
    float farthest = 0;
    for (const aiVector3D& p : std::span(mesh.mVertices, mesh.mNumVertices))
        farthest = std::max({farthest, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
    return farthest > 0 ? std::max(0, 60 - std::ilogb(farthest)) : 0;
}

void scale(aiMesh& mesh, int exponent) {
    for (aiVector3D& p : std::span(mesh.mVertices, mesh.mNumVertices))
        p = {std::ldexp(p.x, exponent), std::ldexp(p.y, exponent), std::ldexp(p.z, exponent)};
}

/// Assimp joins vertices that are nearer than 1e-5 to each other, however small a mesh is. Made large meanwhile, which
/// rounds nothing, only equal ones are joined.
const aiScene* joinEqualVertices(Assimp::Importer& importer) {
    aiScene* const scene = const_cast<aiScene*>(importer.GetScene());
    std::vector<int> raised;
    for (aiMesh* const mesh : std::span(scene->mMeshes, scene->mNumMeshes)) {
        raised.push_back(raiseOf(*mesh));
        scale(*mesh, raised.back());
    }
    const aiScene* const joined = importer.ApplyPostProcessing(aiProcess_JoinIdenticalVertices);
    if (joined == nullptr) return nullptr;
    for (unsigned i = 0; i < joined->mNumMeshes; ++i) scale(*joined->mMeshes[i], -raised[i]);
    return joined;
}

}  // namespace

std::set<std::string> allEndings() {
    std::set<std::string> endings = {".tsct", ".tsc",  ".gltf", ".glb", ".usd", ".usda",
                                     ".usdc", ".usdz", ".dxf",  ".3mf", ".amf"};
    for (const std::string_view ending : volumeEndings()) endings.insert(fmt::format(".{}", ending));
    std::string all;
    Assimp::Importer().GetExtensionList(all);  // "*.3ds;*.dae;…"
    for (std::size_t at = all.find('.'); at != std::string::npos; at = all.find('.', at + 1))
        endings.insert(all.substr(at, all.find(';', at) - at));
    // Another program's (server/import/coin).
    for (const char* other : {".x3d", ".x3db"}) endings.erase(other);
    return endings;
}

Expected<PlainScene> readWithAssimp(const std::string& path, const ReadLimits& limits) {
    const FolderFiles files(path.substr(0, std::max<std::size_t>(path.rfind('/'), 1)), limits.maxFileBytes);
    BeforeAssimp before;
    Assimp::Importer& importer = newImporter(files, before);
    const std::string extension = path.substr(std::min(path.rfind('.'), path.size()));
    if (!importer.IsExtensionSupported(extension))
        return fail(ErrorCode::kUnsupported, fmt::format("nothing here reads files that end in '{}'. Read are models "
                                                         "(.glb, .gltf, .usd, .obj, .fbx, .dae, .blend, .3ds), "
                                                         "meshes and scans (.ply, .stl, .off), buildings (.ifc, .dxf), "
                                                         "volumes (.mhd, .nrrd), and our own (.tsct, "
                                                         ".tsc). The program that wrote it, or Blender, can often "
                                                         "export .glb; tessera-check --formats lists all",
                                                         extension));
    // Sorting by type would put a mesh's triangles before its polygons, and assimp's triangles of a polygon are ears.
    const unsigned toTriangles = limits.verbatim ? 0u : aiProcess_Triangulate | aiProcess_SortByPType;
    std::vector<std::string> leftOut;
    const auto read = [&](Assimp::Importer& by) {
        const aiScene* const scene = by.ReadFile(path, 0);
        if (scene != nullptr && scene->mRootNode != nullptr) leftOut = leaveOutUnsound(const_cast<aiScene&>(*scene));
        return scene;
    };
    const aiScene* scene = read(importer);
    if (before.refusal()) return tl::unexpected(*before.refusal());
    if (!leftOut.empty() && scene->mNumMeshes == 0) return fail(ErrorCode::kBadInput, leftOut.front());
    // A mesh without faces would be refused; bare points need nothing of what follows.
    const bool bare = scene != nullptr && scene->mNumMeshes > 0 &&
                      std::all_of(scene->mMeshes, scene->mMeshes + scene->mNumMeshes,
                                  [](const aiMesh* mesh) { return isBarePoints(*mesh); });
    const unsigned ofFaces = toTriangles | aiProcess_GenUVCoords | aiProcess_ValidateDataStructure |
                             (scene != nullptr && lacksNormalsOfDeformed(*scene) ? aiProcess_GenSmoothNormals : 0u);
    if (scene != nullptr) scene = importer.ApplyPostProcessing(aiProcess_FlipUVs | (bare ? 0u : ofFaces));
    if (scene != nullptr && !bare) scene = joinEqualVertices(importer);
    std::string reason = firstLine(importer.GetErrorString());
    std::optional<std::string> mended;
    // Assimp's own check refuses all for one fault, and has deleted the scene then.
    constexpr std::string_view kInvalid = "Validation failed: ";
    if (scene == nullptr && reason.starts_with(kInvalid)) {
        // Another one: some of assimp's readers remember what is gone.
        Assimp::Importer& again = newImporter(files, before);
        scene = read(again);
        if (scene != nullptr && scene->mRootNode != nullptr) {
            const std::set<std::string> gone = mendScene(const_cast<aiScene&>(*scene));
            mended = fmt::format("assimp finds fault with it ({}): what is sound of it is shown{}{}",
                                 reason.substr(kInvalid.size()), gone.empty() ? "" : "; left out are ",
                                 fmt::join(gone, ", "));
            const unsigned unchecked = ofFaces & ~static_cast<unsigned>(aiProcess_ValidateDataStructure);
            if (scene->mNumMeshes > 0) {
                scene = again.ApplyPostProcessing(aiProcess_FlipUVs | unchecked);
                if (scene != nullptr) scene = joinEqualVertices(again);
            }
        }
        if (scene == nullptr) reason = firstLine(again.GetErrorString());
        if (scene != nullptr && scene->mRootNode == nullptr) reason = "it holds no node";
    }
    if (scene == nullptr || scene->mRootNode == nullptr) {
        if (reason.find("bad_alloc") != std::string::npos) throw std::bad_alloc();
        if (reason.empty()) reason = "no reason given";
        return fail(ErrorCode::kBadInput, fmt::format("it cannot be read: {}{}{}", reason,
                                                      before.doubt().empty() ? "" : "; ", before.doubt()));
    }
    hangUnderParents(*scene);
    // Of these formats none says whether a face has a back.
    static const std::set<std::string> sidesUnknown = {".obj", ".ply", ".stl", ".off", ".3ds"};
    const std::string lower = lowerCase(extension);
    Expected<PlainScene> converted =
        AssimpConverter(*scene, files, limits, sidesUnknown.count(lower) > 0, lower).convert();
    if (!converted) return converted;
    for (const std::string& note : before.notes()) converted->note(note);
    for (const std::string& note : leftOut) converted->noteMissing(note);
    converted->missing.insert(converted->missing.end(), before.missing().begin(), before.missing().end());
    if (mended) converted->note(*mended);
    if (lower == ".obj") noteObjMaterials(before.objNames(), path, files, *converted);
    converted->file.set_up_axis(upAxisOf(*scene, lower));
    return converted;
}

}  // namespace tessera
