#include "server/optimise/MeshOrder.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <cstring>
#include <numeric>
#include <span>
#include <unordered_map>
#include <utility>

namespace tessera {
namespace {

using Indices = std::vector<std::uint32_t>;

/// What each vertex has in one array.
struct VertexArray {
    Blob Geometry::*blob;
    std::size_t bytesEach;
};
constexpr VertexArray kVertexArrays[] = {{&Geometry::positions, 12}, {&Geometry::normals, 12},
                                         {&Geometry::colors, 4},     {&Geometry::texcoords, 8},
                                         {&Geometry::texcoords1, 8}, {&Geometry::tangents, 16}};

std::size_t verticesOf(const Geometry& mesh) {
    return mesh.positions.sizeBytes() / 12;
}

Indices indicesOf(const Geometry& mesh) {
    const std::span<const std::uint32_t> all = mesh.indices.as<std::uint32_t>();
    return {all.begin(), all.end()};
}

/// Vertex i goes to remap[i], of `count`; ~0: nowhere.
Geometry remapped(const Geometry& mesh, const Indices& indices, const Indices& remap, std::size_t count) {
    Geometry out = mesh;
    for (const VertexArray& array : kVertexArrays) {
        const Blob& from = mesh.*array.blob;
        if (from.empty()) continue;
        std::vector<std::byte> to(count * array.bytesEach);
        for (std::size_t i = 0; i < remap.size(); ++i)
            if (remap[i] != ~0u)
                std::memcpy(to.data() + remap[i] * array.bytesEach, from.bytes().data() + i * array.bytesEach,
                            array.bytesEach);
        out.*array.blob = Blob::of(std::span<const std::byte>(to));
    }
    Indices moved(indices.size());
    std::ranges::transform(indices, moved.begin(), [&remap](std::uint32_t i) { return remap[i]; });
    out.indices = Blob::of(std::span<const std::uint32_t>(moved));
    return out;
}

/// Equal vertices become one, those without a triangle go.
Geometry joined(const Geometry& mesh, const Indices& indices) {
    std::vector<meshopt_Stream> streams;
    for (const VertexArray& array : kVertexArrays)
        if (const Blob& blob = mesh.*array.blob; !blob.empty())
            streams.push_back({blob.bytes().data(), array.bytesEach, array.bytesEach});
    Indices remap(verticesOf(mesh));
    const std::size_t count = meshopt_generateVertexRemapMulti(remap.data(), indices.data(), indices.size(),
                                                               remap.size(), streams.data(), streams.size());
    return remapped(mesh, indices, remap, count);
}

/// Of a run alone, by numbers of its own: a run costs what it holds.
void orderRun(std::span<std::uint32_t> run) {
    Indices vertices(run.begin(), run.end());
    std::ranges::sort(vertices);
    vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
    Indices local(run.size()), better(run.size());
    for (std::size_t i = 0; i < run.size(); ++i)
        local[i] = static_cast<std::uint32_t>(std::ranges::lower_bound(vertices, run[i]) - vertices.begin());
    meshopt_optimizeVertexCache(better.data(), local.data(), local.size(), vertices.size());
    for (std::size_t i = 0; i < run.size(); ++i) run[i] = vertices[better[i]];
}

}  // namespace

Geometry ordered(const Geometry& mesh, bool spatial) {
    Indices indices = indicesOf(mesh);
    if (indices.empty()) return mesh;
    Geometry out = joined(mesh, indices);
    indices = indicesOf(out);
    if (spatial) {
        Indices sorted(indices.size());
        meshopt_spatialSortTriangles(sorted.data(), indices.data(), indices.size(), out.positions.as<float>().data(),
                                     verticesOf(out), 12);
        indices = std::move(sorted);
    }
    for (std::size_t first = 0; first < indices.size(); first += 3 * kTrianglesOfARun)
        orderRun(std::span(indices).subspan(first, std::min(3 * kTrianglesOfARun, indices.size() - first)));
    Indices remap(verticesOf(out));
    const std::size_t count =
        meshopt_optimizeVertexFetchRemap(remap.data(), indices.data(), indices.size(), remap.size());
    return remapped(out, indices, remap, count);
}

std::vector<CoarserMesh> coarserMeshes(const Geometry& mesh, std::size_t fewest) {
    std::vector<CoarserMesh> coarser;
    const Indices finest = indicesOf(mesh);
    const float* positions = mesh.positions.as<float>().data();
    const double size = meshopt_simplifyScale(positions, verticesOf(mesh), 12);
    constexpr float kMostError = 0.1f;
    std::size_t had = finest.size();
    while (had / 2 >= 3 * fewest) {
        Indices indices(finest.size());
        float error = 0;
        const std::size_t wanted = had / 6 * 3;
        indices.resize(meshopt_simplify(indices.data(), finest.data(), finest.size(), positions, verticesOf(mesh), 12,
                                        wanted, kMostError, 0, &error));
        // What hardly gets less is not worth a level.
        if (indices.empty() || indices.size() > had * 3 / 4) break;
        had = indices.size();
        Geometry level = mesh;
        level.indices = Blob::of(std::span<const std::uint32_t>(indices));
        const double before = coarser.empty() ? 0 : coarser.back().error;
        coarser.push_back({ordered(level, false), std::max(before, error * size)});
    }
    return coarser;
}

}  // namespace tessera
