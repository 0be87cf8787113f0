/// What calls draw with, kept from draw to draw: a look for each material that some draw has met, as GL wants it. What
/// a material's version says is old is made anew, and that alone goes to GL.
#pragma once

#include <array>
#include <map>
#include <unordered_map>
#include <utility>
#include <vector>

#include "client/draw/shaders/PersonPrograms.h"
#include "client/draw/shaders/Program.h"
#include "client/draw/store/TextureCache.h"
#include "client/draw/surface/GlState.h"
#include "client/render/DrawMaterial.h"

namespace tessera {

/// What the calls of one material share. Its LookBlock has the same index.
struct DrawLook {
    struct Map {
        TextureCache::Found texture;  ///< null: none
        TextureCache::SamplerKey sampler = 0;
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

/// Belongs to the surface's thread.
class LookTable {
public:
    /// In a studio, what no material and no colours of its corners say a colour of is of a middle grey.
    enum class Of : std::uint8_t { kNoSurface, kSurface, kStudioSurface };

    explicit LookTable(GlState& gl);
    /// The surface is current, or gone.
    ~LookTable();
    LookTable(const LookTable&) = delete;
    LookTable& operator=(const LookTable&) = delete;

    /// Call before the first `find` of a draw, and when SharedBudget and PersonPrograms have begun it.
    void beginDraw();
    /// What is seen where nothing is: material 0.
    void setBackground(const Vec3f& radiance);
    /// The look of a material, null: of none, in these scopes (DrawItem's). Its number stays its own while draws go on
    /// to ask for it.
    [[nodiscard]] std::uint32_t find(const Aspect& aspect, const LookSource* source, std::uint32_t scopes, Of of,
                                     TextureCache& textures);
    /// Brings to GL what is new since the last time. How many looks that were.
    std::uint64_t upload();

    [[nodiscard]] const DrawLook& operator[](std::uint32_t index) const { return entries_[index].look; }
    /// False: it has been forgotten.
    [[nodiscard]] bool has(std::uint32_t index) const { return index < entries_.size() && entries_[index].held; }
    /// Of LookBlocks; a texture of MaterialTexels. Others after each `upload`.
    [[nodiscard]] GLuint buffer() const { return lookBuffer_.name; }
    [[nodiscard]] GLuint materialTexture() const { return materialTexture_; }
    [[nodiscard]] PersonPrograms& persons() { return persons_; }
    [[nodiscard]] const PersonPrograms& persons() const { return persons_; }

private:
    struct Key {
        std::uint64_t serial = 0;  ///< of its source
        std::uint32_t scopes = 0;
        Of of = Of::kNoSurface;
        bool operator==(const Key&) const = default;
    };
    struct KeyHash {
        std::size_t operator()(const Key& key) const {
            return key.serial * 0x9E3779B97F4A7C15ull + 4 * std::size_t{key.scopes} + static_cast<std::size_t>(key.of);
        }
    };
    struct Entry {
        Key key;
        DrawLook look;
        std::uint64_t version = 0;                    ///< of its source, when it was made
        std::uint64_t persons = 0;                    ///< PersonPrograms::changes then
        std::uint32_t known = PersonPrograms::kNone;  ///< PersonPrograms::Found::known
        bool asksPersons = false;                     ///< its material has a program
        std::uint64_t draw = 0;                       ///< the last one that asked for it
        std::uint32_t material = 0;                   ///< see MaterialTexels; 0: none yet
        bool held = false;
    };
    /// So many elements in GL as here, those that are `stale` older.
    template <typename T>
    struct Mirror {
        GLuint name = 0;
        std::vector<T> elements;
        std::vector<std::uint32_t> stale;
        bool grown = false;
    };

    /// That all of it is there for this draw, and as its source says.
    [[nodiscard]] bool isFresh(Entry& entry, const LookSource* source, TextureCache& textures);
    void make(const Aspect& aspect, const LookSource* source, std::uint32_t index, TextureCache& textures);
    static void addLayers(const Aspect& aspect, const Material& material, TextureCache& textures, DrawLook& look,
                          LookBlock& block);
    /// Looks that no draw has asked for since this one.
    void forgetBefore(std::uint64_t draw);
    [[nodiscard]] std::uint32_t takeMaterial(const MaterialTexels& texels);
    void leaveMaterial(std::uint32_t index);
    template <typename T>
    [[nodiscard]] static std::uint32_t place(Mirror<T>& in, std::vector<std::uint32_t>& free, std::uint32_t& used);
    /// How many elements went to GL.
    template <typename T>
    std::uint64_t bring(Mirror<T>& mirror);

    GlState& gl_;
    PersonPrograms persons_;
    std::vector<Entry> entries_;
    std::unordered_map<Key, std::uint32_t, KeyHash> indices_;
    std::vector<std::uint32_t> free_;
    Mirror<LookBlock> lookBuffer_;
    Mirror<MaterialTexels> materialBuffer_;
    GLuint materialTexture_ = 0;
    std::map<MaterialTexels, std::uint32_t> materialIndices_;
    std::vector<std::uint32_t> materialUsers_, freeMaterials_;
    std::uint32_t looksUsed_ = 0, materialsUsed_ = 0;
    std::uint64_t draw_ = 0;
    std::uint32_t last_ = 0;  ///< that was found
    std::size_t sweepAt_ = kLooksKept;
    static constexpr std::size_t kLooksKept = 1024;
    static constexpr std::uint64_t kDrawsKept = 256;
};

/// What a material's normals come from, for which its meshes are drawn with tangents; null: nothing.
[[nodiscard]] const Image* normalMapOf(const LookSource* source);
[[nodiscard]] const Image* normalMapOf(const Aspect& aspect, ObjectId material);
/// Its images, in the order of ImageMap.
[[nodiscard]] std::array<std::pair<ObjectId, ImageUse>, kImageMaps> imagesOf(const Material& material);

}  // namespace tessera
