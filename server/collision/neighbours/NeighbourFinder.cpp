#include "server/collision/neighbours/NeighbourFinder.h"

#include "common/base/Error.h"
#include "server/collision/neighbours/DifferenceFinder.h"
#include "server/collision/neighbours/PlainFinders.h"

namespace tessera {

void NeighbourFinder::move(std::span<const std::uint32_t> items, std::span<const Box> boxes) {
    TESSERA_CHECK(items.size() == boxes.size(), "a box for each item");
    for (std::size_t i = 0; i < items.size(); ++i) move(items[i], boxes[i]);
}

std::string_view name(NeighbourMethod method) {
    switch (method) {
        case NeighbourMethod::kAllPairs:
            return "all pairs";
        case NeighbourMethod::kSweepAndPrune:
            return "sweep and prune";
        case NeighbourMethod::kGrid:
            return "grid";
        case NeighbourMethod::kTree:
            return "tree";
        case NeighbourMethod::kAuto:
            return "auto";
    }
    return "";
}

std::unique_ptr<NeighbourFinder> makeNeighbourFinder(const NeighbourOptions& options) {
    switch (options.method) {
        case NeighbourMethod::kAllPairs:
            return std::make_unique<AllPairs>();
        case NeighbourMethod::kSweepAndPrune:
            return std::make_unique<SweepAndPrune>();
        case NeighbourMethod::kGrid:
        case NeighbourMethod::kTree:
        case NeighbourMethod::kAuto:
            break;
    }
    return std::make_unique<neighbours::DifferenceFinder>(options.method, options.workers);
}

}  // namespace tessera
