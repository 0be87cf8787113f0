/// A sheet whose material has a program of a person.
#pragma once

#include <string>
#include <vector>

#include "common/scene/Edits.h"
#include "tests/unit/draw/RendererStage.h"

namespace tessera {

inline const char* const kVertexHead = "void vertex(inout vec3 position, inout vec3 normal) { ";

/// A sheet with a program, unlit unless said otherwise.
struct Programmed {
    TestScene scene;
    Material material{};
    SurfaceProgram program{};
    std::vector<Uniform> uniforms{};
    double size = 1.6;
    Vec3d at = Vec3d::Zero();

    Programmed() { material.unlit = true; }
    Aspect take() {
        program.verdict = program.verdict == SurfaceProgram::kUntried ? SurfaceProgram::kGood : program.verdict;
        material.program = scene.add(program);
        for (const Uniform& uniform : uniforms) material.uniforms.push_back(scene.add(uniform));
        scene.setDark(Vec3f(0, 0, 0.2f));
        scene.place(scene.add(makeSheet(size, size), scene.add(material)), at);
        return scene.take();
    }
};

class PersonProgramTest : public RendererTest {};

}  // namespace tessera
