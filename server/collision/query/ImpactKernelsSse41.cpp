#define TESSERA_KERNELS sse41
#include "server/collision/query/ImpactKernels.inl"
