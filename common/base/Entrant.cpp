#include "common/base/Entrant.h"

#include <fmt/format.h>

namespace tessera {

std::string_view nameOf(Entrant::By by) {
    switch (by) {
        case Entrant::By::kNothing:
            break;
        case Entrant::By::kWord:
            return "the server's token";
        case Entrant::By::kPass:
            return "a token";
        case Entrant::By::kKey:
            return "a key";
    }
    return "nothing";
}

std::string toText(const Entrant& entrant) {
    return fmt::format("{}/{}/{}/{}/{}", nameOf(entrant.role), static_cast<int>(entrant.by), entrant.panel,
                       entrant.from, entrant.name);
}

std::optional<Entrant> readEntrant(std::string_view text) {
    for (const Role role : {Role::kViewer, Role::kEditor, Role::kOperator})
        for (int by = 0; by <= static_cast<int>(Entrant::By::kKey); ++by) {
            const std::string before = fmt::format("{}/{}/", nameOf(role), by);
            if (!text.starts_with(before)) continue;
            const std::string_view left = text.substr(before.size());
            const std::size_t panel = left.find('/'), from = panel == left.npos ? panel : left.find('/', panel + 1);
            if (from == left.npos) return std::nullopt;
            return Entrant{role, static_cast<Entrant::By>(by), std::string(left.substr(from + 1)),
                           std::string(left.substr(panel + 1, from - panel - 1)), std::string(left.substr(0, panel))};
        }
    return std::nullopt;
}

}  // namespace tessera
