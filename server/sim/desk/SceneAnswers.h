/// What the scene itself answers to those who do not follow it. Each answer costs what it tells, or a bound: what is
/// little the frame thread makes between two frames.
#pragma once

#include "common/base/Error.h"
#include "common/codec/ApplicationCodec.h"
#include "common/scene/Aspect.h"
#include "common/scene/Search.h"

namespace tessera {

struct DescribeLimits {
    std::size_t maxLooks = ~std::size_t{0};  ///< at nodes: on the way to names, above them, beside them for paths
    std::size_t maxBytes = ApplicationLimits().maxSceneBytes;  ///< of fields, about
};
/// `sequence` of what is returned is the caller's to set. A path that is too long to be told is the node's number.
/// kLimit: it would be more than the limits.
[[nodiscard]] Expected<answer::Objects> describe(const Aspect& scene, const ObjectsWish& wanted,
                                                 const DescribeLimits& limits = {});

struct PageLimits {
    std::size_t maxTold = 512;       ///< nodes
    std::size_t maxLookedAt = 8192;  ///< nodes, told or not
    /// Of fields, about; the node that goes beyond it is still told.
    std::size_t maxBytes = std::size_t{256} << 10;
    std::size_t maxSiblings = 65'536;  ///< looked at for the paths of what is found
    std::size_t maxWork = SearchOptions().maxWork;
    std::size_t maxObjectBytes = ~std::size_t{0};  ///< kLimit: one that is told has more
};
/// kNotFound: `wanted.node` is no node (any more). The lengths of films are left to the caller.
[[nodiscard]] Expected<answer::TreePage> treePage(const Aspect& scene, const TreeWish& wanted,
                                                  const PageLimits& limits = {});

/// A page of what `wanted.expression` names (common/scene/Search.h). kUsage: it is no expression. A node's path looks
/// at all siblings on its way; where these are too many for one page, `path` is its number ("#17").
[[nodiscard]] Expected<answer::FoundPage> foundPage(const Aspect& scene, const NodeSearch& wanted,
                                                    const PageLimits& limits = {});

}  // namespace tessera
