// Motions and interests find the nodes that they name.

#include <fmt/format.h>

#include <charconv>

#include "common/scene/FieldTable.h"
#include "server/import/SceneAssembly.h"

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

template <typename PlacedNode>
PlacedNode* childNamed(const PlacedNode* node, std::string_view stepText) {
    const Step step = readStep(stepText);
    std::size_t seen = 0;
    for (PlacedNode* child : node->children)
        if (child->name == step.name && seen++ == step.which) return child;
    return nullptr;
}

template <typename PlacedNode>
PlacedNode* descend(PlacedNode* node, std::string_view path) {
    while (node != nullptr && !path.empty()) {
        const std::size_t slash = path.find('/');
        node = childNamed(node, path.substr(0, slash));
        path = slash == std::string_view::npos ? std::string_view() : path.substr(slash + 1);
    }
    return node;
}

}  // namespace

Expected<void> SceneAssembly::resolvePending(std::size_t from) {
    for (std::size_t i = from; i < pending_.size(); ++i) {
        const PendingRef& ref = pending_[i];
        Placed* found = nullptr;
        if (ref.name.empty()) {
            found = ref.from;
            while (found != ref.top && !found->transform) found = found->parent;
            if (found == ref.top) found = nullptr;
        } else if (ref.name.front() == '/') {
            found = descend(ref.top, std::string_view(ref.name).substr(1));
        } else {
            for (Placed* outer = ref.from; found == nullptr && outer != nullptr && outer != ref.top;
                 outer = outer->parent)
                if (outer->parent != nullptr) found = descend(outer->parent, ref.name);
        }
        const std::string shown = readName(ref.name, "");
        if (ref.kind == PendingRef::Kind::kMotionTarget) {
            if (found == nullptr || !found->transform)
                return fail(ErrorCode::kBadInput,
                            ref.name.empty()
                                ? fmt::format("{}: this motion has no transform at or above it to move", ref.where)
                            : found != nullptr
                                ? fmt::format("{}: the motion's target '{}' has no transform", ref.where, shown)
                                : fmt::format("{}: there is no node '{}' for this motion to move", ref.where, shown));
            builder_.set(ref.core, typeOf<Motion>(), field::kMotionTarget, toValue(found->transform));
            continue;
        }
        if (found == nullptr || ref.name.empty())
            return fail(ErrorCode::kBadInput,
                        ref.name.empty()
                            ? fmt::format("{}: this interest names no object", ref.where)
                            : fmt::format("{}: there is no node '{}' for this interest", ref.where, shown));
        const bool object = ref.kind == PendingRef::Kind::kInterestObject;
        builder_.set(ref.core, typeOf<Interest>(), object ? field::kInterestObject : field::kInterestAgainst,
                     toValue(found->id));
    }
    pending_.erase(pending_.begin() + static_cast<std::ptrdiff_t>(from), pending_.end());
    return {};
}

}  // namespace tessera
