#include "client/draw/surface/GlMemory.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <optional>

namespace tessera {
namespace {

// Of extensions that glcorearb.h leaves out; both in KiB. The second is of four numbers: free in all comes first.
constexpr GLenum kFreeNvx = 0x9049, kTextureFreeAti = 0x87FC;

std::optional<std::size_t> freeOnCard(const GlFunctions& gl) {
    std::array<GLint, 4> kib{};
    if (gl.hasExtension("GL_NVX_gpu_memory_info"))
        gl.GetIntegerv(kFreeNvx, kib.data());
    else if (gl.hasExtension("GL_ATI_meminfo"))
        gl.GetIntegerv(kTextureFreeAti, kib.data());
    else
        return std::nullopt;
    return std::size_t{1024} * static_cast<std::size_t>(std::max(0, kib[0]));
}

std::size_t machineBytes() {
    const long pages = ::sysconf(_SC_PHYS_PAGES), size = ::sysconf(_SC_PAGESIZE);
    return pages > 0 && size > 0 ? static_cast<std::size_t>(pages) * static_cast<std::size_t>(size) : 0;
}

}  // namespace

std::size_t memoryForGl(const GlFunctions& gl, const Surface& surface, std::size_t taken) {
    const std::optional<std::size_t> free = drawsOnProcessor(surface) ? std::nullopt : freeOnCard(gl);
    return std::max(kLeastGlMemory, free ? (taken + *free) / 4 * 3 : machineBytes() / 4);
}

}  // namespace tessera
