#define TESSERA_KERNELS sse41
#include "server/collision/tree/kernel/Kernels.inl"
