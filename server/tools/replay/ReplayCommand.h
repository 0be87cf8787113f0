/// tessera-replay: makes a recording's frames again and says whether they are the same.
#pragma once

#include <limits>
#include <string>
#include <variant>
#include <vector>

#include "common/base/Error.h"

namespace tessera {

struct ReplayArguments {
    std::string file;
    unsigned threads = 1;
    std::uint64_t frames = std::numeric_limits<std::uint64_t>::max();
    bool json = false;
    bool contacts = false;
};

/// What --help or --version asked for.
struct ReplayHelp {
    std::string text;
};

/// kUsage says what is wrong with the words.
[[nodiscard]] Expected<std::variant<ReplayArguments, ReplayHelp>> parseReplayArguments(
    const std::vector<std::string>& words);

/// The whole program; returns its exit code: 0 the same, 1 different, 2 usage, 3 a file that is no (whole) recording.
/// Writes to stdout and stderr.
[[nodiscard]] int runReplay(const std::vector<std::string>& words);

}  // namespace tessera
