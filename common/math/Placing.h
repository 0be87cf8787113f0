/// Where what is loaded from a file comes to stand.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/base/Error.h"
#include "common/math/Types.h"

namespace tessera {

/// Which way is up in a file's coordinates. kOfFile: as the file says, else as files of its kind mostly have it.
enum class UpAxis : std::uint8_t { kOfFile, kY, kZ };

/// Lengths are units of the node that it comes under; +Y is up there.
struct Placing {
    /// Where the file's origin comes; with `fit` the middle of its underside. None: the origin.
    std::optional<Vec3d> at;
    std::optional<double> scale;  ///< above 0
    std::optional<double> fit;    ///< above 0, instead of `scale`: how long the longest side of its box becomes
    UpAxis up = UpAxis::kOfFile;
    std::optional<double>
        pointRadius;  ///< above 0, in the file's own units: of all its points, whatever it says of them
    /// Of USD's files what is shown of their variants, whatever they say: "/Chair:color=red".
    std::vector<std::string> variants;

    /// Whether a person has said anything of where it stands.
    [[nodiscard]] bool said() const { return at || scale || fit || up != UpAxis::kOfFile; }
    /// Whether they have said it in lengths of the wall: who looks at it stands before the wall, not where a camera of
    /// the file is.
    [[nodiscard]] bool isInMetres() const { return at || fit; }
};

/// Where anything may be placed, and how large or small it may become.
inline constexpr double kMaxPlacingCoordinate = 1e15, kMaxPlacingScale = 1e12, kMaxPlacedRadius = 1e12;
/// So many variants may be chosen, of so many letters each.
inline constexpr std::size_t kMostVariants = 100, kMostVariantBytes = 1000;

/// What is wrong with it.
[[nodiscard]] Expected<void> checkPlacing(const Placing& placing);

/// As the options of a command line say it, with one space between words: "--at 1 2 3 --up z". Empty: nothing is said.
[[nodiscard]] std::string optionsText(const Placing& placing);

}  // namespace tessera
