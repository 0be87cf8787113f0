#include "server/collision/query/SurfaceTopology.h"

#include <algorithm>
#include <bit>
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
        const std::uint32_t face = i / 3, from = place_[mesh.vertexOf(face, i % 3)],
                            to = place_[mesh.vertexOf(face, (i + 1) % 3)];
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

bool SurfaceTopology::holds(const TriangleMesh& mesh) const {
    const MeshPositions at = mesh.positions();
    for (std::uint32_t v = 0; v < place_.size(); ++v)
        if (at[v] != at[place_[v]]) return false;
    // No two places are one: a table of places by their numbers' bits, each looked for from where these say on.
    std::vector<std::uint32_t> table(std::bit_ceil(2 * place_.size() + 1), kNone);
    for (std::uint32_t v = 0; v < place_.size(); ++v) {
        if (place_[v] != v) continue;
        const Vec3d p = at[v];
        std::uint64_t hash = 0;
        // 0 and -0 are one.
        for (int k = 0; k < 3; ++k) hash = (hash ^ std::bit_cast<std::uint64_t>(p[k] + 0.0)) * 0x9e37'79b9'7f4a'7c15U;
        std::size_t slot = (hash ^ hash >> 32U) & (table.size() - 1);
        for (; table[slot] != kNone; slot = (slot + 1) & (table.size() - 1))
            if (at[table[slot]] == p) return false;
        table[slot] = v;
    }
    return true;
}

}  // namespace tessera
