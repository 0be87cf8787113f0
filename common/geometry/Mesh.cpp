#include "common/geometry/Mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/geometry/MeshCopies.h"
#include "common/geometry/Points.h"

namespace tessera {

namespace {

Expected<std::size_t> elementCount(const Blob& blob, std::size_t bytesEach, std::string_view name) {
    if (!blob.empty() && !blob.resident()) {
        return fail(ErrorCode::kBadInput,
                    fmt::format("the {} are not here: blob {} has to be fetched first", name, toHex(blob.id())));
    }
    if (blob.sizeBytes() % bytesEach != 0) {
        return fail(ErrorCode::kBadInput,
                    fmt::format("the {} have {} bytes, not a whole number of elements of {} bytes", name,
                                blob.sizeBytes(), bytesEach));
    }
    return blob.sizeBytes() / bytesEach;
}

/// An optional per-vertex array is left out or as long as the positions.
Expected<void> checkPerVertex(const Blob& blob, std::size_t bytesEach, std::string_view name, std::size_t vertices) {
    const Expected<std::size_t> count = elementCount(blob, bytesEach, name);
    if (!count) return tl::unexpected(count.error());
    if (!blob.empty() && *count != vertices) {
        return fail(
            ErrorCode::kBadInput,
            fmt::format("{} {} for {} vertices: leave the array out or give one per vertex", *count, name, vertices));
    }
    return {};
}

Expected<void> checkFinite(std::span<const float> values, std::size_t perVertex, std::string_view name) {
    for (std::size_t i = 0; i < values.size(); ++i) {
        if (!std::isfinite(values[i])) {
            return fail(ErrorCode::kBadInput, fmt::format("the {} of vertex {} are not finite", name, i / perVertex));
        }
    }
    return {};
}

/// What the arrays of a kind hold beside positions, normals, colours and tangents.
struct KindRow {
    enum class Has : std::uint8_t { kNot, kMay, kMust };
    MeshKind kind;
    std::string_view name;
    Has triangles, lines, copies, texcoords, texcoords1;
    bool radius, sorted;  ///< may it have one, may it be
};
using enum KindRow::Has;
constexpr std::array<KindRow, kMeshKinds> kKinds = {{
    {MeshKind::kTriangles, "triangles", kMay, kNot, kNot, kMay, kMay, false, false},
    {MeshKind::kPoints, "points", kNot, kNot, kNot, kMay, kMay, true, false},
    {MeshKind::kLines, "lines", kNot, kMay, kNot, kMay, kMay, false, false},
    {MeshKind::kDiscs, "discs", kNot, kNot, kNot, kMust, kNot, true, true},
    {MeshKind::kStreaks, "streaks", kNot, kMust, kNot, kMust, kNot, true, true},
    {MeshKind::kSprites, "sprites", kNot, kNot, kNot, kMust, kMust, true, true},
    {MeshKind::kMarched, "volumes' boxes", kMust, kNot, kNot, kNot, kNot, false, false},
    {MeshKind::kSlices, "volumes' slices", kMust, kNot, kNot, kMust, kNot, false, false},
    {MeshKind::kGlyphs, "glyphs", kMust, kNot, kMust, kMay, kMay, false, false},
}};
static_assert([] {
    for (std::size_t i = 0; i < kKinds.size(); ++i)
        if (static_cast<std::size_t>(kKinds[i].kind) != i) return false;
    return true;
}());

/// Whether the arrays are those of their kind.
Expected<void> checkKind(const MeshArrays& arrays, const MeshLimits& limits) {
    const auto number = static_cast<std::size_t>(arrays.kind);
    if (number >= kKinds.size()) return fail(ErrorCode::kBadInput, fmt::format("there is no kind {} of mesh", number));
    const KindRow& row = kKinds[number];
    struct Array {
        const Blob& blob;
        KindRow::Has has;
        std::string_view name;
    };
    for (const Array& array :
         {Array{arrays.indices, row.triangles, "triangle indices"}, Array{arrays.lines, row.lines, "line indices"},
          Array{arrays.copies, row.copies, "copies"}, Array{arrays.texcoords, row.texcoords, "texture coordinates"},
          Array{arrays.texcoords1, row.texcoords1, "second texture coordinates"}}) {
        if (array.has == kNot && array.blob.sizeBytes() > 0)
            return fail(ErrorCode::kBadInput, fmt::format("{} have no {}: leave the array out", row.name, array.name));
        if (array.has == kMust && array.blob.sizeBytes() == 0 && arrays.positions.sizeBytes() > 0)
            return fail(ErrorCode::kBadInput, fmt::format("{} need {}", row.name, array.name));
    }
    if (!row.radius && arrays.pointRadius != 0)
        return fail(ErrorCode::kBadInput, fmt::format("{} have no radius: it is {}", row.name, arrays.pointRadius));
    if (!row.sorted && arrays.sorted)
        return fail(ErrorCode::kBadInput, fmt::format("only particles are sorted, not {}", row.name));
    if (!(arrays.pointRadius >= 0 && arrays.pointRadius <= limits.maxPointRadius))
        return fail(ErrorCode::kBadInput, fmt::format("the {}' radius is {}: it has to be from 0 to {:g}", row.name,
                                                      arrays.pointRadius, limits.maxPointRadius));
    return {};
}

Expected<void> checkLines(const MeshArrays& arrays, std::size_t vertices, const MeshLimits& limits) {
    const Expected<std::size_t> lines = elementCount(arrays.lines, 2 * sizeof(std::uint32_t), "line indices");
    if (!lines) return tl::unexpected(lines.error());
    if (*lines > limits.maxLines)
        return fail(ErrorCode::kLimit, fmt::format("{} lines, at most {} are allowed", *lines, limits.maxLines));
    if (arrays.kind == MeshKind::kStreaks && vertices != 2 * *lines)
        return fail(ErrorCode::kBadInput,
                    fmt::format("{} streaks of {} vertices: they have two each", *lines, vertices));
    return {};
}

Expected<void> checkCopies(const MeshArrays& arrays, std::size_t triangles, const MeshLimits& limits) {
    const Expected<std::size_t> copies = elementCount(arrays.copies, sizeof(MeshCopy), "copies");
    if (!copies) return tl::unexpected(copies.error());
    if (*copies == 0) return {};
    if (triangles > 0 && *copies > limits.maxTriangles / triangles)
        return fail(ErrorCode::kLimit, fmt::format("{} copies of {} triangles, at most {} triangles are allowed",
                                                   *copies, triangles, limits.maxTriangles));
    const std::span<const float> numbers = arrays.copies.as<float>();
    const auto bad = std::ranges::find_if_not(numbers, [](float number) { return std::isfinite(number); });
    if (bad == numbers.end()) return {};
    return fail(ErrorCode::kBadInput,
                fmt::format("copy {} is not finite",
                            static_cast<std::size_t>(bad - numbers.begin()) * sizeof(float) / sizeof(MeshCopy)));
}

Expected<void> checkIndices(std::span<const std::uint32_t> indices, std::size_t each, std::string_view what,
                            std::size_t vertices) {
    for (std::size_t i = 0; i < indices.size(); ++i)
        if (indices[i] >= vertices)
            return fail(ErrorCode::kBadInput, fmt::format("{} {} names vertex {}, but there are {} vertices", what,
                                                          i / each, indices[i], vertices));
    return {};
}

}  // namespace

Expected<void> checkMesh(const MeshArrays& arrays, const MeshLimits& limits) {
    const Expected<std::size_t> vertices = elementCount(arrays.positions, 3 * sizeof(float), "positions");
    if (!vertices) return tl::unexpected(vertices.error());
    if (*vertices > limits.maxVertices) {
        return fail(ErrorCode::kLimit,
                    fmt::format("{} vertices, at most {} are allowed", *vertices, limits.maxVertices));
    }
    const Expected<std::size_t> triangles = elementCount(arrays.indices, 3 * sizeof(std::uint32_t), "triangle indices");
    if (!triangles) return tl::unexpected(triangles.error());
    if (*triangles > limits.maxTriangles) {
        return fail(ErrorCode::kLimit,
                    fmt::format("{} triangles, at most {} are allowed", *triangles, limits.maxTriangles));
    }
    if (arrays.kind == MeshKind::kPoints && *vertices > limits.maxPoints)
        return fail(ErrorCode::kLimit, fmt::format("{} points, at most {} are allowed", *vertices, limits.maxPoints));
    if (auto ok = checkKind(arrays, limits); !ok) return ok;
    if (auto ok = checkLines(arrays, *vertices, limits); !ok) return ok;
    if (auto ok = checkCopies(arrays, *triangles, limits); !ok) return ok;
    if (auto ok = checkPerVertex(arrays.normals, 3 * sizeof(float), "normals", *vertices); !ok) return ok;
    const std::size_t colored = arrays.kind == MeshKind::kGlyphs ? copyCount(arrays) : *vertices;
    if (auto ok = checkPerVertex(arrays.colors, 4, "colours", colored); !ok) return ok;
    for (const Blob* texcoords : {&arrays.texcoords, &arrays.texcoords1})
        if (auto ok = checkPerVertex(*texcoords, 2 * sizeof(float), "texture coordinates", *vertices); !ok) return ok;
    if (auto ok = checkPerVertex(arrays.tangents, 4 * sizeof(float), "tangents", *vertices); !ok) return ok;

    if (auto ok = checkFinite(arrays.positions.as<float>(), 3, "positions"); !ok) return ok;
    if (auto ok = checkFinite(arrays.normals.as<float>(), 3, "normals"); !ok) return ok;
    for (const Blob* texcoords : {&arrays.texcoords, &arrays.texcoords1})
        if (auto ok = checkFinite(texcoords->as<float>(), 2, "texture coordinates"); !ok) return ok;
    if (auto ok = checkFinite(arrays.tangents.as<float>(), 4, "tangents"); !ok) return ok;

    if (auto ok = checkIndices(arrays.indices.as<std::uint32_t>(), 3, "triangle", *vertices); !ok) return ok;
    return checkIndices(arrays.lines.as<std::uint32_t>(), 2, "line", *vertices);
}

ByteRange elementsOf(const ByteRange& bytes, std::size_t elementBytes) {
    if (bytes.empty()) return {};
    return {bytes.begin / elementBytes, (bytes.end + elementBytes - 1) / elementBytes};
}

bool soundWithin(const MeshArrays& arrays, const MeshRanges& ranges) {
    const auto within = [](const Blob& blob, const ByteRange& bytes, auto sound) {
        using Number = typename decltype(sound)::Number;
        const ByteRange which = elementsOf(bytes, sizeof(Number));
        const std::uint64_t end = std::min<std::uint64_t>(which.end, blob.sizeBytes() / sizeof(Number));
        constexpr std::uint64_t kAtOnce = 4096;
        for (std::uint64_t first = which.begin; first < end; first += kAtOnce)
            if (!std::ranges::all_of(blob.values<Number>(first, std::min(kAtOnce, end - first)), sound)) return false;
        return true;
    };
    struct Finite {
        using Number = float;
        bool operator()(float number) const { return std::isfinite(number); }
    };
    struct Known {
        using Number = std::uint32_t;
        std::size_t vertices;
        bool operator()(std::uint32_t vertex) const { return vertex < vertices; }
    };
    const auto finite = [&](const Blob& blob, const ByteRange& bytes) { return within(blob, bytes, Finite()); };
    const Known isVertex{arrays.positions.sizeBytes() / (3 * sizeof(float))};
    const auto known = [&](const Blob& blob, const ByteRange& bytes) { return within(blob, bytes, isVertex); };
    return finite(arrays.positions, ranges[0]) && finite(arrays.normals, ranges[1]) &&
           finite(arrays.texcoords, ranges[3]) && finite(arrays.texcoords1, ranges[5]) &&
           finite(arrays.tangents, ranges[7]) && known(arrays.indices, ranges[4]) && known(arrays.lines, ranges[6]) &&
           finite(arrays.copies, ranges[8]);
}

Box boundsOf(std::span<const float> positions) {
    Vec3f lower = Vec3f::Constant(std::numeric_limits<float>::infinity());
    Vec3f upper = -lower;
    for (std::size_t i = 0; i + 2 < positions.size(); i += 3) {
        const Vec3f p(positions[i], positions[i + 1], positions[i + 2]);
        lower = lower.cwiseMin(p);
        upper = upper.cwiseMax(p);
    }
    Box box;
    if ((lower.array() <= upper.array()).all()) {
        box.lower = lower.cast<double>();
        box.upper = upper.cast<double>();
    }
    return box;
}

Box shownBounds(const MeshArrays& arrays) {
    if (arrays.kind == MeshKind::kGlyphs) return boundsOfCopies(arrays, 0, copyCount(arrays));
    Box places = boundsOf(arrays.positions.as<float>());
    if (arrays.kind == MeshKind::kPoints) return boundsOfPoints(places, arrays.pointRadius);
    if (!places.empty()) {
        places.lower.array() -= arrays.pointRadius;
        places.upper.array() += arrays.pointRadius;
    }
    return places;
}

std::uint64_t triangleCount(const MeshArrays& arrays) {
    if (arrays.kind == MeshKind::kPoints) return arrays.positions.sizeBytes() / (3 * sizeof(float)) * kFacesPerPoint;
    const std::uint64_t triangles = arrays.indices.sizeBytes() / (3 * sizeof(std::uint32_t));
    return arrays.kind == MeshKind::kGlyphs ? triangles * copyCount(arrays) : triangles;
}

std::optional<std::array<Vec3f, 3>> cornersOf(const MeshArrays& arrays, std::uint32_t triangle, double shownRadius) {
    std::array<Vec3f, 3> corners;
    const auto read = [&](std::span<const float> positions, std::span<const std::uint32_t> indices, std::size_t first) {
        if (first + 2 >= indices.size()) return false;
        for (std::size_t i = 0; i < 3; ++i) {
            const std::size_t at = std::size_t{3} * indices[first + i];
            if (at + 2 >= positions.size()) return false;
            corners[i] = Vec3f(positions[at], positions[at + 1], positions[at + 2]);
        }
        return true;
    };
    bool found = false;
    if (arrays.kind == MeshKind::kPoints) {
        const std::size_t point = triangle / kFacesPerPoint;
        if (point >= arrays.positions.as<float>().size() / 3) return std::nullopt;
        const MeshData one = trianglesOfPoints(arrays, shownRadius, {point, point + 1});
        found = read(one.positions, one.indices, 3 * (triangle % kFacesPerPoint));
    } else {
        found = read(arrays.positions.as<float>(), arrays.indices.as<std::uint32_t>(), std::size_t{3} * triangle);
    }
    if (!found) return std::nullopt;
    return corners;
}

static MeshKind kindOf(Primitive primitive) {
    switch (primitive) {
        case Primitive::kPoints:
            return MeshKind::kPoints;
        case Primitive::kLines:
            return MeshKind::kLines;
        case Primitive::kTriangles:
            break;
    }
    return MeshKind::kTriangles;
}

MeshArrays MeshData::toArrays() const {
    const auto blob = [](const auto& values) {
        using Value = typename std::decay_t<decltype(values)>::value_type;
        return values.empty() ? Blob() : Blob::of(std::span<const Value>(values));
    };
    return {.positions = blob(positions),
            .normals = blob(normals),
            .colors = blob(colors),
            .texcoords = blob(texcoords),
            .indices = blob(indices),
            .texcoords1 = blob(texcoords1),
            .lines = blob(lines),
            .tangents = blob(tangents),
            .kind = kindOf(primitive),
            .pointRadius = primitive == Primitive::kPoints ? pointRadius : 0,
            .lineWidth = primitive == Primitive::kLines ? lineWidth : 0};
}

void MeshData::append(const MeshData& other, const Affine3d& place) {
    const std::size_t before = positions.size() / 3;
    const std::size_t added = other.positions.size() / 3;
    if (added == 0) return;

    // An array that only one side has is made up for the other.
    if (before > 0 && normals.empty() && !other.normals.empty()) computeNormals(*this);
    const bool wantNormals = before == 0 ? !other.normals.empty() : !normals.empty();
    if (wantNormals && other.normals.empty()) {
        MeshData withNormals = other;
        computeNormals(withNormals);
        append(withNormals, place);
        return;
    }
    for (const auto set : {&MeshData::texcoords, &MeshData::texcoords1}) {
        std::vector<float>& own = this->*set;
        const std::vector<float>& theirs = other.*set;
        if (own.empty() && theirs.empty()) continue;
        own.resize(2 * before, 0.0f);
        own.insert(own.end(), theirs.begin(), theirs.end());
        own.resize(2 * (before + added), 0.0f);
    }
    if (!colors.empty() || !other.colors.empty()) {
        colors.resize(4 * before, 255);
        colors.insert(colors.end(), other.colors.begin(), other.colors.end());
        colors.resize(4 * (before + added), 255);
    }
    // Where one side has none, they are made of the texture coordinates of both when somebody needs some.
    const bool wantTangents = wantNormals && !other.tangents.empty() && (before == 0 || tangents.size() == 4 * before);
    if (!wantTangents) tangents.clear();

    const auto addTransformed = [](std::vector<float>& to, const Vec3d& v) {
        for (int axis = 0; axis < 3; ++axis) to.push_back(static_cast<float>(v[axis]));
    };
    const double handedness = place.linear().determinant() < 0 ? -1.0 : 1.0;
    // The cofactor matrix: normals' transform up to a positive factor, and defined for flattening transforms too.
    const Mat3d& m = place.linear();
    Mat3d cofactor;
    cofactor.col(0) = m.col(1).cross(m.col(2));
    cofactor.col(1) = m.col(2).cross(m.col(0));
    cofactor.col(2) = m.col(0).cross(m.col(1));
    for (std::size_t i = 0; i < added; ++i) {
        const Vec3d p(other.positions[3 * i], other.positions[3 * i + 1], other.positions[3 * i + 2]);
        addTransformed(positions, place * p);
        if (!wantNormals) continue;
        const Vec3d n(other.normals[3 * i], other.normals[3 * i + 1], other.normals[3 * i + 2]);
        addTransformed(normals, (handedness * (cofactor * n)).normalized());
        if (!wantTangents) continue;
        const float* const tangent = &other.tangents[4 * i];
        addTransformed(tangents, (m * Vec3d(tangent[0], tangent[1], tangent[2])).normalized());
        tangents.push_back(static_cast<float>(handedness) * tangent[3]);
    }
    for (std::size_t i = 0; i + 2 < other.indices.size(); i += 3) {
        const std::uint32_t base = static_cast<std::uint32_t>(before);
        const std::uint32_t a = base + other.indices[i], b = base + other.indices[i + 1],
                            c = base + other.indices[i + 2];
        // A reflection turns triangles around; turned back, they are counter-clockwise seen from outside again.
        if (handedness > 0) {
            indices.insert(indices.end(), {a, b, c});
        } else {
            indices.insert(indices.end(), {a, c, b});
        }
    }
}

void computeNormals(MeshData& mesh) {
    const std::size_t vertices = mesh.positions.size() / 3;
    std::vector<Vec3d> sums(vertices, Vec3d::Zero());
    const auto position = [&](std::uint32_t v) {
        return Vec3d(mesh.positions[3 * v], mesh.positions[3 * v + 1], mesh.positions[3 * v + 2]);
    };
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
        const std::uint32_t a = mesh.indices[i], b = mesh.indices[i + 1], c = mesh.indices[i + 2];
        // The cross product's length is twice the area: that is the weight.
        const Vec3d normal = (position(b) - position(a)).cross(position(c) - position(a));
        for (const std::uint32_t v : {a, b, c}) sums[v] += normal;
    }
    mesh.normals.resize(3 * vertices);
    for (std::size_t v = 0; v < vertices; ++v) {
        // A vertex of degenerate triangles alone, or of none, still gets a unit vector: shaders divide by its length.
        const double length = sums[v].norm();
        const Vec3d normal = length > 0 ? Vec3d(sums[v] / length) : Vec3d(Vec3d::UnitY());
        for (int axis = 0; axis < 3; ++axis)
            mesh.normals[3 * v + static_cast<std::size_t>(axis)] = static_cast<float>(normal[axis]);
    }
}

}  // namespace tessera
