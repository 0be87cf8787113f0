#include "client/draw/store/TextureCache.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "client/draw/store/BlockPixels.h"

namespace tessera {
namespace {

constexpr GLint kMaxTextureSidePx = 16384;

// Of S3TC, which no version of OpenGL asks for; of an extension that glcorearb.h leaves out.
constexpr GLenum kBc1 = 0x83F1, kBc2 = 0x83F2, kBc3 = 0x83F3, kSrgbBc1 = 0x8C4D, kSrgbBc2 = 0x8C4E, kSrgbBc3 = 0x8C4F;

/// Of what goes there as it is.
GLenum formatOf(std::int64_t encoding, ImageUse use) {
    const bool color = use == ImageUse::kColor;
    switch (encoding) {
        case Image::kBc1:
            return color ? kSrgbBc1 : kBc1;
        case Image::kBc2:
            return color ? kSrgbBc2 : kBc2;
        case Image::kBc3:
            return color ? kSrgbBc3 : kBc3;
        case Image::kBc4:
            return GL_COMPRESSED_RED_RGTC1;
        case Image::kBc6h:
            return GL_COMPRESSED_RGB_BPTC_UNSIGNED_FLOAT;
        case Image::kBc7:
            return color ? GL_COMPRESSED_SRGB_ALPHA_BPTC_UNORM : GL_COMPRESSED_RGBA_BPTC_UNORM;
        case Image::kRgbe:
            return GL_RGBA16F;
        default:
            return color ? GL_SRGB8_ALPHA8 : GL_RGBA8;
    }
}

/// Red, green, blue and 1 of pixels whose exponent is shared; none above what halves hold.
std::vector<float> floatsOf(ByteSpan pixels) {
    constexpr float kGreatestHalf = 65504;
    std::vector<float> floats;
    floats.reserve(pixels.size());
    for (std::size_t i = 0; i + 3 < pixels.size(); i += 4) {
        const int exponent = std::to_integer<int>(pixels[i + 3]);
        const float unit = exponent == 0 ? 0.0f : std::ldexp(1.0f, exponent - 136);
        for (std::size_t c = 0; c < 3; ++c)
            floats.push_back(std::min(kGreatestHalf, unit * static_cast<float>(std::to_integer<int>(pixels[i + c]))));
        floats.push_back(1);
    }
    return floats;
}

}  // namespace

GLenum textureTarget(const Image& image) {
    return image.shape == Image::kSolid  ? GL_TEXTURE_3D
           : image.shape == Image::kCube ? GL_TEXTURE_CUBE_MAP
                                         : GL_TEXTURE_2D;
}

TextureCache::TextureCache(const GlFunctions& gl, const UseClock& clock, int anisotropy) : gl_(gl), clock_(clock) {
    readsS3tc_ = gl.hasExtension("GL_EXT_texture_compression_s3tc") &&
                 (gl.hasExtension("GL_EXT_texture_sRGB") || gl.hasExtension("GL_EXT_texture_compression_s3tc_srgb"));
    if (gl.hasExtension("GL_ARB_texture_filter_anisotropic") || gl.hasExtension("GL_EXT_texture_filter_anisotropic"))
        anisotropyHere_ = std::clamp(anisotropy, 1, 1 << (kAnisotropies - 1));
    gl_.GetIntegerv(GL_MAX_TEXTURE_SIZE, &mostFlatPx_);
    gl_.GetIntegerv(GL_MAX_3D_TEXTURE_SIZE, &mostSolidPx_);
    gl_.GetIntegerv(GL_MAX_CUBE_MAP_TEXTURE_SIZE, &mostCubePx_);
}

bool TextureCache::isShown(const Image& image) const {
    if (!image.pixels.resident() || image.pixels.sizeBytes() == 0 || !checkImage(image)) return false;
    const GLint most = image.shape == Image::kSolid  ? mostSolidPx_
                       : image.shape == Image::kCube ? mostCubePx_
                                                     : std::min(mostFlatPx_, kMaxTextureSidePx);
    return std::max({image.widthPx, image.heightPx, image.depthPx}) <= most;
}

bool TextureCache::readsBlocks(const Image& image, ImageUse use) const {
    switch (image.encoding) {
        case Image::kBc1:
        case Image::kBc2:
        case Image::kBc3:
            // Nor is S3TC, nor RGTC, of three dimensions.
            return readsS3tc_ && image.shape != Image::kSolid;
        case Image::kBc4:
            // It knows no sRGB.
            return use == ImageUse::kNumbers && image.shape != Image::kSolid;
        case Image::kBc6h:
        case Image::kBc7:
            return true;
        default:
            return false;
    }
}

/// With all mipmaps.
std::size_t TextureCache::bytesOf(const Image& image, ImageUse use) const {
    if (readsBlocks(image, use)) return image.pixels.sizeBytes();
    std::size_t bytes = 0;
    if (isCompressed(image.encoding))
        for (const ImageLevel& level : levelsOf(image))
            bytes += static_cast<std::size_t>(level.widthPx * level.heightPx * level.depthPx) * 4;
    else
        bytes = image.shape == Image::kSolid ? image.pixels.sizeBytes() / 7 * 8 : image.pixels.sizeBytes() / 3 * 4;
    return image.encoding == Image::kRgbe ? 2 * bytes : bytes;
}

TextureCache::~TextureCache() {
    for (const auto& [key, texture] : textures_) gl_.DeleteTextures(1, &texture->name);
    for (const GLuint sampler : samplers_)
        if (sampler) gl_.DeleteSamplers(1, &sampler);
}

void TextureCache::limitAnisotropy(int most) {
    const auto samples = static_cast<unsigned>(std::max(1, std::min(anisotropyHere_, most)));
    anisotropy_ = static_cast<std::size_t>(std::bit_width(samples)) - 1;
}

void TextureCache::addSpares(std::vector<UseClock::Spare>& spares) {
    clock_.addSpares(textures_, spares, [this](const Key& key) {
        const auto it = textures_.find(key);
        Texture& texture = *it->second;
        clock_.remember(gone_, key, texture.uses);
        bytes_ -= texture.bytes;
        gl_.DeleteTextures(1, &texture.name);
        texture.gone = true;
        textures_.erase(it);
    });
}

TextureCache::SamplerKey TextureCache::samplerOf(const Image& image) {
    // The table of types bounds them.
    const auto u = static_cast<unsigned>(image.wrapU), v = static_cast<unsigned>(image.wrapV),
               w = static_cast<unsigned>(image.wrapW), large = static_cast<unsigned>(image.magnification),
               small = static_cast<unsigned>(image.minification);
    const bool smoothest = image.magnification == Image::kLinear && image.minification == Image::kTrilinear &&
                           textureTarget(image) == GL_TEXTURE_2D;
    return static_cast<SamplerKey>(2 * ((((u * 3 + v) * 3 + w) * 2 + large) * 6 + small) + (smoothest ? 1 : 0));
}

GLuint TextureCache::sampler(SamplerKey key) {
    static constexpr std::array<GLint, 3> kWraps = {GL_REPEAT, GL_CLAMP_TO_EDGE, GL_MIRRORED_REPEAT};
    static constexpr std::array<GLint, 2> kMagnifications = {GL_LINEAR, GL_NEAREST};
    static constexpr std::array<GLint, 6> kMinifications = {
        GL_LINEAR_MIPMAP_LINEAR, GL_NEAREST, GL_LINEAR, GL_NEAREST_MIPMAP_NEAREST, GL_LINEAR_MIPMAP_NEAREST,
        GL_NEAREST_MIPMAP_LINEAR};
    const std::size_t anisotropy = key % 2 != 0 ? anisotropy_ : 0, read = key / 2, small = read % 6,
                      large = read / 6 % 2, w = read / 12 % 3, v = read / 36 % 3, u = read / 108;
    GLuint& name = samplers_[read * kAnisotropies + anisotropy];
    if (name) return name;
    gl_.CreateSamplers(1, &name);
    gl_.SamplerParameteri(name, GL_TEXTURE_WRAP_S, kWraps[u]);
    gl_.SamplerParameteri(name, GL_TEXTURE_WRAP_T, kWraps[v]);
    gl_.SamplerParameteri(name, GL_TEXTURE_WRAP_R, kWraps[w]);
    gl_.SamplerParameteri(name, GL_TEXTURE_MAG_FILTER, kMagnifications[large]);
    gl_.SamplerParameteri(name, GL_TEXTURE_MIN_FILTER, kMinifications[small]);
    if (anisotropy > 0)
        gl_.SamplerParameterf(name, GL_TEXTURE_MAX_ANISOTROPY, static_cast<float>(std::size_t{1} << anisotropy));
    return name;
}

TextureCache::Found TextureCache::find(const Image& image, ImageUse use) {
    // First: what is drawn must not depend on whether another image of the same pixels is here, with the size they
    // have.
    if (!isShown(image)) return nullptr;
    const Key key = keyOf(image, use);
    const auto known = textures_.find(key);
    const Found& texture = known != textures_.end() ? known->second : upload(image, key);
    clock_.use(texture->uses);
    return texture;
}

bool TextureCache::use(Texture& found) const {
    if (found.gone) return false;
    clock_.use(found.uses);
    return true;
}

std::optional<std::size_t> TextureCache::prepare(const Image& image, ImageUse use) {
    if (!isShown(image)) return 0;
    const Key key = keyOf(image, use);
    if (textures_.contains(key)) return 0;
    if (bytes_ + bytesOf(image, use) > budgetBytes_) return std::nullopt;
    Texture& texture = *upload(image, key);
    texture.uses.lastDraw = clock_.draw();
    return texture.bytes;
}

const TextureCache::Found& TextureCache::upload(const Image& image, const Key& key) {
    const GLenum target = textureTarget(image);
    const bool compressed = isCompressed(image.encoding), asBlocks = readsBlocks(image, key.use),
               asFloats = image.encoding == Image::kRgbe;
    const GLenum format = formatOf(asBlocks || asFloats ? image.encoding : Image::kSrgb, key.use);
    const auto levels = static_cast<GLsizei>(compressed ? image.mipmaps : mostMipmaps(image));
    const auto widthPx = static_cast<GLsizei>(image.widthPx), heightPx = static_cast<GLsizei>(image.heightPx);
    Texture texture{.bytes = bytesOf(image, key.use), .uses = UseClock::recall(gone_, key)};
    gl_.CreateTextures(target, 1, &texture.name);
    if (target == GL_TEXTURE_3D)
        gl_.TextureStorage3D(texture.name, levels, format, widthPx, heightPx, static_cast<GLsizei>(image.depthPx));
    else
        gl_.TextureStorage2D(texture.name, levels, format, widthPx, heightPx);
    const std::vector<ImageLevel> given = levelsOf(image);
    for (std::size_t i = 0; i < given.size(); ++i) {
        const ImageLevel& level = given[i];
        const auto w = static_cast<GLsizei>(level.widthPx), h = static_cast<GLsizei>(level.heightPx),
                   d = static_cast<GLsizei>(level.depthPx);
        const auto at = static_cast<GLint>(i);
        const ByteSpan bytes = image.pixels.bytes().subspan(level.offset, level.sizeBytes);
        if (asBlocks) {
            const auto size = static_cast<GLsizei>(level.sizeBytes);
            if (target == GL_TEXTURE_2D)
                gl_.CompressedTextureSubImage2D(texture.name, at, 0, 0, w, h, format, size, bytes.data());
            else
                gl_.CompressedTextureSubImage3D(texture.name, at, 0, 0, 0, w, h, d, format, size, bytes.data());
            continue;
        }
        for (GLsizei slice = 0; slice < d; ++slice) {
            ByteSpan pixels = bytes.subspan(static_cast<std::size_t>(slice) * level.sliceBytes, level.sliceBytes);
            Bytes decoded;
            if (compressed) pixels = decoded = decodeBlocks(pixels, image.encoding, level.widthPx, level.heightPx);
            std::vector<float> floats;
            if (asFloats) pixels = std::as_bytes(std::span(floats = floatsOf(pixels)));
            const GLenum type = asFloats ? GL_FLOAT : GL_UNSIGNED_BYTE;
            if (target == GL_TEXTURE_2D)
                gl_.TextureSubImage2D(texture.name, at, 0, 0, w, h, GL_RGBA, type, pixels.data());
            else
                gl_.TextureSubImage3D(texture.name, at, 0, 0, slice, w, h, 1, GL_RGBA, type, pixels.data());
        }
    }
    if (!compressed) gl_.GenerateTextureMipmap(texture.name);
    if (asBlocks && image.encoding == Image::kBc4)
        for (const auto channel : {GLenum{GL_TEXTURE_SWIZZLE_G}, GLenum{GL_TEXTURE_SWIZZLE_B}})
            gl_.TextureParameteri(texture.name, channel, GL_RED);
    bytes_ += texture.bytes;
    uploadedBytes_ += texture.bytes;
    return textures_.emplace(key, std::make_shared<Texture>(texture)).first->second;
}

}  // namespace tessera
