#include "server/sim/desk/Surroundings.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "common/cores/Environment.h"
#include "common/cores/Node.h"
#include "common/scene/Aspect.h"

namespace tessera {

bool bringsSurroundings(const Preparation& made) {
    return std::ranges::any_of(made.lists, [](const ChangeList& list) {
        return std::ranges::any_of(list.creations,
                                   [](const Creation& creation) { return creation.type == typeOf<Environment>(); });
    });
}

std::optional<std::string> surroundingsNote(const Aspect& scene, const Preparation& made) {
    if (!bringsSurroundings(made)) return std::nullopt;
    // In document order, by a stack of what is to come; what is loaded stands where its parent's end is met.
    struct Turn {
        ObjectId node;
        bool end = false;
    };
    std::vector<Turn> turns{Turn{kRootNode}};
    bool passed = false;
    while (!turns.empty()) {
        const Turn turn = turns.back();
        turns.pop_back();
        passed = passed || turn.end;
        const Node* const node = turn.end ? nullptr : scene.get<Node>(turn.node);
        if (!node) continue;
        if (node->core && scene.find(node->core).is<Environment>()) {
            const std::string known = pathOf(scene, turn.node);
            return passed ? fmt::format("its Environment comes before that of {}, which does not count any more", known)
                          : fmt::format("its Environment does not count: that of {} comes first", known);
        }
        if (turn.node == made.node) turns.push_back({turn.node, true});
        const std::vector<ObjectId> children(node->children.begin(), node->children.end());
        for (auto child = children.rbegin(); child != children.rend(); ++child) turns.push_back({*child});
    }
    return std::nullopt;
}

}  // namespace tessera
