#include "server/import/PlacedNodes.h"

#include <algorithm>
#include <charconv>
#include <utility>

namespace tessera {
namespace {

struct Step {
    std::string_view name;
    std::size_t which = 0;  ///< among equal names
};

/// "pillar[2]" → {"pillar", 2}
Step readStep(std::string_view text) {
    if (text.size() > 2 && text.back() == ']') {
        if (const std::size_t open = text.rfind('['); open != std::string_view::npos) {
            std::size_t which = 0;
            const char* last = text.data() + text.size() - 1;
            const auto [end, error] = std::from_chars(text.data() + open + 1, last, which);
            if (error == std::errc() && end == last) return {text.substr(0, open), which};
        }
    }
    return {text, 0};
}

PlacedNode* descend(PlacedNode* node, std::string_view path) {
    while (node != nullptr && !path.empty()) {
        const std::size_t slash = path.find('/');
        const Step step = readStep(path.substr(0, slash));
        node = node->child(step.name, step.which);
        path = slash == std::string_view::npos ? std::string_view() : path.substr(slash + 1);
    }
    return node;
}

/// Where the path begins with the node's own name. So in each copy of a repeated node its name means that copy.
PlacedNode* descendFrom(PlacedNode* node, std::string_view path) {
    const std::size_t slash = path.find('/');
    if (node->name != path.substr(0, slash)) return nullptr;
    return descend(node, slash == std::string_view::npos ? std::string_view() : path.substr(slash + 1));
}

}  // namespace

PlacedNode* PlacedNode::child(std::string_view wanted, std::size_t which) {
    for (; entered_ < children.size(); ++entered_) byName_[children[entered_]->name].push_back(children[entered_]);
    const auto same = byName_.find(wanted);
    return same == byName_.end() || which >= same->second.size() ? nullptr : same->second[which];
}

Expected<PlacedNode*> PlacedNodes::make(std::string name, ObjectId core, const Spot& spot) {
    const ImportOptions& options = draft_.options();
    if (made_++ >= options.maxNodes) return tl::unexpected(draft_.tooManyNodes());
    if (spot.depth >= options.maxDepth) return tl::unexpected(draft_.tooDeep());
    Node node;
    node.name = name;
    node.core = core;
    const ObjectId id = draft_.create(node);
    draft_.list().place(id, spot.parent);
    return enter(id, std::move(name), spot.placed);
}

PlacedNode* PlacedNodes::enter(ObjectId id, std::string name, PlacedNode* parent) {
    PlacedNode* const node = nodes_.emplace_back(std::make_unique<PlacedNode>()).get();
    node->id = id;
    node->name = std::move(name);
    node->parent = parent;
    if (parent != nullptr) parent->children.push_back(node);
    return node;
}

bool PlacedNodes::hasRoomFor(std::size_t more) const {
    const std::size_t most = draft_.options().maxNodes;
    return more <= most - std::min(made_, most);
}

PlacedNode* PlacedNodes::find(PlacedNode* from, PlacedNode* top, std::string_view name) {
    if (name.starts_with('/')) return descend(top, name.substr(1));
    PlacedNode* found = nullptr;
    for (PlacedNode* outer = from; found == nullptr && outer != nullptr && outer != top; outer = outer->parent) {
        if (outer != from) found = descendFrom(outer, name);
        if (found == nullptr && outer->parent != nullptr) found = descend(outer->parent, name);
    }
    return found;
}

}  // namespace tessera
