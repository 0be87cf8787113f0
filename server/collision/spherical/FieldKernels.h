/// The vector kernels of this folder for this processor.
#pragma once

#include "server/collision/mesh/InstructionSet.h"
#include "server/collision/spherical/FieldTypes.h"

namespace tessera::kernel {

struct FieldKernels {
    FieldWalk walk;
    LatticeWalk lattice;
    PointDistance pointDistance;
};
[[nodiscard]] FieldKernels fieldKernels(InstructionSet set = instructionSet());

}  // namespace tessera::kernel
