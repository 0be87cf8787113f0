#include "client/draw/MeshBuffers.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/geometry/Mesh.h"

namespace tessera {
namespace {

constexpr std::uint64_t kFirstCapacity = 64 * 1024;

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

std::vector<MeshVertex> interleave(const MeshArrays& arrays, const ByteRange& which) {
    static const std::array<std::uint16_t, 256> kLinear = makeLinearTable();
    const std::span<const float> positions = arrays.positions.as<float>();
    const std::span<const float> normals = arrays.normals.as<float>();
    const std::span<const float> texcoords = arrays.texcoords.as<float>();
    const std::span<const std::uint8_t> colors = arrays.colors.as<std::uint8_t>();
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
        v.texcoord = {0, 0};
        if (!texcoords.empty()) v.texcoord = {texcoords[2 * i], texcoords[2 * i + 1]};
    }
    return vertices;
}

}  // namespace

MeshBuffers::MeshBuffers(const GlFunctions& gl, GLuint vertexArray, std::size_t budgetBytes)
    : gl_(gl), vertexArray_(vertexArray), budgetBytes_(budgetBytes) {}

MeshBuffers::~MeshBuffers() {
    gl_.DeleteBuffers(1, &vertices_.name);
    gl_.DeleteBuffers(1, &indices_.name);
}

void MeshBuffers::beginDraw() {
    if (residentBytes() > budgetBytes_) makeRoom();
    ++draw_;
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
        it = takeOver(key, arrays) ? meshes_.find(key) : meshes_.emplace(key, upload(arrays)).first;
    }
    it->second.lastDraw = draw_;
    if (it->second.refused) return std::nullopt;
    return it->second.range;
}

MeshBuffers::Mesh MeshBuffers::upload(const MeshArrays& arrays) {
    Mesh mesh;
    if (!checkMesh(arrays)) {
        mesh.refused = true;
        return mesh;
    }
    mesh.vertexCount = arrays.positions.as<float>().size() / 3;
    const std::uint64_t indexCount = arrays.indices.as<std::uint32_t>().size();
    const std::uint64_t baseVertex = place(vertices_, mesh.vertexCount, sizeof(MeshVertex));
    const std::uint64_t firstIndex = place(indices_, indexCount, sizeof(std::uint32_t));
    mesh.range = {.firstIndex = static_cast<std::uint32_t>(firstIndex),
                  .indexCount = static_cast<std::uint32_t>(indexCount),
                  .baseVertex = static_cast<std::int32_t>(baseVertex),
                  .hasNormals = !arrays.normals.empty()};
    writeVertices(arrays, mesh.range, {0, mesh.vertexCount});
    writeIndices(arrays, mesh.range, {0, indexCount});
    return mesh;
}

bool MeshBuffers::takeOver(const MeshKey& key, const MeshArrays& arrays) {
    for (const MeshOrigin& origin : originsOf(arrays)) {
        const auto known = meshes_.find(origin.key);
        if (known == meshes_.end() || known->second.refused || known->second.lastDraw == draw_ ||
            !soundWithin(arrays, origin.changed))
            continue;
        auto mesh = meshes_.extract(known);
        mesh.key() = key;
        constexpr std::array<std::size_t, 4> kVertexBytes = {3 * sizeof(float), 3 * sizeof(float), 4, 2 * sizeof(float)};
        for (std::size_t i = 0; i < kVertexBytes.size(); ++i)
            writeVertices(arrays, mesh.mapped().range, elementsOf(origin.changed[i], kVertexBytes[i]));
        writeIndices(arrays, mesh.mapped().range, elementsOf(origin.changed[4], sizeof(std::uint32_t)));
        meshes_.insert(std::move(mesh));
        return true;
    }
    return false;
}

void MeshBuffers::writeVertices(const MeshArrays& arrays, const MeshRange& place, const ByteRange& which) {
    if (which.empty()) return;
    const std::vector<MeshVertex> made = interleave(arrays, which);
    const std::uint64_t first = static_cast<std::uint64_t>(place.baseVertex) + which.begin;
    gl_.NamedBufferSubData(vertices_.name, static_cast<GLintptr>(first * sizeof(MeshVertex)),
                           static_cast<GLsizeiptr>(made.size() * sizeof(MeshVertex)), made.data());
    uploadedBytes_ += made.size() * sizeof(MeshVertex);
}

void MeshBuffers::writeIndices(const MeshArrays& arrays, const MeshRange& place, const ByteRange& which) {
    if (which.empty()) return;
    const auto made = arrays.indices.as<std::uint32_t>().subspan(which.begin, which.end - which.begin);
    gl_.NamedBufferSubData(indices_.name, static_cast<GLintptr>((place.firstIndex + which.begin) * sizeof(std::uint32_t)),
                           static_cast<GLsizeiptr>(made.size_bytes()), made.data());
    uploadedBytes_ += made.size_bytes();
}

std::uint64_t MeshBuffers::place(Buffer& buffer, std::uint64_t count, std::size_t elementBytes) {
    if (const auto start = buffer.ranges.allocate(count)) return *start;
    const std::uint64_t old = buffer.ranges.capacity();
    const std::uint64_t capacity = std::max({kFirstCapacity, 2 * old, old + count});
    GLuint larger = 0;
    gl_.CreateBuffers(1, &larger);
    gl_.NamedBufferData(larger, static_cast<GLsizeiptr>(capacity * elementBytes), nullptr, GL_STATIC_DRAW);
    if (buffer.name) {
        gl_.CopyNamedBufferSubData(buffer.name, larger, 0, 0, static_cast<GLsizeiptr>(old * elementBytes));
        gl_.DeleteBuffers(1, &buffer.name);
    }
    buffer.name = larger;
    buffer.ranges.grow(capacity);
    rebind();
    const auto start = buffer.ranges.allocate(count);
    TESSERA_CHECK(start, "the grown buffer has room");
    return *start;
}

void MeshBuffers::rebind() {
    if (vertices_.name) gl_.VertexArrayVertexBuffer(vertexArray_, 0, vertices_.name, 0, sizeof(MeshVertex));
    if (indices_.name) gl_.VertexArrayElementBuffer(vertexArray_, indices_.name);
}

void MeshBuffers::makeRoom() {
    // Least recently drawn first, until three quarters of the budget are left, so that this does not happen every
    // frame.
    std::vector<std::pair<std::uint64_t, const MeshKey*>> byAge;
    byAge.reserve(meshes_.size());
    for (const auto& [key, mesh] : meshes_)
        if (mesh.lastDraw != draw_) byAge.emplace_back(mesh.lastDraw, &key);
    std::sort(byAge.begin(), byAge.end());
    for (const auto& [age, key] : byAge) {
        if (residentBytes() <= budgetBytes_ / 4 * 3) return;
        const auto it = meshes_.find(*key);
        const Mesh& mesh = it->second;
        vertices_.ranges.release(static_cast<std::uint64_t>(mesh.range.baseVertex), mesh.vertexCount);
        indices_.ranges.release(mesh.range.firstIndex, mesh.range.indexCount);
        meshes_.erase(it);
    }
}

}  // namespace tessera
