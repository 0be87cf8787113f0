/// Ascending, each once.
#pragma once

#include <algorithm>
#include <vector>

namespace tessera {

template <typename Number>
void sortOnce(std::vector<Number>& numbers) {
    if (!std::is_sorted(numbers.begin(), numbers.end())) std::sort(numbers.begin(), numbers.end());
    numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
}

}  // namespace tessera
