/// Letters.
#pragma once

#include "common/cores/ShippedTypes.h"
#include "common/field/Field.h"

namespace tessera {

/// Text in the node's XY plane, read from +Z, its first line's baseline along +X from the origin. The server sets it in
/// its own fonts and writes `outlines`; hosts draw those, so they need no font.
struct Text {
    static constexpr ObjectType kType{27};
    static constexpr std::int64_t kLeft = 0, kCenter = 1, kRight = 2;
    std::string text;  ///< UTF-8; lines end at '\n'
    std::string font =
        "sans";                ///< a family, as fontconfig finds it, and what it says of weight and slant: "serif:bold"
    double size = 1;           ///< of the em square, in the node's coordinates
    double depth = 0;          ///< of solid letters, from 0 to -depth along Z; 0: flat, seen from both sides
    double lineSpacing = 1.2;  ///< from baseline to baseline, in ems
    std::int64_t alignment = kLeft;  ///< of each line at the origin
    ObjectId material;               ///< a Material; none: the default material
    /// What the server has made of the fields above: closed curves (`common/geometry` says how they lie in it). Not
    /// written by hand.
    Blob outlines;
    double screenError = 0.5;  ///< pixels that curves may be off on a screen
};
template <>
inline constexpr auto kSaid<Text> = []<typename T>(Describing<T>) {
    return describe("Text", field<&T::text>(1, "text").affects(Effect::kTime),
                    field<&T::font>(2, "font").affects(Effect::kTime),
                    field<&T::size>(3, "size").between(1e-30, 1e30).affects(Effect::kShape),
                    field<&T::depth>(4, "depth").between(0, 1e30).affects(Effect::kShape),
                    field<&T::lineSpacing>(5, "lineSpacing").between(-1e3, 1e3).affects(Effect::kTime),
                    field<&T::alignment>(6, "alignment")
                        .oneOf({{Text::kLeft, "left"}, {Text::kCenter, "center"}, {Text::kRight, "right"}})
                        .affects(Effect::kTime),
                    field<&T::material>(7, "material").to(typeOf<Material>()).affects(Effect::kLook),
                    field<&T::outlines>(8, "outlines").affects(Effect::kShape),
                    field<&T::screenError>(9, "screenError").unit(Unit::kPixel).between(0, 1e6).affects(Effect::kLook));
};

}  // namespace tessera
