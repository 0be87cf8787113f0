#include "client/draw/store/DrawForms.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <numeric>
#include <utility>
#include <vector>

#include "common/geometry/MeshCopies.h"
#include "common/math/Decompositions.h"
#include "common/math/Srgb.h"

namespace tessera {
namespace {

/// In place of a width, of lines whose ends are one place and are drawn as squares: as no drawable has it.
constexpr float kSquares = -1;

/// What is made of arrays on its way to GL: so many units at a time.
constexpr std::uint64_t kUnitsAtOnce = 65536;

/// sRGB byte -> linear, 16 bit.
const std::array<std::uint16_t, 256>& linearTable() {
    static const auto kTable = [] {
        std::array<std::uint16_t, 256> table{};
        for (std::size_t i = 0; i < table.size(); ++i) {
            table[i] = static_cast<std::uint16_t>(std::lround(linearOfSrgb(static_cast<double>(i) / 255.0) * 65535.0));
        }
        return table;
    }();
    return kTable;
}

std::uint64_t countOf(const MeshArrays& arrays) {
    return arrays.positions.sizeBytes() / (3 * sizeof(float));
}

/// The arrays of vertices, as numbers.
struct VertexArrays {
    explicit VertexArrays(const MeshArrays& arrays)
        : positions(arrays.positions.as<float>()),
          normals(arrays.normals.as<float>()),
          texcoords(arrays.texcoords.as<float>()),
          texcoords1(arrays.texcoords1.as<float>()),
          tangents(arrays.tangents.as<float>()),
          colors(arrays.colors.as<std::uint8_t>()) {}
    std::span<const float> positions, normals, texcoords, texcoords1, tangents;
    std::span<const std::uint8_t> colors;

    [[nodiscard]] MeshVertex vertex(std::size_t i) const {
        MeshVertex v{.position = {positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]},
                     .normal = {0, 0, 0},
                     .color = {0xffff, 0xffff, 0xffff, 0xffff},
                     .texcoord = {0, 0},
                     .texcoord1 = {0, 0}};
        const auto& linear = linearTable();
        if (!normals.empty()) v.normal = {normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]};
        if (!colors.empty())
            v.color = {linear[colors[4 * i]], linear[colors[4 * i + 1]], linear[colors[4 * i + 2]],
                       static_cast<std::uint16_t>(colors[4 * i + 3] * 257)};
        if (!texcoords.empty()) v.texcoord = {texcoords[2 * i], texcoords[2 * i + 1]};
        if (!texcoords1.empty()) v.texcoord1 = {texcoords1[2 * i], texcoords1[2 * i + 1]};
        return v;
    }
    [[nodiscard]] MappedVertex mapped(std::size_t i) const {
        MappedVertex v{.vertex = vertex(i), .tangent = {}};
        const std::span<const float> t = tangents.subspan(4 * i, 4);
        const float longest = std::max({std::abs(t[0]), std::abs(t[1]), std::abs(t[2])});
        constexpr float kOne = 32767;
        // Whatever length an array gives it.
        if (longest > 0) {
            const Vec3f along = Vec3f(t[0], t[1], t[2]) / longest;
            const Vec3f unit = kOne / along.norm() * along;
            for (std::size_t k = 0; k < 3; ++k)
                v.tangent[k] = static_cast<std::int16_t>(std::lround(unit[static_cast<Eigen::Index>(k)]));
        }
        v.tangent[3] = static_cast<std::int16_t>(t[3] < 0 ? -kOne : kOne);
        return v;
    }
};

/// Told in pieces of kUnitsAtOnce; `append(elements, unit)` makes those of one.
template <typename Element, typename F>
void tellUnits(const ByteRange& units, const std::function<void(ByteSpan)>& tell, F&& append) {
    std::vector<Element> elements;
    for (std::uint64_t first = units.begin; first < units.end; first += kUnitsAtOnce) {
        elements.clear();
        for (std::uint64_t i = first; i < std::min(first + kUnitsAtOnce, units.end); ++i) append(elements, i);
        tell(std::as_bytes(std::span(elements)));
    }
}

// ---- triangles: vertices and indices as they come ------------------------------------------------------------------

std::array<MeshPart, 2> partsOfTriangles(const MeshArrays& arrays) {
    return {{{arrays.tangents.empty() ? MeshStore::kVertices : MeshStore::kMappedVertices, countOf(arrays), 1},
             {MeshStore::kIndices, 3 * triangleCount(arrays), 1}}};
}

void writeTriangles(const MeshArrays& arrays, MeshStore store, const ByteRange& units,
                    const std::function<void(ByteSpan)>& tell) {
    if (store == MeshStore::kIndices)
        return tell(std::as_bytes(arrays.indices.as<std::uint32_t>().subspan(units.begin, units.end - units.begin)));
    const VertexArrays vertices(arrays);
    if (store == MeshStore::kMappedVertices)
        tellUnits<MappedVertex>(units, tell, [&](auto& to, std::uint64_t i) { to.push_back(vertices.mapped(i)); });
    else
        tellUnits<MeshVertex>(units, tell, [&](auto& to, std::uint64_t i) { to.push_back(vertices.vertex(i)); });
}

constexpr DrawForm::Follows kTrianglesFollow[] = {{0, 3 * sizeof(float), MeshStore::kVertices},
                                                  {1, 3 * sizeof(float), MeshStore::kVertices},
                                                  {2, 4, MeshStore::kVertices},
                                                  {3, 2 * sizeof(float), MeshStore::kVertices},
                                                  {5, 2 * sizeof(float), MeshStore::kVertices},
                                                  {0, 3 * sizeof(float), MeshStore::kMappedVertices},
                                                  {1, 3 * sizeof(float), MeshStore::kMappedVertices},
                                                  {2, 4, MeshStore::kMappedVertices},
                                                  {3, 2 * sizeof(float), MeshStore::kMappedVertices},
                                                  {5, 2 * sizeof(float), MeshStore::kMappedVertices},
                                                  {7, 4 * sizeof(float), MeshStore::kMappedVertices},
                                                  {4, sizeof(std::uint32_t), MeshStore::kIndices}};

// ---- lines: four vertices each, of two triangles -------------------------------------------------------------------

std::array<MeshPart, 2> partsOfLines(const MeshArrays& arrays) {
    const std::uint64_t lines = arrays.lines.sizeBytes() / (2 * sizeof(std::uint32_t));
    return {{{MeshStore::kVertices, lines, 4}, {MeshStore::kIndices, lines, 6}}};
}

/// As MeshVertex.glsl wants them: each end twice, with the other end as its normal and the side in the second texture
/// coordinate.
void writeLines(const MeshArrays& arrays, MeshStore store, const ByteRange& units,
                const std::function<void(ByteSpan)>& tell) {
    if (store == MeshStore::kIndices)
        return tellUnits<std::uint32_t>(units, tell, [](auto& to, std::uint64_t line) {
            for (const std::uint32_t corner : {0, 1, 2, 0, 2, 3})
                to.push_back(static_cast<std::uint32_t>(4 * line) + corner);
        });
    const VertexArrays vertices(arrays);
    const bool asSquares = arrays.lineWidth == kSquares;
    const std::span<const std::uint32_t> ends = arrays.lines.as<std::uint32_t>();
    tellUnits<MeshVertex>(units, tell, [&](auto& to, std::uint64_t line) {
        for (const std::size_t end : {2 * line, 2 * line + 1})
            for (const float side : {1.0f, -1.0f}) {
                MeshVertex corner = vertices.vertex(ends[end]);
                corner.normal = vertices.vertex(ends[end ^ 1]).position;
                // Of a line from a corner to itself the other end is the other way: a square.
                corner.texcoord1 = {side, asSquares && end % 2 == 1 ? 1.0f : 0.0f};
                to.push_back(corner);
            }
    });
}

// ---- points: as they are, for shaders to find balls around -----------------------------------------------

std::uint64_t texelsPerPoint(std::uint8_t parts) {
    return 1u + ((parts & kPointNormals) != 0) + ((parts & kPointTexcoords) != 0);
}

std::array<MeshPart, 2> partsOfPoints(const MeshArrays& arrays) {
    return {{{MeshStore::kTexels, countOf(arrays), texelsPerPoint(pointPartsOf(arrays))}, {MeshStore::kIndices, 0, 1}}};
}

PointTexel texel(float x, float y, float z, std::uint32_t last) {
    return {std::bit_cast<std::uint32_t>(x), std::bit_cast<std::uint32_t>(y), std::bit_cast<std::uint32_t>(z), last};
}

/// Four bytes as they stand; white where there are none.
std::uint32_t colorBits(std::span<const std::uint8_t> colors, std::uint64_t i) {
    if (colors.empty()) return 0xffffffffu;
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 4; ++k) bits |= std::uint32_t{colors[4 * i + k]} << (8 * k);
    return bits;
}

void writePoints(const MeshArrays& arrays, MeshStore, const ByteRange& units,
                 const std::function<void(ByteSpan)>& tell) {
    const VertexArrays points(arrays);
    const std::uint8_t parts = pointPartsOf(arrays);
    tellUnits<PointTexel>(units, tell, [&](auto& to, std::uint64_t i) {
        to.push_back(texel(points.positions[3 * i], points.positions[3 * i + 1], points.positions[3 * i + 2],
                           colorBits(points.colors, i)));
        if (parts & kPointNormals)
            to.push_back(texel(points.normals[3 * i], points.normals[3 * i + 1], points.normals[3 * i + 2], 0));
        if (parts & kPointTexcoords) {
            const auto of = [i](std::span<const float> set, std::size_t k) {
                return set.empty() ? 0.0f : set[2 * i + k];
            };
            to.push_back(texel(of(points.texcoords, 0), of(points.texcoords, 1), of(points.texcoords1, 0),
                               std::bit_cast<std::uint32_t>(of(points.texcoords1, 1))));
        }
    });
}

DrawForm::Fetched fetchedOfPoints(const MeshArrays& arrays) {
    return {.things = countOf(arrays),
            .numberBits = std::bit_width(kNumbersPerPoint) - 1u,
            .indicesEach = kIndicesPerPoint};
}

constexpr DrawForm::Follows kPointsFollow[] = {{0, 3 * sizeof(float), MeshStore::kTexels},
                                               {1, 3 * sizeof(float), MeshStore::kTexels},
                                               {2, 4, MeshStore::kTexels},
                                               {3, 2 * sizeof(float), MeshStore::kTexels},
                                               {5, 2 * sizeof(float), MeshStore::kTexels}};

// ---- copies: the mesh once, and where it stands; shaders put them together ------------------------------------------

constexpr std::uint64_t kTexelsPerCopy = 3, kTexelsPerCorner = 2;
/// About so many triangles have indices: as many as one call draws.
constexpr std::uint64_t kTrianglesAtOnce = 16384;

std::uint64_t trianglesOfCopy(const MeshArrays& arrays) {
    return arrays.indices.sizeBytes() / (3 * sizeof(std::uint32_t));
}

DrawForm::Fetched fetchedOfCopies(const MeshArrays& arrays) {
    const std::uint64_t copies = copyCount(arrays), triangles = std::max<std::uint64_t>(trianglesOfCopy(arrays), 1);
    return {.things = trianglesOfCopy(arrays) > 0 ? copies : 0,
            .before = (kTexelsPerCorner * countOf(arrays) + kTexelsPerCopy - 1) / kTexelsPerCopy,
            .numberBits = static_cast<unsigned>(std::bit_width(std::max<std::uint64_t>(countOf(arrays), 1) - 1)),
            .indicesEach = static_cast<std::uint32_t>(3 * triangles),
            .atOnce = static_cast<std::uint32_t>(
                std::clamp<std::uint64_t>(kTrianglesAtOnce / triangles, 1, std::max<std::uint64_t>(copies, 1)))};
}

std::array<MeshPart, 2> partsOfCopies(const MeshArrays& arrays) {
    const DrawForm::Fetched fetched = fetchedOfCopies(arrays);
    return {{{MeshStore::kTexels, fetched.before + copyCount(arrays), kTexelsPerCopy},
             {MeshStore::kIndices, fetched.atOnce * trianglesOfCopy(arrays), 3}}};
}

/// The mesh's corners, two texels each, in as many units as they take; then a unit for each copy, which says how many
/// texels before it the corners begin.
void writeCopies(const MeshArrays& arrays, MeshStore store, const ByteRange& units,
                 const std::function<void(ByteSpan)>& tell) {
    const DrawForm::Fetched fetched = fetchedOfCopies(arrays);
    if (store == MeshStore::kIndices)
        return tellUnits<std::uint32_t>(
            units, tell, [&, indices = arrays.indices.as<std::uint32_t>()](auto& to, std::uint64_t triangle) {
                const std::uint64_t copy = 3 * triangle / fetched.indicesEach,
                                    first = 3 * triangle % fetched.indicesEach;
                for (std::uint64_t i = first; i < first + 3; ++i)
                    to.push_back(static_cast<std::uint32_t>(copy << fetched.numberBits) + indices[i]);
            });
    const VertexArrays corners(arrays);
    const std::span<const MeshCopy> copies = arrays.copies.as<MeshCopy>();
    const auto corner = [&](std::uint64_t at) {
        const std::span<const float> of = at % kTexelsPerCorner == 0 ? corners.positions : corners.normals;
        const std::uint64_t i = 3 * (at / kTexelsPerCorner);
        // One of its texture coordinates beside each: kTexelsPerCorner is how many there are of those, too.
        const float beside = at < corners.texcoords.size() ? corners.texcoords[at] : 0;
        return i + 2 < of.size() ? texel(of[i], of[i + 1], of[i + 2], std::bit_cast<std::uint32_t>(beside))
                                 : PointTexel{0, 0, 0, std::bit_cast<std::uint32_t>(beside)};
    };
    tellUnits<PointTexel>(units, tell, [&](auto& to, std::uint64_t unit) {
        if (unit < fetched.before) {
            for (std::uint64_t k = 0; k < kTexelsPerCopy; ++k) to.push_back(corner(kTexelsPerCopy * unit + k));
            return;
        }
        const std::uint64_t i = unit - fetched.before;
        const MeshCopy& copy = copies[i];
        to.push_back(texel(copy.place[0], copy.place[1], copy.place[2], colorBits(corners.colors, i)));
        to.push_back(texel(copy.turn[0], copy.turn[1], copy.turn[2], std::bit_cast<std::uint32_t>(copy.turn[3])));
        to.push_back({std::bit_cast<std::uint32_t>(copy.width), std::bit_cast<std::uint32_t>(copy.length),
                      static_cast<std::uint32_t>(kTexelsPerCopy * unit), 0});
    });
}

// ---- particles: four vertices each, of two triangles ---------------------------------------------------------------

std::uint64_t placesPerParticle(const MeshArrays& arrays) {
    return arrays.kind == MeshKind::kStreaks ? 2 : 1;
}

std::array<MeshPart, 2> partsOfParticles(const MeshArrays& arrays) {
    const std::uint64_t particles = countOf(arrays) / placesPerParticle(arrays);
    return {{{MeshStore::kVertices, particles, 4}, {MeshStore::kIndices, particles, 6}}};
}

/// Of discs and sprites each corner is at the middle; x and y of its normal say which it is. Streaks are as lines,
/// their width beside the side.
void writeParticles(const MeshArrays& arrays, MeshStore store, const ByteRange& units,
                    const std::function<void(ByteSpan)>& tell) {
    if (store == MeshStore::kIndices) return writeLines(arrays, store, units, tell);
    const VertexArrays places(arrays);
    tellUnits<MeshVertex>(units, tell, [&, streaks = placesPerParticle(arrays) == 2](auto& to, std::uint64_t particle) {
        if (streaks) {
            for (const std::size_t end : {2 * particle, 2 * particle + 1})
                for (const float side : {1.0f, -1.0f}) {
                    MeshVertex corner = places.vertex(end);
                    corner.normal = places.vertex(end ^ 1).position;
                    corner.texcoord1 = {side, corner.texcoord[0]};
                    to.push_back(corner);
                }
            return;
        }
        for (const auto& [x, y] : {std::pair(-1.0f, -1.0f), {1.0f, -1.0f}, {1.0f, 1.0f}, {-1.0f, 1.0f}}) {
            MeshVertex corner = places.vertex(particle);
            corner.normal = {x, y, 0};
            to.push_back(corner);
        }
    });
}

constexpr DrawForm::Follows kParticlesFollow[] = {{0, 3 * sizeof(float), MeshStore::kVertices},
                                                  {2, 4, MeshStore::kVertices},
                                                  {3, 2 * sizeof(float), MeshStore::kVertices},
                                                  {5, 2 * sizeof(float), MeshStore::kVertices}};
constexpr DrawForm::Follows kStreaksFollow[] = {{0, 6 * sizeof(float), MeshStore::kVertices},
                                                {2, 8, MeshStore::kVertices},
                                                {3, 4 * sizeof(float), MeshStore::kVertices}};

/// Metres a unit of the item's own: where it is scaled unevenly the least, so that all stays in the box around the
/// scaled balls.
std::array<std::uint32_t, 2> scaleOfParticles(const DrawItem&, const Mat3d& eye_R_item) {
    if (!eye_R_item.allFinite()) return {};
    const double least = singularStretchOf(eye_R_item).least;
    return {std::bit_cast<std::uint32_t>(static_cast<float>(least)), 0u};
}

/// The same, and the widest.
std::array<std::uint32_t, 2> scaleOfStreaks(const DrawItem& item, const Mat3d& eye_R_item) {
    return {scaleOfParticles(item, eye_R_item)[0], std::bit_cast<std::uint32_t>(item.widestLinePx)};
}

constexpr DrawForm formOfParticles(MeshKind kind, const char* define, std::span<const DrawForm::Follows> follows) {
    return {.kind = kind,
            .define = define,
            .parts = partsOfParticles,
            .write = writeParticles,
            .follows = follows,
            .normals = true,
            .fetched = nullptr,
            .size = kind == MeshKind::kStreaks ? scaleOfStreaks : scaleOfParticles};
}

constexpr DrawForm formOfVolumes(MeshKind kind, const char* define) {
    return {.kind = kind,
            .define = define,
            .parts = partsOfTriangles,
            .write = writeTriangles,
            .follows = {},
            .normals = true,
            .fetched = nullptr,
            // A ray leaves a box once.
            .sides = kind == MeshKind::kSlices ? DrawForm::Sides::kBoth : DrawForm::Sides::kOne,
            .castRays = kind == MeshKind::kMarched};
}

constexpr DrawForm kForms[] = {
    {.kind = MeshKind::kTriangles,
     .define = "TRIANGLES",
     .parts = partsOfTriangles,
     .write = writeTriangles,
     .follows = kTrianglesFollow,
     .normals = false,
     .fetched = nullptr},
    {.kind = MeshKind::kPoints,
     .define = "POINTS",
     .parts = partsOfPoints,
     .write = writePoints,
     .follows = kPointsFollow,
     .normals = true,
     .fetched = fetchedOfPoints,
     .balls = true,
     // As the eye has it, or the item where that stretches balls; as the item has it.
     .size =
         [](const DrawItem& item, const Mat3d& eye_R_item) {
             const double scale =
                 isStretched(item.world_T_item.linear()) ? 1 : std::cbrt(std::abs(eye_R_item.determinant()));
             return std::array{std::bit_cast<std::uint32_t>(static_cast<float>(item.pointRadius * scale)),
                               std::bit_cast<std::uint32_t>(static_cast<float>(item.pointRadius))};
         }},
    {.kind = MeshKind::kLines,
     .define = "LINES",
     .parts = partsOfLines,
     .write = writeLines,
     .follows = {},
     .normals = true,
     .fetched = nullptr,
     // Of a surface's own edges how much nearer they lie: on it they would be half hidden by it.
     .size =
         [](const DrawItem& item, const Mat3d&) {
             return std::array{std::bit_cast<std::uint32_t>(item.lineWidth),
                               item.fill == Material::kFilled ? 0u : std::bit_cast<std::uint32_t>(kOutlineNearer)};
         }},
    formOfParticles(MeshKind::kDiscs, "DISCS", kParticlesFollow),
    formOfParticles(MeshKind::kStreaks, "STREAKS", kStreaksFollow),
    formOfParticles(MeshKind::kSprites, "SPRITES", kParticlesFollow),
    formOfVolumes(MeshKind::kMarched, "MARCHED"),
    formOfVolumes(MeshKind::kSlices, "SLICES"),
    {.kind = MeshKind::kGlyphs,
     .define = "GLYPHS",
     .parts = partsOfCopies,
     .write = writeCopies,
     .follows = {},
     .normals = false,
     .fetched = fetchedOfCopies},
};
static_assert([] {
    for (const DrawKindRow& row : kDrawKinds)
        if (kForms[static_cast<std::size_t>(row.kind)].kind != row.kind) return false;
    return true;
}());

}  // namespace

const DrawForm& formOf(MeshKind kind) {
    return kForms[static_cast<std::size_t>(kind)];
}

std::size_t MeshSize::bytes() const {
    std::size_t sum = 0;
    for (std::size_t i = 0; i < kMeshStores; ++i) sum += elements[i] * elementBytes(static_cast<MeshStore>(i));
    return sum;
}

MeshSize& MeshSize::operator+=(const MeshSize& other) {
    for (std::size_t i = 0; i < kMeshStores; ++i) elements[i] += other.elements[i];
    return *this;
}

MeshSize sizeOf(const MeshArrays& arrays) {
    MeshSize size;
    for (const MeshPart& part : formOf(arrays.kind).parts(arrays))
        size.elements[static_cast<std::size_t>(part.store)] += part.elements();
    return size;
}

std::uint8_t pointPartsOf(const MeshArrays& arrays) {
    if (arrays.kind == MeshKind::kGlyphs) return static_cast<std::uint8_t>(fetchedOfCopies(arrays).numberBits);
    if (arrays.kind != MeshKind::kPoints) return 0;
    std::uint8_t parts = 0;
    if (!arrays.colors.empty()) parts |= kPointColors;
    if (!arrays.normals.empty()) parts |= kPointNormals;
    if (!arrays.texcoords.empty() || !arrays.texcoords1.empty()) parts |= kPointTexcoords;
    return parts;
}

MeshArrays outlineOf(const MeshArrays& arrays, std::int64_t fill) {
    MeshArrays outline = arrays;
    outline.indices = Blob();
    outline.tangents = Blob();
    outline.kind = MeshKind::kLines;
    outline.lineWidth = fill == Material::kCorners ? kSquares : 0;
    const std::span<const std::uint32_t> indices = arrays.indices.as<std::uint32_t>();
    const std::span<const float> positions = arrays.positions.as<float>();
    // Of vertices at one place the first: where a surface is cut for its normals or textures, its edges are not twice
    // there.
    std::vector<std::uint32_t> order(positions.size() / 3), first(order.size());
    std::iota(order.begin(), order.end(), 0u);
    const auto at = [&](std::uint32_t v) {
        return std::array{positions[3 * std::size_t{v}] + 0.0f, positions[3 * std::size_t{v} + 1] + 0.0f,
                          positions[3 * std::size_t{v} + 2] + 0.0f};
    };
    std::ranges::sort(order,
                      [&](std::uint32_t a, std::uint32_t b) { return std::pair(at(a), a) < std::pair(at(b), b); });
    for (std::size_t i = 0; i < order.size(); ++i)
        first[order[i]] = i > 0 && at(order[i]) == at(order[i - 1]) ? first[order[i - 1]] : order[i];
    std::vector<std::uint64_t> pairs;
    for (std::size_t i = 0; i < indices.size(); ++i) {
        const std::uint32_t a = first[indices[i]],
                            b = fill == Material::kCorners ? a : first[indices[i % 3 == 2 ? i - 2 : i + 1]];
        if (a != b || fill == Material::kCorners) pairs.push_back(std::uint64_t{std::min(a, b)} << 32 | std::max(a, b));
    }
    std::ranges::sort(pairs);
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    std::vector<std::uint32_t> ends;
    ends.reserve(2 * pairs.size());
    for (const std::uint64_t pair : pairs) {
        ends.push_back(static_cast<std::uint32_t>(pair >> 32));
        ends.push_back(static_cast<std::uint32_t>(pair));
    }
    outline.lines = Blob::of(std::span<const std::uint32_t>(ends));
    return outline;
}

bool isStretched(const Mat3d& linear) {
    // Columns of one length, across each other: the matrix times its transpose has one number alone.
    const Mat3d square = linear.transpose() * linear;
    const double mean = square.trace() / 3;
    return !((square - mean * Mat3d::Identity()).cwiseAbs().maxCoeff() <= 1e-4 * mean);
}

std::vector<std::uint16_t> sharedPointIndices(bool insides) {
    std::vector<std::uint16_t> indices;
    indices.reserve(std::size_t{kPointsAtOnce} * kIndicesPerPoint * (insides ? 2 : 1));
    for (std::uint32_t point = 0; point < kPointsAtOnce; ++point)
        for (std::uint32_t side = insides ? 0 : 1; side < 2; ++side)
            for (const std::uint32_t corner : cornersOf(MeshKind::kPoints, {}, 2 * point + side))
                indices.push_back(static_cast<std::uint16_t>(corner));
    return indices;
}

std::array<std::uint32_t, 3> cornersOf(MeshKind kind, std::span<const std::uint32_t> indices, std::uint32_t triangle) {
    if (rowOf(kind).particles) {
        static constexpr std::array<std::uint32_t, 6> kOfSquare = {0, 1, 2, 0, 2, 3};
        const std::uint32_t first = 4 * (triangle / 2);
        const std::size_t at = 3 * (triangle % 2);
        return {first + kOfSquare[at], first + kOfSquare[at + 1], first + kOfSquare[at + 2]};
    }
    if (kind != MeshKind::kPoints) {
        const std::size_t at = 3 * std::size_t{triangle};
        return {indices[at], indices[at + 1], indices[at + 2]};
    }
    // The inside is wound the other way.
    const std::uint32_t first = kNumbersPerPoint * (triangle / 2);
    if (triangle % 2 == 0) return {first + 4, first + 6, first + 5};
    return {first, first + 1, first + 2};
}

std::array<float, 256> linearNumbers() {
    std::array<float, 256> numbers{};
    for (std::size_t i = 0; i < numbers.size(); ++i)
        numbers[i] = static_cast<float>(linearTable()[i]) * (1.0f / 65535.0f);
    return numbers;
}

}  // namespace tessera
