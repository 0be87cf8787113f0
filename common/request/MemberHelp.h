/// What members are for whose description does not say it. Internal to common/request.
#pragma once

#include <string_view>

namespace tessera {

/// Half a sentence; empty: nothing is known.
[[nodiscard]] std::string_view memberHelp(std::string_view owner, std::string_view member);

}  // namespace tessera
