#define TESSERA_KERNELS avx2
#include "server/collision/query/ImpactKernels.inl"
