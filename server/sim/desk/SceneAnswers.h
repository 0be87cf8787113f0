/// What the scene itself answers to those who do not follow it. Each answer costs what it tells, or a bound: the frame
/// thread makes it between two frames.
#pragma once

#include "common/base/Error.h"
#include "common/codec/ApplicationCodec.h"
#include "common/scene/Aspect.h"

namespace tessera {

/// `sequence` of what is returned is the caller's to set.
[[nodiscard]] answer::Objects describe(const Aspect& scene, const request::GetObjects& wanted);

struct PageLimits {
    std::size_t maxTold = 512;       ///< nodes
    std::size_t maxLookedAt = 8192;  ///< nodes, told or not
    /// Of fields, about; the node that goes beyond it is still told.
    std::size_t maxBytes = std::size_t{256} << 10;
};
/// kNotFound: `wanted.node` is no node (any more).
[[nodiscard]] Expected<answer::TreePage> treePage(const Aspect& scene, const request::GetTree& wanted,
                                                  const PageLimits& limits = {});

}  // namespace tessera
