#include "server/sim/frame/AppearingOrder.h"

#include <algorithm>
#include <numeric>

namespace tessera {
namespace {

/// Nodes that are placed below others, in document order.
class PlacedNodes {
public:
    /// Whatever hangs below nothing that was there before is not among them.
    PlacedNodes(const std::vector<Placement>& placements, std::uint64_t count) {
        // Children in a row for each parent, in their order; at the end those of what was there before.
        const auto parentOf = [&](const Placement& placement) {
            return std::min(placement.parent.value - kFirstPlaceholder, count);
        };
        std::vector<std::uint32_t> starts(count + 2), children(placements.size());
        for (const Placement& placement : placements) ++starts[parentOf(placement) + 1];
        std::inclusive_scan(starts.begin(), starts.end(), starts.begin());
        std::vector<std::uint32_t> next = starts;
        for (std::uint32_t row = 0; row < placements.size(); ++row) children[next[parentOf(placements[row])]++] = row;

        struct Level {
            std::uint32_t next, end;
            std::size_t above;  ///< in the order
        };
        std::vector<Level> levels{{starts[count], starts[count + 1], 0}};
        while (!levels.empty()) {
            Level& level = levels.back();
            if (level.next == level.end) {
                if (levels.size() > 1) nodes_[level.above].end = nodes_.size();
                levels.pop_back();
                continue;
            }
            const std::uint32_t row = children[level.next++];
            const std::uint64_t node = placements[row].node.value - kFirstPlaceholder;
            levels.push_back({starts[node], starts[node + 1], nodes_.size()});
            nodes_.push_back({row, 0});
        }
    }

    struct Placed {
        std::uint32_t row = 0;  ///< of the placement
        std::size_t end = 0;    ///< behind the last node below it
    };
    [[nodiscard]] const std::vector<Placed>& nodes() const { return nodes_; }

private:
    std::vector<Placed> nodes_;
};

}  // namespace

std::vector<std::vector<std::uint32_t>> appearingOrder(const std::vector<Placement>& placements, std::uint64_t count,
                                                       std::size_t atOnce) {
    const PlacedNodes order(placements, count);
    const std::vector<PlacedNodes::Placed>& nodes = order.nodes();
    std::vector<std::vector<std::uint32_t>> lists(1);
    std::size_t room = atOnce;
    for (std::size_t i = 0; i < nodes.size();) {
        const std::size_t below = nodes[i].end - i;
        const bool whole = below <= atOnce;
        const std::size_t seen = whole ? below : 1;
        if (seen > room && !lists.back().empty()) {
            lists.emplace_back();
            room = atOnce;
        }
        lists.back().push_back(nodes[i].row);
        room -= std::min(room, seen);
        i = whole ? nodes[i].end : i + 1;
    }
    return lists;
}

}  // namespace tessera
