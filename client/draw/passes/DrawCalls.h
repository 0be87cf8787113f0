/// From a draw list to what GL is told: numbers for uniform blocks, and draw calls in the list's order. No GL calls but
/// those of the caches.
#pragma once

#include <array>
#include <deque>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "client/draw/passes/ItemRecords.h"
#include "client/draw/passes/LookTable.h"
#include "client/draw/passes/Renderer.h"
#include "client/draw/store/MeshBuffers.h"
#include "client/draw/store/SharedBudget.h"
#include "client/draw/store/VolumeTextures.h"

namespace tessera {

/// Where what a list names lies in GL, or will.
struct DrawStores {
    SharedBudget& budget;
    MeshBuffers& meshes;
    TextureCache& textures;
    VolumeTextures& volumes;
    LookTable& looks;
};

/// One item, or a part of one. Neighbours may become one call of GL.
struct DrawCall {
    MeshRange mesh;
    std::uint32_t record = 0;  ///< its ItemRecord
    std::uint32_t block = 0;   ///< its ItemBlock, where it is large
    std::uint32_t look = 0;
    std::uint32_t firstSorted = 0,
                  sortedCount = 0;  ///< these of the sorted indices, where there are some, not the mesh's
    VolumeTextures::Found voxels;   ///< of volumes: their textures, and which of `volumes` says the rest
    std::uint32_t volume = 0;
    bool mirrored = false;
    bool equal = false;              ///< blended over a surface that is there: where depth is equal, too
    const DrawItem* item = nullptr;  ///< of the list that is drawn
};

/// Kept from draw to draw for its memory.
class DrawCalls {
public:
    /// `step` is called for each thing that is collected, as uploads may take long. May be empty.
    void callAtEach(std::function<void()> step) { step_ = std::move(step); }
    /// Everything is relative to the eye, composed in double, then rounded: the same numbers on every tile of a screen.
    void collect(const Aspect& aspect, const DrawList& list, const ScreenCamera& camera, const DrawStores& stores);
    /// Of solid things, as a light sees them: looks that decide nowhere where their surface is are all one.
    void collectDepth(const Aspect& aspect, std::span<const DrawItem> items, const ScreenCamera& camera,
                      const DrawStores& stores);

    [[nodiscard]] const std::vector<DrawCall>& calls() const { return calls_; }
    /// Calls from here on are transparent.
    [[nodiscard]] std::size_t opaqueCount() const { return opaqueCount_; }
    [[nodiscard]] static bool isLarge(const DrawCall& call) { return call.mesh.indexCount > 3 * kLargeMeshTriangles; }
    [[nodiscard]] const std::vector<ItemBlock>& blocks() const { return blocks_; }
    [[nodiscard]] const ItemRecord& recordOf(const DrawCall& call) const { return records_[call.record]; }
    /// The same mesh, whole, in the same state: as instances of one call they are what they are one after the other.
    [[nodiscard]] static bool sameButPlace(const DrawCall& a, const DrawCall& b) {
        return a.look == b.look && a.mirrored == b.mirrored && a.equal == b.equal && a.mesh == b.mesh &&
               a.voxels.voxels == 0 && b.voxels.voxels == 0 && a.sortedCount == 0 && b.sortedCount == 0;
    }
    /// Of calls that draw some of their mesh's triangles, in an order of their own.
    [[nodiscard]] const std::vector<std::uint32_t>& sortedIndices() const { return sortedIndices_; }
    [[nodiscard]] const std::vector<VolumeBlock>& volumes() const { return volumes_; }
    /// Of all calls, in pixels; 0 without lines.
    [[nodiscard]] double widestLineReachPx() const { return widestLineReachPx_; }
    [[nodiscard]] const DrawCounts& counts() const { return counts_; }

private:
    void begin(const ScreenCamera& camera, const DrawStores& stores);
    /// `source`: of its look; null: the one of what has none. False: nothing of it can be drawn.
    bool add(const Aspect& aspect, const DrawItem& item, const LookSource* source, const ScreenCamera& camera,
             const DrawStores& stores);
    /// What a call of a volume is besides. False: nothing of it can be drawn.
    bool addVolume(const Aspect& aspect, const DrawItem& item, const ScreenCamera& camera, VolumeTextures& volumes,
                   DrawCall& call);
    /// An item with the level of its material that this screen draws it with: a coarser one where it is small there.
    struct Shown {
        const DrawItem& item;
        const DrawMaterial::Level* level;  ///< null: it has no material
        [[nodiscard]] const LookSource* source() const { return level ? level->own.look.get() : nullptr; }
        [[nodiscard]] std::span<const DrawMaterial::Layer> passes() const {
            return level ? std::span<const DrawMaterial::Layer>(level->passes) : std::span<const DrawMaterial::Layer>();
        }
    };
    Shown shownOf(const DrawItem& item, const ScreenCamera& camera);
    /// The same thing with another layer of its material: kept here, as calls point to their items.
    const DrawItem& layerOf(const DrawItem& item, const DrawMaterial::Layer& layer);
    void makeRecords(const ScreenCamera& camera);

    std::function<void()> step_;
    std::vector<DrawCall> calls_;
    std::deque<DrawItem> layerItems_;
    std::vector<const DrawItem*> recordItems_;  ///< a record each
    std::vector<ItemRecord> records_;
    RecordMaker recordMaker_;
    std::vector<ItemBlock> blocks_;
    std::vector<std::uint32_t> blockRecords_;  ///< whose copies blocks are
    std::vector<VolumeBlock> volumes_;
    std::vector<std::uint32_t> sortedIndices_;
    /// Of a node that comes several times.
    struct Part {
        DrawCall call;
        Blob indices;        ///< as it lies in GL
        bool there = false;  ///< else it cannot be drawn
        /// Of the passes whose normal maps ask for other tangents than the material's own: the mesh with these, which
        /// may have further vertices, by the number of the pass.
        struct Mapped {
            std::size_t pass;
            MeshRange mesh;
            Blob indices;
        };
        std::vector<Mapped> mapped;
    };
    /// Of a thing whose own call stands last.
    [[nodiscard]] Part partOf(const Shown& shown, const DrawStores& stores);
    /// As many of a mesh's triangles as a part has, behind the others; the number of the first index.
    std::uint32_t addSorted(const DrawList& list, const DrawItem& part, const Blob& indices);
    std::unordered_map<ObjectId, Part> parts_;
    struct Found {
        const DrawMesh* mesh = nullptr;
        std::int64_t fill = Material::kFilled;
        const Image* normalMap = nullptr;
        const MeshRange* range = nullptr;
    };
    Found found_;  ///< last, in this draw
    bool inStudio_ = false;
    bool scoped_ = false;  ///< some light has a scope
    std::size_t opaqueCount_ = 0;
    double widestLineReachPx_ = 0;
    DrawCounts counts_;
};

[[nodiscard]] FrameBlock makeFrameBlock(const DrawList& list, const ScreenCamera& camera);
/// Where a camera of the same eye sees other pixels, as a cell's does: what differs.
void project(FrameBlock& block, const ScreenCamera& camera);
/// FrameBlock::pixelRays of a viewport whose lower left corner lies there in its framebuffer.
[[nodiscard]] std::array<float, 4> pixelRaysOf(const ScreenCamera& camera, int left, int bottom);

}  // namespace tessera
