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

}  // namespace tessera
