#include <immintrin.h>

#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "server/collision/tree/KernelTypes.h"

#define TESSERA_KERNELS avx2
#include "server/collision/tree/kernel/Kernels.inl"
