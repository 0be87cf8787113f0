/// Which types a scene of this build can hold, by name. `Cores.h` has their structs.
#pragma once

#include "common/cores/ShippedTypes.h"

// A build of its own may hold more types: the tests' does, to try kinds of fields that no shipped type has yet.
#ifdef TESSERA_EXTRA_TYPES
#include TESSERA_EXTRA_TYPES
#else
namespace tessera {
using ExtraTypes = TypeList<>;
}
#endif

namespace tessera {

using SceneTypes = JoinedTypes<ShippedTypes, ExtraTypes>;

/// The place of a type in `allTypes()`.
template <typename T>
inline constexpr auto kTypeIndex = static_cast<std::uint16_t>(placeIn<T>(SceneTypes()));

}  // namespace tessera
