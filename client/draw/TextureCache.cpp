#include "client/draw/TextureCache.h"

#include <algorithm>
#include <bit>

namespace tessera {
namespace {

constexpr std::int64_t kMaxTextureSidePx = 16384;

bool hasItsSize(const Image& image) {
    return image.pixels.resident() && image.widthPx > 0 && image.heightPx > 0 && image.widthPx <= kMaxTextureSidePx &&
           image.heightPx <= kMaxTextureSidePx &&
           image.pixels.sizeBytes() == static_cast<std::uint64_t>(image.widthPx * image.heightPx) * 4;
}

}  // namespace

TextureCache::~TextureCache() {
    for (const auto& [key, texture] : textures_) gl_.DeleteTextures(1, &texture.name);
}

void TextureCache::beginDraw() {
    if (bytes_ > budgetBytes_) {
        std::erase_if(textures_, [&](const auto& item) {
            if (item.second.lastDraw == draw_) return false;
            gl_.DeleteTextures(1, &item.second.name);
            bytes_ -= item.second.bytes;
            return true;
        });
    }
    ++draw_;
}

GLuint TextureCache::find(const Image& image) {
    const Key key{.pixels = image.pixels.id(), .widthPx = image.widthPx};
    if (const auto it = textures_.find(key); it != textures_.end()) {
        it->second.lastDraw = draw_;
        return it->second.name;
    }
    if (!hasItsSize(image)) return 0;
    const auto widthPx = static_cast<GLsizei>(image.widthPx);
    const auto heightPx = static_cast<GLsizei>(image.heightPx);
    const auto levels = static_cast<GLsizei>(std::bit_width(static_cast<unsigned>(std::max(widthPx, heightPx))));
    Texture texture{.bytes = image.pixels.sizeBytes() / 3 * 4, .lastDraw = draw_};
    gl_.CreateTextures(GL_TEXTURE_2D, 1, &texture.name);
    gl_.TextureStorage2D(texture.name, levels, GL_SRGB8_ALPHA8, widthPx, heightPx);
    gl_.TextureSubImage2D(texture.name, 0, 0, 0, widthPx, heightPx, GL_RGBA, GL_UNSIGNED_BYTE,
                          image.pixels.bytes().data());
    gl_.TextureParameteri(texture.name, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    gl_.TextureParameteri(texture.name, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    gl_.TextureParameteri(texture.name, GL_TEXTURE_WRAP_S, GL_REPEAT);
    gl_.TextureParameteri(texture.name, GL_TEXTURE_WRAP_T, GL_REPEAT);
    gl_.GenerateTextureMipmap(texture.name);
    bytes_ += texture.bytes;
    return textures_.emplace(key, texture).first->second.name;
}

}  // namespace tessera
