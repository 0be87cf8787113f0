/// What a Material may have beside its own fields: further images one over the other, and a person's own program with
/// its uniforms.
#pragma once

#include "common/cores/ShippedTypes.h"
#include "common/field/Field.h"

namespace tessera {

/// One image more, over the base colour so far (which is baseColor, its image and the vertex colours).
struct TextureLayer {
    static constexpr ObjectType kType{32};
    static constexpr std::int64_t kModulate = 0, kAdd = 1, kDecal = 2, kReplace = 3;
    static constexpr std::int64_t kTexcoords = 0, kSphere = 1, kReflection = 2, kPosition = 3;
    ObjectId image;
    std::int64_t mode = kModulate;  ///< kDecal: by the image's alpha
    float strength = 1;             ///< from the base colour so far to what the mode makes of it
    /// Where on the image: kSphere by the normal as the eye sees it (a sphere map), kReflection by the reflected view
    /// in the world (a cube, or all around), kPosition by the place in the node's coordinates (3D; of a flat image x
    /// and y).
    std::int64_t source = kTexcoords;
};
template <>
inline constexpr auto kSaid<TextureLayer> = []<typename T>(Describing<T>) {
    return describe("TextureLayer", field<&T::image>(1, "image").to(typeOf<Image>()).affects(Effect::kLook),
                    field<&T::mode>(2, "mode")
                        .oneOf({{TextureLayer::kModulate, "modulate"},
                                {TextureLayer::kAdd, "add"},
                                {TextureLayer::kDecal, "decal"},
                                {TextureLayer::kReplace, "replace"}})
                        .affects(Effect::kLook),
                    field<&T::strength>(3, "strength").between(0, 1).affects(Effect::kLook),
                    field<&T::source>(4, "source")
                        .oneOf({{TextureLayer::kTexcoords, "texcoords"},
                                {TextureLayer::kSphere, "sphere"},
                                {TextureLayer::kReflection, "reflection"},
                                {TextureLayer::kPosition, "position"}})
                        .affects(Effect::kLook))
        .notACore();
};

/// GLSL of a person. The server tries it in a process of its own before any host compiles it.
struct SurfaceProgram {
    static constexpr ObjectType kType{33};
    static constexpr std::int64_t kUntried = 0, kGood = 1, kBad = 2, kHeavy = 3;
    std::string
        surface;  ///< `void surface(inout Surface s)`, after what the material's fields and images say; empty: nothing
    std::string
        vertex;  ///< `void vertex(inout vec3 position, inout vec3 normal)`, in the node's coordinates; empty: nothing
    double reach =
        0;  ///< how far, at most, `vertex` moves a position, in the node's coordinates: boxes are grown by it
    // Written by the server. kHeavy: it is good, and has held a host up; materials are drawn without it, until a text
    // of it is said again.
    std::int64_t verdict = kUntried;
    std::string problem;  ///< of kBad: which line, and what is wrong with it; of kHeavy: which host, and for how long
};
template <>
inline constexpr auto kSaid<SurfaceProgram> = []<typename T>(Describing<T>) {
    return describe("SurfaceProgram", field<&T::surface>(1, "surface").affects(Effect::kLook | Effect::kTime),
                    field<&T::vertex>(2, "vertex").affects(Effect::kLook | Effect::kTime),
                    field<&T::reach>(3, "reach").unit(Unit::kWorld).between(0, 1e30).affects(Effect::kLook),
                    field<&T::verdict>(4, "verdict")
                        .oneOf({{SurfaceProgram::kUntried, "untried"},
                                {SurfaceProgram::kGood, "good"},
                                {SurfaceProgram::kBad, "bad"},
                                {SurfaceProgram::kHeavy, "heavy"}})
                        .affects(Effect::kLook),
                    field<&T::problem>(5, "problem").affects(Effect::kTime))
        .notACore();
};

/// A number, or an image, that a program asks for by name.
struct Uniform {
    static constexpr ObjectType kType{34};
    std::string name;
    Vec4f value = Vec4f::Zero();  ///< a float, vec2, vec3 or vec4, as the program declares it
    ObjectId image;               ///< of a sampler2D
};
template <>
inline constexpr auto kSaid<Uniform> = []<typename T>(Describing<T>) {
    return describe("Uniform", field<&T::name>(1, "name").affects(Effect::kLook),
                    field<&T::value>(2, "value").affects(Effect::kLook),
                    field<&T::image>(3, "image").to(typeOf<Image>()).affects(Effect::kLook))
        .notACore();
};

}  // namespace tessera
