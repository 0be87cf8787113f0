#define TESSERA_KERNELS avx2
#include "server/collision/neighbours/SlotKernels.inl"
