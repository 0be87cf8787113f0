/// `measure`: how far something is from a place.
#pragma once

#include "client/ctl/Answer.h"
#include "client/ctl/CommandLine.h"
#include "common/application/Application.h"

namespace tessera {

/// Each is a place, "X,Y,Z" in the world, or a node; one of them at least is a place. kUsage.
[[nodiscard]] Expected<verb::Measure> measureVerb(const std::string& from, const std::string& to);

[[nodiscard]] Expected<Answer> run(Application& application, const verb::Measure& measure);

}  // namespace tessera
