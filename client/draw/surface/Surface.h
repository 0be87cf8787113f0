/// Where a tile is drawn: a GL context without a window. One thread creates, uses and destroys it.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/Error.h"

namespace tessera {

class Surface {
public:
    virtual ~Surface() = default;
    /// Makes the context current on the calling thread.
    [[nodiscard]] virtual Expected<void> makeCurrent() = 0;
    /// As glGetProcAddress. Never call a function that the version does not promise.
    [[nodiscard]] virtual void* procAddress(const char* name) const = 0;
    /// For reports, e.g. "OSMesa, llvmpipe (LLVM 14)".
    [[nodiscard]] virtual std::string description() const = 0;
};

/// Whether that is Mesa's software.
[[nodiscard]] bool drawsOnProcessor(const Surface& surface);

struct SurfaceOptions {
    /// Of "egl": which of the machine's devices, counted from 0. Nothing: the first GPU, else Mesa's software.
    std::optional<int> device;
};

/// "osmesa": Mesa's software, without a window system. "egl": a GPU, or Mesa's software, without a window. Each loads
/// its library when it is asked for. Other names, no library, no such device, a driver below OpenGL 4.5: kUnsupported,
/// saying what there is.
[[nodiscard]] Expected<std::unique_ptr<Surface>> makeSurface(std::string_view name, const SurfaceOptions& options = {});

/// The names above, for messages: "osmesa, egl".
[[nodiscard]] std::string surfaceNames();

/// How many threads of its own a software surface may draw with; 0: everything on the caller's. The pixels do not
/// depend on it. Counts when called before the process' first surface is made and before it has other threads.
void limitDrawThreads(int threads);

}  // namespace tessera
