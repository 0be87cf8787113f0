#include "common/scene/Search.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "common/scene/ChildChoice.h"
#include "common/scene/FieldTable.h"

namespace tessera {

namespace {

bool shows(const Node& parent, const Object& core, std::size_t index) {
    const std::optional<std::vector<std::size_t>> seen = seenChildren(core, parent.children.size());
    return !seen || std::ranges::binary_search(*seen, index);
}

}  // namespace

struct PathPattern::Step {
    /// A character of a name, or one of the two that stand for others.
    struct Sign {
        enum class Kind : std::uint8_t { kByte, kOne, kAny } kind = Kind::kByte;
        char byte = 0;
    };

    bool anyDepth = false;  ///< any number of levels may lie before it
    std::vector<Sign> name;
    std::vector<ObjectType> coreTypes;  ///< all of them
    bool visible = false, hidden = false;

    [[nodiscard]] bool fitsNode(const Candidate& node, std::size_t& work) const {
        if ((visible && !node.visible) || (hidden && node.visible)) return false;
        for (const ObjectType type : coreTypes)
            if (type != node.coreType) return false;
        return fits(node.name, work);
    }

private:
    /// Bytes of a UTF-8 character that follow its first.
    static bool continues(char byte) { return (static_cast<unsigned char>(byte) & 0xc0u) == 0x80u; }

    /// Remembers the last "*" alone: at most as many comparisons as the one's bytes times the other's.
    [[nodiscard]] bool fits(std::string_view text, std::size_t& work) const {
        std::size_t s = 0, n = 0;
        std::optional<std::pair<std::size_t, std::size_t>> retry;  // behind the last "*"; where its rest is tried next
        while (n < text.size() || s < name.size()) {
            ++work;
            if (s < name.size() && name[s].kind == Sign::Kind::kAny) {
                retry = {++s, n};
                continue;
            }
            const bool both = n < text.size() && s < name.size();
            if (both && (name[s].kind == Sign::Kind::kOne || name[s].byte == text[n])) {
                const bool one = name[s++].kind == Sign::Kind::kOne;
                do ++n;
                while (one && n < text.size() && continues(text[n]));
                continue;
            }
            if (!retry || retry->second >= text.size()) return false;
            n = ++retry->second;
            s = retry->first;
        }
        return true;
    }
};

Expected<PathPattern> PathPattern::parse(std::string_view expression) {
    if (expression.size() > kMaxBytes)
        return fail(ErrorCode::kLimit,
                    fmt::format("an expression of {} bytes; at most {} are allowed", expression.size(), kMaxBytes));
    std::size_t at = 0;
    const auto wrong = [&](std::string_view what) {
        return fail(ErrorCode::kUsage, fmt::format("expression \"{}\": {} at character {}", expression, what, at + 1));
    };
    if (expression.empty()) return wrong("nothing is asked for");
    std::vector<Step> steps;
    bool anyDepth = !expression.starts_with('/');
    bool levelsAtEnd = false;  // it ends in "**"
    const auto conditions = [&](Step& step) -> Expected<void> {
        while (at < expression.size() && expression[at] == '[') {
            const std::size_t end = expression.find(']', at);
            if (end == std::string_view::npos) return wrong("a bracket that is not closed");
            const std::string_view word = expression.substr(at + 1, end - at - 1);
            const TypeInfo* type = findType(word);
            if (word == "visible")
                step.visible = true;
            else if (word == "hidden")
                step.hidden = true;
            else if (type && type->isCore)
                step.coreTypes.push_back(type->type);
            else
                return wrong(fmt::format("\"[{}]\" is no condition (a type of core, visible, hidden)", word));
            at = end + 1;
        }
        return {};
    };
    while (at < expression.size()) {
        if (expression[at] == '/') {
            ++at;
            if (at < expression.size() && expression[at] == '/') {
                anyDepth = true;
                ++at;
            }
            if (at == expression.size()) {
                if (expression == "/") break;
                return wrong("a name is missing");
            }
            if (expression[at] == '/') return wrong("a name is missing");
        }
        const std::string_view rest = expression.substr(at);
        if (rest.starts_with("**") && (rest.size() == 2 || rest[2] == '/')) {
            at += 2;
            anyDepth = levelsAtEnd = true;
            continue;
        }
        levelsAtEnd = false;
        if (steps.size() == kMaxSteps)
            return fail(ErrorCode::kLimit, fmt::format("an expression of more than {} steps", kMaxSteps));
        Step step;
        step.anyDepth = std::exchange(anyDepth, false);
        for (; at < expression.size() && expression[at] != '/' && expression[at] != '['; ++at) {
            char byte = expression[at];
            if (byte == ']') return wrong("a bracket that was not opened");
            if (byte == '\\') {
                if (++at == expression.size()) return wrong("nothing follows the backslash");
                step.name.push_back({.byte = expression[at]});
                continue;
            }
            // Stars in a row are one.
            if (byte == '*' && !step.name.empty() && step.name.back().kind == Step::Sign::Kind::kAny) continue;
            step.name.push_back({byte == '*'   ? Step::Sign::Kind::kAny
                                 : byte == '?' ? Step::Sign::Kind::kOne
                                               : Step::Sign::Kind::kByte,
                                 byte});
        }
        // Conditions alone are about nodes of any name.
        if (step.name.empty()) step.name.push_back({Step::Sign::Kind::kAny, '*'});
        if (const Expected<void> good = conditions(step); !good) return tl::unexpected(good.error());
        if (at < expression.size() && expression[at] != '/') return wrong("a \"/\" is missing");
        steps.push_back(std::move(step));
    }
    if (levelsAtEnd) {
        steps.emplace_back().anyDepth = true;
        steps.back().name.push_back({Step::Sign::Kind::kAny, '*'});
    }
    PathPattern pattern;
    pattern.steps_ = std::make_shared<const std::vector<Step>>(std::move(steps));
    return pattern;
}

PathPattern::Progress PathPattern::follow(Progress parent, const Candidate& node, std::size_t& work) const {
    Progress progress = 0;
    for (std::size_t i = 0; i < steps_->size(); ++i) {
        if ((parent >> i & 1) == 0) continue;
        const Step& step = (*steps_)[i];
        if (step.anyDepth) progress |= Progress{1} << i;
        if (step.fitsNode(node, work)) progress |= Progress{2} << i;
    }
    return progress;
}

bool PathPattern::names(Progress progress) const {
    return (progress >> steps_->size() & 1) != 0;
}

bool PathPattern::leadsOn(Progress progress) const {
    return (progress & ((Progress{1} << steps_->size()) - 1)) != 0;
}

bool isShown(const Aspect& aspect, ObjectId node) {
    const Node* here = aspect.get<Node>(node);
    while (here && here->parent) {
        const Node* parent = aspect.get<Node>(here->parent);
        const Object core = parent->core ? aspect.find(parent->core) : Object();
        if (core.is<Switch>() && !shows(*parent, core, parent->children.indexOf(node))) return false;
        node = here->parent;
        here = parent;
    }
    return true;
}

namespace {

/// A walk in the order of the document that goes where the pattern may lead, and can stop anywhere and go on in another
/// state of the scene.
class Search {
public:
    Search(const Aspect& aspect, const PathPattern& pattern, const SearchOptions& options)
        : aspect_(aspect), pattern_(pattern), options_(options) {}

    SearchPage page() {
        const bool fromTheStart = options_.after.empty();
        if (fromTheStart)
            look(options_.top, PathPattern::atTop(), isShown(aspect_, options_.top));
        else
            goOn();
        for (;;) {
            // Before levels that are done are left: the node looked at last stands right below the last of them.
            const bool full =
                page_.lookedAt > 0 && (page_.found.size() >= options_.maxFound ||
                                       page_.lookedAt >= options_.maxLookedAt || work_ >= options_.maxWork);
            if (full && std::ranges::any_of(above_, [](const Level& level) { return !(level.at == level.end); })) {
                for (const Level& level : above_) page_.next.push_back(level.parent);
                if (page_.next.back() != last_) page_.next.push_back(last_);
                break;
            }
            while (!above_.empty() && above_.back().at == above_.back().end) above_.pop_back();
            if (above_.empty()) break;
            Level& level = above_.back();
            const ObjectId child = *level.at++;
            step(level, child, level.index++, true);
        }
        return std::move(page_);
    }

private:
    struct Level {
        ObjectId parent;
        PathPattern::Progress progress = 0;
        bool visible = true;
        Object core;
        ChildList::Iterator at, end;
        std::size_t index = 0;  ///< of the child at `at`
    };

    /// Looks at one child; `tell`: it is in this page.
    void step(const Level& level, ObjectId child, std::size_t index, bool tell) {
        const Node& node = *aspect_.get<Node>(child);
        const bool visible = level.visible && shows(*aspect_.get<Node>(level.parent), level.core, index);
        const ObjectType coreType = node.core ? aspect_.find(node.core).info().type : ObjectType();
        const PathPattern::Progress progress = pattern_.follow(level.progress, {node.name, coreType, visible}, work_);
        look(child, progress, visible, tell);
    }
    void look(ObjectId id, PathPattern::Progress progress, bool visible, bool tell = true) {
        const Node& node = *aspect_.get<Node>(id);
        const Object core = node.core ? aspect_.find(node.core) : Object();
        last_ = id;
        if (tell) {
            ++page_.lookedAt;
            const bool rightType = options_.coreType == ObjectType() || (core && core.info().type == options_.coreType);
            if (rightType && pattern_.names(progress)) page_.found.push_back(id);
        }
        if (!node.children.empty() && pattern_.leadsOn(progress))
            above_.push_back({id, progress, visible, core, node.children.begin(), node.children.end()});
    }
    /// Behind the last node of a way. Where the way is not what it was, from the first child of the last node that
    /// still is: rather twice than not at all.
    void goOn() {
        const std::vector<ObjectId>& way = options_.after;
        look(options_.top, PathPattern::atTop(), isShown(aspect_, options_.top), false);
        for (std::size_t i = 1; i < way.size() && above_.size() == i; ++i) {
            const Node* next = aspect_.get<Node>(way[i]);
            if (!next || next->parent != way[i - 1]) return;
            Level& level = above_.back();
            const ChildList& siblings = aspect_.get<Node>(level.parent)->children;
            const std::size_t index = siblings.indexOf(way[i]);
            level.at = siblings.from(index + 1);
            level.index = index + 1;
            step(level, way[i], index, false);
        }
    }

    const Aspect& aspect_;
    const PathPattern& pattern_;
    const SearchOptions& options_;
    SearchPage page_;
    std::vector<Level> above_;
    ObjectId last_;
    std::size_t work_ = 0;
};

}  // namespace

Expected<SearchPage> searchPage(const Aspect& aspect, const PathPattern& pattern, const SearchOptions& options) {
    if (!aspect.get<Node>(options.top))
        return fail(ErrorCode::kNotFound, fmt::format("there is no node #{}", options.top.value));
    if (!options.after.empty() && options.after.front() != options.top)
        return fail(ErrorCode::kBadInput, "a page that goes on below another node than it began at");
    return Search(aspect, pattern, options).page();
}

}  // namespace tessera
