#define TESSERA_KERNELS sse41
#include "server/collision/query/kernel/Impact.inl"
