/// Where the joints of skins have got to, as the skins' own `pose`: what travels, and what every host deforms its mesh
/// by.
#pragma once

#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "common/math/Types.h"
#include "common/scene/Aspect.h"

namespace tessera {

/// The skins of a scene that have joints, followed through its lists. Not thread-safe.
///
/// pose[j] = bearer_T_world · world_T_joint[j] · joint_T_bind[j], the bearer being the node whose core the skin is (of
/// several the one with the lowest id): glTF 2.0, "Skins", has the mesh where its joints are, whatever the bearer's own
/// transform is. It is calculated from the nearest node that holds bearer and joints, so nothing changes when all of
/// them are carried away together.
///
/// A list costs a look-up per entry that moves or places something; a frame the skins whose joints or bearer it has
/// moved, and what lies between them.
class SkinPoses {
public:
    /// After each list applied to the scene, with that list; null: anything may have changed.
    void update(const Aspect& scene, const ChangeList* list);

    /// Adds the poses that are no longer right, by the bytes that differ. A pose that cannot be said (a bearer scaled
    /// to nothing, joints out of this world) stays as it was; why is appended to `remarks`, once until it can be said
    /// again. `scene`: as of the last update.
    void write(const Aspect& scene, ChangeListBuilder& builder, std::vector<std::string>& remarks);

    /// How many were calculated since the start.
    [[nodiscard]] std::uint64_t calculated() const { return calculated_; }

private:
    struct Known {
        std::set<ObjectId> bearers;
        std::vector<ObjectId> watched;  ///< nodes between the one that holds all and bearer and joints, and their cores
        ObjectId holder;                ///< none: what stands in world coordinates
        bool complained = false;
    };
    void look(const Aspect& scene, ObjectId skin);
    void forget(ObjectId skin);
    void unwatch(ObjectId skin, Known& known);

    std::unordered_map<ObjectId, Known> known_;
    std::unordered_map<ObjectId, std::set<ObjectId>> watchers_;  ///< by node or core
    std::set<ObjectId> stale_;
    std::uint64_t calculated_ = 0;
};

}  // namespace tessera
