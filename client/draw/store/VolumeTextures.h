/// Voxels as GL textures, found by content, and what a shader is told of each volume that a list draws.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "client/draw/store/UseClock.h"
#include "client/draw/store/VolumeBricks.h"
#include "client/draw/surface/GlState.h"
#include "client/render/DrawList.h"
#include "common/cores/ShippedTypes.h"
#include "common/drawable/VolumeArrays.h"

namespace tessera {

/// Units of GL that nobody else has.
inline constexpr GLuint kVoxelUnit = 20, kTransferUnit = 21, kBrickUnit = 22;
/// Of uniform buffers.
inline constexpr GLuint kVolumeBinding = 3;

/// ProgramKind::pointParts of kMarched: what is done along a ray. kEachSample, beside it: of several samples those
/// pixels alone whose samples see different depths, one by one; the others without it.
inline constexpr std::uint8_t kMarchCloud = 0, kMarchShaded = 1, kMarchMaximum = 2, kMarchKind = 3,
                              kMarchEachSample = 4;
[[nodiscard]] std::uint8_t marchOf(const Volume& volume);

/// A ray takes no more samples than these, however fine its step is said to be.
inline constexpr int kMostMarchSamples = 4096;

// Of an opacity of 1 there is 1 - 2^-16 after its thickness: so it is as thick as others, and no jump.

/// One volume at one place; std140. Steps are voxels: the middle of the first one is 0 0 0.
struct VolumeBlock {
    std::array<std::array<float, 4>, 3> steps_T_eye;  ///< rows
    std::array<std::array<float, 4>, 3> node_T_eye;   ///< rows, of which directions are asked alone
    std::array<float, 4> last;                        ///< voxels - 1; clip planes
    std::array<float, 4> texel;                       ///< 1 / voxels
    std::array<float, 4>
        toTable;  ///< from what GL reads to a place in the transfer function: · x + y; the last place; its first texel
    std::array<float, 4> march;  ///< step in the node's lengths; 1 / thickness
    std::array<std::array<float, 4>, kMostVolumePlanes>
        clips;  ///< of what xyz · p + w > 0 holds in eye space nothing is seen
    std::array<float, 24> padding{};
};
static_assert(sizeof(VolumeBlock) == 1280 && sizeof(VolumeBlock) % 256 == 0);

/// Composed in double, then rounded: the same on every tile of a screen. Nothing: the place has no inverse, and nothing
/// of it is seen.
[[nodiscard]] std::optional<VolumeBlock> blockOf(const Volume& volume, const DrawItem& item, const ScreenCamera& camera,
                                                 std::size_t firstTransferTexel);

/// Of bytes and 16 bits as they are (what has signs is shifted by 32768), floats as floats. Where a range of voxels was
/// edited the layers that it touches are uploaded alone. They make room as SharedBudget says.
///
/// Beside the voxels lies what rays need not look at (VolumeBricks.h): of clouds how far off anything is that the
/// transfer function shows, of maxima the greatest value of each brick. Rays sample where they sample without it, only
/// less often: pictures are the same, byte for byte.
class VolumeTextures {
public:
    /// The surface must be current. The clock is all stores'. `leaveOutEmpty`: false, and rays sample everywhere.
    VolumeTextures(GlState& gl, const UseClock& clock, bool leaveOutEmpty);
    ~VolumeTextures();
    VolumeTextures(const VolumeTextures&) = delete;
    VolumeTextures& operator=(const VolumeTextures&) = delete;

    /// Forgets the transfer functions of the list before.
    void beginList() { transfer_.clear(); }
    /// Its voxels, and of what is marched its bricks. 0: bytes that are absent, or more voxels along an axis than GL
    /// takes. Of volumes whose fields have been checked.
    struct Found {
        GLuint voxels = 0, bricks = 0;
    };
    [[nodiscard]] Found find(const Volume& volume);
    /// Ahead of need about so many bytes of its layers. How many were uploaded: 0, and all is there, or cannot be.
    /// Nothing: the budget has no room.
    [[nodiscard]] std::optional<std::size_t> prepare(const Volume& volume, std::size_t bytes);
    /// Transfer functions of a list, one behind the other; the first texel of this one's.
    [[nodiscard]] std::size_t addTransfer(const Volume& volume);
    /// Behind the last `find` and `addTransfer` of a draw: what shaders read.
    void upload(const std::vector<VolumeBlock>& blocks);
    /// For one of the blocks.
    void bind(const Found& textures, std::size_t block) const;

    void addSpares(std::vector<UseClock::Spare>& spares);
    [[nodiscard]] std::size_t residentBytes() const { return bytes_; }
    /// That `prepare` keeps to.
    void setBudget(std::size_t bytes) { budgetBytes_ = bytes; }
    /// Voxels given to GL since this began.
    [[nodiscard]] std::uint64_t uploadedBytes() const { return uploadedBytes_; }

private:
    struct Key {
        BlobId voxels;
        std::int64_t format = 0, sizeX = 0, sizeY = 0, sizeZ = 0;
        bool operator==(const Key&) const = default;
    };
    struct KeyHash {
        std::size_t operator()(const Key& key) const {
            return std::hash<BlobId>{}(key.voxels) ^
                   static_cast<std::size_t>(key.format << 40 ^ key.sizeX << 24 ^ key.sizeY << 12 ^ key.sizeZ);
        }
    };
    /// What a transfer function leaves of the bricks, or their greatest values.
    struct BrickTexture {
        GLuint name = 0;
        Hash128 of;
        std::uint64_t lastDraw = 0;
    };
    struct Texture {
        GLuint name = 0;
        std::size_t bytes = 0;
        std::int64_t layers = 0;  ///< that are there; bricks once all are
        UseClock::Uses uses;
        VolumeBricks bricks;
        std::vector<BrickTexture> brickTextures;
    };
    [[nodiscard]] static Key keyOf(const Volume& v) { return {v.voxels.id(), v.format, v.sizeX, v.sizeY, v.sizeZ}; }
    [[nodiscard]] bool canBeShown(const Volume& volume) const;
    /// Known, taken over, or new without any layer.
    [[nodiscard]] Texture& textureOf(const Volume& volume);
    /// About so many bytes more of its layers; those uploaded.
    std::size_t fill(Texture& texture, const Volume& volume, std::size_t bytes);
    [[nodiscard]] GLuint bricksOf(Texture& texture, const Volume& volume);
    void drop(Texture& texture);
    /// Layers [first, end).
    void write(GLuint texture, const Volume& volume, std::int64_t first, std::int64_t end);
    /// One that edits of ranges have led from to this, unless this draw needs it as it was.
    [[nodiscard]] bool takeOver(const Key& key, const Volume& volume);

    GlState& gl_;
    const UseClock& clock_;
    std::size_t budgetBytes_ = ~std::size_t{0}, bytes_ = 0;  ///< none, at first
    bool leaveOutEmpty_;
    GLint mostPx_ = 0;
    std::unordered_map<Key, Texture, KeyHash> textures_;
    std::unordered_map<Key, UseClock::Uses, KeyHash> gone_;
    std::uint64_t uploadedBytes_ = 0;
    std::vector<std::uint32_t> transfer_;
    GLuint transferBuffer_ = 0, transferTexture_ = 0, blockBuffer_ = 0;
};

}  // namespace tessera
