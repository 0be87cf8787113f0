#include "common/drawable/TangentArrays.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "common/drawable/ContentCache.h"
#include "common/drawable/Drawable.h"
#include "common/geometry/TangentSpace.h"

namespace tessera {
namespace {

/// What of a normal map decides where tangents point.
struct ImageCoordinates {
    const Blob* texcoords;
    /// Row by row, what becomes of (u, v) but for an offset. Identity where the image's u still grows where the mesh's
    /// does.
    std::array<float, 4> turn{1, 0, 0, 1};
};

ImageCoordinates coordinatesOf(const MeshArrays& arrays, const Image& map) {
    ImageCoordinates of{.texcoords = map.texcoordSet == 1 ? &arrays.texcoords1 : &arrays.texcoords};
    if (map.rotation == 0 && map.scale.x() > 0 && map.scale.y() > 0) return of;
    const float c = std::cos(map.rotation), s = std::sin(map.rotation);
    of.turn = {c * map.scale.x(), s * map.scale.y(), -s * map.scale.x(), c * map.scale.y()};
    return of;
}

/// What the tangents depend on, alone.
MeshArrays madeOf(const MeshArrays& arrays, const ImageCoordinates& image) {
    MeshArrays parts;
    parts.positions = arrays.positions;
    parts.normals = arrays.normals;
    parts.texcoords = *image.texcoords;
    parts.indices = arrays.indices;
    return parts;
}

Hash128 nameOf(const MeshKey& key, const std::array<float, 4>& turn) {
    const std::array<Hash128, 6> parts{Hash128{std::bit_cast<std::uint64_t>(std::array{turn[0], turn[1]}),
                                               std::bit_cast<std::uint64_t>(std::array{turn[2], turn[3]})},
                                       Hash128{0x74616e67656e7473ull, 0},
                                       key.arrays[0],
                                       key.arrays[1],
                                       key.arrays[3],
                                       key.arrays[4]};
    return hash128(std::as_bytes(std::span(parts)));
}

/// A handle of its own: whether somebody uses an entry is told by handles.
template <typename Value>
Blob ownBlob(std::vector<Value> values) {
    return values.empty() ? Blob() : Blob::of(std::span<const Value>(values));
}

struct MadeTangents {
    Blob tangents;                                             ///< empty: the arrays are not sound
    Blob indices;                                              ///< where vertices were added
    std::shared_ptr<const std::vector<std::uint32_t>> copied;  ///< of each the vertex that it is a copy of
    Hash128 name;
    [[nodiscard]] std::size_t bytes() const { return 256 + tangents.sizeBytes() + indices.sizeBytes(); }
    [[nodiscard]] bool inUse() const { return !tangents.empty() && !tangents.soleHandle(); }
};

struct LongerArray {
    Blob array;
    [[nodiscard]] std::size_t bytes() const { return 256 + array.sizeBytes(); }
    [[nodiscard]] bool inUse() const { return !array.empty() && !array.soleHandle(); }
};

ContentCache<MadeTangents>& madeTangents() {
    static ContentCache<MadeTangents> cache(std::size_t{1} << 27);
    return cache;
}
ContentCache<LongerArray>& longerArrays() {
    static ContentCache<LongerArray> cache(std::size_t{1} << 27);
    return cache;
}

/// As a range of an earlier array, where only a part is new: so who uploads ranges follows.
Blob asRangeOf(const MadeTangents& earlier, const std::vector<float>& tangents) {
    const ByteSpan before = earlier.tangents.bytes(), now = std::as_bytes(std::span(tangents));
    if (before.size() != now.size() || (earlier.copied && !earlier.copied->empty())) return ownBlob(tangents);
    std::size_t first = 0, end = now.size();
    while (first < end && before[first] == now[first]) ++first;
    while (end > first && before[end - 1] == now[end - 1]) --end;
    if (first == end || end - first == now.size()) return ownBlob(tangents);
    Expected<Blob> led = earlier.tangents.withRange(first, now.subspan(first, end - first));
    return led ? std::move(*led) : ownBlob(tangents);
}

MadeTangents make(const MeshArrays& parts, const std::array<float, 4>& turn) {
    MadeTangents out{.tangents = {}, .indices = {}, .copied = {}, .name = nameOf(keyOf(parts), turn)};
    if (!checkMesh(parts)) return out;
    std::span<const float> texcoords = parts.texcoords.as<float>();
    std::vector<float> turned;
    if (turn != std::array<float, 4>{1, 0, 0, 1}) {
        for (std::size_t i = 0; i < texcoords.size(); i += 2)
            for (const std::size_t row : {0, 2})
                turned.push_back(turn[row] * texcoords[i] + turn[row + 1] * texcoords[i + 1]);
        texcoords = turned;
    }
    VertexTangents made = mikkVertexTangents({.positions = parts.positions.as<float>(),
                                              .normals = parts.normals.as<float>(),
                                              .texcoords = texcoords,
                                              .indices = parts.indices.as<std::uint32_t>()});
    if (!made.copied.empty()) {
        out.indices = ownBlob(std::move(made.indices));
        out.copied = std::make_shared<const std::vector<std::uint32_t>>(std::move(made.copied));
        out.tangents = ownBlob(std::move(made.tangents));
        return out;
    }
    for (const MeshOrigin& origin : originsOf(parts))
        if (const auto earlier = madeTangents().find(nameOf(origin.key, turn)); earlier && !earlier->tangents.empty()) {
            out.tangents = asRangeOf(*earlier, made.tangents);
            return out;
        }
    out.tangents = ownBlob(std::move(made.tangents));
    return out;
}

/// With copies of some elements behind them.
Blob withAdded(const Blob& array, const MadeTangents& made, std::size_t bytesEach) {
    if (array.empty()) return {};
    const std::array<Hash128, 2> parts{made.name, array.id()};
    return longerArrays()
        .get(hash128(std::as_bytes(std::span(parts))),
             [&]() -> LongerArray {
                 const ByteSpan from = array.bytes();
                 Bytes to(from.size() + made.copied->size() * bytesEach);
                 std::memcpy(to.data(), from.data(), from.size());
                 std::byte* at = to.data() + from.size();
                 for (const std::uint32_t vertex : *made.copied) {
                     std::memcpy(at, from.data() + vertex * bytesEach, bytesEach);
                     at += bytesEach;
                 }
                 return {.array = Blob(std::move(to))};
             })
        ->array;
}

}  // namespace

MeshArrays withTangents(MeshArrays arrays, const Image& normalMap) {
    if (arrays.kind != MeshKind::kTriangles || arrays.normals.empty()) arrays.tangents = {};
    if (arrays.kind != MeshKind::kTriangles || arrays.normals.empty() || !arrays.tangents.empty()) return arrays;
    const ImageCoordinates image = coordinatesOf(arrays, normalMap);
    if (image.texcoords->empty() || arrays.indices.empty()) return arrays;
    // All, as copies are made of all.
    for (const Blob* blob :
         {&arrays.positions, &arrays.normals, &arrays.colors, &arrays.texcoords, &arrays.texcoords1, &arrays.indices})
        if (!blob->empty() && !blob->resident()) return arrays;
    const MeshArrays parts = madeOf(arrays, image);
    const std::shared_ptr<const MadeTangents> made =
        madeTangents().get(nameOf(keyOf(parts), image.turn), [&] { return make(parts, image.turn); });
    if (made->tangents.empty()) return arrays;
    if (made->copied) {
        const std::uint64_t vertices = arrays.positions.sizeBytes() / (3 * sizeof(float));
        const std::pair<Blob*, std::size_t> perVertex[] = {{&arrays.positions, 12},
                                                           {&arrays.normals, 12},
                                                           {&arrays.colors, 4},
                                                           {&arrays.texcoords, 8},
                                                           {&arrays.texcoords1, 8}};
        for (const auto& [array, bytesEach] : perVertex)
            if (!array->empty() && array->sizeBytes() != vertices * bytesEach) return arrays;
        for (const auto& [array, bytesEach] : perVertex) *array = withAdded(*array, *made, bytesEach);
        arrays.indices = made->indices;
    }
    arrays.tangents = made->tangents;
    return arrays;
}

}  // namespace tessera
