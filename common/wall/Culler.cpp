#include "common/wall/Culler.h"

#include <fmt/format.h>

#include <array>

namespace tessera {

namespace {

/// By number.
constexpr std::array<std::string_view, 4> kNames = {"none", "frustum", "masked", "auto"};

}  // namespace

Expected<CullerKind> parseCuller(std::string_view name) {
    for (std::size_t i = 0; i < kNames.size(); ++i)
        if (kNames[i] == name) return static_cast<CullerKind>(i);
    return fail(ErrorCode::kUsage, fmt::format("there is no culler '{}': use none, frustum, masked or auto", name));
}

std::string_view nameOf(CullerKind kind) {
    return kNames.at(static_cast<std::size_t>(kind));
}

}  // namespace tessera
