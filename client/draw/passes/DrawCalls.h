/// From a draw list to what GL is told: numbers for uniform blocks, and draw calls in the list's order. No GL calls but
/// those of the caches.
#pragma once

#include <array>
#include <deque>
#include <map>
#include <unordered_map>
#include <utility>
#include <vector>

#include "client/draw/passes/Renderer.h"
#include "client/draw/shaders/PersonPrograms.h"
#include "client/draw/shaders/Program.h"
#include "client/draw/store/MeshBuffers.h"
#include "client/draw/store/TextureCache.h"
#include "client/draw/store/VolumeTextures.h"
#include "common/cores/Material.h"

namespace tessera {

/// What the calls of one material share. Its LookBlock has the same index.
struct DrawLook {
    struct Map {
        GLuint texture = 0, sampler = 0;
    };
    std::array<Map, kImageMaps> maps{};
    std::uint8_t mapBits = 0;  ///< of ImageMap: those that are there
    std::array<Map, Material::kMostLayers> layers{};
    std::uint16_t layerBits = 0;  ///< of LayerLookup, see ProgramKind::layers
    bool masked = false;
    bool doubleSided = false;
    bool incomplete = false;                       ///< it has an image that is not here
    std::uint32_t person = PersonPrograms::kNone;  ///< a person's program
    PersonValues said;                             ///< what the material says to it
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
    void collect(const Aspect& aspect, const DrawList& list, const ScreenCamera& camera, MeshBuffers& meshes,
                 TextureCache& textures, VolumeTextures& volumes);

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
    [[nodiscard]] const DrawLook& lookOf(const DrawCall& call) const { return looks_[call.look]; }
    [[nodiscard]] const std::vector<DrawLook>& looks() const { return looks_; }
    [[nodiscard]] const std::vector<LookBlock>& lookBlocks() const { return lookBlocks_; }
    [[nodiscard]] const std::vector<VolumeBlock>& volumes() const { return volumes_; }
    [[nodiscard]] const std::vector<MaterialTexels>& materials() const { return materials_; }
    /// Of all calls, in pixels; 0 without lines.
    [[nodiscard]] double widestLineReachPx() const { return widestLineReachPx_; }
    [[nodiscard]] const DrawCounts& counts() const { return counts_; }
    [[nodiscard]] PersonPrograms& persons() { return persons_; }
    [[nodiscard]] const PersonPrograms& persons() const { return persons_; }

private:
    /// False: nothing of it can be drawn.
    bool collect(const Aspect& aspect, const DrawItem& item, const ScreenCamera& camera, MeshBuffers& meshes,
                 TextureCache& textures, VolumeTextures& volumes);
    /// What a call of a volume is besides. False: nothing of it can be drawn.
    bool addVolume(const Aspect& aspect, const DrawItem& item, const ScreenCamera& camera, VolumeTextures& volumes,
                   DrawCall& call);
    /// The item with the material that this screen draws it with: a coarser one where it is small there.
    const DrawItem& shownOf(const Aspect& aspect, const DrawItem& item, const ScreenCamera& camera);
    /// The same thing with one of its material's passes: kept here, as calls point to their items.
    const DrawItem& passOf(const Aspect& aspect, const DrawItem& item, ObjectId pass);
    /// In a studio, what no material and no colours of its corners say a colour of is of a middle grey.
    enum class LookOf : std::uint8_t { kNoSurface, kSurface, kStudioSurface };
    /// `scopes`: DrawItem's.
    std::uint32_t look(const Aspect& aspect, ObjectId material, std::uint32_t scopes, LookOf of,
                       TextureCache& textures);
    static void addLayers(const Aspect& aspect, const Material& material, TextureCache& textures, DrawLook& look,
                          LookBlock& block);
    std::uint32_t materialIndex(const MaterialTexels& texels);

    std::function<void()> step_;
    std::vector<DrawCall> calls_;
    std::deque<DrawItem> passItems_;
    std::vector<ItemRecord> records_;
    std::vector<ItemBlock> blocks_;
    std::vector<VolumeBlock> volumes_;
    std::vector<std::uint32_t> sortedIndices_;
    /// Of a node that comes several times.
    struct Part {
        DrawCall call;
        Blob indices;
        bool there = false;  ///< else it cannot be drawn
    };
    std::unordered_map<ObjectId, Part> parts_;
    std::vector<DrawLook> looks_;
    std::vector<LookBlock> lookBlocks_;
    /// By material, and by the scopes that it lies in.
    std::array<std::unordered_map<ObjectId, std::vector<std::pair<std::uint32_t, std::uint32_t>>>, 3> lookIndices_;
    bool inStudio_ = false;
    bool scoped_ = false;  ///< some light has a scope
    std::size_t opaqueCount_ = 0;
    double widestLineReachPx_ = 0;
    std::vector<MaterialTexels> materials_;
    std::map<MaterialTexels, std::uint32_t> materialIndices_;
    DrawCounts counts_;
    PersonPrograms persons_;
};

/// Its images, in the order of ImageMap.
[[nodiscard]] std::array<std::pair<ObjectId, ImageUse>, kImageMaps> imagesOf(const Material& material);
/// From an item to the eye, composed in double, then rounded: the same numbers wherever it is drawn.
[[nodiscard]] ItemRecord recordOf(const DrawItem& item, const ScreenCamera& camera);
[[nodiscard]] FrameBlock makeFrameBlock(const DrawList& list, const ScreenCamera& camera);
/// FrameBlock::pixelRays of a viewport whose lower left corner lies there in its framebuffer.
[[nodiscard]] std::array<float, 4> pixelRaysOf(const ScreenCamera& camera, int left, int bottom);

}  // namespace tessera
