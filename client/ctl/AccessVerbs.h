/// Who comes in, and how.
#pragma once

#include "client/ctl/Answer.h"
#include "client/ctl/CommandLine.h"

namespace tessera {

[[nodiscard]] Expected<Answer> run(Application& application, const verb::Who&);
[[nodiscard]] Expected<Answer> run(Application& application, const verb::People&);
/// Asks no server: what it has left for its user's programs is read. kNotFound: it runs elsewhere, as somebody else, or
/// has no console.
[[nodiscard]] Expected<Answer> linkOf(const CommandLine& line, const verb::Link& wanted);

}  // namespace tessera
