/// Where an edit says something of a Text, its outlines.
#pragma once

#include <string>
#include <vector>

#include "common/change/ChangeList.h"
#include "common/scene/Aspect.h"
#include "server/text/Typesetter.h"

namespace tessera {

/// Adds `outlines` to the list for each Text whose text, font, line spacing or alignment it sets, unless it sets them
/// itself: so what is taken back is taken back together, and what was saved looks as it did. `scene` is what the list
/// is meant for. Refused with the object's id, and then the list is as it was.
[[nodiscard]] Expected<void> setTexts(ChangeList& list, const Aspect& scene, Typesetter& typesetter,
                                      std::vector<std::string>& notes);

}  // namespace tessera
