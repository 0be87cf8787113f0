/// Channels of animations name what they drive, and skins their joints: by names, keys and materials of their file.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "server/import/MaterialCores.h"
#include "server/import/NodeReferences.h"
#include "server/import/PlacedNodes.h"

namespace tessera {

/// Looks them up once everything of a file has its place. Not thread-safe.
class AnimationParts {
public:
    AnimationParts(SceneDraft& draft, MaterialCores& materials, NodeReferences& names)
        : draft_(draft), materials_(materials), names_(names) {}

    using Keys = std::map<std::uint32_t, PlacedNode*>;
    /// What a file has begun that another one stands in.
    struct Outer {
        Keys keys;
        std::size_t pending = 0;
    };
    /// Keys are a file's own.
    [[nodiscard]] Outer beginFile();
    /// Looks up what the file named; then the outer one goes on.
    Expected<void> endFile(LoadedFile& file, Outer outer);

    void key(std::uint32_t key, PlacedNode* node) { keys_[key] = node; }
    /// What an animation or a skin names. `core`: of it. `from`: the node that bears it.
    void take(const LoadedFile& file, const proto::scene::Node& node, ObjectId core, PlacedNode* from, PlacedNode* top);

private:
    struct Pending {
        ObjectId core;
        const proto::scene::Animation* animation = nullptr;  ///< one of the two
        const proto::scene::Skin* skin = nullptr;
        PlacedNode* from;
        PlacedNode* top;
        std::string where;
    };
    Expected<void> resolve(LoadedFile& file, const Pending& parts);
    Expected<void> resolveJoints(LoadedFile& file, const Pending& parts);
    Expected<ObjectId> keyFrames(LoadedFile& file, const proto::scene::Channel& channel, const Pending& parts);
    /// What has the field: the transform of a node, its content, or the node; or a material.
    Expected<ObjectId> channelTarget(LoadedFile& file, const proto::scene::Channel& channel, const Pending& parts);
    [[nodiscard]] PlacedNode* atKey(std::uint32_t key) const;

    SceneDraft& draft_;
    MaterialCores& materials_;
    NodeReferences& names_;
    Keys keys_;  ///< of the file that is being placed
    std::vector<Pending> pending_;
};

}  // namespace tessera
