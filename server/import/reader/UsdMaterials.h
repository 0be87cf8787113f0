/// Materials of USD: UsdPreviewSurface with its textures, as materials of a scene.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "server/import/reader/BoundedNumbers.h"
#include "server/import/reader/Pictures.h"
#include "server/import/reader/PlainScene.h"
#include "server/import/reader/usd/UsdStage.h"

namespace tessera {

/// A material, and what it wants of a mesh.
struct UsdLook {
    std::string material;                  ///< of the scene; empty: the default one
    std::array<std::string, 2> texcoords;  ///< names of primvars, of both sets; empty: none
    std::string colors;                    ///< name of a primvar of colours; empty: none
    bool textured() const { return !texcoords[0].empty(); }
};

/// The path of what is bound to the prim itself, to be looked at or else for all purposes; empty: nothing.
[[nodiscard]] std::string usdBoundMaterial(const UsdComposedPrim& prim);
/// Whether it binds materials to collections of what is below.
[[nodiscard]] bool usdHasCollections(const UsdComposedPrim& prim);

class UsdMaterials {
public:
    UsdMaterials(UsdStage& stage, UsdFiles& files, const ReadLimits& limits, PlainScene& scene, UsdRemarks& remarks)
        : stage_(stage), files_(files), limits_(limits), scene_(scene), remarks_(remarks), pictures_(scene, limits) {}

    /// The material at a path, which may be empty.
    Expected<UsdLook> look(const std::string& path, bool doubleSided);
    /// White, so that colours of vertices are what they are; of a name that begins so.
    static constexpr std::string_view kColored = "display color";
    UsdLook colored(bool doubleSided, bool transparent);
    /// A picture of the surroundings; empty: it cannot be had.
    std::string surroundings(const UsdAttribute& file, const std::string& prim);
    /// Once all are there.
    void finish() { pictures_.finish(); }

private:
    /// An input of a shader: a value, or a texture's.
    struct Input {
        UsdValuePtr value;
        UsdStage::Prim texture;       ///< null: none
        std::string channel = "rgb";  ///< of the texture that counts
        std::string primvar;          ///< a primvar instead
    };
    /// What a picture's numbers are: colours in sRGB, as Tessera has them, or other things, as they stand.
    enum class Holds : std::uint8_t { kColors, kNumbers };
    struct Texture {
        std::string image;  ///< of the scene; empty: none
        std::string file;   ///< what it is a picture of
        std::array<double, 4> scale{1, 1, 1, 1}, bias{0, 0, 0, 0};
    };
    /// `depth`: connections that led here; those that go in a circle end somewhere.
    Expected<Input> input(const UsdComposedPrim& shader, const std::string& name, int depth = 0);
    /// The same of materials that say the same, as those of an asset that is placed often do.
    Expected<std::string> fingerprint(const UsdComposedPrim& prim, const std::string& material, int depth);
    Expected<UsdStage::Prim> surfaceOf(const UsdComposedPrim& material);
    Expected<void> setSurface(const UsdComposedPrim& shader, UsdLook& look, proto::scene::Material& message);
    Expected<void> setOpacity(const UsdComposedPrim& shader, const Input& color, const BoundedNumbers& numbers,
                              UsdLook& look, proto::scene::Material& message);
    Expected<void> setMetalRoughness(const UsdComposedPrim& shader, const BoundedNumbers& numbers, UsdLook& look,
                                     proto::scene::Material& message);
    /// Adds its primvar to those that the look wants.
    Expected<Texture> texture(const Input& input, UsdLook& look, Holds holds);
    Expected<std::optional<proto::scene::Image>> place(const UsdComposedPrim& texture, UsdLook& look);
    std::string imageOf(const std::string& picture, const proto::scene::Image& wanted,
                        const std::function<Expected<DecodedImage>()>& decode);
    Expected<DecodedImage> decode(const UsdComposedPrim& texture, Holds holds);
    /// The shader that an input is connected to, through graphs of nodes; null: none.
    Expected<UsdStage::Prim> shaderOf(const UsdComposedPrim& prim, const std::string& property);
    Expected<DecodedImage> decodePacked(const Input& metal, const Input& roughness);

    UsdStage& stage_;
    UsdFiles& files_;
    const ReadLimits& limits_;
    PlainScene& scene_;
    UsdRemarks& remarks_;
    Pictures pictures_;
    std::map<std::pair<std::string, bool>, UsdLook> known_;   ///< by path
    std::map<std::pair<std::string, bool>, UsdLook> sameAs_;  ///< by what they are made of
    std::map<std::pair<std::string, std::string>, std::string>
        images_;  ///< by picture, and what the message says besides
};

}  // namespace tessera
