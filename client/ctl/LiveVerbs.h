/// A wall while it runs: `top`, `watch`, `trace`.
#pragma once

#include "client/ctl/Answer.h"
#include "client/ctl/CommandLine.h"

namespace tessera {

/// A table that is drawn anew until q, Ctrl-C or a signal ends it. Once, as text or JSON, where standard output is no
/// terminal or JSON is wanted.
[[nodiscard]] Expected<Answer> run(Application& application, const verb::Top& top, bool json);
/// A line for each thing that happens, until a signal, its time or the server ends it.
[[nodiscard]] Expected<Answer> run(Application& application, const verb::Watch& watch, bool json, const Print& print);
/// Writes what so many frames have told. kNetwork: none came.
[[nodiscard]] Expected<Answer> run(Application& application, const verb::Trace& trace);

}  // namespace tessera
