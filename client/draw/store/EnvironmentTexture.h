/// The surroundings' light, where shaders read it.
#pragma once

#include <array>
#include <deque>
#include <memory>
#include <string>

#include "client/draw/store/EnvironmentLight.h"
#include "client/draw/surface/GlState.h"
#include "common/scene/Aspect.h"

namespace tessera {

/// What FrameBlock says of them: EnvironmentLight's harmonics times the strength; w of the first is the strength, of
/// the second 1 where the picture is seen behind everything.
using SurroundingsBlock = std::array<std::array<float, 4>, 9>;

/// Keeps what it made of the last pictures. Belongs to the surface's thread.
class EnvironmentTexture {
public:
    explicit EnvironmentTexture(GlState& gl);
    /// The surface is current, or gone.
    ~EnvironmentTexture();
    EnvironmentTexture(const EnvironmentTexture&) = delete;
    EnvironmentTexture& operator=(const EnvironmentTexture&) = delete;

    /// For a frame. False: there is no image, or none that can be used; `trouble` says why. A picture that is new here
    /// takes some tenths of a second.
    [[nodiscard]] bool begin(const Aspect& aspect, const Environment& environment);
    [[nodiscard]] const SurroundingsBlock& block() const { return block_; }
    /// Whether the picture is seen behind everything.
    [[nodiscard]] bool seen() const { return block_[1][3] > 0; }
    [[nodiscard]] const std::string& trouble() const { return trouble_; }
    void bind(GLuint unit) const;

private:
    struct Known {
        BlobId pixels;
        std::int64_t widthPx, encoding, shape, mipmaps;
        Expected<EnvironmentLight> light;
    };
    [[nodiscard]] const Known& know(const Image& image);
    [[nodiscard]] Expected<EnvironmentLight> lightOf(const Image& image) const;
    /// By GL, as it would be seen on a surface: a level of at most 1024 pixels around, where there is one.
    [[nodiscard]] SurroundingsPicture decompressed(const Image& image) const;
    void makeTexture(int widthPx, int heightPx);

    GlState& gl_;
    GLuint texture_ = 0, sampler_ = 0;
    int widthPx_ = 0;                           ///< of the texture
    std::deque<std::unique_ptr<Known>> known_;  ///< the last one used first
    const Known* uploaded_ = nullptr;
    SurroundingsBlock block_{};
    std::string trouble_;
};

}  // namespace tessera
