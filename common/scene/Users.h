/// Who refers to an object, in words. Internal to common/scene.
#pragma once

#include <cstdint>
#include <string>

#include "common/scene/Aspect.h"

namespace tessera {

/// ": /hall/wish (Interest), #17 (Material), and 4 more": those that refer to `id` once the list is applied, of `uses` references; a core by a node
/// that bears it. Three at most, and empty in scenes of more than a million objects: it looks at all of them, for a refusal's words alone.
[[nodiscard]] std::string usersInWords(const Aspect& aspect, const ChangeList& list, ObjectId id, std::int64_t uses);

}  // namespace tessera
