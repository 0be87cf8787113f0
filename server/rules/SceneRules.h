/// Whether what a list of changes leaves behind makes sense, beyond what the table of types says of each field.
#pragma once

#include <set>

#include "common/change/ChangeList.h"
#include "common/scene/Aspect.h"
#include "server/rules/Fault.h"

namespace tessera {

/// The first fault of the list, applied to the scene. Ids may be placeholders, as long as the list creates them. What
/// else is wrong with the list is the scene's to refuse. Costs what the checks cost (`…Check.h`): look-ups by what the
/// list says, not by the size of the scene. `movies`: all that the scene has.
[[nodiscard]] Sound checkRules(const Aspect& scene, const ChangeList& list, const std::set<ObjectId>& movies);

/// The same for who has one scene and commits one list after the other. Not thread-safe.
class SceneRules {
public:
    /// After each list applied to the scene, with that list; null: anything may have changed.
    void follow(const Aspect& scene, const ChangeList* list);
    [[nodiscard]] Sound check(const Aspect& scene, const ChangeList& list) const {
        return checkRules(scene, list, movies_);
    }

private:
    std::set<ObjectId> movies_;  ///< of the scene
};

}  // namespace tessera
