#include "common/math/Placing.h"

#include <fmt/format.h>

namespace tessera {

Expected<void> checkPlacing(const Placing& placing) {
    if (placing.at && !(placing.at->cwiseAbs().maxCoeff() <= kMaxPlacingCoordinate))
        return fail(ErrorCode::kBadInput, fmt::format("it would stand farther than {:g} units from the origin, or nowhere", kMaxPlacingCoordinate));
    if (placing.scale && placing.fit) return fail(ErrorCode::kBadInput, "a scale and a size that it shall have contradict each other");
    const auto good = [](double factor) { return factor >= 1 / kMaxPlacingScale && factor <= kMaxPlacingScale; };
    if (placing.scale && !good(*placing.scale))
        return fail(ErrorCode::kBadInput, fmt::format("a scale of {:g}: it has to be between {:g} and {:g}", *placing.scale, 1 / kMaxPlacingScale, kMaxPlacingScale));
    if (placing.fit && !good(*placing.fit))
        return fail(ErrorCode::kBadInput, fmt::format("a size of {:g}: it has to be between {:g} and {:g}", *placing.fit, 1 / kMaxPlacingScale, kMaxPlacingScale));
    return {};
}

}  // namespace tessera
