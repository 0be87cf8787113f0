/// Carries out one command against a server.
#pragma once

#include <string>

#include "client/ctl/Answer.h"
#include "client/ctl/CommandLine.h"
#include "common/base/Error.h"

namespace tessera {

/// `print` takes what a verb that follows the wall has to say before its end.
[[nodiscard]] Expected<Answer> carryOut(const CommandLine& line, const Print& print);

/// What the program prints and returns.
struct CtlOutcome {
    int exitCode = 0;
    std::string out, err;
};
/// The whole of tessera-ctl. `words` without the program's name. What `print` has taken is not in the outcome.
[[nodiscard]] CtlOutcome runCtl(const std::vector<std::string>& words, const Print& print);
/// All of it at the end.
[[nodiscard]] CtlOutcome runCtl(const std::vector<std::string>& words);

}  // namespace tessera
