/// Meshes in GL buffers, found by content: geometries that share arrays share the memory.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <unordered_map>

#include "client/draw/store/DrawForms.h"
#include "client/draw/store/RangeAllocator.h"
#include "client/draw/store/UseClock.h"
#include "client/draw/surface/GlState.h"
#include "common/drawable/Drawable.h"

namespace tessera {

/// Texture units of what points are fetched from; none of a material's, nor of light's.
inline constexpr GLuint kPointUnit = 13, kLinearUnit = 14;

/// Where a mesh lies in the buffers of its form.
struct MeshRange {
    std::uint32_t firstIndex = 0, indexCount = 0;
    std::int32_t baseVertex = 0;
    bool hasNormals = false, hasColors = false;
    DrawKind kind = DrawKind::kTriangles;
    std::uint8_t pointParts = 0;  ///< see DrawForms.h
    bool operator==(const MeshRange&) const = default;
};

/// One buffer of each sort for all meshes of a renderer. Once `budgetBytes` is exceeded meshes make room as UseClock
/// says; what one draw needs is never thrown out in it. The indices that points share, 0.15 MB, and a table of colours
/// stand beside the budget.
class MeshBuffers {
public:
    MeshBuffers(GlState& gl, GLuint vertexArray, std::size_t budgetBytes);
    ~MeshBuffers();
    MeshBuffers(const MeshBuffers&) = delete;
    MeshBuffers& operator=(const MeshBuffers&) = delete;

    /// Before the first draw of a frame; see UseClock.
    void beginFrame() { clock_.beginFrame(); }
    /// Call before the first `find` of a draw.
    void beginDraw();
    /// Uploads on first sight. Nothing: an array is absent (it may come later), checkMesh refuses the mesh (it is not
    /// looked at again: the same arrays will never be better), or there are more points than GL can fetch
    /// (GL_MAX_TEXTURE_BUFFER_SIZE).
    [[nodiscard]] std::optional<MeshRange> find(const Drawable& drawable);
    /// The same of its edges or corners, made when they are first asked for (outlineOf): of triangles.
    [[nodiscard]] std::optional<MeshRange> findOutline(const Drawable& drawable, std::int64_t fill);

    /// Uploads ahead of need, so much of a mesh as `bytes` allow (one vertex, line or point more). Throws nothing out.
    /// What was uploaded: 0 when it is there, or cannot be; nothing: the budget has no room for it.
    [[nodiscard]] std::optional<std::size_t> prepare(const Drawable& drawable, std::size_t bytes);
    /// One step for what will come: buffers that grow one mesh at a time copy what they hold again and again.
    void expect(const MeshSize& more);

    /// Instances of a mesh, the records from `firstRecord` on theirs in turn: so many of its triangles, or all where
    /// its vertices are fetched; `insides`: with those of points. The vertex array is bound. How many calls of GL that
    /// took.
    std::uint64_t draw(const MeshRange& mesh, std::size_t firstTriangle, std::size_t triangles, std::size_t firstRecord,
                       std::size_t instances, bool insides);
    /// To the vertex array, where it has others. By `draw`, and by who draws with indices of its own.
    void bindElements(GLuint buffer);
    /// What the programs of a kind read besides vertices.
    void bindFor(DrawKind kind);

    [[nodiscard]] GLuint indexBuffer() const { return buffer(MeshStore::kIndices).name; }
    [[nodiscard]] std::size_t residentBytes() const;
    /// Given to GL since this began.
    [[nodiscard]] std::uint64_t uploadedBytes() const { return uploadedBytes_; }

private:
    /// In one of the buffers, with what was left free before it.
    struct Place {
        std::uint64_t taken = 0, takenCount = 0, first = 0;
    };
    struct Mesh {
        MeshRange range;
        std::array<Place, kMeshStores> places{};
        UseClock::Uses uses;
        bool refused = false;
        std::uint64_t written = 0, toWrite = 0;  ///< units, of one part after the other
    };
    struct Buffer {
        GLuint name = 0;
        RangeAllocator ranges;
    };

    /// A place for it, which is empty. Nothing: there is no room that GL can reach.
    [[nodiscard]] std::optional<Mesh> allocate(const MeshArrays& arrays);
    /// Goes on writing it: the next units, and at least one.
    void writeOn(const MeshArrays& arrays, Mesh& mesh, std::size_t bytes);
    /// A mesh that came by edits of ranges from one that is here takes over its place, and only what is new is
    /// uploaded; unless that one has been drawn in this draw. False: there is none.
    [[nodiscard]] bool takeOver(const MeshKey& key, const MeshArrays& arrays);
    void write(const MeshArrays& arrays, const Mesh& mesh, const MeshPart& part, const ByteRange& units);
    [[nodiscard]] bool place(MeshStore store, std::uint64_t count, std::uint64_t multipleOf, Place& place);
    void release(const Mesh& mesh);
    void grow(MeshStore store, std::uint64_t capacity);
    [[nodiscard]] std::uint64_t mostOf(MeshStore store) const;
    void rebind();
    void makeSharedByPoints();
    [[nodiscard]] Buffer& buffer(MeshStore store) { return buffers_[static_cast<std::size_t>(store)]; }
    [[nodiscard]] const Buffer& buffer(MeshStore store) const { return buffers_[static_cast<std::size_t>(store)]; }

    GlState& gl_;
    GLuint vertexArray_;
    std::size_t budgetBytes_;
    std::array<Buffer, kMeshStores> buffers_;
    GLuint elementsBound_ = 0;  ///< 0: nobody knows
    // Of points, made with the first ones.
    std::array<GLuint, 2> sharedIndices_{};  ///< without, with insides
    GLuint linearBuffer_ = 0, pointTexture_ = 0, linearTexture_ = 0;
    std::uint64_t mostTexels_ = 0;
    std::unordered_map<MeshKey, Mesh, MeshKeyHash> meshes_;
    UseClock clock_;
    std::unordered_map<MeshKey, UseClock::Uses, MeshKeyHash> gone_;
    std::uint64_t uploadedBytes_ = 0;
};

}  // namespace tessera
