#include "client/render/scene/OccluderMesh.h"

#include <algorithm>
#include <cstring>

#include "client/render/MeshClusters.h"

namespace tessera {

namespace {

/// Vertices that files store several times (for their normals) become one, by exact position: only positions that the
/// rasteriser maps to the very same place make a surface without cracks.
std::vector<std::uint32_t> weld(std::span<const float> positions, std::vector<OccluderMesh::Point>& points) {
    const std::size_t count = positions.size() / 3;
    std::size_t size = 16;
    while (size < 2 * count) size *= 2;
    std::vector<std::uint32_t> slots(size, OccluderMesh::kNone);
    std::vector<std::uint32_t> welded(count);
    for (std::size_t i = 0; i < count; ++i) {
        // Adding zero turns -0 into +0: they are the same place.
        const OccluderMesh::Point p{positions[3 * i] + 0.0f, positions[3 * i + 1] + 0.0f, positions[3 * i + 2] + 0.0f};
        std::array<std::uint32_t, 3> bits;
        std::memcpy(bits.data(), p.data(), sizeof bits);
        std::uint64_t h = (std::uint64_t{bits[0]} << 32 | bits[1]) * 0x9E3779B97F4A7C15ull;
        h = (h ^ (h >> 29) ^ bits[2]) * 0xBF58476D1CE4E5B9ull;
        std::size_t slot = (h ^ (h >> 32)) & (size - 1);
        while (slots[slot] != OccluderMesh::kNone && points[slots[slot]] != p) slot = (slot + 1) & (size - 1);
        if (slots[slot] == OccluderMesh::kNone) {
            slots[slot] = static_cast<std::uint32_t>(points.size());
            points.push_back(p);
        }
        welded[i] = slots[slot];
    }
    return welded;
}

/// Of those that begin or end at one vertex and go to or come from a higher one.
struct HalfEdge {
    std::uint32_t higher;
    std::uint32_t triangle;
    std::uint8_t corner;
    bool forwards;  ///< from the lower to the higher vertex
};

}  // namespace

OccluderMesh::OccluderMesh(std::span<const float> positions, std::span<const std::uint32_t> indices) {
    const std::vector<std::uint32_t> welded = weld(positions, points_);
    triangles_.reserve(indices.size() / 3);
    clusterStarts_.reserve(indices.size() / (3 * MeshCluster::kTriangles) + 2);
    for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
        if (i % (3 * MeshCluster::kTriangles) == 0)
            clusterStarts_.push_back(static_cast<std::uint32_t>(triangles_.size()));
        const std::array<std::uint32_t, 3> v{welded[indices[i]], welded[indices[i + 1]], welded[indices[i + 2]]};
        // A triangle with two equal corners covers nothing; its neighbours meet each other.
        if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) continue;
        triangles_.push_back({v, {kNone, kNone, kNone}});
    }
    clusterStarts_.push_back(static_cast<std::uint32_t>(triangles_.size()));
    findNeighbours();
}

// Edges are put together by their lower vertex: one pass that counts, one that fills, and each vertex has few.
void OccluderMesh::findNeighbours() {
    std::vector<std::uint32_t> ends(points_.size() + 1, 0);
    const auto forEachEdge = [this](const auto& f) {
        for (std::uint32_t t = 0; t < triangles_.size(); ++t)
            for (std::uint8_t corner = 0; corner < 3; ++corner)
                f(t, corner, triangles_[t].vertex[corner], triangles_[t].vertex[(corner + 1u) % 3]);
    };
    forEachEdge([&](std::uint32_t, std::uint8_t, std::uint32_t a, std::uint32_t b) { ++ends[std::min(a, b) + 1]; });
    for (std::size_t v = 1; v < ends.size(); ++v) ends[v] += ends[v - 1];
    std::vector<HalfEdge> edges(3 * triangles_.size());
    // From now on `ends[v]` is where the next one of v goes; when all are there, the end of them.
    forEachEdge([&](std::uint32_t t, std::uint8_t corner, std::uint32_t a, std::uint32_t b) {
        edges[ends[std::min(a, b)]++] = {std::max(a, b), t, corner, a < b};
    });
    for (std::size_t v = 0, begin = 0; v < points_.size(); begin = ends[v++]) {
        const std::span<HalfEdge> of = std::span(edges).subspan(begin, ends[v] - begin);
        std::sort(of.begin(), of.end(), [](const HalfEdge& x, const HalfEdge& y) {
            return x.higher != y.higher ? x.higher < y.higher : x.triangle < y.triangle;
        });
        for (std::size_t i = 0; i < of.size();) {
            std::size_t end = i + 1;
            while (end < of.size() && of[end].higher == of[i].higher) ++end;
            if (end == i + 2 && of[i].forwards != of[i + 1].forwards) {
                triangles_[of[i].triangle].behind[of[i].corner] = of[i + 1].triangle;
                triangles_[of[i + 1].triangle].behind[of[i + 1].corner] = of[i].triangle;
            }
            i = end;
        }
    }
}

}  // namespace tessera
