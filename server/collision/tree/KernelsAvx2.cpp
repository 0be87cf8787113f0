#define TESSERA_KERNELS avx2
#include "server/collision/tree/kernel/Kernels.inl"
