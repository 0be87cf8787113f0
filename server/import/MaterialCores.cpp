#include "server/import/MaterialCores.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <vector>

#include "common/cores/Image.h"
#include "common/cores/Material.h"
#include "common/cores/SurfaceParts.h"
#include "common/drawable/ImageLayout.h"
#include "common/scene/MaterialParts.h"
#include "common/scene/Text.h"
#include "server/import/TableCores.h"

namespace tessera {
namespace {

constexpr std::uint32_t kMaxImageSide = 16384;

// One number in code, on the wire and in files.
using ImageMessage = proto::scene::Image;
using MaterialMessage = proto::scene::Material;
using LayerMessage = proto::scene::TextureLayer;
static_assert(MaterialMessage::AUTO_ALPHA == Material::kAutoAlpha && MaterialMessage::OPAQUE == Material::kOpaque &&
              MaterialMessage::MASK == Material::kMask && MaterialMessage::BLEND == Material::kBlend);
static_assert(MaterialMessage::FILLED == Material::kFilled && MaterialMessage::EDGES == Material::kEdges &&
              MaterialMessage::CORNERS == Material::kCorners);
static_assert(MaterialMessage::METAL_ROUGHNESS == Material::kMetalRoughness &&
              MaterialMessage::PHONG == Material::kPhong);
static_assert(LayerMessage::MODULATE == TextureLayer::kModulate && LayerMessage::ADD == TextureLayer::kAdd &&
              LayerMessage::DECAL == TextureLayer::kDecal && LayerMessage::REPLACE == TextureLayer::kReplace);
static_assert(LayerMessage::TEXCOORDS == TextureLayer::kTexcoords && LayerMessage::SPHERE == TextureLayer::kSphere &&
              LayerMessage::REFLECTION == TextureLayer::kReflection &&
              LayerMessage::POSITION == TextureLayer::kPosition);
static_assert(ImageMessage::REPEAT == Image::kRepeat && ImageMessage::CLAMP == Image::kClamp &&
              ImageMessage::MIRROR == Image::kMirror);
static_assert(ImageMessage::LINEAR == Image::kLinear && ImageMessage::NEAREST == Image::kNearest);
static_assert(ImageMessage::TRILINEAR == Image::kTrilinear && ImageMessage::NEAREST_ALONE == Image::kNearestAlone &&
              ImageMessage::LINEAR_ALONE == Image::kLinearAlone &&
              ImageMessage::NEAREST_MIPMAP_NEAREST == Image::kNearestOfNearest &&
              ImageMessage::LINEAR_MIPMAP_NEAREST == Image::kLinearOfNearest &&
              ImageMessage::NEAREST_MIPMAP_LINEAR == Image::kNearestOfTwo);
static_assert(ImageMessage::RGBE == Image::kRgbe && ImageMessage::BC1 == Image::kBc1 &&
              ImageMessage::BC2 == Image::kBc2 && ImageMessage::BC3 == Image::kBc3 &&
              ImageMessage::BC4 == Image::kBc4 && ImageMessage::BC5 == Image::kBc5 &&
              ImageMessage::BC6H == Image::kBc6h && ImageMessage::BC7 == Image::kBc7);
static_assert(ImageMessage::FLAT == Image::kFlat && ImageMessage::LINE == Image::kLine &&
              ImageMessage::SOLID == Image::kSolid && ImageMessage::CUBE == Image::kCube);

}  // namespace

Expected<ObjectId> MaterialCores::worn(LoadedFile& file, const std::string& said, const Coating& paint) {
    const std::string name = paint.nameFor(said);
    return name.empty() ? Expected<ObjectId>(paint.over) : material(file, name);
}

Expected<ObjectId> MaterialCores::material(LoadedFile& file, const std::string& name) {
    if (const auto known = materials_.find({&file, name}); known != materials_.end()) return known->second;
    const auto found = file.materials.find(name);
    if (found == file.materials.end())
        return fail(ErrorCode::kBadInput, fmt::format("there is no material '{}'", readName(name, "")));
    return made(file, *found->second);
}

Expected<ObjectId> MaterialCores::made(LoadedFile& file, const proto::scene::Material& message) {
    const std::string who = fmt::format("material '{}'", readName(message.name(), ""));
    std::vector<Mended> mended;
    Expected<Material> material = readTableObject<Material>(message, &mended);
    if (!material) return failWith(who, material.error());
    for (const Mended& number : mended)
        draft_.noteMended(file, fmt::format("{}{}: {}", placeIn(message, number.field), who, number.what));
    if (Expected<void> set = setImages(file, message, *material); !set) return tl::unexpected(set.error());
    if (Expected<void> added = addLayers(file, message, *material); !added) return tl::unexpected(added.error());
    if (const Expected<void> sound = checkLayers(*material); !sound) return failWith(who, sound.error());
    // Known from here on: materials may name one another in circles.
    const ObjectId id = materials_[{&file, message.name()}] = draft_.create(*material);
    if (Expected<void> set = setParts(file, message, id); !set) return failWith(who, set.error());
    return id;
}

Expected<void> MaterialCores::setImages(LoadedFile& file, const proto::scene::Material& message, Material& material) {
    for (const FieldEntry& field : findType(Material::kType)->fields) {
        if (field.kind != FieldKind::kRef || field.refType != Image::kType) continue;
        const auto* said = message.GetDescriptor()->FindFieldByName(snakeCase(field.name));
        if (!field.name.ends_with("Image") || !said) continue;
        const std::string name = message.GetReflection()->GetString(message, said);
        if (name.empty()) continue;
        const Expected<ObjectId> core = image(file, name);
        if (!core) return tl::unexpected(core.error());
        field.store(&material, *core);
    }
    return {};
}

Expected<void> MaterialCores::addLayers(LoadedFile& file, const proto::scene::Material& message, Material& material) {
    for (const proto::scene::TextureLayer& layer : message.layer()) {
        Expected<TextureLayer> made = readTableObject<TextureLayer>(layer);
        if (!made)
            return failWith(
                fmt::format("material '{}', layer {}", readName(message.name(), ""), material.layers.size()),
                made.error());
        if (!layer.image().empty()) {
            const Expected<ObjectId> core = image(file, layer.image());
            if (!core) return tl::unexpected(core.error());
            made->image = *core;
        }
        material.layers.push_back(draft_.create(*made));
    }
    return {};
}

Expected<void> MaterialCores::setParts(LoadedFile& file, const proto::scene::Material& message, ObjectId id) {
    if (static_cast<std::size_t>(message.pass_size()) > Material::kMostPasses)
        return fail(ErrorCode::kLimit,
                    fmt::format("{} passes, and {} may be", message.pass_size(), Material::kMostPasses));
    if (static_cast<std::size_t>(message.uniform_size()) > Material::kMostUniforms)
        return fail(ErrorCode::kLimit,
                    fmt::format("{} uniforms, and {} may be", message.uniform_size(), Material::kMostUniforms));
    if (message.has_program()) {
        const Expected<SurfaceProgram> program = readTableObject<SurfaceProgram>(message.program());
        if (!program) return tl::unexpected(program.error());
        setField<&Material::program>(draft_.list(), id, draft_.create(*program));
    }
    if (Expected<void> set = setUniforms(file, message, id); !set) return set;
    if (message.pass().empty() && message.coarser().empty()) return {};
    constexpr int kDeepest = 64;
    if (depth_ == kDeepest)
        return fail(ErrorCode::kLimit, fmt::format("materials name one another {} times in a row", kDeepest));
    ++depth_;
    const Expected<void> set = setOthers(file, message, id);
    --depth_;
    return set;
}

Expected<void> MaterialCores::setUniforms(LoadedFile& file, const proto::scene::Material& message, ObjectId id) {
    RefList uniforms;
    for (const proto::scene::Uniform& said : message.uniform()) {
        Uniform uniform{.name = said.name(), .value = Vec4f::Zero(), .image = {}};
        if (said.value_size() > 4)
            return fail(ErrorCode::kBadInput,
                        fmt::format("the uniform '{}' has more than four numbers", readName(said.name(), "")));
        for (int i = 0; i < said.value_size(); ++i) {
            if (!std::isfinite(said.value(i)))
                return fail(ErrorCode::kBadInput,
                            fmt::format("the uniform '{}' is not a number", readName(said.name(), "")));
            uniform.value[i] = said.value(i);
        }
        if (!said.image().empty()) {
            const Expected<ObjectId> core = image(file, said.image());
            if (!core) return tl::unexpected(core.error());
            uniform.image = *core;
        }
        uniforms.push_back(draft_.create(uniform));
    }
    if (!uniforms.empty()) setField<&Material::uniforms>(draft_.list(), id, uniforms);
    return {};
}

Expected<void> MaterialCores::setOthers(LoadedFile& file, const proto::scene::Material& message, ObjectId id) {
    RefList passes;
    for (const std::string& name : message.pass()) {
        const Expected<ObjectId> pass = material(file, name);
        if (!pass) return tl::unexpected(pass.error());
        passes.push_back(*pass);
    }
    if (!message.coarser().empty()) {
        const Expected<ObjectId> coarser = material(file, message.coarser());
        if (!coarser) return tl::unexpected(coarser.error());
        setField<&Material::coarser>(draft_.list(), id, *coarser);
    }
    if (!passes.empty()) setField<&Material::passes>(draft_.list(), id, passes);
    return {};
}

Expected<ObjectId> MaterialCores::image(LoadedFile& file, const std::string& name) {
    if (const auto known = images_.find({&file, name}); known != images_.end()) return known->second;
    const auto found = file.images.find(name);
    if (found == file.images.end())
        return fail(ErrorCode::kBadInput, fmt::format("there is no image '{}'", readName(name, "")));
    const std::string who = fmt::format("image '{}'", readName(name, ""));
    const proto::scene::Image& message = *found->second;
    const Expected<Blob> pixels = file.blob(message.pixels_blob());
    if (!pixels) return failWith(who, pixels.error());
    Expected<Image> image = readTableObject<Image>(message);
    if (!image) return failWith(who, image.error());
    image->pixels = *pixels;
    if (pixels->empty() && message.width_px() == 0 && message.height_px() == 0 && file.isFilm(name)) {
        // Black, until the film is there.
        static constexpr std::array<std::uint8_t, 4> kBlack = {0, 0, 0, 255};
        image->pixels = Blob::of(std::span<const std::uint8_t>(kBlack));
        image->widthPx = image->heightPx = 1;
        return images_[{&file, name}] = draft_.create(*image);
    }
    if (message.width_px() == 0 || message.height_px() == 0 || message.width_px() > kMaxImageSide ||
        message.height_px() > kMaxImageSide || pixels->sizeBytes() == 0)
        return fail(ErrorCode::kBadInput, fmt::format("{}: {} bytes are not {} × {} pixels", who, pixels->sizeBytes(),
                                                      message.width_px(), message.height_px()));
    if (const Expected<void> sound = checkImage(*image); !sound) return failWith(who, sound.error());
    return images_[{&file, name}] = draft_.create(*image);
}

}  // namespace tessera
