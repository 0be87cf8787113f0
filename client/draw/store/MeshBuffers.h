/// Meshes in GL buffers, found by content: geometries that share arrays share the memory.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "client/draw/store/DrawForms.h"
#include "client/draw/store/RangeAllocator.h"
#include "client/draw/store/UseClock.h"
#include "client/draw/surface/GlState.h"
#include "client/render/DrawMesh.h"
#include "common/cores/Image.h"

namespace tessera {

/// Texture units of what points are fetched from; none of a material's, nor of light's.
inline constexpr GLuint kPointUnit = 13, kLinearUnit = 14;

/// Where a mesh lies in the buffers of its form.
struct MeshRange {
    std::uint32_t firstIndex = 0, indexCount = 0;
    std::int32_t baseVertex = 0;
    bool hasNormals = false, hasColors = false, hasTangents = false;
    MeshKind kind = MeshKind::kTriangles;
    std::uint8_t pointParts = 0;  ///< see DrawForms.h
    // Of what is fetched, where `indexCount` is three of each thing: see DrawForm::Fetched.
    std::uint32_t indicesEach = 3, atOnce = 0;
    unsigned numberBits = 0;
    bool operator==(const MeshRange&) const = default;
};

/// What of a mesh is drawn: tangents for a normal map alone, and where there is one.
[[nodiscard]] MeshArrays drawnArrays(const DrawMesh& mesh, const Image* normalMap);

/// One buffer of each sort for all meshes of a renderer. Meshes make room as SharedBudget says; what one draw needs is
/// never thrown out in it. A mesh for which there is no memory, though all others of the draw have given way, is none.
/// The indices that points share, 0.15 MB, and a table of colours stand beside the budget.
class MeshBuffers {
public:
    /// The clock is all stores'. `mostBytes`: of one buffer; beyond kMostBufferBytes GL, or indices, count no further.
    MeshBuffers(GlState& gl, const UseClock& clock, GLuint vertexArray, std::size_t mostBytes = kMostBufferBytes);
    /// Mesa refuses more than 32 bits count. Its llvmpipe (22.3.6) adds offsets of 32 bits that have a sign.
    static constexpr std::size_t kMostBufferBytes = 0xffff0000u, kMostOnProcessor = kMostBufferBytes / 2;
    ~MeshBuffers();
    MeshBuffers(const MeshBuffers&) = delete;
    MeshBuffers& operator=(const MeshBuffers&) = delete;

    /// Call before the first `find` of a draw. The first of a frame gives back what is free.
    void beginDraw();
    /// Nothing is drawn any more: no picture before the last one has a claim to what is free.
    void rest();
    /// Uploads on first sight; what has been found is found again by its serial alone. With tangents where triangles
    /// are drawn with a normal map; their edges or corners (`fill`) are made when they are first asked for (outlineOf).
    /// Null: it is not sound, has more points than GL can fetch (GL_MAX_TEXTURE_BUFFER_SIZE), or GL has no memory for
    /// it. Valid until the next `beginDraw`, or `find` of another one.
    [[nodiscard]] const MeshRange* find(const DrawMesh& mesh, std::int64_t fill = Material::kFilled,
                                        const Image* normalMap = nullptr);

    /// Uploads ahead of need, so much of a mesh as `bytes` allow (one vertex, line or point more). Throws nothing out.
    /// What was uploaded: 0 when it is there, or cannot be; nothing: the budget has no room for it.
    [[nodiscard]] std::optional<std::size_t> prepare(const DrawMesh& mesh, const Image* normalMap, std::size_t bytes);
    /// One step for what will come: buffers that grow one mesh at a time copy what they hold again and again.
    void expect(const MeshSize& more);

    /// Instances of a mesh, the records from `firstRecord` on theirs in turn: so many of its triangles, or of its
    /// copies; of points all, `insides`: with theirs. The vertex array is bound. How many calls of GL that took.
    std::uint64_t draw(const MeshRange& mesh, std::size_t firstTriangle, std::size_t triangles, std::size_t firstRecord,
                       std::size_t instances, bool insides);
    /// To the vertex array, where it has others: the buffers that a mesh's vertices lie in, and indices. By `draw`, and
    /// by who draws with indices of its own.
    void bind(const MeshRange& mesh, GLuint indices);
    /// What the programs of a kind read besides vertices.
    void bindFor(MeshKind kind);

    [[nodiscard]] GLuint indexBuffer() const { return buffer(MeshStore::kIndices).name; }
    [[nodiscard]] std::size_t residentBytes() const;
    /// Of the buffers, what is free in them included: when a frame begins at most the budget, or a quarter more than
    /// lay there in the last frames.
    [[nodiscard]] std::size_t allocatedBytes() const;
    static constexpr std::size_t kRecentFrames = 3;
    void addSpares(std::vector<UseClock::Spare>& spares);
    /// In bytes; none, at first. A buffer that grows is there twice while it is copied: `atOnce` is what all of them
    /// may take then where it could be done without, `mostAtOnce` where it could not.
    struct Budget {
        std::size_t bytes = ~std::size_t{0}, atOnce = ~std::size_t{0}, mostAtOnce = ~std::size_t{0};
    };
    void setBudget(const Budget& budget) { budget_ = budget; }
    /// How often all of a buffer was copied, to a larger or smaller one.
    [[nodiscard]] std::uint64_t copies() const { return copies_; }
    /// Given to GL since this began.
    [[nodiscard]] std::uint64_t uploadedBytes() const { return uploadedBytes_; }

private:
    /// In one of the buffers, with what was left free before it.
    struct Place {
        std::uint64_t taken = 0, takenCount = 0, first = 0, multipleOf = 1;
    };
    struct Mesh {
        MeshRange range;
        std::array<Place, kMeshStores> places{};
        UseClock::Uses uses;
        std::uint64_t unitsBefore = 0;           ///< Fetched::before
        std::uint64_t written = 0, toWrite = 0;  ///< units, of one part after the other
        bool gone = false;                       ///< it has given way, or is another's: what is known of it is void
    };
    /// The content of a mesh, and what is made of it.
    struct Key {
        MeshKey mesh;
        std::int64_t fill = Material::kFilled;
        bool operator==(const Key&) const = default;
    };
    struct KeyHash {
        std::size_t operator()(const Key& key) const {
            return MeshKeyHash{}(key.mesh) + static_cast<std::size_t>(key.fill);
        }
    };
    [[nodiscard]] static Key keyOf(const MeshKey& mesh, std::int64_t fill);
    struct Buffer {
        GLuint name = 0;
        RangeAllocator ranges;
    };

    /// By content. Null as `find`.
    [[nodiscard]] std::shared_ptr<Mesh> findByContent(const DrawMesh& mesh, std::int64_t fill, const Image* normalMap);
    [[nodiscard]] std::shared_ptr<Mesh>& knownOf(const DrawMesh& mesh, std::int64_t fill, const Image* normalMap);
    /// A place for it, which is empty. Null: there is no room. `needed`: what this draw does not need may give way.
    [[nodiscard]] std::shared_ptr<Mesh> allocate(const MeshArrays& arrays, bool needed);
    /// Goes on writing it: the next units, and at least one.
    void writeOn(const MeshArrays& arrays, Mesh& mesh, std::size_t bytes);
    /// A mesh that came by edits of ranges from one that is here takes over its place, and only what is new is
    /// uploaded; unless that one has been drawn in this draw. Null: there is none.
    [[nodiscard]] std::shared_ptr<Mesh> takeOver(const MeshArrays& arrays);
    void write(const MeshArrays& arrays, const Mesh& mesh, const MeshPart& part, const ByteRange& units);
    [[nodiscard]] bool place(MeshStore store, std::uint64_t count, std::uint64_t multipleOf, bool needed, Place& place);
    /// So many elements in a row.
    [[nodiscard]] std::optional<std::uint64_t> roomFor(MeshStore store, std::uint64_t wanted, bool needed);
    /// Lets meshes go that this draw does not need until there are.
    [[nodiscard]] std::optional<std::uint64_t> roomOfOthers(MeshStore store, std::uint64_t wanted);
    void letGo(const Key& key);
    void release(const Mesh& mesh);
    /// As far as it may and can; the same where GL has no memory.
    void grow(MeshStore store, std::uint64_t capacity);
    /// How many elements it may have where all buffers may take so much, and what counts beside it takes `others`.
    [[nodiscard]] std::uint64_t mostIn(MeshStore store, std::size_t bytes, std::size_t others) const;
    /// What is free goes back to GL where the budget does not bear it: smaller buffers, without gaps. But as much stays
    /// as lay there in the last frames: tiles in turn would have it all copied there and back.
    void shrink();
    void compact(MeshStore store, std::uint64_t capacity);
    /// 0: GL has no memory.
    [[nodiscard]] GLuint makeBuffer(std::size_t bytes);
    [[nodiscard]] MeshSize used() const;
    /// In what is fetched, behind what comes before it.
    [[nodiscard]] static std::uint64_t firstUnitOf(const Mesh& mesh);
    /// What follows from where it lies.
    static void setRange(Mesh& mesh);
    [[nodiscard]] std::uint64_t mostOf(MeshStore store) const;
    void rebind();
    void bindElements(GLuint buffer);
    void makeSharedByPoints();
    [[nodiscard]] Buffer& buffer(MeshStore store) { return buffers_[static_cast<std::size_t>(store)]; }
    [[nodiscard]] const Buffer& buffer(MeshStore store) const { return buffers_[static_cast<std::size_t>(store)]; }

    GlState& gl_;
    const UseClock& clock_;
    GLuint vertexArray_;
    std::size_t mostBytes_;
    Budget budget_;
    std::array<Buffer, kMeshStores> buffers_;
    // What lay there at most, in this frame and those before it.
    std::uint64_t frame_ = 0;
    MeshSize most_;
    std::array<MeshSize, kRecentFrames> mostBefore_{};
    /// By store: the draw in which so much or more could not be had.
    struct Refused {
        std::uint64_t draw = UseClock::kNever, wanted = 0;
    };
    std::array<Refused, kMeshStores> byOthers_{}, byGl_{};  ///< as nothing gave way any more; of capacity
    std::uint64_t copies_ = 0;
    GLuint verticesBound_ = 0, elementsBound_ = 0;  ///< 0: nobody knows
    // Of points, made with the first ones.
    std::array<GLuint, 2> sharedIndices_{};  ///< without, with insides
    GLuint linearBuffer_ = 0, pointTexture_ = 0, linearTexture_ = 0;
    std::uint64_t mostTexels_ = 0;
    std::unordered_map<Key, std::shared_ptr<Mesh>, KeyHash> meshes_;
    std::unordered_map<Key, UseClock::Uses, KeyHash> gone_;
    /// What of a normal map decides where tangents point (TangentArrays.h).
    struct Placing {
        std::int64_t texcoordSet = 0;
        float rotation = 0;
        std::array<float, 2> scale{};
        bool operator==(const Placing&) const = default;
    };
    struct Known {
        std::array<std::shared_ptr<Mesh>, 3> plain;  ///< filled, edges, corners
        std::vector<std::pair<Placing, std::shared_ptr<Mesh>>> mapped;
    };
    /// By the serial of a DrawMesh. Forgotten where it has grown beyond what there may be.
    std::unordered_map<std::uint64_t, Known> known_;
    std::uint64_t uploadedBytes_ = 0;
};

}  // namespace tessera
