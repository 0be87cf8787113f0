/// Where a tile is drawn: a GL context without a window. One thread creates, uses and destroys it.
#pragma once

#include <memory>
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

/// "osmesa". Other names: kUnsupported, naming those that this build has.
[[nodiscard]] Expected<std::unique_ptr<Surface>> makeSurface(std::string_view name);

/// How many threads of its own a software surface may draw with; 0: everything on the caller's. The pixels do not
/// depend on it. Counts when called before the process' first surface is made and before it has other threads.
void limitDrawThreads(int threads);

}  // namespace tessera
