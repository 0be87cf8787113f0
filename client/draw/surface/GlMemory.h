/// How much of GL's memory this process may take.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>

#include "client/draw/surface/GlFunctions.h"
#include "client/draw/surface/Surface.h"

namespace tessera {

/// In bytes.
struct GlMemory {
    std::size_t limit = 0;  ///< that it may take for good
    std::size_t there = 0;  ///< what it has taken, and what is free
    bool hard = false;      ///< nothing lies beyond `there`: the system would end the process
};

/// For a process that has `taken` so many and was told no limit. Where the driver tells what is free on the card
/// (GL_NVX_gpu_memory_info, GL_ATI_meminfo): three quarters of that and of `taken`. Where the processor draws: a
/// quarter of `taken` and of freeOnMachine, kMostOnProcessor at most. A driver that tells nothing gets that quarter,
/// too. Processes that ask again and again come to share what there is. At least kLeastGlMemory. The surface is
/// current.
[[nodiscard]] GlMemory memoryForGl(const GlFunctions& gl, const Surface& surface, std::size_t taken);
inline constexpr std::size_t kLeastGlMemory = std::size_t{256} << 20, kMostOnProcessor = std::size_t{3} << 30;

/// What memoryForGl says where the processor draws and so much is free; nothing: nobody knows.
[[nodiscard]] GlMemory memoryOfProcessor(std::optional<std::size_t> free, std::size_t taken);
/// Bytes that this process may still take: MemAvailable of /proc/meminfo, and what the control groups (version 2) that
/// it is in leave. Nothing: the system does not say. `root`: where those files are.
[[nodiscard]] std::optional<std::size_t> freeOnMachine(const std::filesystem::path& root = "/");

}  // namespace tessera
