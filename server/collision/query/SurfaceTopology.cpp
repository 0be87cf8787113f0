#include "server/collision/query/SurfaceTopology.h"

#include <algorithm>
#include <numeric>
#include <tuple>

namespace tessera {

SurfaceTopology::SurfaceTopology(const TriangleMesh& mesh)
    : across_(3 * mesh.faceCount(), kNone), place_(mesh.vertexCount()), closed_(mesh.faceCount() != 0) {
    std::vector<std::uint32_t> order(mesh.vertexCount());
    std::iota(order.begin(), order.end(), 0U);
    const auto key = [&](std::uint32_t v) {
        const Vec3d p = mesh.positions()[v];
        return std::tuple(p.x(), p.y(), p.z());
    };
    std::sort(order.begin(), order.end(), [&](std::uint32_t u, std::uint32_t v) { return key(u) < key(v); });
    for (std::size_t i = 0; i < order.size(); ++i)
        place_[order[i]] = i > 0 && key(order[i]) == key(order[i - 1]) ? place_[order[i - 1]] : order[i];

    struct HalfEdge {
        std::uint32_t low, high;  ///< places
        std::uint32_t index;      ///< 3 face + corner
        bool upwards;
    };
    std::vector<HalfEdge> edges;
    edges.reserve(across_.size());
    for (std::uint32_t i = 0; i < across_.size(); ++i) {
        const std::uint32_t face = i / 3, from = place_[mesh.vertexOf(face, i % 3)], to = place_[mesh.vertexOf(face, (i + 1) % 3)];
        edges.push_back({std::min(from, to), std::max(from, to), i, from < to});
    }
    std::sort(edges.begin(), edges.end(), [](const HalfEdge& x, const HalfEdge& y) {
        return std::tie(x.low, x.high, x.index) < std::tie(y.low, y.high, y.index);
    });
    for (std::size_t first = 0; first < edges.size();) {
        std::size_t end = first + 1;
        while (end < edges.size() && edges[end].low == edges[first].low && edges[end].high == edges[first].high) ++end;
        const HalfEdge &one = edges[first], &other = edges[end - 1];
        if (end - first == 2 && one.upwards != other.upwards) {
            across_[one.index] = other.index / 3;
            across_[other.index] = one.index / 3;
        } else {
            closed_ = false;
        }
        first = end;
    }
}

}  // namespace tessera
