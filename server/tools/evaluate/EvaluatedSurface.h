/// Smooth surfaces by the name of their scheme, whatever they are made of: one row of a table each.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/Error.h"
#include "common/freeform/SurfacePoint.h"

namespace tessera {

class EvaluatedSurface {
public:
    virtual ~EvaluatedSurface() = default;
    /// kBadInput, kRefused: there is no such point, in words without the place in a file. Not const: surfaces keep what they work out.
    [[nodiscard]] virtual Expected<SurfacePoint> at(std::uint32_t face, double u, double v) = 0;
    [[nodiscard]] virtual std::vector<std::string> notes() const { return {}; }
};

struct SurfaceScheme {
    std::string_view name;  ///< as --scheme has it
    /// `file` for messages: kBadInput as `file:line: what is wrong`, or `file: …` of what has no line.
    Expected<std::unique_ptr<EvaluatedSurface>> (*load)(std::string_view text, std::string_view file);
};

/// The first is taken where nobody says.
[[nodiscard]] std::span<const SurfaceScheme> surfaceSchemes();

}  // namespace tessera
