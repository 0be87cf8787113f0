/// Lights and cameras of what assimp reads.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "server/import/reader/ModelView.h"

struct aiCamera;
struct aiLight;
struct aiNode;
struct aiScene;

namespace tessera {

/// Assimp 5.2.5 leaves much of it as its formats have it: where -Z is, what a cone's angle means, whether there is a
/// falloff. What the documentation of assimp says of these holds for few of them, so each format has its row here.
class AssimpSights {
public:
    /// `lowerEnding`: of the file, with its dot.
    AssimpSights(const aiScene& source, PlainScene& scene, std::string lowerEnding);

    /// Adds those that are called after the node. To be asked of all nodes, in the order in which assimp finds names.
    void add(const aiNode& node, const Affine3d& world_T_node, proto::scene::Node& placed);
    /// Whether a light or a camera stands there.
    [[nodiscard]] bool isNamed(const aiNode& node) const;
    /// What there was to say.
    void finish();

private:
    void addCamera(const aiCamera& camera, const Affine3d& world_T_node, proto::scene::Node& placed);
    void addLight(const aiLight& light, const Affine3d& world_T_node, proto::scene::Node& placed);
    void leaveOut(const std::string& what, const char* name);

    PlainScene& scene_;
    std::string ending_;
    double unit_ = 1;  ///< of the file, in the world's
    Box bounds_;       ///< of all meshes as they stand, where there is anything to be looked at
    std::multimap<std::string, const aiCamera*> cameras_;
    std::multimap<std::string, const aiLight*> lights_;
    ModelLight light_;
    std::size_t count_ = 1;                                    ///< of lights
    std::map<std::string, std::vector<std::string>> leftOut_;  ///< names, by what is said of them
};

}  // namespace tessera
