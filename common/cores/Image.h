/// Pixels, and how a surface takes them.
#pragma once

#include "common/field/Field.h"

namespace tessera {

/// What glTF calls a texture: an image, a sampler, and KHR_texture_transform. Images of the same pixels share their
/// bytes everywhere, so each place where a picture is used may say on its own how.
struct Image {
    static constexpr ObjectType kType{6};
    static constexpr std::int64_t kRepeat = 0, kClamp = 1, kMirror = 2;
    static constexpr std::int64_t kLinear = 0, kNearest = 1;
    static constexpr std::int64_t kTrilinear = 0, kNearestAlone = 1, kLinearAlone = 2, kNearestOfNearest = 3,
                                  kLinearOfNearest = 4, kNearestOfTwo = 5;
    static constexpr std::int64_t kSrgb = 0, kRgbe = 1, kBc1 = 2, kBc2 = 3, kBc3 = 4, kBc4 = 5, kBc5 = 6, kBc6h = 7,
                                  kBc7 = 8;
    static constexpr std::int64_t kFlat = 0, kLine = 1, kSolid = 2, kCube = 3;
    Blob pixels;  ///< uint8[4] RGBA per pixel, rows from the top; sRGB where a material takes colours from it
    std::int64_t widthPx = 0;
    std::int64_t heightPx = 0;
    std::int64_t wrapU = kRepeat, wrapV = kRepeat;  ///< beyond 0 to 1
    std::int64_t magnification = kLinear;           ///< where a pixel of it covers several of the screen
    std::int64_t minification = kTrilinear;         ///< where several of it lie in one of the screen
    std::int64_t texcoordSet = 0;                   ///< which texture coordinates of a mesh: the first or the second
    /// Texture coordinates are scaled, then turned by `rotation` (radians, counter-clockwise as the image is looked
    /// at), then moved; all around its upper left corner.
    Vec2f offset = Vec2f::Zero(), scale = Vec2f::Ones();
    float rotation = 0;
    /// What `pixels` are. Of rgbe: red, green, blue and the exponent that they share, as Radiance's pictures have them:
    /// linear (c / 256) · 2^(e - 128), 0 where e is 0. Of surroundings, and of materials: up to 65504 there. bc1 to
    /// bc7: blocks of 4×4 pixels, as DirectX and KTX2 name them (bc6h: unsigned), rows of blocks from the top.
    std::int64_t encoding = kSrgb;
    /// kLine: one row, looked up by u alone. kSolid: `depthPx` pictures one behind the other, looked up by a place.
    /// kCube: six squares, as OpenGL orders and turns them (+X, -X, +Y, -Y, +Z, -Z), looked up by a direction. Solids
    /// and cubes are for TextureLayers; cubes for surroundings too.
    std::int64_t shape = kFlat;
    std::int64_t depthPx = 1;
    /// Of compressed ones: so many mipmaps follow each other in `pixels`, each half the one before, of each all its
    /// slices or faces. Of others they are made, and this is 1.
    std::int64_t mipmaps = 1;
    std::int64_t wrapW = kRepeat;  ///< of solids

    static constexpr double kMaxSidePx = 65536;
};
template <>
inline constexpr auto kSaid<Image> = []<typename T>(Describing<T>) {
    return describe(
               "Image", field<&T::pixels>(1, "pixels").affects(Effect::kLook),
               field<&T::widthPx>(2, "widthPx").unit(Unit::kPixel).between(0, Image::kMaxSidePx).affects(Effect::kLook),
               field<&T::heightPx>(3, "heightPx")
                   .unit(Unit::kPixel)
                   .between(0, Image::kMaxSidePx)
                   .affects(Effect::kLook),
               field<&T::wrapU>(4, "wrapU")
                   .oneOf({{Image::kRepeat, "repeat"}, {Image::kClamp, "clamp"}, {Image::kMirror, "mirror"}})
                   .affects(Effect::kLook),
               field<&T::wrapV>(5, "wrapV")
                   .oneOf({{Image::kRepeat, "repeat"}, {Image::kClamp, "clamp"}, {Image::kMirror, "mirror"}})
                   .affects(Effect::kLook),
               field<&T::magnification>(6, "magnification")
                   .oneOf({{Image::kLinear, "linear"}, {Image::kNearest, "nearest"}})
                   .affects(Effect::kLook),
               field<&T::minification>(7, "minification")
                   .oneOf({{Image::kTrilinear, "trilinear"},
                           {Image::kNearestAlone, "nearest"},
                           {Image::kLinearAlone, "linear"},
                           {Image::kNearestOfNearest, "nearest-mipmap-nearest"},
                           {Image::kLinearOfNearest, "linear-mipmap-nearest"},
                           {Image::kNearestOfTwo, "nearest-mipmap-linear"}})
                   .affects(Effect::kLook),
               field<&T::texcoordSet>(8, "texcoordSet").between(0, 1).affects(Effect::kLook),
               field<&T::offset>(9, "offset").between(-1e6, 1e6).affects(Effect::kLook),
               field<&T::scale>(10, "scale").between(-1e6, 1e6).affects(Effect::kLook),
               field<&T::rotation>(11, "rotation").unit(Unit::kRadian).between(-1e6, 1e6).affects(Effect::kLook),
               field<&T::encoding>(12, "encoding")
                   .oneOf({{Image::kSrgb, "srgb"},
                           {Image::kRgbe, "rgbe"},
                           {Image::kBc1, "bc1"},
                           {Image::kBc2, "bc2"},
                           {Image::kBc3, "bc3"},
                           {Image::kBc4, "bc4"},
                           {Image::kBc5, "bc5"},
                           {Image::kBc6h, "bc6h"},
                           {Image::kBc7, "bc7"}})
                   .affects(Effect::kLook),
               field<&T::shape>(13, "shape")
                   .oneOf({{Image::kFlat, "flat"},
                           {Image::kLine, "line"},
                           {Image::kSolid, "solid"},
                           {Image::kCube, "cube"}})
                   .affects(Effect::kLook),
               field<&T::depthPx>(14, "depthPx").unit(Unit::kPixel).between(1, 4096).affects(Effect::kLook),
               field<&T::mipmaps>(15, "mipmaps").between(1, 17).affects(Effect::kLook),
               field<&T::wrapW>(16, "wrapW")
                   .oneOf({{Image::kRepeat, "repeat"}, {Image::kClamp, "clamp"}, {Image::kMirror, "mirror"}})
                   .affects(Effect::kLook))
        .notACore();
};

}  // namespace tessera
