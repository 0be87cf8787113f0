/// Shader programs and the layouts that they share with C++.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "client/draw/shaders/PersonText.h"
#include "client/draw/store/EnvironmentTexture.h"
#include "client/draw/surface/GlFunctions.h"
#include "client/render/DrawKinds.h"
#include "common/cores/Material.h"

namespace tessera {

/// Lights that are infinitely far away, of a scene that has no others: as many as one without any is given.
inline constexpr std::size_t kMostSuns = 3;
struct Sun {
    std::array<float, 4> towards{0, 0, 1, 0};  ///< of length 1, in eye space
    std::array<float, 4> radiance{};
};

/// A light without a cone that falls off by the square of distance: LightClusters.h, LightTexels.
struct PlainLight {
    std::array<float, 4> place{0, 0, 1, 1}, radiance{};
};
/// One that is infinitely far away, and others: of a scene that has no more, `kFew`. Those that there are not are dark.
inline constexpr std::size_t kMostLamps = 4;
using FewLights = std::array<PlainLight, 1 + kMostLamps>;

/// What all items of one draw share; std140.
struct FrameBlock {
    std::array<float, 16> clip_T_eye;  ///< columns; depth 1 at the near plane, 0 infinitely far away
    std::array<float, 16> eye_T_clip;
    /// Rows. Where the surroundings are a picture, turned as that is.
    std::array<std::array<float, 4>, 3> world_R_eye;
    std::array<float, 4> sky, ground;   ///< sky's w: what radiance is multiplied by, of the exposure
    std::array<float, 4> clipPerPixel;  ///< 2 / width, 2 / height
    /// Scale and offset of LightClusters' slices; how many lights are everybody's, and that or 1.
    std::array<float, 4> slices;
    SurroundingsBlock surroundings;
    std::array<float, 4> shadows;  ///< LightBuffers::shadowed; the size of a pixel of ShadowMaps' texture, of all of it
    std::array<Sun, kMostSuns> suns;
    std::array<float, 4> head;                        ///< of who looks, in eye space: what sprites face
    std::array<std::array<float, 4>, 3> world_T_eye;  ///< rows; single precision: for what a surface asks alone
    /// Of a pixel's place in the framebuffer: scale, offset; where its ray is a metre before the eye, or where it
    /// begins, of parallel ones.
    std::array<float, 4> pixelRays;
    /// Upwards in eye space, and how high above the ground the eye is, in metres; the ground's middle in eye space, and
    /// 1 / its reach in metres.
    std::array<std::array<float, 4>, 2> studio;
    FewLights few;
};
static_assert(sizeof(FrameBlock) == 64 + 64 + 48 + 48 + 16 + 144 + 16 + 96 + 16 + 48 + 16 + 32 + 160);

/// One drawn item: vertex attributes that advance by instance, so that neighbours of one mesh and one state are one
/// call, and those of one state change nothing between their calls. On llvmpipe that saves about 10 µs an item and
/// costs 15 ns a vertex: the surfaces of large meshes have it as a uniform block, an ItemBlock.
struct ItemRecord {
    std::array<std::array<float, 4>, 3> eye_T_item;  ///< rows
    /// Rows of the inverse transpose of eye_T_item's linear part, up to a positive factor; of points that are
    /// stretched, the very one where a ball has the radius 1.
    std::array<std::array<float, 4>, 3> normalRows;
    std::array<std::uint32_t, 2>
        size{};  ///< bits: the width of lines in pixels; see PointSize; of particles metres a unit
    std::array<std::uint32_t, 2> node{};  ///< low and high word of its id
};
static_assert(sizeof(ItemRecord) == 112);
inline constexpr std::uint32_t kLargeMeshTriangles = 1024;
/// std140, of the largest alignment that GL may ask for.
struct ItemBlock {
    ItemRecord record;
    std::array<float, 36> padding{};
};
static_assert(sizeof(ItemBlock) == 256);
/// Their attributes follow those of vertices: six rows, size, node.
inline constexpr GLuint kFirstItemAttribute = 5, kItemSize = kFirstItemAttribute + 6, kItemNode = kItemSize + 1;
/// Of vertices again; of those that have one.
inline constexpr GLuint kTangentAttribute = kItemNode + 1;
/// Where the vertex array of meshes takes vertices from, and records.
inline constexpr GLuint kVertexBinding = 0, kItemBinding = 1;

/// The images that a material may have; bits of ProgramKind::maps, and their order in a LookBlock.
enum class ImageMap : std::uint8_t { kBaseColor, kMetallicRoughness, kNormal, kOcclusion, kEmissive };
inline constexpr std::size_t kImageMaps = 5;
[[nodiscard]] constexpr std::uint8_t bitOf(ImageMap map) {
    return static_cast<std::uint8_t>(1 << static_cast<int>(map));
}
/// Of those the ones that the first pass has no room for beside normal and colour.
inline constexpr std::uint8_t kDetailMaps =
    bitOf(ImageMap::kMetallicRoughness) | bitOf(ImageMap::kOcclusion) | bitOf(ImageMap::kEmissive);

/// How a TextureLayer is looked up, by its source and the shape of its image: three bits each of ProgramKind::layers.
enum class LayerLookup : std::uint8_t {
    kNone,
    kFlatByTexcoords,
    kFlatBySphere,
    kFlatByReflection,
    kFlatByPosition,
    kCubeByReflection,
    kCubeByPosition,
    kSolidByPosition
};
inline constexpr unsigned kLayerBits = 3;
/// kNone: that source says nothing of a place in an image of that shape.
[[nodiscard]] LayerLookup lookupOf(std::int64_t source, std::int64_t shape);

/// What the surfaces of one material share; std140, of the largest alignment that GL may ask for.
struct LookBlock {
    struct Placed {
        std::array<float, 4> u{1, 0, 0, 0},
            v{0, 1, 0, 0};  ///< xyz · (u, v, 1); u[3]: 1 for the second texture coordinates
    };
    std::array<float, 4> baseColor;
    std::array<float, 4> emissiveAndRoughness;
    std::array<float, 4> metallic;            ///< x; y: MaterialTexels::shininess
    std::array<std::uint32_t, 4> material{};  ///< x: for the light pass; y, z: see packedMaterial; w: DrawItem::scopes
    std::array<Placed, kImageMaps> places;
    std::array<float, 4> strengths;  ///< of normals, of occlusion; alpha's cutoff; unused
    std::array<float, 4> effects;    ///< transmission; 1 for unlit; lacquer and its roughness
    std::array<float, 4> specular;   ///< MaterialTexels::specular
    std::array<Placed, Material::kMostLayers> layerPlaces;
    std::array<std::array<float, 4>, Material::kMostLayers> layers;  ///< mode, strength
    std::array<float, 12> padding{};
};
static_assert(sizeof(LookBlock) == 512);

/// Of the 64 bits of a surface (PackFragment.glsl) those that its material alone decides: all but its normal's, where
/// it is of one colour.
[[nodiscard]] std::array<std::uint32_t, 2> packedMaterial(std::uint32_t material, const std::array<float, 4>& color);

/// What the light pass reads of a material, or of a material in other scopes: four texels. Material 0 is the
/// background.
struct MaterialTexels {
    std::array<float, 4> emissiveAndRoughness{};
    /// y: 1 for what light falls on, -1 for what shows its base colour as it is. z, w: lacquer and its roughness.
    std::array<float, 4> metallicLitAndCoat{};
    /// What it reflects where it is no metal: straight on, and w at a glancing angle. Of Phong's: its highlight's
    /// colour.
    std::array<float, 4> specular = {0.04f, 0.04f, 0.04f, 1};
    /// x: Phong's exponent, or -1 for what is not Phong's. z, w: the lower and the upper half of DrawItem::scopes, as
    /// numbers.
    std::array<float, 4> shininessAndScopes = {-1, 0, 0, 0};
    auto operator<=>(const MaterialTexels&) const = default;
};
inline constexpr std::size_t kMaxMaterials = 1 << 14;

/// Where a program looks for lights; the shaders have a name for each (LIGHTS_…).
enum class LightLists : std::uint8_t {
    kAll,       ///< each one that there is, everywhere
    kClusters,  ///< in its cluster's list
    kShadows,   ///< there, and among those that have shadows
    kSun,       ///< nowhere: it is one alone, infinitely far away, and FrameBlock says it; or there is none
    kSuns,      ///< the same of up to kMostSuns
    kFew,       ///< nowhere: FrameBlock says them, see FewLights
};
inline constexpr std::array<LightLists, 6> kAllLightLists = {LightLists::kSun,      LightLists::kSuns,
                                                             LightLists::kFew,      LightLists::kAll,
                                                             LightLists::kClusters, LightLists::kShadows};

/// What a program is for, and what distinguishes those for the same thing.
struct ProgramKind {
    enum class Use : std::uint8_t {
        kSurface,    ///< first pass of what is solid
        kClear,      ///< before it: nothing, far away
        kClassify,   ///< second pass, of several samples: what is to be done in each pixel
        kLightOne,   ///< pixels whose samples all show the same
        kLight,      ///< the others
        kLightRest,  ///< and what else there is in them
        kMeter,      ///< how bright one of each square of pixels is (LightHistogram.h)
        kBlend,      ///< what is transparent
        kCopy,       ///< before it: the picture into all samples, the rest into those that show it
        kSpread,
        kResolve,  ///< after it: samples to the picture
        kNodeIds,
        kDepth,     ///< of what cullers hide things with
        kPlates,    ///< what they ask for
        kFarthest,  ///< of a pixel's samples
        kShadow,    ///< what a light sees: depth alone
    } use = Use::kSurface;
    // Of what draws items.
    std::uint8_t maps = 0;     ///< bits of ImageMap
    std::uint16_t layers = 0;  ///< of each layer its LayerLookup, the first one's lowest
    bool look = false;         ///< reads images, or what they are read with
    bool faceted = false;
    MeshKind items = MeshKind::kTriangles;
    std::uint8_t pointParts =
        0;                  ///< of points, and kPointStretched (DrawForms.h); of what is marched how (VolumeTextures.h)
    bool masked = false;    ///< what alpha leaves away is not there
    bool large = false;     ///< its item is a uniform block
    bool plain = false;     ///< of one colour, the material's
    bool tangents = false;  ///< its vertices have some, for its normal map
    std::uint32_t person = 0;  ///< of PersonPrograms: a person's text
    // Of whole scenes: the same on every tile.
    bool detail = false;  ///< images say more than colours and normals: 64 bits more of each sample
    bool coated = false;  ///< something has lacquer
    bool glossy = false;  ///< something says how it reflects, or is Phong's (DrawList.h)
    bool scoped = false;  ///< some light does not light everything
    LightLists lists = LightLists::kAll;
    bool cubes = false;        ///< some light with shadows shines to all sides
    bool oneSun = false;       ///< there is one light, a sun, and that has shadows
    bool environment = false;  ///< light from everywhere is a picture's
    bool studio = false;       ///< where nothing is there is a ground
    std::uint8_t toneMap = 0;  ///< Environment's, of what shows light
    int samples = 1;           ///< of those that read samples, choose some, or find each one's depth
    auto operator<=>(const ProgramKind&) const = default;
};

/// Whether light is computed in it.
[[nodiscard]] bool isLit(ProgramKind::Use use);
/// The same for other lights, or other surroundings; in no studio, without `cubes` and `oneSun`.
[[nodiscard]] ProgramKind otherwiseLit(ProgramKind kind, LightLists lists, bool environment, bool scoped);
/// Of a surface: what draws the same thing as a light sees it.
[[nodiscard]] ProgramKind shadowOf(const ProgramKind& surface);

/// What GL compiles: GLSL of both stages.
struct ProgramText {
    std::string vertex, fragment;
};
[[nodiscard]] ProgramText programText(const ProgramKind& kind, const PersonText* person = nullptr);

/// One linked program; destroyed with the renderer, on the surface's thread.
class Program {
public:
    [[nodiscard]] static Expected<Program> create(const GlFunctions& gl, const ProgramKind& kind,
                                                  const PersonText* person = nullptr);
    ~Program();
    Program(Program&& other) noexcept;
    Program& operator=(Program&&) = delete;

    [[nodiscard]] GLuint name() const { return name_; }
    /// Of a person's uniforms, by PersonText's places; -1: the program does not ask for it. Last that of `reach`.
    [[nodiscard]] const std::vector<GLint>& locations() const { return locations_; }

private:
    Program(PFNGLDELETEPROGRAMPROC destroy, GLuint name) : destroy_(destroy), name_(name) {}

    PFNGLDELETEPROGRAMPROC destroy_;
    GLuint name_;
    std::vector<GLint> locations_;
};

}  // namespace tessera
