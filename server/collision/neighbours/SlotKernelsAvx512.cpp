#define TESSERA_KERNELS avx512
#include "server/collision/neighbours/SlotKernels.inl"
