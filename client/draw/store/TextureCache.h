/// Images as GL textures with mipmaps, found by content.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include "client/draw/store/UseClock.h"
#include "client/draw/surface/GlFunctions.h"
#include "common/cores/Image.h"
#include "common/drawable/ImageLayout.h"

namespace tessera {

/// The GL target that an image's texture is of, by its shape alone: GL_TEXTURE_2D of flat ones and of lines (one row:
/// look it up at v = 0.5), GL_TEXTURE_3D of solids, GL_TEXTURE_CUBE_MAP of cubes.
[[nodiscard]] GLenum textureTarget(const Image& image);

/// What the bytes of an image are.
enum class ImageUse : std::uint8_t {
    kColor,    ///< sRGB, decoded on reading
    kNumbers,  ///< linear
};

/// Textures make room as SharedBudget says; what one draw needs is never dropped in it.
class TextureCache {
public:
    /// The surface must be current. Without a budget, at first. The clock is all stores'. `anisotropy`: so many samples
    /// at most, 1 to 16, where an image is seen at a grazing angle; a draw may want fewer. As many as GL has.
    TextureCache(const GlFunctions& gl, const UseClock& clock, int anisotropy);
    ~TextureCache();
    TextureCache(const TextureCache&) = delete;
    TextureCache& operator=(const TextureCache&) = delete;

    struct Texture {
        GLuint name = 0;
        std::size_t bytes = 0;
        UseClock::Uses uses;
        bool gone = false;  ///< it has given way
    };
    using Found = std::shared_ptr<Texture>;

    /// Of the draw that has begun: see `sampler`.
    void limitAnisotropy(int most);
    /// A texture of textureTarget(image). Null: the image's bytes are absent or do not have its size, or they have
    /// shared exponents; what it belongs to is then drawn as if it had none. bc4 is grey, bc5 a normal map of two
    /// channels (BlockPixels.h).
    [[nodiscard]] Found find(const Image& image, ImageUse use);
    /// What an earlier draw has found is needed in this one too. False: it has given way, and is to be found again.
    [[nodiscard]] bool use(Texture& found) const;
    /// Uploads ahead of need, whole. Throws nothing out. What was uploaded: 0 when it is there, or cannot be; nothing:
    /// the budget has no room for it.
    [[nodiscard]] std::optional<std::size_t> prepare(const Image& image, ImageUse use);
    /// How an image wants to be read: wrapping and filters.
    using SamplerKey = std::uint16_t;
    [[nodiscard]] static SamplerKey samplerOf(const Image& image);
    /// Of such images in the draw that has begun: flat ones that want the smoothest filters are read anisotropically.
    [[nodiscard]] GLuint sampler(SamplerKey key);

    void addSpares(std::vector<UseClock::Spare>& spares);
    [[nodiscard]] std::size_t residentBytes() const { return bytes_; }
    /// That `prepare` keeps to.
    void setBudget(std::size_t bytes) { budgetBytes_ = bytes; }
    /// Given to GL since this began, with mipmaps.
    [[nodiscard]] std::uint64_t uploadedBytes() const { return uploadedBytes_; }

private:
    struct Key {
        BlobId pixels;
        std::int64_t widthPx = 0, heightPx = 0, depthPx = 1, encoding = Image::kSrgb, shape = Image::kFlat, mipmaps = 1;
        ImageUse use = ImageUse::kColor;
        bool operator==(const Key&) const = default;
    };
    struct KeyHash {
        std::size_t operator()(const Key& key) const {
            return std::hash<BlobId>{}(key.pixels) ^ static_cast<std::size_t>(2 * key.widthPx) ^
                   static_cast<std::size_t>(key.encoding << 20) ^ static_cast<std::size_t>(key.shape << 24) ^
                   static_cast<std::size_t>(key.use);
        }
    };

    const GlFunctions& gl_;
    const UseClock& clock_;
    std::size_t budgetBytes_ = ~std::size_t{0};
    std::size_t bytes_ = 0;
    std::unordered_map<Key, Found, KeyHash> textures_;
    bool readsS3tc_ = false;
    GLint mostFlatPx_ = 0, mostSolidPx_ = 0, mostCubePx_ = 0;           ///< a side
    static constexpr std::size_t kAnisotropies = 5;                     ///< 1, 2, 4, 8, 16
    std::array<GLuint, 3 * 3 * 3 * 2 * 6 * kAnisotropies> samplers_{};  ///< made when first needed
    std::size_t anisotropy_ = 0;                                        ///< which of them
    int anisotropyHere_ = 1;
    [[nodiscard]] static Key keyOf(const Image& image, ImageUse use) {
        return {.pixels = image.pixels.id(),
                .widthPx = image.widthPx,
                .heightPx = image.heightPx,
                .depthPx = image.depthPx,
                .encoding = image.encoding,
                .shape = image.shape,
                .mipmaps = image.mipmaps,
                .use = use};
    }
    /// Whether GL takes its blocks as they are.
    [[nodiscard]] bool readsBlocks(const Image& image, ImageUse use) const;
    [[nodiscard]] std::size_t bytesOf(const Image& image, ImageUse use) const;
    [[nodiscard]] bool isShown(const Image& image) const;
    const Found& upload(const Image& image, const Key& key);

    std::unordered_map<Key, UseClock::Uses, KeyHash> gone_;
    std::uint64_t uploadedBytes_ = 0;
};

}  // namespace tessera
