/// Pictures that follow each other.
#pragma once

#include "common/cores/ShippedTypes.h"
#include "common/field/Field.h"

namespace tessera {

/// Writes the pixels of an Image from a film's file, on the server, once for all: every tile shows the same frame of
/// it.
struct Movie {
    static constexpr ObjectType kType{35};
    static constexpr std::int64_t kOnce = 0, kLoop = 1;
    ObjectId image;    ///< an Image; its pixels and size are the film's from then on
    std::string file;  ///< as Inline's
    bool playing = true;
    /// s from the film's start. Grows by speed / 60 s per frame while it plays; setting it is a seek.
    double time = 0;
    double speed = 1;
    std::int64_t mode = kLoop;
    std::string problem;  ///< written by the server: why nothing is shown; empty: all is well
};
template <>
inline constexpr auto kSaid<Movie> = []<typename T>(Describing<T>) {
    return describe(
        "Movie", field<&T::image>(1, "image").to(typeOf<Image>()).affects(Effect::kTime),
        field<&T::file>(2, "file").affects(Effect::kTime), field<&T::playing>(3, "playing").affects(Effect::kTime),
        field<&T::time>(4, "time").unit(Unit::kSecond).between(-1e9, 1e9).affects(Effect::kTime),
        field<&T::speed>(5, "speed").between(-1e6, 1e6).affects(Effect::kTime),
        field<&T::mode>(6, "mode").oneOf({{Movie::kOnce, "once"}, {Movie::kLoop, "loop"}}).affects(Effect::kTime),
        field<&T::problem>(7, "problem").affects(Effect::kTime));
};

}  // namespace tessera
