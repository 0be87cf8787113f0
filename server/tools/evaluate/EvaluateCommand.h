/// tessera-evaluate: points of smooth surfaces by their parameters.
#pragma once

#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "common/base/Error.h"
#include "common/math/Types.h"

namespace tessera {

struct EvaluateArguments {
    std::string surface, places, scheme;
    bool nearest = false;     ///< places are x y z, and their nearest points are asked for
    double tolerance = 1e-6;  ///< of nearest points: the error that is aimed at
    bool json = false;
};
/// What --help and --version print.
struct EvaluateText {
    std::string text;
};
[[nodiscard]] Expected<std::variant<EvaluateArguments, EvaluateText>> parseEvaluateArguments(
    const std::vector<std::string>& words);

/// A line of a file of places.
struct PlaceLine {
    std::uint32_t face = 0;
    double u = 0, v = 0;
    std::size_t line = 0;  ///< from 1
};
/// `face u v` each, `#` begins a comment, empty lines do not count. kBadInput as `file:line: what is wrong`.
[[nodiscard]] Expected<std::vector<PlaceLine>> parsePlaces(std::string_view text, std::string_view file);

/// A line of a file of places for --nearest.
struct SpaceLine {
    Vec3d place = Vec3d::Zero();
    std::size_t line = 0;
};
/// `x y z` each, as parsePlaces.
[[nodiscard]] Expected<std::vector<SpaceLine>> parseSpacePlaces(std::string_view text, std::string_view file);

/// The whole program; its exit code.
[[nodiscard]] int runEvaluate(const std::vector<std::string>& words);

}  // namespace tessera
