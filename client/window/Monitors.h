/// The monitors of this machine's desktop.
#pragma once

#include <string>
#include <vector>

#include "common/base/Error.h"

namespace tessera {

/// In pixels of the desktop, origin at its upper left.
struct DesktopRect {
    int x = 0, y = 0, width = 0, height = 0;
    bool operator==(const DesktopRect&) const = default;
};

struct Monitor {
    std::string name;    ///< as the desktop says; may be empty
    DesktopRect all;     ///< of the desktop
    DesktopRect usable;  ///< without panels and docks
    int refreshHz = 0;   ///< 0: unknown
};

/// Which of them `wanted` means: a number from 0, or a name, however it is written in capitals. kNotFound says what
/// there is.
[[nodiscard]] Expected<std::size_t> findMonitor(const std::vector<Monitor>& monitors, const std::string& wanted);
/// For people: a line each.
[[nodiscard]] std::string describe(const std::vector<Monitor>& monitors);

/// Where a tile's window stands when it is no full screen: the wall that the tile is a part of
/// (common/wall/WindowLayout.h) is shrunk, if need be, until it fits into nine tenths of `usable`, in its middle.
/// `part`: the tile's place in the picture of the wall, origin at the upper left, of `whole` pixels. Parts that do not
/// overlap get windows that do not, unless one is thinner than a pixel of the desktop: it gets one.
struct PlacedPart {
    DesktopRect part;
    int wholeWidthPx = 0, wholeHeightPx = 0;
};
[[nodiscard]] DesktopRect placeOnDesktop(const PlacedPart& placed, const DesktopRect& usable);

/// The largest rectangle of the picture's shape in the middle of a window.
[[nodiscard]] DesktopRect fitted(int pictureWidthPx, int pictureHeightPx, int windowWidthPx, int windowHeightPx);

}  // namespace tessera
