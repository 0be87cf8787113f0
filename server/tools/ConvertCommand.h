/// tessera-convert: any readable scene to Tessera's own files, and to those of other programs.
#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/base/Error.h"
#include "common/export/Export.h"
#include "server/optimise/SceneOptimiser.h"

namespace tessera {

struct ConvertArguments {
    std::string in, out;
    std::vector<std::string> assets;
    bool allowUnconfined = false;
    std::size_t importMemoryMib = 0;  ///< 0: as ImportOptions has it
    std::vector<std::string> variants;
    std::optional<OptimiseOptions> optimise;
    std::optional<ExportOptions> leaves;  ///< for a file of other programs
};
/// What --help or --version asked for.
struct ConvertHelp {
    std::string text;
};

/// kUsage says what is wrong with the words.
[[nodiscard]] Expected<std::variant<ConvertArguments, ConvertHelp>> parseConvertArguments(
    const std::vector<std::string>& words);

/// The whole program; returns its exit code. Writes to stdout and stderr.
[[nodiscard]] int runConvert(const std::vector<std::string>& words);

}  // namespace tessera
