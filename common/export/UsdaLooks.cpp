#include "common/export/UsdaLooks.h"

#include <cmath>
#include <numbers>

#include "common/export/LeavingLooks.h"
#include "common/export/LeavingPictures.h"
#include "common/export/UsdaText.h"
#include "common/export/WorldMeshes.h"

namespace tessera {
namespace {

constexpr std::size_t kDepth = 4;  ///< of what stands in a shader

const char* usdWrap(std::int64_t how) {
    return how == Image::kClamp ? "clamp" : how == Image::kMirror ? "mirror" : "repeat";
}

std::string four(const Vec3f& c, float a) {
    return fmt::format("({}, {}, {}, {})", c[0], c[1], c[2], a);
}

}  // namespace

struct UsdaLooks::Shaders {
    std::string here;  ///< the material's path
    ObjectId node;
    Companions& companions;
    LeavingFiles& files;
    std::string surface, others;
};

std::string UsdaLooks::path(ObjectId material, ObjectId node, Companions& companions, LeavingFiles& files) {
    const auto [known, isNew] = known_.try_emplace(material, std::string());
    if (!isNew) return known->second;
    const std::string name = fmt::format("material_{}", known_.size() - 1);
    known->second = fmt::format("{}/{}", scope_, name);
    const Material m = materialOf(leaving_.scene, material);
    noteLostLooks(m, leaving_.notes, node);
    if (m.transmission > 0) leaving_.notes.add("light that goes through materials is left out", node);
    if (!m.unlit && (m.specular != 1 || m.specularColor != Vec3f::Ones()))
        leaving_.notes.add("how much what is no metal reflects, and how tinted, is left out", node);
    Shaders shaders{
        .here = known->second, .node = node, .companions = companions, .files = files, .surface = {}, .others = {}};
    addInputs(m, shaders);
    const std::string in = usdIndent(kDepth);
    for (const char* set : {"st", "st1"})
        if (shaders.others.find(fmt::format("/{}.outputs:result>", set)) != std::string::npos)
            shaders.others += fmt::format(
                "            def Shader \"{}\"\n            {{\n{}uniform token info:id = "
                "\"UsdPrimvarReader_float2\"\n{}string inputs:varname = \"{}\"\n"
                "{}float2 outputs:result\n            }}\n",
                set, in, in, set, in);
    text_ += fmt::format(
        "        def Material \"{}\"\n        {{\n            token outputs:surface.connect = "
        "<{}/surface.outputs:surface>\n            def Shader \"surface\"\n            {{\n{}"
        "            }}\n{}        }}\n",
        name, shaders.here, shaders.surface, shaders.others);
    return known->second;
}

void UsdaLooks::addInputs(const Material& m, Shaders& shaders) {
    const std::string in = usdIndent(kDepth);
    shaders.surface = fmt::format("{}uniform token info:id = \"UsdPreviewSurface\"\n", in);
    const Vec3f base = m.baseColor.head<3>();
    addInput(shaders, "color3f", m.unlit ? "emissiveColor" : "diffuseColor", m.baseColorImage, "rgb", usdTuple(base),
             four(base, m.baseColor[3]));
    if (m.unlit)
        shaders.surface += fmt::format("{}color3f inputs:diffuseColor = (0, 0, 0)\n", in);
    else
        addInput(shaders, "color3f", "emissiveColor", m.emissiveImage, "rgb", usdTuple(m.emissive),
                 four(m.emissive, 1));
    const bool phong = m.shading == Material::kPhong;
    const float roughness = phong ? roughnessOfShininess(m.shininess) : m.roughness, metallic = phong ? 0 : m.metallic;
    const std::string scale = fmt::format("(1, {}, {}, 1)", roughness, metallic);
    addInput(shaders, "float", "roughness", m.metallicRoughnessImage, "g", fmt::format("{}", roughness), scale);
    addInput(shaders, "float", "metallic", m.metallicRoughnessImage, "b", fmt::format("{}", metallic), scale);
    const float kept = m.occlusionStrength;
    addInput(shaders, "float", "occlusion", m.occlusionImage, "r", {}, fmt::format("({}, 1, 1, 1)", kept),
             kept == 1 ? std::string() : fmt::format("({}, 0, 0, 0)", 1 - kept));
    // From -1 to 1; green goes the other way from below.
    const float bump = m.normalScale;
    addInput(shaders, "normal3f", "normal", m.normalImage, "rgb", {}, fmt::format("({}, {}, 2, 1)", 2 * bump, 2 * bump),
             fmt::format("({}, {}, -1, 0)", -bump, -bump));
    const bool blends = m.alphaMode == Material::kBlend || (m.alphaMode == Material::kAutoAlpha && m.baseColor[3] < 1);
    if (blends || m.alphaMode == Material::kMask)
        addInput(shaders, "float", "opacity", m.baseColorImage, "a", fmt::format("{}", m.baseColor[3]),
                 four(base, m.baseColor[3]));
    if (m.alphaMode == Material::kMask)
        shaders.surface += fmt::format("{}float inputs:opacityThreshold = {}\n", in, m.alphaCutoff);
    shaders.surface += fmt::format(
        "{}float inputs:clearcoat = {}\n{}float inputs:clearcoatRoughness = {}\n"
        "{}float inputs:ior = {}\n{}token outputs:surface\n",
        in, m.clearcoat, in, m.clearcoatRoughness, in, m.ior, in);
}

void UsdaLooks::addInput(Shaders& shaders, std::string_view type, std::string_view name, ObjectId image,
                         std::string_view channel, const std::string& value, const std::string& scale,
                         const std::string& bias) {
    const std::string in = usdIndent(kDepth);
    if (image && addTexture(shaders, name, channel, image, scale, bias))
        shaders.surface +=
            fmt::format("{}{} inputs:{}.connect = <{}/{}.outputs:{}>\n", in, type, name, shaders.here, name, channel);
    else if (!value.empty())
        shaders.surface += fmt::format("{}{} inputs:{} = {}\n", in, type, name, value);
}

bool UsdaLooks::addTexture(Shaders& shaders, std::string_view name, std::string_view channel, ObjectId id,
                           const std::string& scale, const std::string& bias) {
    const auto* image = leaving_.scene.get<Image>(id);
    const std::string file = image ? picture(*image, shaders) : std::string();
    if (file.empty()) return false;
    if (image->magnification != Image::kLinear || image->minification != Image::kTrilinear)
        leaving_.notes.add("how images are filtered is left out", shaders.node);
    const std::string in = usdIndent(kDepth);
    const char* set = image->texcoordSet == 1 ? "st1" : "st";
    std::string from = fmt::format("<{}/{}.outputs:result>", shaders.here, set);
    if (isPlaced(*image)) {
        // Ours count v from above: 1 - v goes in, and comes out.
        const float c = std::cos(image->rotation), s = std::sin(image->rotation);
        const Vec2f at(image->offset[0] + s * image->scale[1], 1 - image->offset[1] - c * image->scale[1]);
        shaders.others += fmt::format(
            "            def Shader \"{}_place\"\n            {{\n{}uniform token info:id = \"UsdTransform2d\"\n"
            "{}float2 inputs:in.connect = {}\n{}float inputs:rotation = {}\n{}float2 inputs:scale = ({}, {})\n"
            "{}float2 inputs:translation = ({}, {})\n{}float2 outputs:result\n            }}\n",
            name, in, in, from, in, image->rotation * 180 / std::numbers::pi_v<float>, in, image->scale[0],
            image->scale[1], in, at[0], at[1], in);
        from = fmt::format("<{}/{}_place.outputs:result>", shaders.here, name);
    }
    shaders.others += fmt::format(
        "            def Shader \"{}\"\n            {{\n{}uniform token info:id = \"UsdUVTexture\"\n"
        "{}asset inputs:file = @{}@\n{}float2 inputs:st.connect = {}\n"
        "{}token inputs:wrapS = \"{}\"\n{}token inputs:wrapT = \"{}\"\n",
        name, in, in, file, in, from, in, usdWrap(image->wrapU), in, usdWrap(image->wrapV));
    shaders.others += fmt::format("{}float4 inputs:scale = {}\n", in, scale);
    if (!bias.empty()) shaders.others += fmt::format("{}float4 inputs:bias = {}\n", in, bias);
    const bool color = channel == "rgb" && bias.empty();
    shaders.others +=
        fmt::format("{}token inputs:sourceColorSpace = \"{}\"\n{}{} outputs:{}\n            }}\n", in,
                    color || channel == "a" ? "sRGB" : "raw", in, channel == "rgb" ? "float3" : "float", channel);
    return true;
}

std::string UsdaLooks::picture(const Image& image, Shaders& shaders) {
    if (image.pixels.empty()) return {};
    const auto [known, isNew] = pictures_.try_emplace(image.pixels.id(), std::string());
    if (!isNew) return known->second;
    std::optional<Bytes> png = pngOf(image, leaving_.notes, shaders.node);
    if (!png) return {};
    return known->second = shaders.companions.addPicture(std::move(*png), shaders.files);
}

}  // namespace tessera
