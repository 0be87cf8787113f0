/// Meshes in GL buffers, found by content: geometries that share arrays share the memory.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <unordered_map>

#include "client/draw/GlFunctions.h"
#include "client/draw/RangeAllocator.h"
#include "client/draw/UseClock.h"
#include "common/drawable/Drawable.h"

namespace tessera {

/// One vertex as the vertex array describes it to GL.
struct MeshVertex {
    std::array<float, 3> position;
    std::array<float, 3> normal;         ///< zero: none, shaded by the face
    std::array<std::uint16_t, 4> color;  ///< linear, normalised
    std::array<float, 2> texcoord, texcoord1;
};
static_assert(sizeof(MeshVertex) == 48);

/// Where a mesh lies in the two buffers.
struct MeshRange {
    std::uint32_t firstIndex = 0, indexCount = 0;
    std::int32_t baseVertex = 0;
    bool hasNormals = false, hasColors = false;
    bool operator==(const MeshRange&) const = default;
};

/// One vertex and one index buffer for all meshes of a renderer. Once `budgetBytes` is exceeded meshes make room as UseClock
/// says; what one draw needs is never thrown out in it.
class MeshBuffers {
public:
    MeshBuffers(const GlFunctions& gl, GLuint vertexArray, std::size_t budgetBytes);
    ~MeshBuffers();
    MeshBuffers(const MeshBuffers&) = delete;
    MeshBuffers& operator=(const MeshBuffers&) = delete;

    /// Before the first draw of a frame; see UseClock.
    void beginFrame() { clock_.beginFrame(); }
    /// Call before the first `find` of a draw.
    void beginDraw();
    /// Uploads on first sight. Nothing: an array is absent (it may come later), or checkMesh refuses the mesh (it is
    /// not looked at again: the same arrays will never be better).
    [[nodiscard]] std::optional<MeshRange> find(const Drawable& drawable);

    /// Uploads ahead of need, so much of a mesh as `bytes` allow (one vertex more, or all of a mesh of lines). Throws nothing out.
    /// What was uploaded: 0 when it is there, or cannot be; nothing: the budget has no room for it.
    [[nodiscard]] std::optional<std::size_t> prepare(const Drawable& drawable, std::size_t bytes);
    /// One step for what will come: buffers that grow one mesh at a time copy what they hold again and again.
    void expect(std::uint64_t vertices, std::uint64_t indices);

    [[nodiscard]] GLuint indexBuffer() const { return indices_.name; }
    [[nodiscard]] std::size_t residentBytes() const;
    /// Given to GL since this began.
    [[nodiscard]] std::uint64_t uploadedBytes() const { return uploadedBytes_; }
    [[nodiscard]] std::size_t meshCount() const { return meshes_.size(); }

private:
    struct Mesh {
        MeshRange range;
        std::uint64_t vertexCount = 0;
        double pointRadius = 0;  ///< that points were given; 0 of triangles
        UseClock::Uses uses;
        bool refused = false;
        /// Of `toWrite`: vertices and then indices, or points and then points; lines: all or nothing.
        std::uint64_t written = 0, toWrite = 0;
    };
    struct Buffer {
        GLuint name = 0;
        RangeAllocator ranges;
    };

    /// A place for it, which is empty.
    Mesh allocate(const MeshArrays& arrays);
    /// Goes on writing it: the next elements, and at least one.
    void writeOn(const MeshArrays& arrays, Mesh& mesh, std::size_t bytes);
    /// A mesh that came by edits of ranges from one that is here takes over its place, and only what is new is uploaded; unless
    /// that one has been drawn in this draw. False: there is none.
    [[nodiscard]] bool takeOver(const MeshKey& key, const MeshArrays& arrays);
    /// `which`: vertices, or points.
    void writeVertices(const MeshArrays& arrays, const Mesh& mesh, const ByteRange& which);
    /// `which`: indices, or points.
    void writeIndices(const MeshArrays& arrays, const Mesh& mesh, const ByteRange& which);
    void writeLines(const MeshArrays& arrays, const Mesh& mesh);
    std::uint64_t place(Buffer& buffer, std::uint64_t count, std::size_t elementBytes);
    void grow(Buffer& buffer, std::uint64_t capacity, std::size_t elementBytes);
    void rebind();
    void makeRoom();

    const GlFunctions& gl_;
    GLuint vertexArray_;
    std::size_t budgetBytes_;
    Buffer vertices_, indices_;
    std::unordered_map<MeshKey, Mesh, MeshKeyHash> meshes_;
    UseClock clock_;
    std::unordered_map<MeshKey, UseClock::Uses, MeshKeyHash> gone_;
    std::uint64_t uploadedBytes_ = 0;
};

}  // namespace tessera
