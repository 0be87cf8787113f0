#define TESSERA_KERNELS avx512
#include "server/collision/tree/kernel/Kernels.inl"
