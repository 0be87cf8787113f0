#define TESSERA_KERNELS avx512
#include "server/collision/query/ImpactKernels.inl"
