#include "server/import/reader/SoundParts.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

namespace tessera {
namespace {

/// Of `each` numbers a vertex, those of the vertices that stay.
template <typename Number>
void pick(std::vector<Number>& values, std::size_t each, const std::vector<bool>& stays) {
    if (values.size() != each * stays.size()) return;
    std::size_t kept = 0;
    for (std::size_t v = 0; v < stays.size(); ++v)
        if (stays[v])
            std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(v * each), each,
                        values.begin() + static_cast<std::ptrdiff_t>(each * kept++));
    values.resize(kept * each);
}

std::string keepSoundPoints(MeshData& mesh, const std::string& name) {
    const std::size_t vertices = mesh.positions.size() / 3;
    LeftOutParts leftOut(name, "points");
    std::vector<bool> stays(vertices);
    for (std::uint32_t v = 0; v < vertices; ++v)
        stays[v] = leftOut.keeps(std::span(&v, 1), vertices, [&](std::uint32_t corner) {
            return stands(mesh.positions.data() + std::size_t{3} * corner);
        });
    if (leftOut.text().empty()) return {};
    pick(mesh.positions, 3, stays);
    pick(mesh.normals, 3, stays);
    pick(mesh.texcoords, 2, stays);
    pick(mesh.texcoords1, 2, stays);
    pick(mesh.colors, 4, stays);
    pick(mesh.tangents, 4, stays);
    return leftOut.text();
}

}  // namespace

void LeftOutParts::rememberFirst(std::size_t number, std::uint32_t corner, std::size_t vertices) {
    if (numbers_ == Numbers::kOrNone && corner == std::numeric_limits<std::uint32_t>::max()) {
        first_ = fmt::format("number {}, has a corner that is no vertex's number (whole, from 0 on)", number);
        return;
    }
    const bool isSigned = numbers_ == Numbers::kSigned;
    const std::int64_t said = isSigned ? std::int64_t{static_cast<std::int32_t>(corner)} : std::int64_t{corner};
    first_ = corner >= vertices ? fmt::format("number {}, names vertex {} of {}", number, said, vertices)
                                : fmt::format("number {}, has vertex {}, whose position is not finite", number, corner);
}

std::string LeftOutParts::text() const {
    if (leftOut_ == 0) return {};
    return fmt::format("{}: {} of {} {} {} left out; the first, {}", mesh_, leftOut_, seen_, parts_,
                       leftOut_ == 1 ? "is" : "are", first_);
}

std::string keepSoundParts(MeshData& mesh, const std::string& name) {
    if (mesh.primitive == Primitive::kPoints) return keepSoundPoints(mesh, name);
    const std::size_t vertices = mesh.positions.size() / 3;
    const auto stood = [&](std::size_t vertex) { return stands(mesh.positions.data() + 3 * vertex); };
    const bool lines = mesh.primitive == Primitive::kLines;
    LeftOutParts leftOut(name, lines ? "lines" : "triangles");
    std::vector<std::uint32_t>& indices = lines ? mesh.lines : mesh.indices;
    const std::size_t corners = lines ? 2 : 3;
    std::size_t kept = 0;
    for (std::size_t at = 0; at + corners <= indices.size(); at += corners) {
        if (!leftOut.keeps(std::span(indices).subspan(at, corners), vertices, stood)) continue;
        std::copy_n(indices.begin() + static_cast<std::ptrdiff_t>(at), corners,
                    indices.begin() + static_cast<std::ptrdiff_t>(kept));
        kept += corners;
    }
    indices.resize(kept);
    std::array<float, 3> somewhere = {0, 0, 0};
    for (std::size_t v = 0; v < vertices; ++v)
        if (stood(v)) {
            std::copy_n(mesh.positions.begin() + static_cast<std::ptrdiff_t>(3 * v), 3, somewhere.begin());
            break;
        }
    for (std::size_t v = 0; v < vertices; ++v)
        if (!stood(v)) std::copy_n(somewhere.begin(), 3, mesh.positions.begin() + static_cast<std::ptrdiff_t>(3 * v));
    return leftOut.text();
}

}  // namespace tessera
