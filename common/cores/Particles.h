/// Many small things.
#pragma once

#include "common/cores/ShippedTypes.h"
#include "common/field/Field.h"

namespace tessera {

/// Sparks, smoke, rain, streams of a flow. Each particle has a place and, where arrays say so, a size, a colour, an
/// age. Nobody collides with them and no ray meets them.
struct Particles {
    static constexpr ObjectType kType{30};
    static constexpr std::int64_t kPoints = 0, kLines = 1, kQuads = 2;
    Blob positions;  ///< float[3] per particle
    /// float[3] per particle: of kLines where each line begins, which ends at its position. With other modes it says
    /// nothing. Of kLines not empty.
    Blob tails;
    Blob colors;  ///< uint8[4] per particle, sRGB + alpha, multiplied with the material; empty: white
    Blob sizes;   ///< float per particle, in the node's coordinates: diameters of points, sides of quads; of lines
                  ///< pixels. Empty: `size`
    Blob ages;    ///< float per particle, 0 at birth to 1 at its end; outside of that it is not shown. Empty: all 0
    Blob turns;   ///< float per particle, of quads: radians, counter-clockwise as the user sees it. Empty: 0
    /// Over a particle's life, evenly spaced, linear in between: uint8[4] each, sRGB + alpha, and float each;
    /// multiplied with its own.
    Blob ageColors, ageSizes;
    /// kPoints: balls, round on the screen, as far away as their middle. kQuads: squares that face the head of the user
    /// who looks, the same for both eyes and on all screens; with the material's images.
    std::int64_t mode = kPoints;
    double size = 0.01;
    bool sorted = true;  ///< drawn from back to front; false: as the arrays have them
    ObjectId material;
};
template <>
inline constexpr auto kSaid<Particles> = []<typename T>(Describing<T>) {
    return describe(
        "Particles", field<&T::positions>(1, "positions").floats(3).affects(Effect::kShape),
        field<&T::tails>(2, "tails").floats(3).affects(Effect::kShape),
        field<&T::colors>(3, "colors").integers(4, 1).affects(Effect::kLook),
        field<&T::sizes>(4, "sizes").floats(1).affects(Effect::kShape),
        field<&T::ages>(5, "ages").floats(1).affects(Effect::kShape),
        field<&T::turns>(6, "turns").floats(1).affects(Effect::kShape),
        field<&T::ageColors>(7, "ageColors").integers(4, 1).affects(Effect::kLook),
        field<&T::ageSizes>(8, "ageSizes").floats(1).affects(Effect::kShape),
        field<&T::mode>(9, "mode")
            .oneOf({{Particles::kPoints, "points"}, {Particles::kLines, "lines"}, {Particles::kQuads, "quads"}})
            .affects(Effect::kShape),
        field<&T::size>(10, "size").between(0, 1e12).affects(Effect::kShape),
        field<&T::sorted>(11, "sorted").affects(Effect::kLook),
        field<&T::material>(12, "material").to(typeOf<Material>()).affects(Effect::kLook));
};

}  // namespace tessera
