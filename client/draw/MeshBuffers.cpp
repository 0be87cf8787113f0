#include "client/draw/MeshBuffers.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "common/geometry/Points.h"

namespace tessera {
namespace {

constexpr std::uint64_t kFirstCapacity = 8 * 1024;

/// sRGB byte -> linear, 16 bit.
std::array<std::uint16_t, 256> makeLinearTable() {
    std::array<std::uint16_t, 256> table{};
    for (std::size_t i = 0; i < table.size(); ++i) {
        const double s = static_cast<double>(i) / 255.0;
        const double linear = s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
        table[i] = static_cast<std::uint16_t>(std::lround(linear * 65535.0));
    }
    return table;
}

struct VertexArrays {
    std::span<const float> positions, normals, texcoords, texcoords1;
    std::span<const std::uint8_t> colors;
};

std::vector<MeshVertex> interleave(const VertexArrays& arrays, const ByteRange& which) {
    static const std::array<std::uint16_t, 256> kLinear = makeLinearTable();
    const auto& [positions, normals, texcoords, texcoords1, colors] = arrays;
    std::vector<MeshVertex> vertices(which.end - which.begin);
    for (std::size_t i = which.begin; i < which.end; ++i) {
        MeshVertex& v = vertices[i - which.begin];
        v.position = {positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]};
        v.normal = {0, 0, 0};
        if (!normals.empty()) v.normal = {normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]};
        v.color = {0xffff, 0xffff, 0xffff, 0xffff};
        if (!colors.empty())
            v.color = {kLinear[colors[4 * i]], kLinear[colors[4 * i + 1]], kLinear[colors[4 * i + 2]],
                       static_cast<std::uint16_t>(colors[4 * i + 3] * 257)};
        v.texcoord = v.texcoord1 = {0, 0};
        if (!texcoords.empty()) v.texcoord = {texcoords[2 * i], texcoords[2 * i + 1]};
        if (!texcoords1.empty()) v.texcoord1 = {texcoords1[2 * i], texcoords1[2 * i + 1]};
    }
    return vertices;
}

constexpr std::uint64_t kVerticesPerLine = 4, kIndicesPerLine = 6;

/// Four vertices a line, as SurfaceShader.cpp wants them: each end twice, with the other end as its normal and the side in the
/// second texture coordinate.
std::vector<MeshVertex> cornersOfLines(const MeshArrays& arrays, std::span<const std::uint32_t> ends) {
    const std::vector<MeshVertex> vertices =
        interleave({arrays.positions.as<float>(), {}, arrays.texcoords.as<float>(), {}, arrays.colors.as<std::uint8_t>()},
                   {0, arrays.positions.as<float>().size() / 3});
    std::vector<MeshVertex> corners;
    corners.reserve(2 * ends.size());
    for (std::size_t i = 0; i + 1 < ends.size(); i += 2)
        for (const std::size_t end : {i, i + 1})
            for (const float side : {1.0f, -1.0f}) {
                MeshVertex corner = vertices[ends[end]];
                corner.normal = vertices[ends[end ^ 1]].position;
                corner.texcoord1 = {side, 0};
                corners.push_back(corner);
            }
    return corners;
}

struct GlSize {
    std::uint64_t vertices, indices;
    [[nodiscard]] std::size_t bytes() const { return vertices * sizeof(MeshVertex) + indices * sizeof(std::uint32_t); }
};
/// What a mesh takes.
GlSize sizeOf(const MeshArrays& arrays) {
    const std::uint64_t count = arrays.positions.sizeBytes() / (3 * sizeof(float));
    const std::uint64_t lines = arrays.lines.sizeBytes() / (2 * sizeof(std::uint32_t));
    switch (arrays.primitive) {
        case Primitive::kLines: return {lines * kVerticesPerLine, lines * kIndicesPerLine};
        case Primitive::kPoints: return {count * kVerticesPerPoint, count * 3 * kFacesPerPoint};
        case Primitive::kTriangles: break;
    }
    return {count, 3 * triangleCount(arrays)};
}

/// Octahedra take many times what their points take: so many points at a time.
void forSlices(const ByteRange& points, const std::function<void(const ByteRange&)>& visit) {
    constexpr std::uint64_t kPointsAtOnce = 65536;
    for (std::uint64_t first = points.begin; first < points.end; first += kPointsAtOnce)
        visit({first, std::min(first + kPointsAtOnce, points.end)});
}

}  // namespace

MeshBuffers::MeshBuffers(const GlFunctions& gl, GLuint vertexArray, std::size_t budgetBytes)
    : gl_(gl), vertexArray_(vertexArray), budgetBytes_(budgetBytes) {}

MeshBuffers::~MeshBuffers() {
    gl_.DeleteBuffers(1, &vertices_.name);
    gl_.DeleteBuffers(1, &indices_.name);
}

void MeshBuffers::beginDraw() {
    clock_.beginDraw();
    if (residentBytes() > budgetBytes_) makeRoom();
}

std::size_t MeshBuffers::residentBytes() const {
    return vertices_.ranges.used() * sizeof(MeshVertex) + indices_.ranges.used() * sizeof(std::uint32_t);
}

std::optional<MeshRange> MeshBuffers::find(const Drawable& drawable) {
    const MeshKey key = drawable.key();
    auto it = meshes_.find(key);
    if (it == meshes_.end()) {
        if (!drawable.resident()) return std::nullopt;
        const MeshArrays arrays = drawable.arrays();
        it = takeOver(key, arrays) ? meshes_.find(key) : meshes_.emplace(key, allocate(arrays)).first;
        if (gone_.contains(key)) it->second.uses = UseClock::recall(gone_, key);
    }
    Mesh& mesh = it->second;
    clock_.use(mesh.uses);
    if (mesh.refused) return std::nullopt;
    if (mesh.written < mesh.toWrite) writeOn(drawable.arrays(), mesh, ~std::size_t{0});
    return mesh.range;
}

std::optional<std::size_t> MeshBuffers::prepare(const Drawable& drawable, std::size_t bytes) {
    const MeshKey key = drawable.key();
    auto it = meshes_.find(key);
    if (it == meshes_.end()) {
        if (!drawable.resident()) return 0;
        const MeshArrays arrays = drawable.arrays();
        // What goes on changing takes a place over when it is drawn.
        for (const MeshOrigin& origin : originsOf(arrays))
            if (meshes_.contains(origin.key)) return 0;
        if (residentBytes() + sizeOf(arrays).bytes() > budgetBytes_) return std::nullopt;
        it = meshes_.emplace(key, allocate(arrays)).first;
        it->second.uses.lastDraw = clock_.draw();
    }
    const std::uint64_t before = uploadedBytes_;
    if (it->second.written < it->second.toWrite) writeOn(drawable.arrays(), it->second, bytes);
    return uploadedBytes_ - before;
}

void MeshBuffers::expect(std::uint64_t vertices, std::uint64_t indices) {
    const auto reserve = [this](Buffer& buffer, std::uint64_t more, std::size_t elementBytes) {
        const std::uint64_t most = budgetBytes_ / elementBytes, wanted = std::min(most, buffer.ranges.used() + more);
        if (wanted > buffer.ranges.capacity()) grow(buffer, wanted, elementBytes);
    };
    reserve(vertices_, vertices, sizeof(MeshVertex));
    reserve(indices_, indices, sizeof(std::uint32_t));
}

MeshBuffers::Mesh MeshBuffers::allocate(const MeshArrays& arrays) {
    Mesh mesh;
    if (!checkMesh(arrays)) {
        mesh.refused = true;
        return mesh;
    }
    const GlSize size = sizeOf(arrays);
    const bool points = arrays.primitive == Primitive::kPoints, lines = arrays.primitive == Primitive::kLines;
    const std::uint64_t count = arrays.positions.as<float>().size() / 3;
    mesh.vertexCount = size.vertices;
    mesh.pointRadius = points ? shownRadius(arrays) : 0;
    mesh.toWrite = lines ? 1 : points ? 2 * count : size.vertices + size.indices;
    const std::uint64_t baseVertex = place(vertices_, size.vertices, sizeof(MeshVertex));
    const std::uint64_t firstIndex = place(indices_, size.indices, sizeof(std::uint32_t));
    mesh.range = {.firstIndex = static_cast<std::uint32_t>(firstIndex),
                  .indexCount = static_cast<std::uint32_t>(size.indices),
                  .baseVertex = static_cast<std::int32_t>(baseVertex),
                  .hasNormals = points || lines || !arrays.normals.empty(),
                  .hasColors = !arrays.colors.empty()};
    return mesh;
}

void MeshBuffers::writeOn(const MeshArrays& arrays, Mesh& mesh, std::size_t bytes) {
    if (arrays.primitive == Primitive::kLines) {
        writeLines(arrays, mesh);
        mesh.written = mesh.toWrite;
        return;
    }
    const bool points = arrays.primitive == Primitive::kPoints;
    const std::uint64_t begun = mesh.written, first = arrays.positions.as<float>().size() / 3;
    const std::uint64_t vertexBytes = sizeof(MeshVertex) * (points ? kVerticesPerPoint : 1);
    const std::uint64_t indexBytes = sizeof(std::uint32_t) * (points ? 3 * kFacesPerPoint : 1);
    if (mesh.written < first) {
        const std::uint64_t end = std::min(first, mesh.written + std::max<std::uint64_t>(1, bytes / vertexBytes));
        writeVertices(arrays, mesh, {mesh.written, end});
        bytes -= std::min<std::size_t>(bytes, (end - mesh.written) * vertexBytes);
        mesh.written = end;
    }
    const bool any = mesh.written > begun;
    if (mesh.written >= first && mesh.written < mesh.toWrite && (!any || bytes >= indexBytes)) {
        const std::uint64_t end = std::min(mesh.toWrite, mesh.written + std::max<std::uint64_t>(1, bytes / indexBytes));
        writeIndices(arrays, mesh, {mesh.written - first, end - first});
        mesh.written = end;
    }
}

bool MeshBuffers::takeOver(const MeshKey& key, const MeshArrays& arrays) {
    if (arrays.primitive == Primitive::kLines) return false;
    for (const MeshOrigin& origin : originsOf(arrays)) {
        const auto known = meshes_.find(origin.key);
        if (known == meshes_.end() || known->second.refused || clock_.usedNow(known->second.uses) ||
            known->second.written < known->second.toWrite ||
            !soundWithin(arrays, origin.changed))
            continue;
        // Points of no radius of their own change theirs with the box around them.
        if (arrays.primitive == Primitive::kPoints && shownRadius(arrays) != known->second.pointRadius) continue;
        auto mesh = meshes_.extract(known);
        mesh.key() = key;
        // By array, in the order of MeshArrays.
        constexpr std::array<std::pair<std::size_t, std::size_t>, 5> kVertexBytes = {
            {{0, 3 * sizeof(float)}, {1, 3 * sizeof(float)}, {2, 4}, {3, 2 * sizeof(float)}, {5, 2 * sizeof(float)}}};
        for (const auto& [array, bytes] : kVertexBytes)
            writeVertices(arrays, mesh.mapped(), elementsOf(origin.changed[array], bytes));
        writeIndices(arrays, mesh.mapped(), elementsOf(origin.changed[4], sizeof(std::uint32_t)));
        meshes_.insert(std::move(mesh));
        return true;
    }
    return false;
}

void MeshBuffers::writeVertices(const MeshArrays& arrays, const Mesh& mesh, const ByteRange& which) {
    const auto write = [&](std::uint64_t first, const std::vector<MeshVertex>& made) {
        first += static_cast<std::uint64_t>(mesh.range.baseVertex);
        gl_.NamedBufferSubData(vertices_.name, static_cast<GLintptr>(first * sizeof(MeshVertex)),
                               static_cast<GLsizeiptr>(made.size() * sizeof(MeshVertex)), made.data());
        uploadedBytes_ += made.size() * sizeof(MeshVertex);
    };
    if (which.empty()) return;
    if (arrays.primitive == Primitive::kTriangles)
        return write(which.begin, interleave({arrays.positions.as<float>(), arrays.normals.as<float>(),
                                              arrays.texcoords.as<float>(), arrays.texcoords1.as<float>(),
                                              arrays.colors.as<std::uint8_t>()},
                                             which));
    forSlices(which, [&](const ByteRange& slice) {
        const MeshData made = trianglesOfPoints(arrays, mesh.pointRadius, slice);
        write(slice.begin * kVerticesPerPoint,
              interleave({made.positions, made.normals, made.texcoords, made.texcoords1, made.colors},
                         {0, made.positions.size() / 3}));
    });
}

void MeshBuffers::writeLines(const MeshArrays& arrays, const Mesh& mesh) {
    const std::span<const std::uint32_t> ends = arrays.lines.as<std::uint32_t>();
    const std::vector<MeshVertex> corners = cornersOfLines(arrays, ends);
    std::vector<std::uint32_t> indices;
    indices.reserve(kIndicesPerLine * ends.size() / 2);
    for (std::uint32_t first = 0; first + 3 < corners.size(); first += kVerticesPerLine)
        for (const std::uint32_t corner : {0, 1, 2, 0, 2, 3}) indices.push_back(first + corner);
    const auto write = [&](GLuint buffer, std::uint64_t first, const auto& values) {
        const std::size_t bytes = values.size() * sizeof(values[0]);
        gl_.NamedBufferSubData(buffer, static_cast<GLintptr>(first * sizeof(values[0])), static_cast<GLsizeiptr>(bytes),
                               values.data());
        uploadedBytes_ += bytes;
    };
    write(vertices_.name, static_cast<std::uint64_t>(mesh.range.baseVertex), corners);
    write(indices_.name, mesh.range.firstIndex, indices);
}

void MeshBuffers::writeIndices(const MeshArrays& arrays, const Mesh& mesh, const ByteRange& which) {
    const auto write = [&](std::uint64_t first, std::span<const std::uint32_t> made) {
        first += mesh.range.firstIndex;
        gl_.NamedBufferSubData(indices_.name, static_cast<GLintptr>(first * sizeof(std::uint32_t)),
                               static_cast<GLsizeiptr>(made.size_bytes()), made.data());
        uploadedBytes_ += made.size_bytes();
    };
    if (which.empty()) return;
    if (arrays.primitive == Primitive::kTriangles)
        return write(which.begin, arrays.indices.as<std::uint32_t>().subspan(which.begin, which.end - which.begin));
    forSlices(which, [&](const ByteRange& slice) { write(3 * kFacesPerPoint * slice.begin, indicesOfPoints(slice)); });
}

std::uint64_t MeshBuffers::place(Buffer& buffer, std::uint64_t count, std::size_t elementBytes) {
    if (const auto start = buffer.ranges.allocate(count)) return *start;
    const std::uint64_t old = buffer.ranges.capacity();
    grow(buffer, std::max({kFirstCapacity, 2 * old, old + count}), elementBytes);
    const auto start = buffer.ranges.allocate(count);
    TESSERA_CHECK(start, "the grown buffer has room");
    return *start;
}

void MeshBuffers::grow(Buffer& buffer, std::uint64_t capacity, std::size_t elementBytes) {
    GLuint larger = 0;
    gl_.CreateBuffers(1, &larger);
    gl_.NamedBufferData(larger, static_cast<GLsizeiptr>(capacity * elementBytes), nullptr, GL_STATIC_DRAW);
    if (buffer.name) {
        gl_.CopyNamedBufferSubData(buffer.name, larger, 0, 0, static_cast<GLsizeiptr>(buffer.ranges.capacity() * elementBytes));
        gl_.DeleteBuffers(1, &buffer.name);
    }
    buffer.name = larger;
    buffer.ranges.grow(capacity);
    rebind();
}

void MeshBuffers::rebind() {
    if (vertices_.name) gl_.VertexArrayVertexBuffer(vertexArray_, 0, vertices_.name, 0, sizeof(MeshVertex));
    if (indices_.name) gl_.VertexArrayElementBuffer(vertexArray_, indices_.name);
}

void MeshBuffers::makeRoom() {
    for (const auto& candidate : clock_.lastNeededFirst(meshes_)) {
        if (residentBytes() <= UseClock::roomFor(candidate, budgetBytes_)) return;
        const auto it = meshes_.find(*candidate.key);
        const Mesh& mesh = it->second;
        clock_.remember(gone_, *candidate.key, mesh.uses);
        vertices_.ranges.release(static_cast<std::uint64_t>(mesh.range.baseVertex), mesh.vertexCount);
        indices_.ranges.release(mesh.range.firstIndex, mesh.range.indexCount);
        meshes_.erase(it);
    }
}

}  // namespace tessera
