/// The verbs that speak of what plays: animations, play, pause, seek, speed.
#pragma once

#include "client/ctl/Answer.h"
#include "client/ctl/CommandLine.h"

namespace tessera {

/// All animations, motions, films and streams of particles that stand in the tree: where, how many channels and keys,
/// mode, time, speed, whether each plays, or why it cannot.
[[nodiscard]] Expected<Answer> run(Application& application, const verb::Animations&);
/// Edits of fields, as `set` makes them, of a node that bears one of these. A Motion has no speed.
[[nodiscard]] Expected<Answer> run(Application& application, const verb::Play& wanted);

}  // namespace tessera
