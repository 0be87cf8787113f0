#include "tests/architecture/Layers.h"

#include <fmt/format.h>

#include <sstream>

namespace tessera::architecture {

Expected<Layers> parseLayers(std::string_view text, const std::string& file) {
    Layers layers;
    layers.file = file;
    std::istringstream in{std::string(text)};
    std::string line;
    for (int number = 1; std::getline(in, line); ++number) {
        line = line.substr(0, line.find('#'));
        if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
        const auto wrong = [&](std::string_view what) {
            return fail(ErrorCode::kBadInput, fmt::format("{}:{}: {}", file, number, what));
        };

        // The colon that ends the left side is followed by a space or the end: `word std::mutex: common/base`.
        std::size_t colon = line.find(": ");
        if (colon == std::string::npos) colon = line.find_last_not_of(" \t\r");
        if (line[colon] != ':') return wrong("no colon: `module: modules that it may include`");
        std::istringstream left(line.substr(0, colon));
        std::istringstream right(line.substr(colon + 1));
        std::vector<std::string> head;
        std::set<std::string> names;
        for (std::string word; left >> word;) head.push_back(word);
        for (std::string word; right >> word;) names.insert(word);

        if (head.size() == 2 && head[0] == "third-party") {
            layers.thirdParty.push_back({.what = head[1], .owners = names, .line = number});
        } else if (head.size() == 2 && head[0] == "word") {
            layers.words.push_back({.what = head[1], .owners = names, .line = number});
        } else if (head.size() == 1 && head[0] == "system") {
            layers.system.insert(layers.system.end(), names.begin(), names.end());
        } else if (head.size() == 1) {
            if (!layers.modules.emplace(head[0], Layers::Module{.line = number, .mayInclude = names}).second) {
                return wrong(fmt::format("a second line for {}", head[0]));
            }
        } else {
            return wrong("neither `module: …` nor `third-party PREFIX: …` nor `word WORD: …` nor `system: …`");
        }
    }
    for (const auto& [name, module] : layers.modules) {
        for (const std::string& other : module.mayInclude) {
            if (other != "proto" && !layers.modules.contains(other)) {
                return fail(ErrorCode::kBadInput, fmt::format("{}:{}: {} may include {}, which has no line of its own",
                                                              file, module.line, name, other));
            }
        }
    }
    return layers;
}

}  // namespace tessera::architecture
