#include "client/draw/TextureCache.h"

#include <algorithm>
#include <bit>
#include <utility>
#include <vector>

namespace tessera {
namespace {

constexpr std::int64_t kMaxTextureSidePx = 16384;

bool hasItsSize(const Image& image) {
    // Shared exponents are for surroundings.
    return image.encoding == Image::kSrgb && image.pixels.resident() && image.widthPx > 0 && image.heightPx > 0 && image.widthPx <= kMaxTextureSidePx &&
           image.heightPx <= kMaxTextureSidePx &&
           image.pixels.sizeBytes() == static_cast<std::uint64_t>(image.widthPx * image.heightPx) * 4;
}

/// With its mipmaps.
std::size_t bytesOf(const Image& image) {
    return image.pixels.sizeBytes() / 3 * 4;
}

}  // namespace

TextureCache::~TextureCache() {
    for (const auto& [key, texture] : textures_) gl_.DeleteTextures(1, &texture.name);
    for (const GLuint sampler : samplers_)
        if (sampler) gl_.DeleteSamplers(1, &sampler);
}

void TextureCache::beginDraw() {
    clock_.beginDraw();
    if (bytes_ <= budgetBytes_) return;
    for (const auto& candidate : clock_.lastNeededFirst(textures_)) {
        if (bytes_ <= UseClock::roomFor(candidate, budgetBytes_)) return;
        const auto it = textures_.find(*candidate.key);
        clock_.remember(gone_, *candidate.key, it->second.uses);
        gl_.DeleteTextures(1, &it->second.name);
        bytes_ -= it->second.bytes;
        textures_.erase(it);
    }
}

GLuint TextureCache::sampler(const Image& image) {
    static constexpr std::array<GLint, 3> kWraps = {GL_REPEAT, GL_CLAMP_TO_EDGE, GL_MIRRORED_REPEAT};
    static constexpr std::array<GLint, 2> kMagnifications = {GL_LINEAR, GL_NEAREST};
    static constexpr std::array<GLint, 6> kMinifications = {GL_LINEAR_MIPMAP_LINEAR,   GL_NEAREST,
                                                            GL_LINEAR,                 GL_NEAREST_MIPMAP_NEAREST,
                                                            GL_LINEAR_MIPMAP_NEAREST,  GL_NEAREST_MIPMAP_LINEAR};
    // The table of types bounds them.
    const auto u = static_cast<std::size_t>(image.wrapU), v = static_cast<std::size_t>(image.wrapV),
               large = static_cast<std::size_t>(image.magnification), small = static_cast<std::size_t>(image.minification);
    GLuint& name = samplers_[((u * 3 + v) * 2 + large) * 6 + small];
    if (name) return name;
    gl_.CreateSamplers(1, &name);
    gl_.SamplerParameteri(name, GL_TEXTURE_WRAP_S, kWraps[u]);
    gl_.SamplerParameteri(name, GL_TEXTURE_WRAP_T, kWraps[v]);
    gl_.SamplerParameteri(name, GL_TEXTURE_MAG_FILTER, kMagnifications[large]);
    gl_.SamplerParameteri(name, GL_TEXTURE_MIN_FILTER, kMinifications[small]);
    return name;
}

GLuint TextureCache::find(const Image& image, ImageUse use) {
    // First: what is drawn must not depend on whether another image of the same pixels is here, with the size they have.
    if (!hasItsSize(image)) return 0;
    const Key key = keyOf(image, use);
    const auto known = textures_.find(key);
    Texture& texture = known != textures_.end() ? known->second : upload(image, key);
    clock_.use(texture.uses);
    return texture.name;
}

std::optional<std::size_t> TextureCache::prepare(const Image& image, ImageUse use) {
    if (!hasItsSize(image)) return 0;
    const Key key = keyOf(image, use);
    if (textures_.contains(key)) return 0;
    if (bytes_ + bytesOf(image) > budgetBytes_) return std::nullopt;
    Texture& texture = upload(image, key);
    texture.uses.lastDraw = clock_.draw();
    return texture.bytes;
}

TextureCache::Texture& TextureCache::upload(const Image& image, const Key& key) {
    const auto widthPx = static_cast<GLsizei>(image.widthPx);
    const auto heightPx = static_cast<GLsizei>(image.heightPx);
    const auto levels = static_cast<GLsizei>(std::bit_width(static_cast<unsigned>(std::max(widthPx, heightPx))));
    Texture texture{.bytes = bytesOf(image), .uses = UseClock::recall(gone_, key)};
    gl_.CreateTextures(GL_TEXTURE_2D, 1, &texture.name);
    gl_.TextureStorage2D(texture.name, levels, key.use == ImageUse::kColor ? GL_SRGB8_ALPHA8 : GL_RGBA8, widthPx, heightPx);
    gl_.TextureSubImage2D(texture.name, 0, 0, 0, widthPx, heightPx, GL_RGBA, GL_UNSIGNED_BYTE,
                          image.pixels.bytes().data());
    gl_.GenerateTextureMipmap(texture.name);
    bytes_ += texture.bytes;
    uploadedBytes_ += texture.bytes;
    return textures_.emplace(key, texture).first->second;
}

}  // namespace tessera
