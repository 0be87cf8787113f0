/// "Did you mean …?"
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace tessera {

/// The known name with the fewest edits (Levenshtein 1966) to `wanted`, upper and lower case alike; empty when none is
/// near enough to be what was meant. The first of equally near ones.
[[nodiscard]] std::string nearestName(std::string_view wanted, std::span<const std::string> known);

}  // namespace tessera
