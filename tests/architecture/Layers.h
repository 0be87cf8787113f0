/// layers.txt: which module may include which, who owns a third-party header, who may use a word.
#pragma once

#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/Error.h"

namespace tessera::architecture {

struct Layers {
    struct Module {
        int line = 0;
        std::set<std::string> mayInclude;
    };
    /// `third-party PREFIX: owners` and `word WORD: owners`; "*" among the owners means everybody.
    struct Owned {
        std::string what;
        std::set<std::string> owners;
        int line = 0;
    };
    std::string file;  ///< for messages
    std::map<std::string, Module> modules;
    std::vector<Owned> thirdParty;
    std::vector<Owned> words;
    std::vector<std::string> system;  ///< prefixes of headers of C, POSIX and Linux: everybody may include them
};

[[nodiscard]] Expected<Layers> parseLayers(std::string_view text, const std::string& file);

}  // namespace tessera::architecture
