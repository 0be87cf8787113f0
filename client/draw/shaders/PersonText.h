/// GLSL of a person: what of it is refused before any compiler sees it, and what becomes of the rest. Knows no GL.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/Clock.h"
#include "common/base/Error.h"
#include "common/change/Value.h"

namespace tessera {

/// `uniform vec3 tint;` as the text declares it.
struct PersonUniform {
    std::string name;
    std::uint8_t width = 1;  ///< of float to vec4; 0: a sampler2D
    bool operator==(const PersonUniform&) const = default;
};

/// A person's program that is not drawn with, as it took too long.
struct HeldUpBy {
    ObjectId program;  ///< a SurfaceProgram
    Duration took{};   ///< of one picture, when it was ended
    bool operator==(const HeldUpBy&) const = default;
};

/// Ready to stand in a shader, the same line for the same line.
struct PersonText {
    std::string surface, vertex;  ///< empty: there is none
    bool loops = false;           ///< in either
    std::vector<PersonUniform>
        uniforms;  ///< of both, each once, samplers last; a sampler's place among the samplers is its texture unit
    [[nodiscard]] std::size_t numbers() const;  ///< how many of them are no samplers
    bool operator==(const PersonText&) const = default;
};

inline constexpr std::size_t kMostPersonBytes = 65536, kMostPersonUniforms = 16, kMostPersonSamplers = 4,
                             kMostPersonDepth = 64;
/// So often, in sum, may the loops of one text go around for one pixel or vertex: then they end. What is drawn is drawn
/// all the same. Fewer while a LoopWatch says so.
inline constexpr int kMostPersonRounds = 1024;
/// What compilers call the line before the first of each text (`#line`): numbers that no other line has. Mesa forgets
/// which of several texts a line is of.
inline constexpr int kSurfaceLines = 1'000'000, kVertexLines = 2'000'000;

/// Refused, as "surface, line 3: …": anything that the compiler would take for more than two functions, what they need,
/// and uniforms: the preprocessor, names of GLSL that reach beyond the function (gl_…, layouts, inputs and outputs,
/// images, buffers, atomics), `main`, brackets that do not close, names that begin with `tessera`, too much of
/// anything. Loops are given an end by a counter. Everything else is the compiler's to judge.
[[nodiscard]] Expected<PersonText> preparePersonText(std::string_view surface, std::string_view vertex);

/// What a compiler says, in a person's own words and lines: "surface, line 3: …"; the first complaint alone.
[[nodiscard]] std::string personProblem(std::string_view log);

}  // namespace tessera
