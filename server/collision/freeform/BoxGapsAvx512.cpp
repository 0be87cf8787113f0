#define TESSERA_KERNELS avx512
#include "server/collision/freeform/BoxGaps.inl"
