/// The verbs that speak of collisions: contacts, questions, answer; and what a stopped motion met.
#pragma once

#include <span>

#include "client/ctl/Answer.h"
#include "client/ctl/CommandLine.h"

namespace tessera {

/// Follows frames with `follow`, handing lines to `print` as they come, and what else there is to say to `warn`: text,
/// or with `json` one object for each frame.
[[nodiscard]] Expected<Answer> run(Application& application, const verb::Contacts& wanted, bool json,
                                   const Print& print, const Print& warn);
[[nodiscard]] Expected<Answer> run(Application& application, const verb::Questions&);
[[nodiscard]] Expected<Answer> run(Application& application, const verb::Respond& decision);

/// What was touched by whatever hangs on these transforms, as far as the newest frame's contacts tell: a line, and an
/// entry, for each pair of nodes. Nothing where none of them names these transforms.
[[nodiscard]] Answer whatStopped(Application& application, std::span<const ObjectId> transforms);

}  // namespace tessera
