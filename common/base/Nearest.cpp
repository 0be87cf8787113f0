#include "common/base/Nearest.h"

#include <algorithm>
#include <numeric>
#include <vector>

#include "common/base/LowerCase.h"

namespace tessera {

namespace {

std::size_t editDistance(const std::string& a, const std::string& b) {
    std::vector<std::size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 1; i <= a.size(); ++i) {
        std::size_t diagonal = row[0];
        row[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
            diagonal = row[j];
            row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
        }
    }
    return row[b.size()];
}

}  // namespace

std::string nearestName(std::string_view wanted, std::span<const std::string> known) {
    // Names come from files and peers: what is longer than any sensible name is not compared at all.
    constexpr std::size_t kLongestName = 256;
    if (wanted.empty() || wanted.size() > kLongestName) return {};
    const std::string lower = lowerCase(wanted);
    std::string best;
    std::size_t bestDistance = std::max<std::size_t>(2, wanted.size() / 3) + 1;
    for (const std::string& name : known) {
        if (name.size() > kLongestName) continue;
        const std::size_t distance = editDistance(lower, lowerCase(name));
        // As many edits as letters turn anything into anything.
        if (distance < bestDistance && distance < std::max(name.size(), wanted.size())) {
            bestDistance = distance;
            best = name;
        }
    }
    return best;
}

}  // namespace tessera
