/// What moves in a file that assimp reads: bones become the joints of Skins, mesh variants their morph targets,
/// channels key frames.
#pragma once

#include <assimp/matrix4x4.h>

#include <map>
#include <set>
#include <string>
#include <vector>

#include "server/import/reader/MovingParts.h"

struct aiAnimation;
struct aiBone;
struct aiMesh;
struct aiMeshMorphAnim;
struct aiNode;
struct aiNodeAnim;
struct aiScene;

namespace tessera {

/// Rows as they stand; the fourth is taken to be 0, 0, 0, 1.
[[nodiscard]] Affine3d affineOf(const aiMatrix4x4& m);

/// Asked while the nodes are made, in any order; `finish` once all are there.
class AssimpMotion {
public:
    /// `lowerEnding`: of the file, with its dot; formats differ in what assimp makes of their morph targets.
    AssimpMotion(const aiScene& source, PlainScene& scene, std::string lowerEnding);

    /// Whether a bone or a channel names this node: then it is made, whatever else it is good for.
    [[nodiscard]] bool isNamed(const aiNode& node) const { return keys_.contains(&node); }
    /// The node's place, with its key. An animated one has the three parts that channels replace.
    proto::scene::Node* place(const std::function<proto::scene::Node*()>& make, const std::string& name,
                              const aiNode& node, const Affine3d& parent_T_node);
    /// Whether bones or morph targets deform the mesh; what has no triangles stays at rest, which is said.
    [[nodiscard]] bool deforms(const aiMesh& mesh);
    /// Makes `child` the Skin of the mesh that is called `name`, as `node` places it. `placed`: the parent of `child`.
    void addSkin(proto::scene::Node& child, proto::scene::Node& placed, const aiNode& node, unsigned mesh,
                 const std::string& name);
    /// The animations, and what there was to say.
    void finish();

private:
    /// Key frames of one field.
    struct Track {
        std::vector<double> times;   ///< s
        std::vector<double> values;  ///< `width` a key
        std::size_t width = 3;
        std::uint32_t target = 0;
        std::string field = {};
    };
    /// Where each joint is found, its inverse bind matrix: for all places of one mesh.
    struct Bound {
        std::vector<const aiNode*> joints;  ///< null: the rest, which moves with the mesh
        std::vector<std::string> names;
        std::uint32_t binds = 0, indices = 0, weights = 0, morphPositions = 0, morphNormals = 0;  ///< blobs
        std::vector<float> morphWeights;
        bool stepsBetween = false;  ///< of FBX: several targets are steps of one channel
    };
    [[nodiscard]] const aiNode* find(const char* name) const;
    void name(const char* named);
    const Bound& bound(unsigned mesh);
    void bindJoints(const aiMesh& mesh, Bound& bound);
    void bindMorphs(const aiMesh& mesh, Bound& bound);
    [[nodiscard]] std::vector<float> morphDeltas(const aiMesh& mesh, bool normals);

    void addAnimation(const aiAnimation& source, std::size_t number);
    void addChannel(const aiNodeAnim& source, double ticksPerSecond);
    void addMorphChannel(const aiMeshMorphAnim& source, double ticksPerSecond);
    template <typename Key, typename Read>
    Track track(const Key* keys, unsigned count, double ticksPerSecond, std::size_t width, Read&& read);
    void keep(Track track, std::uint32_t target, const char* field);
    void holdUntilTheEnd();
    [[nodiscard]] proto::scene::Animation written();
    /// Something that is noted once, with how often it was and where first.
    void odd(const std::string& what, const std::string& where);

    const aiScene& source_;
    PlainScene& scene_;
    std::string ending_;
    AnimationNodes animations_;
    std::map<std::string, const aiNode*> nodes_;  ///< the first of each name
    std::set<std::string> ambiguous_;
    std::map<const aiNode*, std::uint32_t> keys_;  ///< of the nodes that are named
    std::set<const aiNode*> animated_;
    std::uint32_t lastKey_ = 0;
    std::map<unsigned, Bound> bounds_;  ///< by mesh
    struct Morphed {
        std::uint32_t key;
        unsigned mesh;
    };
    std::multimap<std::string, Morphed> morphed_;  ///< by the names of the node and of the mesh
    std::map<std::string, std::pair<std::size_t, std::string>> odd_;
    // Of the animation that is being made.
    double shift_ = 0, length_ = 0;  ///< s
    std::set<std::pair<std::uint32_t, std::string>> driven_;
    std::vector<Track> tracks_;
};

}  // namespace tessera
