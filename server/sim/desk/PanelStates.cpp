#include "server/sim/desk/PanelStates.h"

#include <algorithm>
#include <cmath>
#include <variant>

#include "common/base/Utf8.h"
#include "common/scene/FieldTable.h"
#include "server/panel/PanelInScene.h"

namespace tessera {
namespace {

constexpr std::size_t kMostFaultBytes = 512;

void tell(const FieldValue& value, PanelSetting& setting) {
    std::visit(
        [&]<typename Value>(const Value& held) {
            if constexpr (std::is_same_v<Value, Floats> || std::is_same_v<Value, Doubles>)
                setting.numbers.assign(held.values.begin(), held.values.begin() + held.width);
            else if constexpr (std::is_same_v<Value, bool>)
                setting.flag = held;
            else if constexpr (std::is_same_v<Value, std::int64_t>)
                setting.numbers.push_back(static_cast<double>(held));
            else if constexpr (std::is_same_v<Value, std::string>)
                setting.text = cutUtf8(held, Panel::kMostValueBytes);
        },
        value);
}

/// With the value that it is to have, or else the one that it has.
PanelSetting settingOf(const PanelInScene::Target& target, const Aspect& scene) {
    if (!target.field) return {};
    const Object object = scene.find(target.object);
    PanelSetting setting{target.object, object.info().type, std::string(target.field->name)};
    tell(target.value ? *target.value : target.field->load(object), setting);
    return setting;
}

/// Of whole numbers the ends and steps are whole.
void tell(const PanelSlider& slider, bool whole, PanelControlState& told) {
    told.least = whole ? std::ceil(slider.least) : slider.least;
    told.greatest = whole ? std::floor(slider.greatest) : slider.greatest;
    told.step = whole ? std::max(1.0, std::round(slider.step)) : slider.step;
}

}  // namespace

answer::PanelState stateOf(const Panel& panel, const Aspect& scene) {
    const PanelInScene there(panel, scene);
    answer::PanelState state{.stamp = {}, .title = panel.title};
    for (std::size_t at = 0; at < panel.controls.size(); ++at) {
        const PanelControl& control = panel.controls[at];
        const PanelInScene::Found& found = there.controls()[at];
        PanelControlState& told = state.controls.emplace_back();
        told.kind = static_cast<PanelKind>(control.as.index());
        told.label = control.label;
        told.fault = cutUtf8(found.fault, kMostFaultBytes);
        if (const auto* press = std::get_if<PanelPress>(&control.as)) {
            told.bookmark = press->bookmark;
            told.home = press->home;
            for (const PanelInScene::Target& target : found.targets) told.sets.push_back(settingOf(target, scene));
            continue;
        }
        bool whole = false;
        for (PanelInScene::Target target : found.targets) {
            if (!target.field) continue;
            whole = target.field->kind == FieldKind::kInt;
            told.unit = nameOf(target.field->measuredIn);
            target.value.reset();
            told.now = settingOf(target, scene);
        }
        if (const auto* slider = std::get_if<PanelSlider>(&control.as)) {
            tell(*slider, whole, told);
        } else if (const auto* text = std::get_if<PanelText>(&control.as)) {
            told.bytes = static_cast<std::uint32_t>(text->bytes);
        } else if (const auto* choice = std::get_if<PanelChoice>(&control.as)) {
            for (std::size_t i = 0; i < choice->options.size(); ++i) {
                const auto& [label, value] = choice->options[i];
                told.options.push_back({label.empty() ? value : label, settingOf(found.targets[i], scene)});
            }
        }
    }
    return state;
}

}  // namespace tessera
