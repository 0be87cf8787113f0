/// Handles on the wall that move what they belong to.
#pragma once

#include "common/cores/ShippedTypes.h"
#include "common/field/Field.h"

namespace tessera {

/// Drawn at its target's place. Who drags a handle by pick rays edits the target: OpenSG's three, and those of Open Inventor.
struct Manipulator {
    static constexpr ObjectType kType{36};
    static constexpr std::int64_t kMove = 0, kRotate = 1, kScale = 2, kTrackball = 3, kCenterball = 4, kTabBox = 5, kJack = 6, kTransformer = 7,
                                  kPointLight = 8, kDirectionalLight = 9, kSpotLight = 10;
    ObjectId target;  ///< a Node whose core is a Transform or ComponentTransform; of lights one whose core is that light
    std::int64_t kind = kMove;
    double size = 0;   ///< of the handles, in world units; 0: as large as what they belong to
    double snap = 0;   ///< steps of moves in world units, of turns in radians, of factors; 0: none
    bool world = false;  ///< moves along the world's axes, not the target's own
    std::int64_t held = 0;  ///< written by the server: which handle somebody drags; 0: none
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
                         {Manipulator::kSpotLight, "spot-light"}})
                 .affects(Effect::kTime),
             field<&T::size>(3, "size").unit(Unit::kWorld).between(0, 1e30).affects(Effect::kTime),
             field<&T::snap>(4, "snap").between(0, 1e30).affects(Effect::kTime),
             field<&T::world>(5, "world").affects(Effect::kTime),
             field<&T::held>(6, "held").between(0, 255).affects(Effect::kTime));
};

}  // namespace tessera
