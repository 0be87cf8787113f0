#include "server/import/coin/CoinMaterials.h"

#include <Inventor/VRMLnodes/SoVRMLImageTexture.h>
#include <Inventor/VRMLnodes/SoVRMLPixelTexture.h>
#include <Inventor/nodes/SoDrawStyle.h>
#include <Inventor/nodes/SoTexture2.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/base/Hash.h"
#include "common/base/Utf8.h"
#include "common/math/Srgb.h"
#include "server/import/coin/GreyPicture.h"
#include "server/import/reader/BoundedNumbers.h"

namespace tessera {
namespace {

using ImageMessage = proto::scene::Image;
using MaterialMessage = proto::scene::Material;

/// Of a picture within the file: one to four numbers a pixel, rows from below.
Expected<DecodedImage> decodeBare(const SoSFImage& field, int maxSidePx) {
    SbVec2s size;
    int channels = 0;
    const unsigned char* pixels = field.getValue(size, channels);
    if (pixels == nullptr || size[0] <= 0 || size[1] <= 0 || channels < 1 || channels > 4)
        return fail(ErrorCode::kBadInput, "it has no pixels");
    DecodedImage image;
    image.widthPx = size[0];
    image.heightPx = size[1];
    const auto width = static_cast<std::size_t>(size[0]), height = static_cast<std::size_t>(size[1]);
    const auto step = static_cast<std::size_t>(channels);
    image.rgba.resize(width * height * 4);
    for (std::size_t y = 0; y < height; ++y)
        for (std::size_t x = 0; x < width; ++x) {
            const unsigned char* from = pixels + ((height - 1 - y) * width + x) * step;
            std::byte* to = image.rgba.data() + (y * width + x) * 4;
            const bool grey = channels < 3;
            for (std::size_t c = 0; c < 3; ++c) to[c] = std::byte{from[grey ? 0 : c]};
            to[3] = channels % 2 == 0 ? std::byte{from[step - 1]} : std::byte{255};
        }
    while (std::max(image.widthPx, image.heightPx) > maxSidePx && halve(image)) {
    }
    return image;
}

bool seesThrough(const DecodedImage& image) {
    if (image.encoding != ImageMessage::SRGB) return false;
    for (std::size_t i = 3; i < image.rgba.size(); i += 4)
        if (image.rgba[i] != std::byte{255}) return true;
    return false;
}

void setColor(proto::scene::Color& to, const Vec3f& color) {
    to.set_r(linearOfSrgb(color.x()));
    to.set_g(linearOfSrgb(color.y()));
    to.set_b(linearOfSrgb(color.z()));
}

Vec3f boundedColor(const BoundedNumbers& numbers, std::string_view name, const Vec3f& color) {
    Vec3f bounded;
    for (int i = 0; i < 3; ++i) bounded[i] = numbers.share(name, color[i], 0.8);
    return bounded;
}

}  // namespace

std::string CoinMaterials::name(const Wanted& wanted) {
    const std::string called = wanted.source != nullptr ? nameOf(*wanted.source) : "";
    const BoundedNumbers numbers(scene_, called.empty() ? "a material" : fmt::format("material '{}'", called));
    const CoinLook& look = wanted.look;
    const Vec3f diffuse = boundedColor(numbers, "the colour", look.diffuse);
    const Vec3f emissive = boundedColor(numbers, "the glow", look.emissive);
    const Vec3f specular = boundedColor(numbers, "the highlight's colour", look.specular);
    const float opacity = 1.0f - numbers.share("the transparency", look.transparency, 0);
    const Shown* shown = wanted.texture != nullptr ? &picture(*wanted.texture, wanted.from) : nullptr;
    if (shown != nullptr && shown->image.empty()) shown = nullptr;

    MaterialMessage message;
    message.set_double_sided(look.backFaces);
    const bool unlit = look.unlit || wanted.strokes;
    using Counted = CoinMotion::Counted;
    const bool replaced = wanted.colored || (shown != nullptr && shown->replaces);
    // Nothing lights lines and points of VRML 2: they have the glow's colour.
    const bool glows = wanted.strokes && wanted.vrml2 && !look.unlit;
    const Counted diffuseCounts = replaced || glows ? Counted::kNot : Counted::kAsBase;
    const Counted emissiveCounts = !unlit ? Counted::kAsGlow : glows && !replaced ? Counted::kAsBase : Counted::kNot;
    const Vec3f base = replaced ? Vec3f(Vec3f::Ones()) : glows ? emissive : diffuse;
    setColor(*message.mutable_base_color(), base);
    // Colours of VRML 2 have no transparency of their own: geometry that others show more clearly shares them.
    message.mutable_base_color()->set_a(wanted.colored && !wanted.vrml2 ? 1.0f : opacity);
    message.set_unlit(unlit);
    if (!unlit) {
        message.set_shading(MaterialMessage::PHONG);
        setColor(*message.mutable_specular_color(), specular);
        message.set_shininess(std::max(1.0f, 128.0f * numbers.share("the shininess", look.shininess, 0.2)));
        if (!emissive.isZero()) setColor(*message.mutable_emissive(), emissive);
    }
    if (look.drawStyle == SoDrawStyle::LINES && !wanted.strokes) message.set_fill(MaterialMessage::EDGES);
    if (look.drawStyle == SoDrawStyle::POINTS && !wanted.strokes) message.set_fill(MaterialMessage::CORNERS);
    if (shown != nullptr) message.set_base_color_image(shown->image);
    if (opacity < 1 || (shown != nullptr && shown->translucent)) message.set_alpha_mode(MaterialMessage::BLEND);
    std::string key = message.SerializeAsString();
    // What moves must not take along what merely looks like it at rest.
    if (wanted.moves)
        key += fmt::format("{} {} {}", static_cast<const void*>(wanted.source), static_cast<int>(diffuseCounts),
                           static_cast<int>(emissiveCounts));
    const auto [place, isNew] = materials_.try_emplace(key);
    if (!isNew) return place->second;
    const std::size_t number = materials_.size();
    constexpr std::size_t kShown = 200;  // the number stands behind it
    place->second =
        called.empty() ? fmt::format("material {}", number) : fmt::format("{} {}", cutUtf8(called, kShown), number);
    message.set_name(place->second);
    if (wanted.moves) motion_.addMaterial(*wanted.source, message, diffuseCounts, emissiveCounts);
    *scene_.file.add_material() = std::move(message);
    return place->second;
}

const CoinMaterials::Shown& CoinMaterials::picture(const SoNode& texture, const std::string& from) {
    const auto known = shown_.find(&texture);
    return known != shown_.end() ? known->second : shown_.emplace(&texture, makePicture(texture, from)).first->second;
}

CoinMaterials::Shown CoinMaterials::makePicture(const SoNode& texture, const std::string& from) {
    std::vector<std::string> names;
    const SoSFImage* bare = nullptr;
    bool repeatS = true, repeatT = true;
    Shown shown;
    if (texture.isOfType(SoVRMLImageTexture::getClassTypeId())) {
        const auto& node = static_cast<const SoVRMLImageTexture&>(texture);
        for (int i = 0; i < node.url.getNum(); ++i) names.emplace_back(node.url[i].getString());
        repeatS = node.repeatS.getValue();
        repeatT = node.repeatT.getValue();
    } else if (texture.isOfType(SoVRMLPixelTexture::getClassTypeId())) {
        const auto& node = static_cast<const SoVRMLPixelTexture&>(texture);
        bare = &node.image;
        repeatS = node.repeatS.getValue();
        repeatT = node.repeatT.getValue();
        SbVec2s size;
        int channels = 0;
        node.image.getValue(size, channels);
        shown.replaces = channels >= 3;
    } else if (texture.isOfType(SoTexture2::getClassTypeId())) {
        const auto& node = static_cast<const SoTexture2&>(texture);
        if (node.filename.getValue().getLength() > 0)
            names.emplace_back(node.filename.getValue().getString());
        else
            bare = &node.image;
        repeatS = node.wrapS.getValue() == SoTexture2::REPEAT;
        repeatT = node.wrapT.getValue() == SoTexture2::REPEAT;
        shown.replaces = node.model.getValue() == SoTexture2::DECAL || node.model.getValue() == SoTexture2::REPLACE;
        SbVec2s size;
        int channels = 0;
        // One that says neither is how a file ends textures.
        if (names.empty() && node.image.getValue(size, channels) == nullptr) return {};
    }
    std::erase(names, "");
    if (names.empty() && bare == nullptr) return {};
    std::string key;
    Expected<DecodedImage> decoded = fail(ErrorCode::kNotFound, "there is none");
    if (bare != nullptr) {
        decoded = decodeBare(*bare, limits_.maxImageSide);
        key = decoded ? "picture " + toHex(hash128(decoded->rgba)) : "picture";
    } else {
        key = "picture " + names.front();
        bool isGrey = false;
        decoded = decodeFile(names, from, key, isGrey);
        if (texture.isOfType(SoVRMLImageTexture::getClassTypeId())) shown.replaces = !isGrey;
    }
    if (!decoded) {
        scene_.note(fmt::format("{} is left out: {}", key, decoded.error().message));
        return {};
    }
    shown.translucent = seesThrough(*decoded);
    shown.image = fmt::format("image {}", images_ + 1);
    const Expected<ImageMessage*> image =
        pictures_.addImage(shown.image, key, [&]() -> Expected<DecodedImage> { return std::move(*decoded); });
    if (!image) return {};
    ++images_;
    (*image)->set_wrap_u(repeatS ? ImageMessage::REPEAT : ImageMessage::CLAMP);
    (*image)->set_wrap_v(repeatT ? ImageMessage::REPEAT : ImageMessage::CLAMP);
    return shown;
}

/// The first of them that is there. `key`: its name, one for each file.
Expected<DecodedImage> CoinMaterials::decodeFile(const std::vector<std::string>& names, const std::string& from,
                                                 std::string& key, bool& isGrey) {
    Expected<DecodedImage> first = fail(ErrorCode::kNotFound, "it has no name");
    for (std::size_t i = 0; i < names.size(); ++i) {
        std::string name = names[i];
        std::ranges::replace(name, '\\', '/');
        const Expected<std::string> path = files_.find(name, from);
        Expected<DecodedImage> decoded = tl::unexpected(path ? Error{} : path.error());
        if (path) {
            const Expected<Bytes> bytes = files_.read(*path);
            isGrey = bytes && isGreyPicture(*bytes);
            decoded = bytes ? pictures_.decode(*bytes) : tl::unexpected(bytes.error());
        }
        if (decoded) {
            key = "picture " + path->substr(files_.folder().size() + 1);
            return decoded;
        }
        if (i == 0) first = std::move(decoded);
    }
    return first;
}

}  // namespace tessera
