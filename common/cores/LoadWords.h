/// What the numbers in fields of Inline and ProxyGroup mean: for whoever reads such a number and holds neither.
#pragma once

#include <cstdint>

namespace tessera {

/// What Inline and ProxyGroup share. The server loads the file and puts what it holds below the node, as children of
/// it; from then on they are part of the scene as any others: saved, edited, undone.
struct LoadWords {
    static constexpr std::int64_t kAtOnce = 0, kNear = 1, kByHand = 2;
    static constexpr std::int64_t kWaiting = 0, kLoading = 1, kThere = 2, kFailed = 3;
};

}  // namespace tessera
