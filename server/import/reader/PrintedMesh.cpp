#include "server/import/reader/PrintedMesh.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "server/import/reader/PlaceTable.h"
#include "server/import/reader/SmoothNormals.h"
#include "server/import/reader/SoundParts.h"

namespace tessera {
namespace {

/// Keeps of each array what belongs to the triangles that stay.
template <typename T>
void keep(std::vector<T>& values, std::size_t each, const std::vector<bool>& stays) {
    if (values.empty()) return;
    std::size_t to = 0;
    for (std::size_t triangle = 0; triangle < stays.size(); ++triangle)
        if (stays[triangle])
            for (std::size_t i = 0; i < each; ++i) values[to++] = values[each * triangle + i];
    values.resize(to);
}

template <typename T>
void append(const std::vector<T>& from, std::size_t each, std::uint32_t element, std::vector<T>& to) {
    if (from.empty()) return;
    const auto begin = from.begin() + static_cast<std::ptrdiff_t>(each * element);
    to.insert(to.end(), begin, begin + static_cast<std::ptrdiff_t>(each));
}

bool namesAllVertices(const PrintedMesh& mesh) {
    std::vector<bool> named(mesh.positions.size() / 3);
    for (const std::uint32_t vertex : mesh.indices) named[vertex] = true;
    return std::ranges::find(named, false) == named.end();
}

/// The numbers of triangles, those of one look after the other.
std::vector<std::uint32_t> orderByLook(const std::vector<std::uint32_t>& looks) {
    std::vector<std::uint32_t> order(looks.size());
    std::iota(order.begin(), order.end(), 0u);
    std::ranges::stable_sort(order, {}, [&](std::uint32_t triangle) { return looks[triangle]; });
    return order;
}

}  // namespace

std::string leaveOutUnsound(PrintedMesh& mesh, const std::string& name) {
    const std::size_t vertices = mesh.positions.size() / 3, triangles = mesh.indices.size() / 3;
    LeftOutParts leftOut(name, "triangles", LeftOutParts::Numbers::kOrNone);
    std::vector<bool> stays(triangles);
    bool all = true;
    for (std::size_t t = 0; t < triangles; ++t) {
        stays[t] = leftOut.keeps(std::span(mesh.indices).subspan(3 * t, 3), vertices, [&](std::uint32_t vertex) {
            return stands(&mesh.positions[std::size_t{3} * vertex]);
        });
        all = all && stays[t];
    }
    if (all) return {};
    keep(mesh.indices, 3, stays);
    keep(mesh.looks, 1, stays);
    keep(mesh.colors, 3, stays);
    keep(mesh.texcoords, 6, stays);
    return leftOut.text();
}

std::vector<PrintedPart> partedByLooks(PrintedMesh mesh, std::span<const PrintedLook> looks, bool smooth) {
    std::vector<PrintedPart> parts;
    if (mesh.indices.empty()) return parts;
    const bool isOne = mesh.looks.empty() && mesh.colors.empty() && mesh.texcoords.empty();
    MeshData whole;
    const bool isWhole = namesAllVertices(mesh);
    whole.positions = std::move(mesh.positions);
    whole.indices = std::move(mesh.indices);
    // Who stands nowhere is named by nobody, and is gone before normals are worked out.
    if (!isWhole) {
        VertexChains chains;
        std::vector<float> positions;
        for (std::uint32_t& corner : whole.indices) {
            const std::uint32_t vertex = chains.vertexAt(corner, [](std::uint32_t) { return true; });
            if (3 * std::size_t{vertex} == positions.size()) append(whole.positions, 3, corner, positions);
            corner = vertex;
        }
        whole.positions = std::move(positions);
    }
    if (smooth) setSmoothNormals(whole);
    if (isOne) {
        parts.push_back({0, std::move(whole)});
        return parts;
    }
    if (mesh.looks.empty()) mesh.looks.assign(whole.indices.size() / 3, 0);
    const std::vector<std::uint32_t> order = orderByLook(mesh.looks);
    VertexChains chains;
    std::vector<std::uint32_t> sources;
    for (std::size_t begin = 0; begin < order.size();) {
        PrintedPart& part = parts.emplace_back();
        part.look = mesh.looks[order[begin]];
        const PrintedLook look = looks[part.look];
        const bool hasColors = look.hasColors && !mesh.colors.empty(),
                   hasTexcoords = look.hasTexcoords && !mesh.texcoords.empty();
        MeshData& made = part.mesh;
        std::vector<std::uint32_t> colors;
        sources.clear();
        std::size_t at = begin;
        for (; at < order.size() && mesh.looks[order[at]] == part.look; ++at)
            for (std::size_t corner = 3 * std::size_t{order[at]}; corner < 3 * std::size_t{order[at]} + 3; ++corner) {
                const std::uint32_t source = whole.indices[corner];
                const std::uint32_t vertex = chains.vertexAt(source, [&](std::uint32_t there) {
                    return (!hasColors || colors[there] == mesh.colors[corner]) &&
                           (!hasTexcoords ||
                            (made.texcoords[2 * std::size_t{there}] == mesh.texcoords[2 * corner] &&
                             made.texcoords[2 * std::size_t{there} + 1] == mesh.texcoords[2 * corner + 1]));
                });
                made.indices.push_back(vertex);
                if (vertex < sources.size()) continue;
                sources.push_back(source);
                append(whole.positions, 3, source, made.positions);
                append(whole.normals, 3, source, made.normals);
                if (hasColors) colors.push_back(mesh.colors[corner]);
                if (hasTexcoords)
                    made.texcoords.insert(made.texcoords.end(),
                                          {mesh.texcoords[2 * corner], mesh.texcoords[2 * corner + 1]});
            }
        for (const std::uint32_t color : colors)
            for (const int shift : {24, 16, 8, 0}) made.colors.push_back(static_cast<std::uint8_t>(color >> shift));
        chains.clear(sources);
        begin = at;
    }
    return parts;
}

}  // namespace tessera
