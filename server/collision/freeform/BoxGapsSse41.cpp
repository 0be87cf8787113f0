#define TESSERA_KERNELS sse41
#include "server/collision/freeform/BoxGaps.inl"
