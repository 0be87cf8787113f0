#include "server/panel/PanelInScene.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <sstream>
#include <variant>

#include "common/cores/Node.h"
#include "common/scene/WrittenByServer.h"

namespace tessera {
namespace {

struct FieldOfObject {
    ObjectId object;
    const FieldEntry* field = nullptr;
};

/// Whether the whole text is a number, and none beyond what that type of number holds.
template <typename Number>
bool readNumber(const std::string& text, Number& number) {
    const char* end = text.data() + text.size();
    return std::from_chars(text.data(), end, number) == std::from_chars_result{end, std::errc()};
}

/// A node's own fields come first, then its core's.
std::optional<FieldOfObject> fieldOf(const Aspect& scene, ObjectId node, const std::string& name) {
    const Node* known = scene.get<Node>(node);
    for (const ObjectId id : {node, known ? known->core : ObjectId()})
        if (const Object object = id ? scene.find(id) : Object())
            if (const FieldEntry* field = findField(object.info(), std::string_view(name)))
                return FieldOfObject{id, field};
    return std::nullopt;
}

template <typename Values>
std::optional<FieldValue> numbersIn(const FieldInfo& field, const std::vector<std::string>& words) {
    if (words.size() != field.width) return std::nullopt;
    Values values;
    values.width = field.width;
    for (std::size_t i = 0; i < words.size(); ++i) {
        double number = 0;
        if (!readNumber(words[i], number)) return std::nullopt;
        values.values[i] = static_cast<typename decltype(values.values)::value_type>(number);
    }
    return values;
}

/// None: the text is no value of this field, or of a kind that panels do not set.
std::optional<FieldValue> valueIn(const FieldInfo& field, const std::string& text) {
    std::istringstream in(text);
    std::vector<std::string> words;
    for (std::string word; in >> word;) words.push_back(word);
    switch (field.kind) {
        case FieldKind::kFloat:
            return numbersIn<Floats>(field, words);
        case FieldKind::kDouble:
            return numbersIn<Doubles>(field, words);
        case FieldKind::kText:
            return text;
        case FieldKind::kBool:
            if (text == "true" || text == "1") return true;
            if (text == "false" || text == "0") return false;
            return std::nullopt;
        case FieldKind::kInt: {
            if (const std::optional<std::int64_t> number = numberOfWord(field, text)) return *number;
            std::int64_t number = 0;
            return readNumber(text, number) ? std::optional<FieldValue>(number) : std::nullopt;
        }
        default:
            return std::nullopt;
    }
}

/// The one number of a value; none: it has none, or several.
std::optional<double> numberOf(const FieldValue& value) {
    if (const auto* one = std::get_if<Floats>(&value); one && one->width == 1) return one->values[0];
    if (const auto* one = std::get_if<Doubles>(&value); one && one->width == 1) return one->values[0];
    if (const auto* one = std::get_if<std::int64_t>(&value)) return static_cast<double>(*one);
    return std::nullopt;
}

/// Whether a field is what such a control moves; empty: it is.
std::string misfit(const PanelControl& control, const FieldInfo& field) {
    const bool numbers = field.kind == FieldKind::kFloat || field.kind == FieldKind::kDouble;
    const bool whole = field.kind == FieldKind::kInt;
    if (std::holds_alternative<PanelSlider>(control.as) && !((numbers && field.width == 1) || whole))
        return "is no number, and a slider moves one";
    if (std::holds_alternative<PanelToggle>(control.as) && field.kind != FieldKind::kBool && !whole)
        return "is neither on nor off";
    if (std::holds_alternative<PanelColour>(control.as) && !(field.kind == FieldKind::kFloat && field.width == 3))
        return "is no colour: that is three numbers";
    if (std::holds_alternative<PanelText>(control.as) && field.kind != FieldKind::kText) return "is no text";
    return {};
}

/// Of a control that gives a range of values.
bool gives(const PanelControl& control, const FieldValue& value) {
    if (const auto* slider = std::get_if<PanelSlider>(&control.as)) {
        const std::optional<double> number = numberOf(value);
        // As near to its ends as the field's numbers come.
        const bool narrow = std::holds_alternative<Floats>(value);
        const double least = narrow ? static_cast<double>(static_cast<float>(slider->least)) : slider->least;
        const double greatest = narrow ? static_cast<double>(static_cast<float>(slider->greatest)) : slider->greatest;
        return number && *number >= least && *number <= greatest;
    }
    if (std::holds_alternative<PanelToggle>(control.as)) {
        const auto* whole = std::get_if<std::int64_t>(&value);
        return std::holds_alternative<bool>(value) || (whole && (*whole == 0 || *whole == 1));
    }
    if (std::holds_alternative<PanelColour>(control.as)) {
        const auto* colour = std::get_if<Floats>(&value);
        const auto isShare = [](float part) { return part >= 0 && part <= 1; };
        return colour && colour->width == 3 && std::ranges::all_of(std::span(colour->values).first(3), isShare);
    }
    const auto* limit = std::get_if<PanelText>(&control.as);
    const auto* text = std::get_if<std::string>(&value);
    return limit && text && text->size() <= limit->bytes;
}

}  // namespace

PanelInScene::PanelInScene(const Panel& panel, const Aspect& scene) : panel_(panel), scene_(scene) {
    NodeFinder finder(scene, kLooks);
    for (const PanelControl& control : panel.controls) {
        controls_.emplace_back();
        if (const auto* press = std::get_if<PanelPress>(&control.as)) {
            for (const PanelPress::Set& set : press->sets) allow(set.of, control, &set.value, finder);
        } else if (const auto* choice = std::get_if<PanelChoice>(&control.as)) {
            for (const PanelChoice::Option& option : choice->options) allow(control.of, control, &option.value, finder);
        } else {
            allow(control.of, control, nullptr, finder);
        }
    }
}

Expected<PanelInScene::Target> PanelInScene::look(const PanelField& of, const PanelControl& control,
                                                  const std::string* value, NodeFinder& finder) const {
    const auto fault = [](std::string why) { return fail(ErrorCode::kBadInput, std::move(why)); };
    const Expected<ObjectId> node = finder.find(of.node);
    if (finder.exhausted()) return fault(fmt::format("{} stands among too many others to be looked for", of.node));
    if (!node) return fail(ErrorCode::kNotFound, node.error().message);
    const std::optional<FieldOfObject> found = fieldOf(scene_, *node, of.field);
    if (!found) return fault(fmt::format("{} has no field \"{}\"", of.node, of.field));
    if (fieldOfServer(scene_.find(found->object).info().type, found->field->id))
        return fault(fmt::format("{} of {} is the server's alone to write", of.field, of.node));
    if (const std::string why = misfit(control, *found->field); !why.empty())
        return fault(fmt::format("{} of {} {}", of.field, of.node, why));
    Target target{*node, found->object, found->field};
    if (value) {
        target.value = valueIn(*found->field, *value);
        if (!target.value)
            return fault(fmt::format("\"{}\" is no value that {} of {} may have here", *value, of.field, of.node));
        if (const Expected<void> good = checkValue(*found->field, *target.value); !good)
            return fault(good.error().message);
    }
    return target;
}

void PanelInScene::allow(const PanelField& of, const PanelControl& control, const std::string* value,
                         NodeFinder& finder) {
    Expected<Target> target = look(of, control, value, finder);
    Found& found = controls_.back();
    found.targets.push_back(target.value_or(Target()));
    if (!target) {
        std::string line = fmt::format("\"{}\": {}", control.label, target.error().message);
        if (std::ranges::find(faults_, line) == faults_.end()) faults_.push_back(std::move(line));
        const bool isThere = target.error().code != ErrorCode::kNotFound;
        if (found.fault.empty())
            found.fault = isThere ? std::move(target.error().message) : fmt::format("there is no {} now", of.node);
        return;
    }
    allowed_[{target->object, target->field->id}].push_back({&control, target->value});
    objects_.insert(target->node);
    paths_.insert(of.node);
    objects_.insert(target->object);
}

std::optional<Error> PanelInScene::whyNot(const ChangeList& list) const {
    const auto refused = [&](std::string_view why) {
        return Error{ErrorCode::kRefused, fmt::format("the token is of the panel \"{}\": {}", panel_.title, why)};
    };
    if (!list.creations.empty() || !list.placements.empty() || !list.ranges.empty() || !list.destructions.empty())
        return refused("it changes fields, and neither nodes nor parts of arrays");
    for (const FieldColumn& column : list.columns) {
        for (std::size_t row = 0; row < column.ids.size(); ++row) {
            const auto known = allowed_.find({column.ids[row], column.field});
            if (known == allowed_.end() || typeOf(scene_.find(column.ids[row])) != column.type)
                return refused(fmt::format("it has no control for that field of #{}", column.ids[row].value));
            const FieldValue value = column.value(row);
            const bool given = std::ranges::any_of(known->second, [&](const Allowed& one) {
                return one.exactly ? *one.exactly == value : gives(*one.control, value);
            });
            if (!given) return refused(fmt::format("\"{}\" gives no such value", known->second.front().control->label));
        }
    }
    return std::nullopt;
}

}  // namespace tessera
