/// What whose token is of a panel asks of it: its controls, as they stand in the scene.
#pragma once

#include "common/request/ValueMembers.h"

namespace tessera {

/// In the order of `PanelControl::as` (server/panel/Panel.h).
enum class PanelKind : std::uint8_t { kSlider, kToggle, kChoice, kColour, kText, kPress };

/// A field with a value: what it has, or what a control gives it.
struct PanelSetting {
    ObjectId object;  ///< none: it is not there
    ObjectType type;  ///< of the object
    std::string field;
    std::vector<double> numbers = {};  ///< of numbers; else none
    std::optional<bool> flag = {};     ///< of what is true or false
    std::string text = {};             ///< of texts

    static constexpr std::string_view kName = "PanelSetting";
    static constexpr void members(auto&& take) {
        take(member<&PanelSetting::object>(1, "object").said("0: it is not there"),
             member<&PanelSetting::type>(2, "type").said("of the object"), member<&PanelSetting::field>(3, "field"),
             member<&PanelSetting::numbers>(4, "numbers").atMost(&ApplicationLimits::maxNumbers).said("of numbers"),
             member<&PanelSetting::flag>(5, "flag").said("of what is true or false"),
             member<&PanelSetting::text>(6, "text").said("of texts"));
    }
};

struct PanelOption {
    std::string label;
    PanelSetting gives;

    static constexpr std::string_view kName = "PanelOption";
    static constexpr void members(auto&& take) {
        take(member<&PanelOption::label>(1, "label"), member<&PanelOption::gives>(2, "gives"));
    }
};

struct PanelControlState {
    PanelKind kind = PanelKind::kSlider;
    std::string label;
    std::string fault;                         ///< why it does nothing here, or not all; empty: it does
    PanelSetting now;                          ///< of a press: nothing
    std::string unit;                          ///< of its numbers
    double least = 0, greatest = 0, step = 0;  ///< of a slider
    std::uint32_t bytes = 0;                   ///< of a text, at most
    std::vector<PanelOption> options = {};     ///< of a choice
    std::vector<PanelSetting> sets = {};       ///< of a press: all at once
    std::uint32_t bookmark = 0;                ///< of a press: 1 to 9; 0: none
    bool home = false;                         ///< of a press

    static constexpr std::string_view kName = "PanelControlState";
    static constexpr void members(auto&& take) {
        take(member<&PanelControlState::kind>(1, "kind"), member<&PanelControlState::label>(2, "label"),
             member<&PanelControlState::fault>(3, "fault").said("why it does nothing here, or not all; empty: it does"),
             member<&PanelControlState::now>(4, "now").said("what its field holds"),
             member<&PanelControlState::unit>(5, "unit").said("of its numbers"),
             member<&PanelControlState::least>(6, "least").said("of a slider"),
             member<&PanelControlState::greatest>(7, "greatest").said("of a slider"),
             member<&PanelControlState::step>(8, "step").said("of a slider; 0: as fine as the screen"),
             member<&PanelControlState::bytes>(9, "bytes").said("of a text, at most"),
             member<&PanelControlState::options>(10, "options")
                 .atMost(&ApplicationLimits::maxControls)
                 .said("of a choice"),
             member<&PanelControlState::sets>(11, "sets")
                 .atMost(&ApplicationLimits::maxControls)
                 .said("of a press: all at once"),
             member<&PanelControlState::bookmark>(12, "bookmark").said("of a press: the view goes there; 0: it stays"),
             member<&PanelControlState::home>(13, "home").said("of a press: the view goes to where it began"));
    }
};
template <>
struct WordsOf<PanelKind> {
    static constexpr std::array<std::string_view, 6> kWords{"slider", "toggle", "choice", "colour", "text", "press"};
};

namespace answer {

struct PanelState {
    std::string stamp;  ///< other where the scene may be other, or the server
    bool same = false;  ///< all is as it was at the stamp that was said: nothing else is told
    std::string title;
    std::vector<PanelControlState> controls = {};

    static constexpr ToldInfo kInfo{.name = "PanelState", .answer = 31, .help = "A panel as it stands in the scene"};
    static constexpr void members(auto&& take) {
        take(member<&PanelState::stamp>(1, "stamp").said("other where the scene may be other, or the server"),
             member<&PanelState::same>(2, "same").said("all is as at the stamp that was said: no more is told"),
             member<&PanelState::title>(3, "title"),
             member<&PanelState::controls>(4, "controls").atMost(&ApplicationLimits::maxControls));
    }
};

}  // namespace answer

namespace request {

/// Asked again and again it costs little where nothing has changed.
struct GetPanel {
    std::string since;

    using Answer = answer::PanelState;
    static constexpr RequestInfo kInfo{.number = 41,
                                       .name = "GetPanel",
                                       .help = "The panel that one's token is of, as it stands in the scene",
                                       .forPanels = true};
    static constexpr void members(auto&& take) {
        take(member<&GetPanel::since>(1, "since").said("the stamp of the last answer; empty: all"));
    }
};

using OfPanels = std::variant<GetPanel>;

}  // namespace request
}  // namespace tessera
