/// Carries out one command against a server.
#pragma once

#include <string>

#include "client/ctl/Answer.h"
#include "client/ctl/CommandLine.h"
#include "common/base/Error.h"
#include "common/net/Platform.h"

namespace tessera {

/// `print` takes what a verb that follows the wall has to say before its end, `warn` what it has to say beside that.
[[nodiscard]] Expected<Answer> carryOut(const CommandLine& line, const Print& print, const Print& warn,
                                        const Platform& platform);

/// What the program prints and returns.
struct CtlOutcome {
    int exitCode = 0;
    std::string out, err;
};
void warnOnStderr(const std::string& lines);
/// The whole of tessera-ctl. `words` without the program's name. What `print` and `warn` have taken is not in the
/// outcome.
[[nodiscard]] CtlOutcome runCtl(const std::vector<std::string>& words, const Print& print,
                                const Print& warn = warnOnStderr, const Platform& platform = {});
/// All of it at the end, but for warnings, which are printed as they come.
[[nodiscard]] CtlOutcome runCtl(const std::vector<std::string>& words);

}  // namespace tessera
