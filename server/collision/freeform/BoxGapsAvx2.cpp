#define TESSERA_KERNELS avx2
#include "server/collision/freeform/BoxGaps.inl"
