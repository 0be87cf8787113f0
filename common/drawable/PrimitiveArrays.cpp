#include "common/drawable/PrimitiveArrays.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <numeric>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "common/drawable/ContentCache.h"
#include "common/geometry/Primitives.h"

namespace tessera {
namespace {

/// Nothing: triangles, lines and points are as they stand.
std::optional<RunKind> runKindOf(const Geometry& g) {
    switch (g.primitive) {
        case Geometry::kLineStrip:
            return RunKind::kLineStrips;
        case Geometry::kLineLoop:
            return RunKind::kLineLoops;
        case Geometry::kTriangleStrip:
            return RunKind::kTriangleStrips;
        case Geometry::kTriangleFan:
            return RunKind::kTriangleFans;
        case Geometry::kQuads:
            return RunKind::kQuads;
        case Geometry::kQuadStrip:
            return RunKind::kQuadStrips;
        case Geometry::kPolygons:
            return RunKind::kPolygons;
        default:
            return std::nullopt;
    }
}

bool isHere(const Blob& blob) {
    return blob.empty() || blob.resident();
}
bool areHere(const Geometry& g) {
    return isHere(g.positions) && isHere(g.indices) && isHere(g.lengths);
}

PrimitiveRuns runsOf(const Geometry& g, RunKind kind) {
    return {.kind = kind,
            .positions = g.positions.as<float>(),
            .indices = g.indices.as<std::uint32_t>(),
            .lengths = g.lengths.as<std::uint32_t>()};
}

/// Indices of triangles or lines, or why there are none.
struct AssembledIndices {
    Blob indices;
    Error wrong;
    bool sound = false;
    [[nodiscard]] std::size_t bytes() const { return 256 + indices.sizeBytes(); }
    [[nodiscard]] bool inUse() const { return !indices.empty() && !indices.soleHandle(); }
};

/// Of strips and fans, of what their order depends on alone: moved vertices have the same.
Hash128 nameOf(const Geometry& g, RunKind kind, const BlobId& positions) {
    const std::array<Hash128, 5> parts{Hash128{Geometry::kType.value, static_cast<std::uint64_t>(kind)}, g.indices.id(),
                                       g.lengths.id(), followPlaces(kind) ? positions : BlobId(),
                                       Hash128{g.positions.sizeBytes(), 0}};
    return hash128(std::as_bytes(std::span(parts)));
}

ContentCache<AssembledIndices>& assembledIndices() {
    static ContentCache<AssembledIndices> cache(std::size_t{1} << 27);
    return cache;
}

AssembledIndices wrongIndices(Error wrong) {
    return {.indices = {}, .wrong = std::move(wrong)};
}

/// From those of the positions that edits of ranges led from, if somebody has them still.
std::optional<AssembledIndices> assembledFrom(const Geometry& g, const PrimitiveRuns& runs) {
    for (const Blob::Origin& origin : g.positions.origins()) {
        const std::shared_ptr<const AssembledIndices> known = assembledIndices().find(nameOf(g, runs.kind, origin.id));
        if (!known || !known->sound) continue;
        const std::span<const std::uint32_t> before = known->indices.as<std::uint32_t>();
        std::vector<std::uint32_t> indices(before.begin(), before.end());
        const ByteRange moved = elementsOf({origin.begin, origin.end}, 3 * sizeof(float));
        const Expected<ByteRange> cut = reassembleRuns(runs, moved.begin, moved.end, indices);
        if (!cut) return wrongIndices(cut.error());
        std::size_t first = cut->begin, end = cut->empty() ? first : cut->end;
        while (first < end && indices[first] == before[first]) ++first;
        while (end > first && indices[end - 1] == before[end - 1]) --end;
        if (first == end) {
            // A handle of its own: whether somebody uses an entry is told by handles.
            const auto same = std::make_shared<const std::vector<std::uint32_t>>(std::move(indices));
            return AssembledIndices{
                .indices = known->indices.movedTo(same, std::as_bytes(std::span(*same))), .wrong = {}, .sound = true};
        }
        Expected<Blob> blob = known->indices.withRange(
            first * sizeof(std::uint32_t),
            std::as_bytes(std::span<const std::uint32_t>(indices).subspan(first, end - first)));
        if (!blob) return wrongIndices(blob.error());
        return AssembledIndices{.indices = std::move(*blob), .wrong = {}, .sound = true};
    }
    return std::nullopt;
}

/// A place for each vertex.
Expected<void> checkPlaces(const Geometry& g) {
    MeshArrays places;
    places.positions = g.positions;
    return checkMesh(places);
}

Expected<void> checkWhole(const Blob& numbers, std::string_view name) {
    if (numbers.sizeBytes() % sizeof(std::uint32_t) == 0) return {};
    return fail(ErrorCode::kBadInput, fmt::format("the {} have {} bytes, not a whole number of elements of 4 bytes",
                                                  name, numbers.sizeBytes()));
}

AssembledIndices assembledAnew(const Geometry& g, const PrimitiveRuns& runs) {
    const std::pair<const Blob*, std::string_view> numbers[] = {{&g.indices, "indices"}, {&g.lengths, "lengths"}};
    for (const auto& [blob, name] : numbers)
        if (const Expected<void> whole = checkWhole(*blob, name); !whole) return wrongIndices(whole.error());
    // Of strips and fans the name says nothing of places, so no more may be said here than how many there are.
    if (g.positions.sizeBytes() % (3 * sizeof(float)) != 0)
        return wrongIndices({ErrorCode::kBadInput,
                             fmt::format("the positions have {} bytes, not a whole number of elements of 12 bytes",
                                         g.positions.sizeBytes())});
    if (followPlaces(runs.kind))
        if (const Expected<void> sound = checkPlaces(g); !sound) return wrongIndices(sound.error());
    if (const Expected<void> sound = checkRuns(runs); !sound) return wrongIndices(sound.error());
    const Expected<std::vector<std::uint32_t>> indices = assembleRuns(runs);
    if (!indices) return wrongIndices(indices.error());
    return {.indices = indices->empty() ? Blob() : Blob::of(std::span<const std::uint32_t>(*indices)),
            .wrong = {},
            .sound = true};
}

std::shared_ptr<const AssembledIndices> assembledOf(const Geometry& g, RunKind kind) {
    return assembledIndices().get(nameOf(g, kind, g.positions.id()), [&] {
        const PrimitiveRuns runs = runsOf(g, kind);
        if (followPlaces(kind) && checkPlaces(g))
            if (std::optional<AssembledIndices> led = assembledFrom(g, runs)) return std::move(*led);
        return assembledAnew(g, runs);
    });
}

/// As many bytes as the indices would have: repeated corners, which join strips, are counted.
Blob absentIndices(const Geometry& g, RunKind kind) {
    const std::uint64_t corners = (g.indices.empty() ? g.positions.sizeBytes() / (3 * sizeof(float))
                                                     : g.indices.sizeBytes() / sizeof(std::uint32_t));
    const std::uint64_t runs = g.lengths.empty() ? 1 : g.lengths.sizeBytes() / sizeof(std::uint32_t);
    const auto less = [&](std::uint64_t each) { return corners > each * runs ? corners - each * runs : 0; };
    const std::uint64_t elements = kind == RunKind::kLineStrips  ? 2 * less(1)
                                   : kind == RunKind::kLineLoops ? 2 * corners
                                   : kind == RunKind::kQuads     ? 6 * (corners / 4)
                                                                 : 3 * less(2);
    return elements == 0 ? Blob() : Blob::absent(nameOf(g, kind, g.positions.id()), elements * sizeof(std::uint32_t));
}

/// 0, 1, 2 …: of triangles and lines that take the vertices as they stand. What is left over of vertices makes none, as
/// in OpenGL.
Blob consecutiveIndices(std::uint64_t vertices, std::uint64_t each) {
    const std::uint64_t count = std::min<std::uint64_t>(vertices - vertices % each, 0xffffffffu);
    if (count == 0) return {};
    const std::array<Hash128, 2> parts{Hash128{Geometry::kType.value, 0x636f6e736563ull}, Hash128{count, each}};
    return assembledIndices()
        .get(hash128(std::as_bytes(std::span(parts))),
             [count] {
                 std::vector<std::uint32_t> indices(count);
                 std::iota(indices.begin(), indices.end(), 0u);
                 return AssembledIndices{
                     .indices = Blob::of(std::span<const std::uint32_t>(indices)), .wrong = {}, .sound = true};
             })
        ->indices;
}

bool holdNothing(const Geometry& g) {
    return g.positions.empty() && g.indices.empty() && g.lengths.empty();
}

}  // namespace

MeshArrays arraysOf(const Geometry& g) {
    const std::optional<RunKind> kind = runKindOf(g);
    const bool points = g.primitive == Geometry::kPoints,
               lines = kind ? areLines(*kind) : g.primitive == Geometry::kLines;
    MeshArrays arrays{.positions = g.positions,
                      .normals = g.normals,
                      .colors = g.colors,
                      .texcoords = g.texcoords,
                      .indices = {},
                      .texcoords1 = g.texcoords1,
                      .lines = {},
                      .tangents = g.tangents,
                      .kind = points  ? MeshKind::kPoints
                              : lines ? MeshKind::kLines
                                      : MeshKind::kTriangles,
                      .pointRadius = points ? g.pointRadius : 0.0,
                      .lineWidth = lines ? g.lineWidth : 0.0f};
    Blob indices = g.indices;
    if (kind)
        indices = holdNothing(g) ? Blob() : areHere(g) ? assembledOf(g, *kind)->indices : absentIndices(g, *kind);
    else if (!points && indices.empty())
        indices = consecutiveIndices(g.positions.sizeBytes() / (3 * sizeof(float)), lines ? 2 : 3);
    (lines ? arrays.lines : arrays.indices) = std::move(indices);
    return arrays;
}

Expected<void> checkPrimitives(const Geometry& g) {
    const std::optional<RunKind> kind = runKindOf(g);
    if (!kind) return checkWhole(g.lengths, "lengths");  // which count for nothing yet
    if (holdNothing(g)) return {};
    if (!areHere(g))
        return fail(ErrorCode::kBadInput,
                    "the positions, indices or lengths are not here: their blobs have to be fetched first");
    const std::shared_ptr<const AssembledIndices> assembled = assembledOf(g, *kind);
    if (!assembled->sound) return tl::unexpected(assembled->wrong);
    return {};
}

}  // namespace tessera
