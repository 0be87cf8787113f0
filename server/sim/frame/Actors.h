/// The table of those who act on the scene beside people.
#pragma once

#include <vector>

#include "server/manipulators/ManipulatorDisplay.h"
#include "server/sim/display/ContactDisplay.h"
#include "server/sim/frame/Actor.h"
#include "server/sim/frame/Animations.h"
#include "server/sim/frame/InlineContents.h"
#include "server/sim/frame/Motions.h"
#include "server/sim/frame/SkinPoses.h"

namespace tessera {

struct OutsideActors;

/// Those of the step whom somebody asks something; nobody asks the others, and they live in their rows.
struct StepActors {
    Motions motions;
    Animations animations;
    InlineContents inlines;
    SkinPoses skins;
    ManipulatorDisplay handles;
    ContactDisplay contacts;
};

/// A row each, in the order in which they speak: an actor more is its class and a row here. Both outlive the rows.
/// Without `outside`, as in a replay, its rows say nothing.
[[nodiscard]] std::vector<Actor> actorsOf(StepActors& step, OutsideActors* outside);

}  // namespace tessera
