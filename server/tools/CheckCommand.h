/// tessera-check: what is wrong with scenes, walls and panels.
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "common/base/Error.h"

namespace tessera {

struct CheckArguments {
    std::vector<std::string> files;
    std::vector<std::string> assets;
    std::string scene;  ///< in which panels are looked at; empty: by themselves
    bool json = false;
    bool machine = false;  ///< this machine is looked at, and no file
    bool allowUnconfined = false;
    std::size_t importMemoryMib = 0;  ///< 0: as ImportOptions has it
    std::vector<std::string> variants;
};
/// What --help, --version, --schema or --formats asked for.
struct CheckText {
    std::string text;
};

/// kUsage says what is wrong with the words.
[[nodiscard]] Expected<std::variant<CheckArguments, CheckText>> parseCheckArguments(
    const std::vector<std::string>& words);

struct CheckResult {
    std::string file;
    std::string what;  ///< in a good file: what it holds; else what is wrong, a line each, FILE:LINE:COLUMN: first
    std::vector<std::string> notes;  ///< what was left away or is not understood
    int exitCode = 0;                ///< as the programs have it; 0: good
};
/// A .wall file as a wall, a .panel file as a panel, anything else as a scene, which is imported whole.
[[nodiscard]] CheckResult checkFile(const std::string& path, const CheckArguments& arguments);

/// The whole program; returns its exit code: that of the first file that is not good.
[[nodiscard]] int runCheck(const std::vector<std::string>& words);

}  // namespace tessera
