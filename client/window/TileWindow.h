/// A window that shows what a host shows of one tile: the picture in its `shown.frame`, whoever draws it.
///
/// Without OpenGL unless vsync is asked for: so it is a process of its own, beside hosts that draw with OSMesa.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "client/window/Monitors.h"
#include "common/base/Error.h"

namespace tessera {

struct WindowOptions {
    std::string frameFile;  ///< `tiles/TILE/shown.frame`; may come later
    std::string title;
    std::string monitor;  ///< number or name; empty: the first
    bool fullScreen = false;
    bool vsync = false;   ///< through a renderer of the graphics driver
    std::optional<PlacedPart> part;  ///< where it stands when it is no full screen
    std::string log;                 ///< a line per shown picture: number, when its host showed it, when it stood here; ns, CLOCK_MONOTONIC
};

/// The calling thread is the process' main one. Returns when the window was closed or the process is asked to end. Errors:
/// kUnsupported: no display, no such driver; kNotFound: no such monitor; kFailed: the log cannot be written.
[[nodiscard]] Expected<void> runWindow(const WindowOptions& options);
/// The desktop's monitors. Errors as above.
[[nodiscard]] Expected<std::vector<Monitor>> monitorsHere();

}  // namespace tessera
