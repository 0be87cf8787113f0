#include "server/import/reader/CountedNotes.h"

#include <fmt/format.h>

namespace tessera {

void CountedNotes::add(const std::string& what, const std::string& name, bool isMissing) {
    Kind& kind = kinds_[what];
    if (kind.count++ == 0) kind.first = name;
    kind.isMissing = kind.isMissing || isMissing;
}

void CountedNotes::writeTo(PlainScene& scene) const {
    constexpr std::size_t kMost = 10;
    std::size_t line = 0;
    for (const auto& [what, found] : kinds_) {
        if (++line > kMost)
            return scene.note(fmt::format("{} more kinds of things are left out", kinds_.size() - kMost));
        const std::string text =
            fmt::format("{}{}{}", what, found.count > 1 ? fmt::format(", {} times", found.count) : "",
                        found.first.empty() ? "" : fmt::format(" (the first: '{}')", found.first));
        if (found.isMissing)
            scene.noteMissing(text);
        else
            scene.note(text);
    }
}

}  // namespace tessera
