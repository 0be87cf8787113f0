/// Software contexts for tests, used again.
#pragma once

#include <memory>

#include "client/draw/surface/Surface.h"

namespace tessera::test {

/// An OSMesa context of the calling thread: one whose last user is gone, or else a fresh one. A fresh one compiles its
/// blits and the set-ups of its triangles, which Mesa (22.3.6) keeps in no cache: 0.1 s and more. A Renderer leaves GL
/// as it found it (GlState), so none sees what was drawn before.
[[nodiscard]] std::unique_ptr<Surface> pooledSurface();

}  // namespace tessera::test
