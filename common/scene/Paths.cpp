#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <optional>
#include <unordered_map>
#include <unordered_set>

#include "common/base/Nearest.h"
#include "common/base/Utf8.h"
#include "common/scene/Aspect.h"
#include "common/scene/FieldTable.h"
#include "common/scene/ObjectTable.h"

namespace tessera {

/// Names of nodes whose ids mostly follow each other: of the children of a node with very many, quickly.
class SiblingNames {
public:
    explicit SiblingNames(const Aspect& aspect) : find_(aspect.table()) {}
    [[nodiscard]] const std::string& of(ObjectId child) {
        return static_cast<const Node*>(find_.find(child)->data)->name;
    }

private:
    ObjectTable::ConstCursor find_;
};

namespace {

constexpr std::size_t kNamesInMessages = 8, kLookedAtForMessages = 1000;

/// Names and paths may be as long as a message may.
std::string shortened(std::string_view text) {
    constexpr std::size_t kMost = 200;
    const std::string_view begins = cutUtf8(text, kMost);
    return begins.size() == text.size() ? std::string(text) : fmt::format("{}…", begins);
}

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
    SiblingNames names(aspect);
    for (const ObjectId child : parent.children)
        if (names.of(child) == step.name && index-- == 0) return child;
    return {};
}

std::string childrenInWords(const Aspect& aspect, const Node& parent) {
    if (parent.children.empty()) return "it has no children";
    std::string names;
    std::vector<std::string_view> said;
    std::size_t looked = 0;
    for (const ObjectId child : parent.children) {
        if (++looked > kLookedAtForMessages) {
            names += ", …";
            break;
        }
        const std::string& name = nameOfChild(aspect, child);
        if (std::find(said.begin(), said.end(), name) != said.end()) continue;
        if (said.size() == kNamesInMessages) {
            names += ", …";
            break;
        }
        said.push_back(name);
        names += fmt::format("{}\"{}\"", names.empty() ? "" : ", ", shortened(name));
    }
    return fmt::format("its {} children are {}", parent.children.size(), names);
}

/// " (did you mean …?)", or nothing. Among the first of many: somebody may ask so in every frame.
std::string meant(const Aspect& aspect, const Node& parent, std::string_view said) {
    std::size_t lettersLeft = 4000;  // of pairs to compare: some 20 microseconds
    std::vector<std::string> known;
    for (const ObjectId child : parent.children) {
        const std::string& name = nameOfChild(aspect, child);
        const std::size_t letters = std::max<std::size_t>(1, said.size() * name.size());
        if (letters > lettersLeft) break;
        lettersLeft -= letters;
        known.push_back(name);
    }
    const std::string nearest = nearestName(said, known);
    return nearest.empty() ? nearest : fmt::format(" (did you mean \"{}\"?)", nearest);
}

/// " (…)", or nothing. Where a child's name holds slashes, and the path goes on as that name does: among the first of
/// many.
std::string slashed(const Aspect& aspect, const Node& parent, std::string_view rest) {
    std::size_t looked = 0;
    for (const ObjectId child : parent.children) {
        if (++looked > kLookedAtForMessages) break;
        const std::string& name = nameOfChild(aspect, child);
        if (name.find('/') != name.npos && rest.starts_with(name))
            return fmt::format(" (the name \"{}\" has a slash, and no path: say #{})", shortened(name), child.value);
    }
    return {};
}

Expected<ObjectId> findById(const Aspect& aspect, std::string_view text) {
    const auto number = parseNumber(text.substr(1));
    if (!number)
        return fail(ErrorCode::kNotFound,
                    fmt::format("node \"{}\": an id is written as # and a number, e.g. #17", shortened(text)));
    const Object object = aspect.find(ObjectId(*number));
    if (!object)
        return fail(ErrorCode::kNotFound, fmt::format("node {}: there is no object with this id", shortened(text)));
    if (!object.is<Node>())
        return fail(ErrorCode::kNotFound,
                    fmt::format("node {}: it is a {}, not a node", shortened(text), object.info().name));
    return ObjectId(*number);
}

}  // namespace

namespace {

/// findChild(parent's id, parent, step): no id where there is none. inWords(id): a node for people.
template <typename FindChild, typename InWords>
Expected<ObjectId> walk(const Aspect& aspect, std::string_view path, const FindChild& findChild,
                        const InWords& inWords) {
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
        const Step step = parseStep(text);
        ObjectId child = findChild(at, parent, step);
        // A name that itself looks like "name[2]".
        if (!child && step.name != text) child = findChild(at, parent, Step{text, 0});
        if (!child) {
            const std::string other = slashed(aspect, parent, rest);
            return fail(
                ErrorCode::kNotFound,
                fmt::format("node \"{}\": there is no \"{}\" below {}{}; {}", shortened(path), shortened(text),
                            at == kRootNode ? "the root" : shortened(inWords(at)),
                            other.empty() ? meant(aspect, parent, step.name) : other, childrenInWords(aspect, parent)));
        }
        at = child;
        rest.remove_prefix(std::min(slash + 1, rest.size()));
    }
    return at;
}

}  // namespace

Expected<ObjectId> findNode(const Aspect& aspect, std::string_view path) {
    return walk(
        aspect, path, [&](ObjectId, const Node& parent, const Step& step) { return findChild(aspect, parent, step); },
        [&](ObjectId at) { return pathOf(aspect, at); });
}

bool NodeFinder::look(std::size_t nodes) {
    exhausted_ = exhausted_ || nodes > looks_;
    looks_ -= std::min(nodes, looks_);
    return !exhausted_;
}

bool NodeFinder::lookAbove(ObjectId node, bool siblings) {
    for (const Node* at = aspect_.get<Node>(node); at && at->parent && !exhausted_;) {
        at = aspect_.get<Node>(at->parent);
        look(1 + (siblings ? at->children.size() : 0));
    }
    return !exhausted_;
}

Expected<ObjectId> NodeFinder::find(std::string_view path) {
    const auto inWords = [&](ObjectId at) {
        return look(kLookedAtForMessages) && lookAbove(at, true) ? pathOf(aspect_, at) : fmt::format("#{}", at.value);
    };
    const auto findStep = [&](ObjectId id, const Node& parent, const Step& step) -> ObjectId {
        const auto [at, isNew] = known_.try_emplace(id);
        Children& children = at->second;
        if (!look(children.listed ? 1 : 1 + parent.children.size())) return {};
        if (isNew) return findChild(aspect_, parent, step);
        if (!children.listed) {
            SiblingNames names(aspect_);
            for (const ObjectId child : parent.children) children.byName[names.of(child)].push_back(child);
            children.listed = true;
        }
        const auto found = children.byName.find(step.name);
        return found != children.byName.end() && step.index < found->second.size() ? found->second[step.index]
                                                                                   : ObjectId();
    };
    return walk(aspect_, path, findStep, inWords);
}

namespace {

/// One step of a path, where `before` of `same` equal names stand before it.
std::string stepText(std::string_view name, std::size_t before, std::size_t same) {
    const bool needsIndex = same > 1 || name.empty() || name.ends_with(']');
    return needsIndex ? fmt::format("{}[{}]", name, before) : std::string(name);
}

bool canBeSaid(std::string_view name) {
    return name.find('/') == std::string_view::npos;
}

/// How these children of one parent stand in paths. All siblings are looked at once, however many are asked for.
void addSteps(const Aspect& aspect, const Node& parent, const std::vector<ObjectId>& wanted,
              std::unordered_map<ObjectId, std::string>& steps) {
    std::unordered_map<std::string_view, std::size_t> counts;
    std::unordered_map<ObjectId, std::size_t> before;
    for (const ObjectId child : wanted) {
        counts.emplace(nameOfChild(aspect, child), 0);
        before.emplace(child, 0);
    }
    // Mostly one child is asked for: then no name needs to be hashed.
    const std::string_view only = counts.size() == 1 ? counts.begin()->first : std::string_view();
    SiblingNames names(aspect);
    for (const ObjectId sibling : parent.children) {
        const std::string& name = names.of(sibling);
        if (counts.size() == 1 && name != only) continue;
        const auto count = counts.size() == 1 ? counts.begin() : counts.find(name);
        if (count == counts.end()) continue;
        if (const auto known = before.find(sibling); known != before.end()) known->second = count->second;
        ++count->second;
    }
    for (const auto& [child, index] : before) {
        const std::string& name = nameOfChild(aspect, child);
        steps.emplace(child, stepText(name, index, counts.at(name)));
    }
}

/// The nodes from `id` up to below the root; nothing where the node is detached or a name on the way holds a slash.
std::vector<ObjectId> wayUp(const Aspect& aspect, ObjectId id) {
    std::vector<ObjectId> way;
    for (ObjectId at = id; at != kRootNode;) {
        const Node* node = aspect.get<Node>(at);
        if (!node || !node->parent || !canBeSaid(node->name)) return {};
        way.push_back(at);
        at = node->parent;
    }
    return way;
}

}  // namespace

std::vector<std::string> pathsOf(const Aspect& aspect, std::span<const ObjectId> nodes) {
    std::vector<std::vector<ObjectId>> ways;
    std::unordered_map<ObjectId, std::vector<ObjectId>> wanted;  // by parent
    std::unordered_set<ObjectId> seen;
    for (const ObjectId id : nodes) {
        ways.push_back(wayUp(aspect, id));
        for (const ObjectId at : ways.back()) {
            if (!seen.insert(at).second) break;  // then what is above it was seen too
            wanted[aspect.get<Node>(at)->parent].push_back(at);
        }
    }
    std::unordered_map<ObjectId, std::string> steps;
    for (const auto& [parent, children] : wanted) addSteps(aspect, *aspect.get<Node>(parent), children, steps);
    std::vector<std::string> paths;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        std::string path = nodes[i] == kRootNode ? "/" : ways[i].empty() ? fmt::format("#{}", nodes[i].value) : "";
        for (auto at = ways[i].rbegin(); at != ways[i].rend(); ++at) path.append("/").append(steps.at(*at));
        paths.push_back(std::move(path));
    }
    return paths;
}

std::string pathOf(const Aspect& aspect, ObjectId id) {
    return pathsOf(aspect, std::span(&id, 1)).front();
}

std::vector<std::string> stepsOf(std::span<const std::string_view> names) {
    std::unordered_map<std::string_view, std::size_t> same, before;
    for (const std::string_view name : names) ++same[name];
    std::vector<std::string> steps;
    for (const std::string_view name : names)
        steps.push_back(canBeSaid(name) ? stepText(name, before[name]++, same[name]) : std::string());
    return steps;
}

}  // namespace tessera
