/// Which collisions matter.
#pragma once

#include "common/cores/CollisionWords.h"
#include "common/cores/ShippedTypes.h"
#include "common/field/Field.h"

namespace tessera {

/// An application's interest in collisions: the objects of one side against those of the other.
///
/// A side is a node: the CollisionObjects at or below it that share a bit with the side's mask. Where there are none,
/// `object` means the node and all below it as one object; `against` (none: the root) takes in all other geometry below
/// it besides, each for itself, as layer 1. What belongs to one object never meets itself.
struct Interest : InterestWords {
    static constexpr ObjectType kType{13};
    ObjectId object;   ///< a node; none: the interest means nothing
    ObjectId against;  ///< a node; none: the root
    /// To a motion that would lead into something. Of several interests in one pair of objects the first in document
    /// order decides.
    std::int64_t response = kStop;
    bool enabled = true;
    /// kStatic: what meets. kPseudoDynamic: that, and what began and ended. kDynamic: that, and the first time of
    /// contact within each frame's motion. kDistance: how far apart. kIgnore: its pairs are of no interest to anybody.
    /// kSelf: what of each geometry of the object's side runs into itself; `against` and the response mean nothing.
    std::int64_t mode = kPseudoDynamic;
    std::int64_t detail = kAllFaces;  ///< pairs of faces listed per pair of objects: all, so many, or whether they meet
    std::int64_t objectLayers = -1, againstLayers = -1;  ///< masks: bits of CollisionObject::layers
    double threshold = 0;                                ///< of kDistance: nearer than this is near
    std::int64_t show = 0;                               ///< bits: what of its contacts, or its distances, is drawn
    std::int64_t patience = 12;                          ///< of kAsk: frames until the question goes unanswered
};
template <>
inline constexpr auto kSaid<Interest> = []<typename T>(Describing<T>) {
    return describe("Interest", field<&T::object>(1, "object").to(typeOf<Node>()).affects(Effect::kRules),
                    field<&T::against>(2, "against").to(typeOf<Node>()).affects(Effect::kRules),
                    field<&T::response>(3, "response")
                        .oneOf({{Interest::kReport, "report"},
                                {Interest::kStop, "stop"},
                                {Interest::kSlide, "slide"},
                                {Interest::kBounce, "bounce"},
                                {Interest::kRollback, "rollback"},
                                {Interest::kAsk, "ask"}})
                        .affects(Effect::kTerms),
                    field<&T::enabled>(4, "enabled").affects(Effect::kRules),
                    field<&T::mode>(5, "mode")
                        .oneOf({{Interest::kPseudoDynamic, "pseudo-dynamic"},
                                {Interest::kStatic, "static"},
                                {Interest::kDynamic, "dynamic"},
                                {Interest::kDistance, "distance"},
                                {Interest::kIgnore, "ignore"},
                                {Interest::kSelf, "self"}})
                        .affects(Effect::kRules),
                    field<&T::detail>(6, "detail")
                        .between(Interest::kYesOrNo, 1e6)
                        .named({{Interest::kYesOrNo, "yes-or-no"}, {Interest::kAllFaces, "all"}})
                        .affects(Effect::kTerms),
                    field<&T::objectLayers>(7, "objectLayers").affects(Effect::kRules),
                    field<&T::againstLayers>(8, "againstLayers").affects(Effect::kRules),
                    field<&T::threshold>(9, "threshold").unit(Unit::kWorld).between(0, 1e12).affects(Effect::kTerms),
                    field<&T::show>(10, "show")
                        .flags({{Interest::kShowPoints, "points"},
                                {Interest::kShowNormals, "normals"},
                                {Interest::kShowFaces, "faces"}})
                        .affects(Effect::kTerms),
                    field<&T::patience>(11, "patience").unit(Unit::kFrame).between(0, 1e6).affects(Effect::kTerms));
};

}  // namespace tessera
