/// The same benchmark with the instructions that Debian's peers were built for.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace tessera {

/// Runs this very program with these words in a process of its own under TESSERA_ISA=sse41, waits for it, and reads the
/// ratios of its rows from its JSON: by case, in the order of the rows that have that name. Says so, and gives nothing,
/// where that fails.
[[nodiscard]] std::map<std::string, std::vector<double>> ratiosOfOlderProcessor(std::vector<std::string> words);

}  // namespace tessera
