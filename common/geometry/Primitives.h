/// Strips, loops, fans, quads and polygons as the triangles and lines that they are.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/base/Error.h"
#include "common/geometry/Mesh.h"

namespace tessera {

enum class RunKind : std::uint8_t {
    kLineStrips,
    kLineLoops,
    kTriangleStrips,
    kTriangleFans,
    kQuads,
    kQuadStrips,
    kPolygons
};
[[nodiscard]] constexpr bool areLines(RunKind kind) {
    return kind == RunKind::kLineStrips || kind == RunKind::kLineLoops;
}
/// Their triangles follow where the corners are; those of the others the corners' order alone.
[[nodiscard]] constexpr bool followPlaces(RunKind kind) {
    return kind == RunKind::kQuads || kind == RunKind::kPolygons;
}

/// Corners one after the other, in runs: a strip, loop, fan or polygon each.
struct PrimitiveRuns {
    RunKind kind;
    std::span<const float> positions;        ///< xyz per vertex
    std::span<const std::uint32_t> indices;  ///< a vertex per corner; empty: the vertices as they stand
    std::span<const std::uint32_t> lengths;  ///< corners of each run; empty: all are one. Of quads it says nothing

    [[nodiscard]] std::size_t vertices() const { return positions.size() / 3; }
    [[nodiscard]] std::size_t corners() const { return indices.empty() ? vertices() : indices.size(); }
    [[nodiscard]] std::uint32_t vertex(std::size_t corner) const {
        return indices.empty() ? static_cast<std::uint32_t>(corner) : indices[corner];
    }
};

/// Says what is wrong: a run of too few corners (two of a strip of lines, three, four of a strip of quads, and there an
/// odd number), lengths that do not add up, an index out of range, corners over that are no quad, more triangles or
/// lines than allowed. Costs one pass.
[[nodiscard]] Expected<void> checkRuns(const PrimitiveRuns& runs, const MeshLimits& limits = {});

/// Vertices, two per line or three per triangle, of runs that checkRuns lets pass. Lines and triangles keep the order
/// of the runs and of their corners: a strip's triangle i has corners i, i + 1, i + 2 (every second one turned around,
/// so that all face as the first does), a fan's 0, i + 1, i + 2; quad i is two triangles. A triangle or line that names
/// a vertex twice joins strips and is left out. A polygon of n corners has n - 2 triangles, whatever their places, as
/// do two of a quad: so many that which are whose is known without looking.
///
/// A quad is cut from its first corner to its third, but for one that is concave at its second or fourth: there.
/// Polygons are cut (EarClipping.h) as they are seen along the axis that their normal (Newell's) is nearest to; they
/// need not be quite flat. Each may take kMostClipSteps per corner, else kLimit.
[[nodiscard]] Expected<std::vector<std::uint32_t>> assembleRuns(const PrimitiveRuns& runs);

/// As assembleRuns, where `assembled` was made of the same runs, but that vertices [first, end) were elsewhere: of
/// quads and polygons those that have one of them are cut anew. Elements that may have changed; empty: none.
[[nodiscard]] Expected<ByteRange> reassembleRuns(const PrimitiveRuns& runs, std::size_t first, std::size_t end,
                                                 std::vector<std::uint32_t>& assembled);

inline constexpr std::uint64_t kMostClipSteps = 1024;

}  // namespace tessera
