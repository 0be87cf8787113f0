/// Triangles of tree leaves as the kernels for straight ways take them (ImpactKernels.h). For the queries of this
/// folder.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include "server/collision/mesh/TriangleTriangle.h"
#include "server/collision/query/ImpactKernels.h"

namespace tessera {

/// `rows`: one of a StraightLeaf's two.
inline void setTriangle(double* rows, std::size_t place, const Triangle& t) {
    for (std::size_t row = 0; row < kernel::kLeafRows; ++row)
        rows[row * kernel::kLeafFaces + place] = t[row / 3][static_cast<int>(row % 3)];
}

/// Beside its plane is what is farther off than the margin, a length.
inline void setPlane(kernel::LeafPlanes& out, std::size_t place, const Triangle& start, const Triangle& end,
                     double margin) {
    const Vec3d n = (start[1] - start[0]).cross(start[2] - start[0]);
    const double wide = margin * n.norm();
    const auto set = [&](std::size_t lane, const Triangle& t) {
        for (int i = 0; i < 3; ++i) {
            out.normal[i][lane] = n[i];
            out.size[i][lane] = std::abs(n[i]);
            out.corner[i][lane] = t[0][i];
        }
        const double p = n.dot(t[1] - t[0]), q = n.dot(t[2] - t[0]);
        out.low[lane] = std::min({0.0, p, q}) - wide;
        out.high[lane] = std::max({0.0, p, q}) + wide;
    };
    set(place, start);
    set(place + kernel::kLeafFaces, end);
}

/// What is worked out about a leaf when it is first asked for.
template <typename Known>
class PerLeaf {
public:
    explicit PerLeaf(std::size_t leaves) : place_(leaves, 0) {}

    /// make(what to fill in); the reference stays good.
    template <typename Make>
    const Known& of(kernel::ChildRef leaf, const Make& make) {
        std::uint32_t& place = place_[(leaf & ~kernel::kLeafBit) >> 2];
        if (place == 0) {
            make(known_.emplace_back());
            place = static_cast<std::uint32_t>(known_.size());
        }
        return known_[place - 1];
    }

private:
    std::vector<std::uint32_t> place_;  ///< and 1; 0 where nothing is known
    std::deque<Known> known_;
};

}  // namespace tessera
