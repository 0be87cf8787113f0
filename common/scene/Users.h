/// Who refers to an object, in words. Internal to common/scene.
#pragma once

#include <cstdint>
#include <string>

#include "common/scene/Aspect.h"

namespace tessera {

/// "7 other objects: /hall/wish (Interest), #17 (Material), #18 (Material), and 4 more": those that refer to `id` once
/// the list is applied; a core by a node that bears it. It looks at all objects, for a refusal's words alone; in scenes
/// of more than a million it says how many `references` there are.
[[nodiscard]] std::string usersInWords(const Aspect& aspect, const ChangeList& list, ObjectId id,
                                       std::int64_t references);

}  // namespace tessera
