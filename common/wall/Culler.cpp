#include "common/wall/Culler.h"

#include <fmt/format.h>

namespace tessera {

namespace {

/// By number.
constexpr std::array<std::string_view, kAllCullers.size()> kNames = {"none",   "frustum",  "queries-wait", "queries",
                                                                     "masked", "twophase", "auto"};

}  // namespace

const std::string& cullerNames() {
    static const std::string names =
        fmt::format("{} or {}", fmt::join(kNames.begin(), kNames.end() - 1, ", "), kNames.back());
    return names;
}

Expected<CullerKind> parseCuller(std::string_view name) {
    for (const CullerKind kind : kAllCullers)
        if (nameOf(kind) == name) return kind;
    return fail(ErrorCode::kUsage, fmt::format("there is no culler '{}': use {}", name, cullerNames()));
}

std::string_view nameOf(CullerKind kind) {
    return kNames.at(static_cast<std::size_t>(kind));
}

bool asksRenderer(CullerKind kind) {
    return kind == CullerKind::kQueriesWait || kind == CullerKind::kQueries || kind == CullerKind::kTwoPhase;
}

}  // namespace tessera
