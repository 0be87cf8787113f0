/// What every reader produces: a scene in plain form. Shapes are meshes, repeats are written out, arrays are blobs.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/Bytes.h"
#include "common/base/Error.h"
#include "common/base/Limits.h"
#include "common/geometry/Mesh.h"
#include "proto/scene.pb.h"

namespace tessera {

struct ReadLimits {
    std::size_t maxFileBytes = 0x7fffffff;  ///< of one file, the ones it refers to included
    std::size_t maxNodes = limits::kMaxObjects;
    /// Of few bytes: a node takes about a kilobyte, and an array of a few letters may place a thing very often.
    std::size_t freeNodes = kFreeNodes;
    static constexpr std::size_t kFreeNodes = 200'000, kBytesPerNode = 4;
    /// So many places of glyphs count as a node: they take 48 bytes each (GlyphPlaces.h).
    static constexpr std::size_t kGlyphsPerNode = 20;
    std::size_t maxDepth = 255;
    int maxImageSide = 4096;                           ///< pixels; larger images are halved until they fit
    std::size_t maxImageBytes = std::size_t{1} << 29;  ///< of all images, decoded
    bool verbatim = false;                             ///< see ImportOptions
    bool whole = false;                                ///< see ImportOptions
    std::vector<std::string> variants;                 ///< see ImportOptions

    /// What a model of so many bytes may become: those, and one for each kBytesPerNode.
    [[nodiscard]] std::size_t nodesOf(std::uint64_t bytes) const {
        return std::min<std::uint64_t>(maxNodes, freeNodes + bytes / kBytesPerNode);
    }
    /// What is refused, and what would help.
    [[nodiscard]] std::string tooManyNodes(std::uint64_t bytes) const;
};

struct PlainScene {
    proto::scene::SceneFile file;
    std::vector<Bytes> blobs;
    std::vector<std::string> notes;    ///< what was left away or changed; each once
    std::vector<std::string> missing;  ///< of the notes those that say that triangles, lines or points are not there
    std::vector<std::string> faults;   ///< what is wrong in a person's text, and was left away: "line:column: what"
    std::string plain;                 ///< the name of `plainMaterial`, once there is one
    /// Of triangles in meshes of a model: those that are there, and all, where the reader knows. Progress says them.
    std::uint64_t cornersDone = 0, cornersToCome = 0;

    /// Where animations and the like stand, which are no part of the file's tree: at its top. Of a file of our own with
    /// one top node below that one, so that there is still one.
    proto::scene::Node* addBeside();
    void note(std::string text);
    void noteMissing(const std::string& text);
    /// A material that says nothing but that faces have two sides, for what a file says no looks of; made the first
    /// time.
    const std::string& plainMaterial();
    /// The blob's number for the plain form; 0 for no bytes.
    [[nodiscard]] std::uint32_t addBlob(Bytes bytes);
    /// Adds the mesh under this name. Missing normals of triangles are computed; points of no radius get half of what
    /// lies between neighbours.
    proto::scene::Mesh& addMesh(const std::string& name, MeshData mesh);
    /// Of a model file, whose order means nothing: triangles of a large mesh in spatial order, unless it is read
    /// verbatim.
    void addModelMesh(const std::string& name, MeshData mesh, const ReadLimits& limits);
};

/// Names in old formats may be in any encoding: of those that are not UTF-8, as ours are, ASCII stays. `otherwise`: of
/// what has none.
[[nodiscard]] std::string foreignName(std::string_view name, const char* otherwise);

void setTransform(proto::scene::Transform& message, const Vec3d& translation, const Quatd& rotation,
                  const Vec3d& scale);

/// The node below `parent` that stands for an affine map: one transform, or, where the map shears, two of them nested
/// (a singular value decomposition is rotation · scale · rotation). Content and children belong in the node returned.
/// `make` adds a node to the parent.
proto::scene::Node* addPlacedNode(const std::function<proto::scene::Node*()>& make, const std::string& name,
                                  const Affine3d& map);

}  // namespace tessera
