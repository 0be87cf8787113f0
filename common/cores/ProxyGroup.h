/// A stand-in for a file that is large.
#pragma once

#include "common/cores/LoadWords.h"
#include "common/field/Field.h"

namespace tessera {

/// As Inline, but bounds and counts are known before the content is: views fit them, reports count them, and a box of
/// lines is drawn in place of what is not there yet.
struct ProxyGroup : LoadWords {
    static constexpr ObjectType kType{29};
    std::string file;
    std::int64_t load = kNear;
    double distance = 0;  ///< of kNear: from the user's head to the box
    bool wanted = false;
    Vec3d lower = Vec3d::Zero(), upper = Vec3d::Zero();  ///< of the box, in the node's coordinates
    std::int64_t nodes = 0, triangles = 0;               ///< 0: not known
    std::int64_t state = kWaiting;
    std::string problem;
};
template <>
inline constexpr auto kSaid<ProxyGroup> = []<typename T>(Describing<T>) {
    return describe(
        "ProxyGroup", field<&T::file>(1, "file").affects(Effect::kTime),
        field<&T::load>(2, "load")
            .oneOf({{LoadWords::kAtOnce, "at-once"}, {LoadWords::kNear, "near"}, {LoadWords::kByHand, "by-hand"}})
            .affects(Effect::kTime),
        field<&T::distance>(3, "distance").unit(Unit::kWorld).between(0, 1e30).affects(Effect::kTime),
        field<&T::wanted>(4, "wanted").affects(Effect::kTime),
        field<&T::lower>(5, "lower").unit(Unit::kWorld).between(-1e30, 1e30).affects(Effect::kShape | Effect::kView),
        field<&T::upper>(6, "upper").unit(Unit::kWorld).between(-1e30, 1e30).affects(Effect::kShape | Effect::kView),
        field<&T::nodes>(7, "nodes").between(0, 1e15).affects(Effect::kView),
        field<&T::triangles>(8, "triangles").between(0, 1e15).affects(Effect::kView),
        field<&T::state>(9, "state")
            .oneOf({{LoadWords::kWaiting, "waiting"},
                    {LoadWords::kLoading, "loading"},
                    {LoadWords::kThere, "there"},
                    {LoadWords::kFailed, "failed"}})
            .affects(Effect::kTime | Effect::kShape),
        field<&T::problem>(10, "problem").affects(Effect::kTime));
};

}  // namespace tessera
