/// A surface whose GL does nothing: what is left of a frame's time is ours alone. It counts what is uploaded.
#pragma once

#include <cstdint>

#include "client/draw/surface/Surface.h"

namespace tessera::bench {

/// Written to buffers since the process began, by any such surface.
struct SilentUploads {
    std::uint64_t calls = 0, bytes = 0;
};

/// Takes every call of OpenGL 4.5 and answers as if all went well. One at a time.
class SilentSurface final : public Surface {
public:
    Expected<void> makeCurrent() override { return {}; }
    void* procAddress(const char* name) const override;
    std::string description() const override { return "GL that does nothing"; }
    [[nodiscard]] static SilentUploads uploads();
};

}  // namespace tessera::bench
