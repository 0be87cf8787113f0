#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <optional>

#include "common/scene/Aspect.h"
#include "common/scene/FieldTable.h"

namespace tessera {

namespace {

constexpr std::size_t kNamesInMessages = 8;

std::optional<std::uint64_t> parseNumber(std::string_view text) {
    std::uint64_t number = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (text.empty() || error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return number;
}

/// "name" or "name[2]".
struct Step {
    std::string_view name;
    std::uint64_t index = 0;
};

Step parseStep(std::string_view text) {
    const std::size_t bracket = text.ends_with(']') ? text.rfind('[') : std::string_view::npos;
    if (bracket != std::string_view::npos)
        if (const auto index = parseNumber(text.substr(bracket + 1, text.size() - bracket - 2)))
            return {text.substr(0, bracket), *index};
    return {text, 0};
}

const std::string& nameOfChild(const Aspect& aspect, ObjectId child) {
    return aspect.get<Node>(child)->name;
}

ObjectId findChild(const Aspect& aspect, const Node& parent, const Step& step) {
    std::uint64_t index = step.index;
    for (const ObjectId child : parent.children)
        if (nameOfChild(aspect, child) == step.name && index-- == 0) return child;
    return {};
}

std::string childrenInWords(const Aspect& aspect, const Node& parent) {
    if (parent.children.empty()) return "it has no children";
    std::string names;
    std::vector<std::string_view> said;
    for (const ObjectId child : parent.children) {
        const std::string& name = nameOfChild(aspect, child);
        if (std::find(said.begin(), said.end(), name) != said.end()) continue;
        if (said.size() == kNamesInMessages) {
            names += ", …";
            break;
        }
        said.push_back(name);
        names += fmt::format("{}\"{}\"", names.empty() ? "" : ", ", name);
    }
    return fmt::format("its {} children are {}", parent.children.size(), names);
}

Expected<ObjectId> findById(const Aspect& aspect, std::string_view text) {
    const auto number = parseNumber(text.substr(1));
    if (!number)
        return fail(ErrorCode::kNotFound,
                    fmt::format("node \"{}\": an id is written as # and a number, e.g. #17", text));
    const Object object = aspect.find(ObjectId(*number));
    if (!object) return fail(ErrorCode::kNotFound, fmt::format("node {}: there is no object with this id", text));
    if (!object.is<Node>())
        return fail(ErrorCode::kNotFound, fmt::format("node {}: it is a {}, not a node", text, object.info().name));
    return ObjectId(*number);
}

}  // namespace

Expected<ObjectId> findNode(const Aspect& aspect, std::string_view path) {
    if (path.starts_with('#')) return findById(aspect, path);
    if (path.empty())
        return fail(ErrorCode::kNotFound,
                    "node \"\": a node is named by its path, e.g. /hall/crane, or by its id, e.g. #17");
    ObjectId at = kRootNode;
    std::string_view rest = path;
    if (rest.starts_with('/')) rest.remove_prefix(1);
    while (!rest.empty()) {
        const std::size_t slash = std::min(rest.find('/'), rest.size());
        const std::string_view text = rest.substr(0, slash);
        const Node& parent = *aspect.get<Node>(at);
        ObjectId child = findChild(aspect, parent, parseStep(text));
        if (!child) child = findChild(aspect, parent, {text, 0});  // a name that itself looks like "name[2]"
        if (!child)
            return fail(ErrorCode::kNotFound, fmt::format("node \"{}\": there is no \"{}\" below {}; {}", path, text,
                                                          at == kRootNode ? "the root" : pathOf(aspect, at),
                                                          childrenInWords(aspect, parent)));
        at = child;
        rest.remove_prefix(std::min(slash + 1, rest.size()));
    }
    return at;
}

std::string pathOf(const Aspect& aspect, ObjectId id) {
    if (id == kRootNode) return "/";
    const std::string byId = fmt::format("#{}", id.value);
    std::vector<std::string> steps;
    ObjectId at = id;
    while (at != kRootNode) {
        const Node* node = aspect.get<Node>(at);
        const Node* parent = node && node->parent ? aspect.get<Node>(node->parent) : nullptr;
        if (!parent || node->name.find('/') != std::string::npos) return byId;  // detached, or no path could say it
        std::size_t before = 0, same = 0;
        for (const ObjectId sibling : parent->children) {
            if (sibling == at) before = same;
            if (nameOfChild(aspect, sibling) == node->name) ++same;
        }
        const bool needsIndex = same > 1 || node->name.empty() || node->name.ends_with(']');
        steps.push_back(needsIndex ? fmt::format("{}[{}]", node->name, before) : node->name);
        at = node->parent;
    }
    std::string path;
    for (auto step = steps.rbegin(); step != steps.rend(); ++step) path += "/" + *step;
    return path;
}

}  // namespace tessera
