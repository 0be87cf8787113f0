/// What queries of surfaces find, as the pair table tells it.
#pragma once

#include <algorithm>
#include <utility>

#include "server/collision/pairwise/PairTable.h"
#include "server/collision/query/TouchQuery.h"

namespace tessera {

[[nodiscard]] inline PairTouch foundTouch(const TouchedPair& found) {
    PairTouch out;
    out.touch = found.touch;
    out.complete = found.touch != Touch::kUnknown;
    if (found.touch != Touch::kYes) return out;
    out.count = 1;
    out.faces = {found.faces};
    return out;
}

/// The first `most` are named.
[[nodiscard]] inline PairTouch foundContacts(FacePairs found, std::size_t most) {
    PairTouch out;
    out.touch = !found.pairs.empty() ? Touch::kYes : found.complete ? Touch::kNo : Touch::kUnknown;
    out.complete = found.complete;
    out.count = found.pairs.size();
    out.faces = std::move(found.pairs);
    out.faces.resize(std::min(out.faces.size(), most));
    out.faces.shrink_to_fit();
    return out;
}

}  // namespace tessera
