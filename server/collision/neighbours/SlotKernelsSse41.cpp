#define TESSERA_KERNELS sse41
#include "server/collision/neighbours/SlotKernels.inl"
