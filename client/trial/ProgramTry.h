/// One program of a person, compiled and drawn with: what a process of its own does before any host sees it.
#pragma once

#include <memory>
#include <string>

#include "client/draw/passes/Renderer.h"
#include "common/cores/ShippedTypes.h"

namespace tessera {

/// On Mesa's software, one thread. The same thread makes it, uses it and destroys it.
class ProgramTry {
public:
    /// Draws once without any program: what comes after is that of the program alone.
    [[nodiscard]] static Expected<std::unique_ptr<ProgramTry>> create();

    /// Draws with it what is solid, cut out, transparent and in shadow, and asks for nodes, with all uniforms 0,
    /// then 1. Empty: good. Else what is wrong, by the person's own lines; a program that takes more than
    /// kMostMicroseconds of one core for a pixel is wrong, too. May take for ever, or all memory.
    [[nodiscard]] std::string problemOf(const SurfaceProgram& program);

    static constexpr int kSidePx = 128;
    static constexpr double kMostMicroseconds = 5;

private:
    [[nodiscard]] Expected<double> draw(const SurfaceProgram* program, float uniforms, bool timed);

    std::unique_ptr<Surface> surface_;
    std::unique_ptr<Renderer> renderer_;
};

}  // namespace tessera
