/// Carries out one command against a server.
#pragma once

#include <nlohmann/json.hpp>

#include <string>

#include "client/ctl/CommandLine.h"
#include "common/base/Error.h"

namespace tessera {

/// The same answer for people and for programs.
struct Answer {
    std::string text;  ///< lines, each ended
    nlohmann::ordered_json json;
    std::string warning;  ///< for stderr; empty: none
};

[[nodiscard]] Expected<Answer> carryOut(const CommandLine& line);

/// What the program prints and returns.
struct CtlOutcome {
    int exitCode = 0;
    std::string out, err;
};
/// The whole of tessera-ctl. `words` without the program's name.
[[nodiscard]] CtlOutcome runCtl(const std::vector<std::string>& words);

}  // namespace tessera
