/// What other files hold, loaded when it is wanted.
#pragma once

#include "common/cores/LoadWords.h"
#include "common/field/Field.h"

namespace tessera {

/// Another file's scene.
struct Inline : LoadWords {
    static constexpr ObjectType kType{28};
    std::string file;             ///< as `tessera-ctl load` takes it, or relative to the scene file that says it
    std::int64_t load = kAtOnce;  ///< kNear: once any user's head is within `distance` of the node's origin; kByHand:
                                  ///< once `wanted` is set
    double distance = 0;
    bool wanted = false;
    // Written by the server.
    std::int64_t state = kWaiting;
    std::string problem;  ///< of kFailed: why
};
template <>
inline constexpr auto kSaid<Inline> = []<typename T>(Describing<T>) {
    return describe(
        "Inline", field<&T::file>(1, "file").affects(Effect::kTime),
        field<&T::load>(2, "load")
            .oneOf({{LoadWords::kAtOnce, "at-once"}, {LoadWords::kNear, "near"}, {LoadWords::kByHand, "by-hand"}})
            .affects(Effect::kTime),
        field<&T::distance>(3, "distance").unit(Unit::kWorld).between(0, 1e30).affects(Effect::kTime),
        field<&T::wanted>(4, "wanted").affects(Effect::kTime),
        field<&T::state>(5, "state")
            .oneOf({{LoadWords::kWaiting, "waiting"},
                    {LoadWords::kLoading, "loading"},
                    {LoadWords::kThere, "there"},
                    {LoadWords::kFailed, "failed"}})
            .affects(Effect::kTime),
        field<&T::problem>(6, "problem").affects(Effect::kTime));
};

}  // namespace tessera
