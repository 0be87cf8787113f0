// Included once per instruction set, with TESSERA_KERNELS naming its namespace.
#include <immintrin.h>

#include <cstddef>
#include <cstdint>

#include "server/collision/neighbours/SlotKernels.h"

namespace tessera::neighbours::TESSERA_KERNELS {
namespace {

// In this order: each needs what stands before it.
// clang-format off
#include "server/collision/neighbours/SlotSimd.inl"
#include "server/collision/neighbours/SlotKeys.inl"
#include "server/collision/neighbours/SlotGrid.inl"
#include "server/collision/neighbours/SlotTree.inl"
// clang-format on

}  // namespace

extern const SlotKernels kSlotKernels;
const SlotKernels kSlotKernels = {convert,  spread,     settle,    cells,   gridAll,
                                  gridSome, treeLeaves, treeUpper, treeAll, treeSome};

}  // namespace tessera::neighbours::TESSERA_KERNELS
