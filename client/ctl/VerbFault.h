/// What is wrong with the words of a command line, so that it leads on.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace tessera {

/// What is wrong with words of which none is a verb of `app`: the verb that was meant, or those that people need first.
[[nodiscard]] std::string verbFault(const CLI::App& app, const std::vector<std::string>& words);

/// " (did you mean '--by'?)" of the first word that is no option of this verb, or nothing.
[[nodiscard]] std::string optionMeant(const CLI::App& verb, const std::vector<std::string>& words);
/// Options of a verb may stand before it: where the words begin with an option, the verb is put in front.
[[nodiscard]] std::vector<std::string> withVerbFirst(const CLI::App& app, std::vector<std::string> words);

}  // namespace tessera
