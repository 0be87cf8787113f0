/// Shader programs and the layouts that they share with C++.
#pragma once

#include <array>
#include <string>

#include "client/draw/GlFunctions.h"

namespace tessera {

/// One drawn item, as instanced vertex attributes: found by the draw call's base instance, cheaper on a software
/// rasteriser than a storage buffer.
struct DrawRecord {
    std::array<std::array<float, 4>, 3> eye_T_item;  ///< rows
    /// Rows of the inverse transpose of eye_T_item's linear part, up to a positive factor; the fourth column holds
    /// roughness, metallic, and 1 for "shade by the face".
    std::array<std::array<float, 4>, 3> normalRows;
    std::array<float, 4> baseColor;
    std::array<float, 4> emissive;           ///< w unused
    std::array<std::uint32_t, 2> node{};     ///< low and high word of the id
};
static_assert(sizeof(DrawRecord) == 136);

/// What all items of one draw share; std140.
struct FrameBlock {
    struct Light {
        std::array<float, 4> place;     ///< eye space, metres: position and 1, or direction towards the light and 0
        std::array<float, 4> radiance;  ///< rgb at one metre; w: 1 / range in metres, 0 for unlimited
    };
    std::array<float, 16> clip_T_eye;               ///< columns
    std::array<std::array<float, 4>, 3> world_R_eye;  ///< rows
    std::array<float, 4> sky, ground;               ///< w unused
    std::array<Light, 16> lights;
};
static_assert(sizeof(FrameBlock) == 64 + 48 + 32 + 16 * 32);

enum class ProgramKind { kLit, kLitTextured, kNodeIds };

/// One linked program; destroyed with the renderer, on the surface's thread.
class Program {
public:
    /// The number of lights is part of the program: an index that is not a constant costs a software rasteriser a read per
    /// lane. Of no matter for node ids.
    [[nodiscard]] static Expected<Program> create(const GlFunctions& gl, ProgramKind kind, std::size_t lightCount);
    ~Program();
    Program(Program&& other) noexcept;
    Program& operator=(Program&&) = delete;

    [[nodiscard]] GLuint name() const { return name_; }

private:
    Program(PFNGLDELETEPROGRAMPROC destroy, GLuint name) : destroy_(destroy), name_(name) {}

    PFNGLDELETEPROGRAMPROC destroy_;
    GLuint name_;
};

}  // namespace tessera
