/// Whose boxes does a box meet, but for those of its own company?
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/math/Box.h"

namespace tessera {

/// A binary tree of boxes, made once. Each company of several has a subtree of its own, so a question of one of its
/// members costs nothing for the others, however they lie in each other. Making it costs n log n, a question what it
/// meets and the way there. Not thread-safe.
class BoxesNear {
public:
    static constexpr std::uint32_t kAlone = 0xffffffffu;  ///< of no company
    struct Item {
        std::uint32_t item = 0;  ///< what is told
        std::uint32_t company = kAlone;
        Box box;  ///< not empty
    };
    explicit BoxesNear(std::vector<Item> items);

    /// Replaces `near` by the items whose boxes overlap `box`, but for those of `company`; ascending. Touching counts.
    void find(const Box& box, std::uint32_t company, std::vector<std::uint32_t>& near);
    /// Boxes that were compared so far.
    [[nodiscard]] std::uint64_t looks() const { return looks_; }

private:
    struct Node {
        Box box;
        std::uint32_t company = kAlone;     ///< of all below it, where that is one
        std::uint32_t left = 0, right = 0;  ///< equal: a leaf
        std::uint32_t item = 0;             ///< of a leaf
    };
    [[nodiscard]] std::uint32_t join(std::span<std::uint32_t> roots, std::uint32_t company);

    std::vector<Node> nodes_;
    std::uint32_t root_ = 0;  ///< of nodes_, where there are any
    std::uint64_t looks_ = 0;
    std::vector<std::uint32_t> open_;  ///< kept for its memory
};

}  // namespace tessera
