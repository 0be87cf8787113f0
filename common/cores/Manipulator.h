/// Handles on the wall that move what they belong to.
#pragma once

#include "common/cores/ShippedTypes.h"
#include "common/field/Field.h"

namespace tessera {

/// Drawn at its target's place. Who drags a handle by pick rays edits the target: OpenSG's three, those of Open
/// Inventor that move, turn or scale (SoTrackball, SoCenterball, SoTabBox, SoJack, SoTransformer, SoHandleBox,
/// SoTransformBox), and its three for lights. A box is scaled about the opposite side, as with Inventor's Ctrl key.
struct Manipulator {
    static constexpr ObjectType kType{36};
    static constexpr std::int64_t kMove = 0, kRotate = 1, kScale = 2, kTrackball = 3, kCenterball = 4, kTabBox = 5,
                                  kJack = 6, kTransformer = 7, kPointLight = 8, kDirectionalLight = 9, kSpotLight = 10,
                                  kHandleBox = 11, kTransformBox = 12;
    /// Of lights: they move the nearest transform at or above their target.
    [[nodiscard]] static constexpr bool isLightKind(std::int64_t kind) {
        return kind >= kPointLight && kind <= kSpotLight;
    }
    ObjectId
        target;  ///< a Node whose core is a Transform or ComponentTransform; of lights one whose core is that light
    std::int64_t kind = kMove;
    double size = 0;  ///< of the handles, in world units; 0: as large as what they belong to. Of boxes: while what they
                      ///< belong to shows nothing
    /// Above 0: the size on the screen instead, the same however far away: of the handles, of a box that of its knobs
    /// and edges. Measured on the finest of a user's screens, as if it stood straight before their head; so each user
    /// sees handles of their own, both eyes and all tiles the same.
    double pixels = 0;
    double snap = 0;        ///< steps of moves in world units, of turns in radians, of factors; 0: none
    bool world = false;     ///< moves along the world's axes, not the target's own
    std::int64_t held = 0;  ///< written by the server: which handle somebody drags; 0: none
    /// Written by the server, of `pixels`: how large in world units users see them, the first eight as Node::levels
    /// counts users; 0 from where there are no more users, and all 0: not known yet, `size` counts. Steps of 1/128
    /// octave.
    Vec4f sizes = Vec4f::Zero(), moreSizes = Vec4f::Zero();
};
template <>
inline constexpr auto kSaid<Manipulator> = []<typename T>(Describing<T>) {
    return describe("Manipulator", field<&T::target>(1, "target").to(typeOf<Node>()).affects(Effect::kTime),
                    field<&T::kind>(2, "kind")
                        .oneOf({{Manipulator::kMove, "move"},
                                {Manipulator::kRotate, "rotate"},
                                {Manipulator::kScale, "scale"},
                                {Manipulator::kTrackball, "trackball"},
                                {Manipulator::kCenterball, "centerball"},
                                {Manipulator::kTabBox, "tab-box"},
                                {Manipulator::kJack, "jack"},
                                {Manipulator::kTransformer, "transformer"},
                                {Manipulator::kPointLight, "point-light"},
                                {Manipulator::kDirectionalLight, "directional-light"},
                                {Manipulator::kSpotLight, "spot-light"},
                                {Manipulator::kHandleBox, "handle-box"},
                                {Manipulator::kTransformBox, "transform-box"}})
                        .affects(Effect::kTime),
                    field<&T::size>(3, "size").unit(Unit::kWorld).between(0, 1e30).affects(Effect::kTime),
                    field<&T::snap>(4, "snap").between(0, 1e30).affects(Effect::kTime),
                    field<&T::world>(5, "world").affects(Effect::kTime),
                    field<&T::held>(6, "held").between(0, 255).affects(Effect::kTime),
                    field<&T::pixels>(7, "pixels").unit(Unit::kPixel).between(0, 1e6).affects(Effect::kTime),
                    field<&T::sizes>(8, "sizes").unit(Unit::kWorld).between(0, 1e30).affects(Effect::kTime),
                    field<&T::moreSizes>(9, "moreSizes").unit(Unit::kWorld).between(0, 1e30).affects(Effect::kTime));
};

}  // namespace tessera
