/// A window that shows what a host shows of one tile: the picture in its `shown.frame`, whoever draws it; or what an
/// output makes of it, and of the other eye's.
///
/// Without OpenGL unless vsync is asked for: so it is a process of its own, beside hosts that draw with OSMesa.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "client/output/OutputMaker.h"
#include "client/window/Monitors.h"
#include "common/base/Error.h"

namespace tessera {

struct WindowOptions {
    std::vector<std::string> frameFiles;  ///< `tiles/TILE/shown.frame`, of each tile of the output; may come later
    std::optional<OutputMaker> output;    ///< none: the picture as it is
    std::string title;
    std::string monitor;  ///< number or name; empty: the first
    bool fullScreen = false;
    bool vsync = false;              ///< through a renderer of the graphics driver
    std::optional<PlacedPart> part;  ///< where it stands when it is no full screen
    bool showsKeys = false;          ///< from the beginning, as after F1
    int input = -1;                  ///< descriptor of a socket to say input to (InputPipe); below 0: nobody wants it
    std::string
        log;  ///< a line per shown picture: number, when its host showed it, when it stood here; ns, CLOCK_MONOTONIC
};

/// The calling thread is the process' main one. Returns when the window was closed or the process is asked to end.
/// Errors: kUnsupported: no display, no such driver; kNotFound: no such monitor; kFailed: the log cannot be written.
[[nodiscard]] Expected<void> runWindow(WindowOptions options);
/// The desktop's monitors. Errors as above.
[[nodiscard]] Expected<std::vector<Monitor>> monitorsHere();

}  // namespace tessera
