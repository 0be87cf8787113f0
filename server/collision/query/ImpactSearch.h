/// What is still to be looked at, earliest first: pairs of volumes or of faces, each certain to be free up to its time.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace tessera {

class ImpactSearch {
public:
    struct Item {
        double t = 0;         ///< free before
        std::uint32_t a = 0;  ///< slots, or faces
        std::uint32_t b = 0;
        std::uint32_t depth = 0;
        bool faces = false;
    };

    [[nodiscard]] bool empty() const { return heap_.empty(); }
    void push(const Item& item) {
        heap_.push_back(item);
        std::push_heap(heap_.begin(), heap_.end(), later);
    }
    Item pop() {
        std::pop_heap(heap_.begin(), heap_.end(), later);
        const Item item = heap_.back();
        heap_.pop_back();
        return item;
    }

private:
    /// Of equal times the deepest, so that bodies in contact are not spread out in breadth.
    static bool later(const Item& x, const Item& y) {
        if (x.t != y.t) return x.t > y.t;
        if (x.faces != y.faces) return y.faces;
        if (x.depth != y.depth) return x.depth < y.depth;
        return x.a != y.a ? x.a > y.a : x.b > y.b;
    }

    std::vector<Item> heap_;
};

}  // namespace tessera
