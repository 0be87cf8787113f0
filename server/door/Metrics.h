/// How the wall is, for who collects figures of many machines.
#pragma once

#include <string>

#include "common/request/Requests.h"

namespace tessera {

/// OpenMetrics text 1.0: families `tessera_…`, `# EOF` at its end.
[[nodiscard]] std::string metricsText(const answer::Status& status);

}  // namespace tessera
