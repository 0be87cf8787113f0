/// What a change list means for collisions.
#pragma once

#include <span>
#include <vector>

#include "common/change/ChangeList.h"

namespace tessera {

/// The rows of a list's columns, by what they affect. They live as long as the list.
struct SceneEffects {
    using Rows = std::vector<std::span<const ObjectId>>;

    std::span<const Placement> placements;
    Rows cores;          ///< nodes that bear another core
    Rows choices;        ///< cores that show other children
    Rows poses;          ///< cores that carry what is below them elsewhere
    Rows shapes;         ///< drawables that look different
    Rows objectRules;    ///< CollisionObjects: what belongs to whom
    Rows objectTerms;    ///< CollisionObjects: how it moves
    Rows interestRules;  ///< Interests: who is of interest to whom
    Rows interestTerms;  ///< Interests: what is asked of them
    bool surroundings = false;

    /// Whether who takes part, or with whom, may be another matter. Creations and destructions alone do not: what is
    /// not placed is not visible, and what is visible is not destroyed.
    [[nodiscard]] bool structural() const {
        return !placements.empty() || !cores.empty() || !choices.empty() || !objectRules.empty() ||
               !interestRules.empty();
    }
};

[[nodiscard]] SceneEffects sceneEffectsOf(const ChangeList& list);
/// Whether what was there before the list may be of interest to others now. A new object disturbs whom it touches, and
/// they see it as new.
[[nodiscard]] bool changesRules(const ChangeList& list);

}  // namespace tessera
