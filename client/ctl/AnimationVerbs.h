/// The verbs that speak of what plays: animations, play, pause, seek, speed.
#pragma once

#include "client/ctl/Answer.h"
#include "client/ctl/CommandLine.h"

namespace tessera {

/// All animations, motions and films that stand in the tree: where, how many channels and keys, mode, time, speed, whether each plays, or why it cannot.
[[nodiscard]] Expected<Answer> run(Application& application, const verb::Animations&);
/// Edits of fields, as `set` makes them. Of a node that bears an Animation or a Movie (or, but for its speed, a Motion).
[[nodiscard]] Expected<Answer> run(Application& application, const verb::Play& wanted);

}  // namespace tessera
