/// Which key does what, and how one moves, as a picture that a window lays over its tile's.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "common/image/Picture.h"
#include "common/input/InputState.h"
#include "common/wall/Navigation.h"

namespace tessera {

/// The mode and the pace that one window has asked for. Windows hear nothing from the server: where others steer too,
/// the wall's may differ.
class AskedManner {
public:
    /// The window's newest state. True: mode or pace are others now.
    bool take(const InputState& state);
    [[nodiscard]] NavigationMode mode() const { return mode_; }
    /// Times the wall's own speed.
    [[nodiscard]] double pace() const { return pace_; }

private:
    [[nodiscard]] std::uint16_t newly(const InputState& state, InputAction action) const;

    InputState last_;
    NavigationMode mode_ = NavigationMode::kFly;
    double pace_ = 1;
};

/// For a window of that size; as large as its words, and no larger than the window.
[[nodiscard]] Picture keysOverlay(const AskedManner& manner, int windowWidthPx, int windowHeightPx);

}  // namespace tessera
