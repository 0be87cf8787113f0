#include <cstddef>
#include <cstdint>

#include "server/collision/spherical/FieldTypes.h"

#define TESSERA_KERNELS sse41
#include "server/collision/spherical/kernel/FieldWalk.inl"
#include "server/collision/spherical/kernel/LatticeWalk.inl"
