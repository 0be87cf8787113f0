#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/text_format.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>

#include "common/codec/TextFaults.h"
#include "proto/panel.pb.h"
#include "server/panel/Panel.h"

namespace tessera {
namespace {

using google::protobuf::TextFormat;

constexpr std::uint32_t kBookmarks = 9;

std::string tooMany(std::string_view what, std::size_t there, std::size_t most) {
    return there <= most ? std::string() : fmt::format("{} {}, at most {} may be", there, what, most);
}

/// Of texts that are told as they are; empty: none is too long.
std::string tooLong(std::initializer_list<const std::string*> texts) {
    for (const std::string* text : texts)
        if (text->size() > Panel::kMostValueBytes)
            return tooMany("bytes of a value or name", text->size(), Panel::kMostValueBytes);
    return {};
}

/// What is wrong with one control, by itself; empty: nothing.
std::string faultOf(const PanelControl& control) {
    if (control.label.size() > Panel::kMostLabelBytes)
        return tooMany("bytes of a label", control.label.size(), Panel::kMostLabelBytes);
    const bool presses = std::holds_alternative<PanelPress>(control.as);
    if (!presses && (control.of.node.empty() || control.of.field.empty()))
        return "which field of which node it shows is not said";
    if (presses && (!control.of.node.empty() || !control.of.field.empty()))
        return "a press shows no field: its sets name theirs";
    if (std::string fault = tooLong({&control.of.node, &control.of.field}); !fault.empty()) return fault;
    if (const auto* slider = std::get_if<PanelSlider>(&control.as)) {
        if (!std::isfinite(slider->least) || !std::isfinite(slider->greatest) || slider->least >= slider->greatest)
            return fmt::format("a slider from {} to {} goes nowhere", slider->least, slider->greatest);
        if (!(slider->step >= 0) || slider->step > slider->greatest - slider->least)
            return fmt::format("a step of {} does not fit between {} and {}", slider->step, slider->least,
                               slider->greatest);
    } else if (const auto* choice = std::get_if<PanelChoice>(&control.as)) {
        if (choice->options.empty()) return "a choice of nothing";
        for (const PanelChoice::Option& option : choice->options) {
            if (std::string fault = tooLong({&option.value}); !fault.empty()) return fault;
            if (option.label.size() > Panel::kMostLabelBytes)
                return tooMany("bytes of a label", option.label.size(), Panel::kMostLabelBytes);
        }
        return tooMany("options", choice->options.size(), Panel::kMostOptions);
    } else if (const auto* press = std::get_if<PanelPress>(&control.as)) {
        if (press->sets.empty() && press->bookmark == 0 && !press->home) return "a press that does nothing";
        if (press->bookmark > kBookmarks)
            return fmt::format("bookmarks are 1 to {}, and not {}", kBookmarks, press->bookmark);
        if (press->home && press->bookmark != 0) return "the view goes home or to a bookmark, and not to both";
        for (const PanelPress::Set& set : press->sets) {
            if (set.of.node.empty() || set.of.field.empty()) return "which field of which node it sets is not said";
            if (std::string fault = tooLong({&set.of.node, &set.of.field, &set.value}); !fault.empty()) return fault;
        }
        return tooMany("sets", press->sets.size(), Panel::kMostSets);
    }
    return {};
}

/// None: it does not say what it is.
std::optional<PanelControl> controlOf(const proto::Panel::Control& said) {
    PanelControl control{said.label(), {said.node(), said.field()}, {}};
    switch (said.as_case()) {
        case proto::Panel::Control::kSlider:
            control.as = PanelSlider{said.slider().least(), said.slider().greatest(), said.slider().step()};
            return control;
        case proto::Panel::Control::kToggle:
            control.as = PanelToggle{};
            return control;
        case proto::Panel::Control::kColour:
            control.as = PanelColour{};
            return control;
        case proto::Panel::Control::kText:
            control.as = PanelText{said.text().bytes() == 0 ? PanelText().bytes : said.text().bytes()};
            return control;
        case proto::Panel::Control::kChoice: {
            PanelChoice choice;
            for (const auto& option : said.choice().options())
                choice.options.push_back({option.label(), option.value()});
            control.as = std::move(choice);
            return control;
        }
        case proto::Panel::Control::kPress: {
            PanelPress press{{}, said.press().bookmark(), said.press().home()};
            for (const auto& set : said.press().sets()) press.sets.push_back({{set.node(), set.field()}, set.value()});
            control.as = std::move(press);
            return control;
        }
        case proto::Panel::Control::AS_NOT_SET:
            break;
    }
    return std::nullopt;
}

}  // namespace

Expected<Panel> parsePanel(std::string_view text, std::string_view fileName) {
    const auto bad = [&](TextPlace place, std::string_view what) {
        return fail(ErrorCode::kBadInput, located(fileName, place, what));
    };
    if (text.size() > Panel::kMostBytes) return bad({}, tooMany("bytes", text.size(), Panel::kMostBytes));
    if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
    FirstTextFault faults(text, *proto::Panel::descriptor());
    TextFormat::ParseInfoTree places;
    TextFormat::Parser parser;
    parser.RecordErrorsTo(&faults);
    parser.WriteLocationsTo(&places);
    parser.SetRecursionLimit(8);
    proto::Panel message;
    const bool parsed = parser.ParseFromString(std::string(text), &message);
    if (faults.any()) return bad(faults.place(), faults.message());
    if (!parsed) return bad({}, "not a panel in protobuf text format");

    Panel panel{.title = message.title(), .controls = {}};
    const auto* field = proto::Panel::descriptor()->FindFieldByNumber(proto::Panel::kControlsFieldNumber);
    for (int i = 0; i < message.controls_size(); ++i) {
        const TextFormat::ParseLocation at = places.GetLocation(field, i);
        std::optional<PanelControl> control = controlOf(message.controls(i));
        std::string fault = control ? faultOf(*control) : "a control is slider, toggle, choice, colour, text or press";
        if (panel.controls.size() == Panel::kMostControls)
            fault = tooMany("controls", static_cast<std::size_t>(message.controls_size()), Panel::kMostControls);
        if (!fault.empty()) return bad({at.line, at.column}, fault);
        panel.controls.push_back(std::move(*control));
    }
    if (panel.controls.empty()) return bad({0, 0}, "a panel without controls");
    if (panel.title.size() > Panel::kMostLabelBytes)
        return bad({0, 0}, tooMany("bytes of a title", panel.title.size(), Panel::kMostLabelBytes));
    return panel;
}

Expected<std::string> readPanelFile(const std::string& path) {
    std::error_code code;
    const std::filesystem::file_status status = std::filesystem::status(path, code);
    if (!std::filesystem::exists(status))
        return fail(ErrorCode::kNotFound, fmt::format("{}: there is no such panel", path));
    if (!std::filesystem::is_regular_file(status))
        return fail(ErrorCode::kBadInput, fmt::format("{}: is no file", path));
    std::ifstream file(path, std::ios::binary);
    if (!file) return fail(ErrorCode::kBadInput, fmt::format("{}: {}", path, std::strerror(errno)));
    std::string text(Panel::kMostBytes + 1, '\0');
    file.read(text.data(), static_cast<std::streamsize>(text.size()));
    text.resize(static_cast<std::size_t>(file.gcount()));
    if (text.size() > Panel::kMostBytes)
        return fail(ErrorCode::kLimit, fmt::format("{}: larger than {} bytes", path, Panel::kMostBytes));
    return text;
}

}  // namespace tessera
