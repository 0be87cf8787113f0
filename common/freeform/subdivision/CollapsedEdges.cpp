#include "common/freeform/subdivision/CollapsedEdges.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <string>

namespace tessera {
namespace {

/// Calls back with (place of the edge's first vertex, place of its second) among all faces' vertices.
template <typename Visit>
void forEachSide(const ControlMesh& mesh, const Visit& visit) {
    std::size_t begin = 0;
    for (const std::uint32_t size : mesh.faceSizes) {
        for (std::uint32_t i = 0; i < size; ++i) visit(begin + i, begin + (i + 1) % size);
        begin += size;
    }
}

/// Which corners of faces are one vertex.
class CornerFans {
public:
    explicit CornerFans(std::size_t corners) : parents_(corners) { std::iota(parents_.begin(), parents_.end(), 0U); }
    std::uint32_t find(std::uint32_t corner) {
        while (parents_[corner] != corner) corner = parents_[corner] = parents_[parents_[corner]];
        return corner;
    }
    void join(std::uint32_t a, std::uint32_t b) { parents_[std::max(find(a), find(b))] = std::min(find(a), find(b)); }

private:
    std::vector<std::uint32_t> parents_;
};

}  // namespace

bool hasCollapsedEdges(const ControlMesh& mesh) {
    bool found = false;
    forEachSide(mesh,
                [&](std::size_t a, std::size_t b) { found = found || mesh.faceVertices[a] == mesh.faceVertices[b]; });
    return found;
}

Expected<UnrolledMesh> unrollCollapsedEdges(const ControlMesh& mesh) {
    std::vector<bool> isPole(mesh.positions.size(), false);
    forEachSide(mesh, [&](std::size_t a, std::size_t b) {
        if (mesh.faceVertices[a] == mesh.faceVertices[b]) isPole[mesh.faceVertices[a]] = true;
    });
    // Both sides of an edge that ends at a pole belong to one fan.
    using Side = std::pair<std::uint32_t, std::uint32_t>;
    std::map<Side, std::vector<Side>> sides;  // by vertices in ascending order: places
    forEachSide(mesh, [&](std::size_t a, std::size_t b) {
        const std::uint32_t v = mesh.faceVertices[a], w = mesh.faceVertices[b];
        if (v != w && (isPole[v] || isPole[w]))
            sides[std::minmax(v, w)].push_back({static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b)});
    });
    CornerFans fans(mesh.faceVertices.size());
    for (const auto& [ends, places] : sides) {
        if (places.size() == 1) continue;
        if (places.size() > 2 || mesh.faceVertices[places[0].first] == mesh.faceVertices[places[1].first]) {
            return fail(ErrorCode::kBadInput,
                        "vertices " + std::to_string(ends.first) + " and " + std::to_string(ends.second) +
                            ": a vertex that a face has twice may not be on an edge of more than two faces");
        }
        if (isPole[mesh.faceVertices[places[0].first]]) fans.join(places[0].first, places[1].second);
        if (isPole[mesh.faceVertices[places[0].second]]) fans.join(places[0].second, places[1].first);
    }
    UnrolledMesh out{.mesh = mesh, .sources = std::vector<std::uint32_t>(mesh.positions.size())};
    std::iota(out.sources.begin(), out.sources.end(), 0U);
    std::map<std::uint32_t, std::uint32_t> vertexOfFan;
    std::vector<bool> isTaken(mesh.positions.size(), false);
    for (std::uint32_t place = 0; place < mesh.faceVertices.size(); ++place) {
        const std::uint32_t old = mesh.faceVertices[place];
        if (!isPole[old]) continue;
        const auto [found, isNew] = vertexOfFan.try_emplace(fans.find(place), old);
        if (isNew && isTaken[old]) {
            found->second = static_cast<std::uint32_t>(out.sources.size());
            out.sources.push_back(old);
            out.mesh.positions.push_back(mesh.positions[old]);
        }
        if (isNew) out.mesh.corners.push_back({found->second, kInfiniteSharpness});
        isTaken[old] = true;
        out.mesh.faceVertices[place] = found->second;
    }
    std::size_t begin = 0;
    std::vector<std::uint32_t> sorted;
    for (std::size_t f = 0; f < mesh.faceSizes.size(); begin += mesh.faceSizes[f++]) {
        const auto first = out.mesh.faceVertices.begin() + static_cast<std::ptrdiff_t>(begin);
        sorted.assign(first, first + mesh.faceSizes[f]);
        std::sort(sorted.begin(), sorted.end());
        const auto twice = std::adjacent_find(sorted.begin(), sorted.end());
        if (twice != sorted.end()) {
            return fail(ErrorCode::kBadInput, "face " + std::to_string(f) + " has vertex " +
                                                  std::to_string(out.sources[*twice]) + " twice, in one fan of faces");
        }
    }
    // Creases at poles go with their edges; edges without length become ends of the mesh, and are to stay surface.
    out.mesh.creases.clear();
    for (const ControlMesh::Crease& crease : mesh.creases) {
        const auto found = sides.find(std::minmax(crease.from, crease.to));
        if (found == sides.end()) {
            out.mesh.creases.push_back(crease);
        } else {
            const Side place = found->second.front();
            out.mesh.creases.push_back(
                {out.mesh.faceVertices[place.first], out.mesh.faceVertices[place.second], crease.sharpness});
        }
    }
    std::erase_if(out.mesh.creases, [](const ControlMesh::Crease& crease) { return crease.from == crease.to; });
    forEachSide(mesh, [&](std::size_t a, std::size_t b) {
        if (mesh.faceVertices[a] == mesh.faceVertices[b])
            out.mesh.creases.push_back({out.mesh.faceVertices[a], out.mesh.faceVertices[b], kInfiniteSharpness});
    });
    return out;
}

}  // namespace tessera
