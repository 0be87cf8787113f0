#include "server/import/coin/CountedNotes.h"

#include <fmt/format.h>

namespace tessera {

void CountedNotes::add(const std::string& what, const std::string& name) {
    auto& [count, first] = kinds_[what];
    if (count++ == 0) first = name;
}

void CountedNotes::writeTo(PlainScene& scene) const {
    constexpr std::size_t kMost = 10;
    std::size_t line = 0;
    for (const auto& [what, found] : kinds_) {
        if (++line > kMost)
            return scene.note(fmt::format("{} more kinds of things are left out", kinds_.size() - kMost));
        const auto& [count, first] = found;
        scene.note(fmt::format("{}{}{}", what, count > 1 ? fmt::format(", {} times", count) : "",
                               first.empty() ? "" : fmt::format(" (the first: '{}')", first)));
    }
}

}  // namespace tessera
