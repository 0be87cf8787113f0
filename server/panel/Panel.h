/// Panels: pages of controls that reach some fields of a scene, and nothing else. As files (*.panel), protobuf text.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "common/base/Error.h"

namespace tessera {

/// A field of a node or of its core, by the node's path and the field's name.
struct PanelField {
    std::string node, field;
    auto operator<=>(const PanelField&) const = default;
};

/// One number between two others. `step` 0: as fine as the screen.
struct PanelSlider {
    double least = 0, greatest = 1, step = 0;
};
/// A bool, or 0 and 1.
struct PanelToggle {};
/// Three numbers between 0 and 1.
struct PanelColour {};
struct PanelText {
    std::size_t bytes = 256;  ///< at most
};
/// Values as `tessera-ctl set` takes them.
struct PanelChoice {
    struct Option {
        std::string label, value;
    };
    std::vector<Option> options;
};
/// All that it says, at once.
struct PanelPress {
    struct Set {
        PanelField of;
        std::string value;
    };
    std::vector<Set> sets;
    std::uint32_t bookmark = 0;  ///< 1 to 9: the view goes there
    bool home = false;           ///< the view goes to where it began
};

struct PanelControl {
    std::string label;
    PanelField of;  ///< of all but presses
    std::variant<PanelSlider, PanelToggle, PanelChoice, PanelColour, PanelText, PanelPress> as;
};

struct Panel {
    static constexpr std::size_t kMostBytes = std::size_t{64} << 10;  ///< of a file
    static constexpr std::size_t kMostControls = 64, kMostOptions = 64, kMostSets = 16, kMostLabelBytes = 256;
    static constexpr std::size_t kMostValueBytes = 4096;  ///< of values, and names of nodes and fields

    std::string title;
    std::vector<PanelControl> controls;
};

/// Errors read `file:line:column: text`; an unknown key names the nearest known one.
[[nodiscard]] Expected<Panel> parsePanel(std::string_view text, std::string_view fileName);
/// The text of a file. kNotFound, kBadInput: it is none, or too large.
[[nodiscard]] Expected<std::string> readPanelFile(const std::string& path);

}  // namespace tessera
