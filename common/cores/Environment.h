/// The surroundings.
#pragma once

#include "common/cores/ShippedTypes.h"
#include "common/field/Field.h"

namespace tessera {

/// Light from everywhere, what is seen where nothing is, and gravity. The first one in document order is used. With an
/// image all light from everywhere is the image's, and sky and ground give none.
struct Environment {
    static constexpr ObjectType kType{12};
    Vec3f sky{0.30f, 0.33f, 0.38f};         ///< ambient radiance from +Y, linear RGB
    Vec3f ground{0.12f, 0.11f, 0.10f};      ///< ambient radiance from -Y
    Vec3f background{0.05f, 0.06f, 0.08f};  ///< linear colour of empty pixels
    Vec3d gravity = Vec3d::Zero();          ///< acceleration of free bodies
    /// A picture of everything around, twice as wide as high (equirectangular): its middle lies along -Z, what is right
    /// of that along +X, its upper edge along +Y. Or six squares, an Image whose shape is a cube. Best of encoding
    /// rgbe; none: sky and ground.
    ObjectId image;
    float strength = 1.0f;   ///< of the image: radiance is what it says times this
    float turn = 0.0f;       ///< of the image about +Y, counter-clockwise seen from above
    bool showImage = false;  ///< where nothing is the image is seen, not `background`

    // From radiance to what a screen shows (client/draw/LIGHT.md). What has no light of its own, `background` and
    // unlit things, is as bright as it says.
    /// In stops: radiance counts 2^exposure times. Where it is metered that is added to what the wall finds.
    float exposure = 0.0f;
    /// The curve that brings what is brighter than white onto a screen. kNeutral: colours up to 0.8 stay what they are;
    /// kClamp: none at all; kReinhard; kAces and kAgx, as films are graded.
    static constexpr std::int64_t kNeutral = 0, kClamp = 1, kReinhard = 2, kAces = 3, kAgx = 4;
    std::int64_t toneMap = kNeutral;
    bool metered = false;  ///< the wall looks how bright the scene is, once for all tiles and eyes
};
template <>
inline constexpr auto kSaid<Environment> = []<typename T>(Describing<T>) {
    return describe(
        "Environment", field<&T::sky>(1, "sky").atLeast(0).affects(Effect::kLight),
        field<&T::ground>(2, "ground").atLeast(0).affects(Effect::kLight),
        field<&T::background>(3, "background").atLeast(0).affects(Effect::kLight),
        field<&T::gravity>(4, "gravity").unit(Unit::kWorldPerSecond2).between(-1e6, 1e6).affects(Effect::kTerms),
        field<&T::image>(5, "image").to(typeOf<Image>()).affects(Effect::kLight),
        field<&T::strength>(6, "strength").between(0, 1e6).affects(Effect::kLight),
        field<&T::turn>(7, "turn").unit(Unit::kRadian).between(-1e6, 1e6).affects(Effect::kLight),
        field<&T::showImage>(8, "showImage").affects(Effect::kLight),
        field<&T::exposure>(9, "exposure").between(-40, 40).affects(Effect::kLight),
        field<&T::toneMap>(10, "toneMap")
            .oneOf({{Environment::kNeutral, "neutral"},
                    {Environment::kClamp, "clamp"},
                    {Environment::kReinhard, "reinhard"},
                    {Environment::kAces, "aces"},
                    {Environment::kAgx, "agx"}})
            .affects(Effect::kLight),
        field<&T::metered>(11, "metered").affects(Effect::kLight));
};

}  // namespace tessera
