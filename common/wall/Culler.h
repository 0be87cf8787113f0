/// How render hosts find out what leaves no pixel. No choice changes a picture.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "common/base/Error.h"

namespace tessera {

/// The numbers are the codes' own: nothing is kept or sent by them.
enum class CullerKind : std::uint8_t {
    kNone,
    kFrustum,
    kQueriesWait,  ///< asks the renderer for each box in turn, and waits for each answer
    kQueries,      ///< asks it within the traversal: in groups, late, where the last frame leaves a doubt
    kMasked,       ///< what is hidden too, by a depth buffer in software
    kTwoPhase,     ///< by a pyramid of depths over what was seen before, then over the rest
    kAuto,         ///< masked where that pays, else frustum
};

/// Each of them, in the order of their numbers: what tests, benchmarks and help go through.
inline constexpr std::array kAllCullers = {CullerKind::kNone,    CullerKind::kFrustum, CullerKind::kQueriesWait,
                                           CullerKind::kQueries, CullerKind::kMasked,  CullerKind::kTwoPhase,
                                           CullerKind::kAuto};

/// Their names, in order: "none, frustum, … or auto".
[[nodiscard]] const std::string& cullerNames();
/// One of these names; kUsage names them all.
[[nodiscard]] Expected<CullerKind> parseCuller(std::string_view name);
[[nodiscard]] std::string_view nameOf(CullerKind kind);
/// Whether it looks at depths that the renderer draws, and so needs one.
[[nodiscard]] bool asksRenderer(CullerKind kind);

}  // namespace tessera
