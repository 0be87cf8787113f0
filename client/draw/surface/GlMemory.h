/// How much of GL's memory this process may take.
#pragma once

#include <cstddef>

#include "client/draw/surface/GlFunctions.h"

namespace tessera {

/// In bytes, for a process that has `taken` so many and was told no limit. Three quarters of these and of what is free
/// on the card, where the driver tells that (GL_NVX_gpu_memory_info, GL_ATI_meminfo): processes that ask again and
/// again come to share a card. Else, and where the processor draws, a quarter of the machine's memory. At least
/// kLeastGlMemory. The surface is current.
[[nodiscard]] std::size_t memoryForGl(const GlFunctions& gl, const Surface& surface, std::size_t taken);
inline constexpr std::size_t kLeastGlMemory = std::size_t{256} << 20;

}  // namespace tessera
