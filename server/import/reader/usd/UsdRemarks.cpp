#include "server/import/reader/usd/UsdRemarks.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace tessera {
namespace {

constexpr std::size_t kMostNames = 10, kMostRemembered = 10'000, kMostKinds = 100;

}  // namespace

void UsdRemarks::add(const std::string& what, const std::string& object) {
    if (of_.size() >= kMostKinds && !of_.contains(what)) return;
    Objects& objects = of_[what];
    // Those beyond may count twice; nobody reads so far.
    if (objects.known.size() < kMostRemembered && !objects.known.insert(object).second) return;
    ++objects.count;
    if (objects.first.size() < kMostNames) objects.first.push_back(object);
}

std::vector<std::string> UsdRemarks::lines() const {
    std::vector<std::string> lines;
    for (const auto& [what, objects] : of_) {
        const std::size_t others = objects.count - objects.first.size();
        lines.push_back(fmt::format("{}: {}{}", what, fmt::join(objects.first, ", "),
                                    others > 0 ? fmt::format(" and {} others", others) : ""));
    }
    return lines;
}

}  // namespace tessera
