#include "client/draw/store/EnvironmentTexture.h"

#include <algorithm>
#include <utility>

#include "client/draw/store/BlockPixels.h"
#include "common/cores/Image.h"
#include "common/drawable/ImageLayout.h"

namespace tessera {
namespace {

/// A show that fades between two surroundings does not compute them again and again.
constexpr std::size_t kKept = 3;

}  // namespace

EnvironmentTexture::EnvironmentTexture(GlState& gl) : gl_(gl) {
    // There from the start, and small: programs are compiled for the format that is bound, and for sides that are no
    // powers of two.
    makeTexture(3, 3);
    gl_.CreateSamplers(1, &sampler_);
    for (const GLenum wrap : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T})
        gl_.SamplerParameteri(sampler_, wrap, GL_CLAMP_TO_EDGE);
    for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
        gl_.SamplerParameteri(sampler_, filter, GL_LINEAR);
}

EnvironmentTexture::~EnvironmentTexture() {
    gl_.DeleteTextures(1, &texture_);
    gl_.DeleteSamplers(1, &sampler_);
}

void EnvironmentTexture::makeTexture(int widthPx, int heightPx) {
    if (texture_) gl_.DeleteTextures(1, &texture_);
    gl_.CreateTextures(GL_TEXTURE_2D, 1, &texture_);
    gl_.TextureStorage2D(texture_, 1, GL_RGBA16F, widthPx, heightPx);
    widthPx_ = widthPx;
}

Expected<EnvironmentLight> EnvironmentTexture::lightOf(const Image& image) const {
    if (!isCompressed(image.encoding)) return EnvironmentLight::of(image);
    if (Expected<void> sound = EnvironmentLight::check(image); !sound) return tl::unexpected(sound.error());
    return EnvironmentLight::of(decompressed(image));
}

SurroundingsPicture EnvironmentTexture::decompressed(const Image& image) const {
    const bool cube = image.shape == Image::kCube, linear = image.encoding == Image::kBc6h;
    const std::vector<ImageLevel> levels = levelsOf(image);
    const auto small = std::find_if(levels.begin(), levels.end(),
                                    [cube](const ImageLevel& level) { return level.widthPx <= (cube ? 512 : 1024); });
    const ImageLevel& level = small == levels.end() ? levels.back() : *small;
    SurroundingsPicture out{.cube = cube,
                            .width = static_cast<std::size_t>(level.widthPx),
                            .height = static_cast<std::size_t>(level.heightPx),
                            .pixels = {}};
    const std::size_t facePixels = out.width * out.height;
    out.pixels.resize(facePixels * static_cast<std::size_t>(level.depthPx));
    for (std::size_t face = 0; face < static_cast<std::size_t>(level.depthPx); ++face) {
        const ByteSpan blocks = image.pixels.bytes().subspan(level.offset + face * level.sliceBytes, level.sliceBytes);
        Vec3f* to = out.pixels.data() + face * facePixels;
        if (image.encoding != Image::kBc6h && image.encoding != Image::kBc7) {
            const Bytes pixels = decodeBlocks(blocks, image.encoding, level.widthPx, level.heightPx);
            for (std::size_t i = 0; i < facePixels; ++i)
                for (std::size_t c = 0; c < 3; ++c)
                    to[i][static_cast<Eigen::Index>(c)] =
                        static_cast<float>(std::to_integer<int>(pixels[4 * i + c])) / 255.0f;
        } else {
            const GLenum format =
                linear ? GLenum{GL_COMPRESSED_RGB_BPTC_UNSIGNED_FLOAT} : GLenum{GL_COMPRESSED_RGBA_BPTC_UNORM};
            const auto w = static_cast<GLsizei>(level.widthPx), h = static_cast<GLsizei>(level.heightPx);
            GLuint texture = 0;
            gl_.CreateTextures(GL_TEXTURE_2D, 1, &texture);
            gl_.TextureStorage2D(texture, 1, format, w, h);
            gl_.CompressedTextureSubImage2D(texture, 0, 0, 0, w, h, format, static_cast<GLsizei>(blocks.size()),
                                            blocks.data());
            gl_.GetTextureImage(texture, 0, GL_RGB, GL_FLOAT, static_cast<GLsizei>(facePixels * sizeof(Vec3f)), to);
            gl_.DeleteTextures(1, &texture);
        }
    }
    // A bc6h has infinities, and half floats an end.
    constexpr float kLargestHalf = 60000;
    for (Vec3f& pixel : out.pixels)
        for (float& value : pixel)
            value = linear ? (value <= kLargestHalf ? value : kLargestHalf)
                           : static_cast<float>(linearOfSrgb<double>(value));
    while (out.width > (cube ? 512u : 1024u) && out.height > 1) out.halve();
    return out;
}

const EnvironmentTexture::Known& EnvironmentTexture::know(const Image& image) {
    const auto it = std::find_if(known_.begin(), known_.end(), [&](const auto& known) {
        return known->pixels == image.pixels.id() && known->widthPx == image.widthPx &&
               known->encoding == image.encoding && known->shape == image.shape && known->mipmaps == image.mipmaps;
    });
    std::unique_ptr<Known> found;
    if (it != known_.end()) {
        found = std::move(*it);
        known_.erase(it);
    } else {
        found = std::make_unique<Known>(
            Known{image.pixels.id(), image.widthPx, image.encoding, image.shape, image.mipmaps, lightOf(image)});
    }
    known_.push_front(std::move(found));
    if (known_.size() > kKept) {
        if (known_.back().get() == uploaded_) uploaded_ = nullptr;
        known_.pop_back();
    }
    return *known_.front();
}

bool EnvironmentTexture::begin(const Aspect& aspect, const Environment& environment) {
    trouble_.clear();
    block_ = {};
    if (!environment.image) return false;
    const auto* image = aspect.get<Image>(environment.image);
    if (!image || !image->pixels.resident()) {
        trouble_ = "the surroundings' image is not here";
        return false;
    }
    const Known& known = know(*image);
    if (!known.light) {
        trouble_ = known.light.error().message;
        return false;
    }
    if (widthPx_ != EnvironmentLight::kAtlasWidth)
        makeTexture(EnvironmentLight::kAtlasWidth, EnvironmentLight::kAtlasHeight);
    if (uploaded_ != &known)
        gl_.TextureSubImage2D(texture_, 0, 0, 0, EnvironmentLight::kAtlasWidth, EnvironmentLight::kAtlasHeight, GL_RGBA,
                              GL_FLOAT, known.light->atlas().data());
    uploaded_ = &known;
    for (std::size_t i = 0; i < block_.size(); ++i) {
        const Vec3f value = known.light->harmonics()[i] * environment.strength;
        block_[i] = {value.x(), value.y(), value.z(), 0};
    }
    block_[0][3] = environment.strength;
    block_[1][3] = environment.showImage ? 1.0f : 0.0f;
    return true;
}

void EnvironmentTexture::bind(GLuint unit) const {
    gl_.BindTextureUnit(unit, texture_);
    gl_.BindSampler(unit, sampler_);
}

}  // namespace tessera
