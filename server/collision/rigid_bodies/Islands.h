/// Which bodies hang together?
#pragma once

#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

namespace tessera::rigid {

/// Union-find; the representative of a set is its least member.
class Islands {
public:
    explicit Islands(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0U); }

    std::uint32_t find(std::uint32_t x) {
        while (parent_[x] != x) x = parent_[x] = parent_[parent_[x]];
        return x;
    }
    void join(std::uint32_t x, std::uint32_t y) {
        x = find(x);
        y = find(y);
        if (x > y) std::swap(x, y);
        parent_[y] = x;
    }

private:
    std::vector<std::uint32_t> parent_;
};

}  // namespace tessera::rigid
