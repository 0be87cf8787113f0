/// A window that a graphics driver shows both eyes in, in turn: quad-buffered OpenGL.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "client/window/Monitors.h"
#include "common/base/Error.h"

namespace tessera {

class StereoWindow {
public:
    /// Null where the driver has no stereo visual: says so on stderr, and that the left eye is shown.
    [[nodiscard]] static std::unique_ptr<StereoWindow> open(const std::string& title, const DesktopRect& place,
                                                            bool fullScreen);
    ~StereoWindow();
    StereoWindow(const StereoWindow&) = delete;
    StereoWindow& operator=(const StereoWindow&) = delete;

    /// Two pictures beside each other, the left eye's on the left, four bytes a pixel, rows from the top; null: black.
    /// Each eye fills the window.
    [[nodiscard]] Expected<void> show(const std::uint8_t* rgbx, int eyeWidthPx, int heightPx);

private:
    struct Impl;
    explicit StereoWindow(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

}  // namespace tessera
