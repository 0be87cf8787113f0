#include "server/collision/neighbours/SlotKernels.h"

#include "server/collision/mesh/InstructionSet.h"

namespace tessera::neighbours {

namespace sse41 {
extern const SlotKernels kSlotKernels;
}
namespace avx2 {
extern const SlotKernels kSlotKernels;
}
namespace avx512 {
extern const SlotKernels kSlotKernels;
}

const SlotKernels& slotKernels(InstructionSet set) {
    switch (set) {
        case InstructionSet::kAvx512:
            return avx512::kSlotKernels;
        case InstructionSet::kAvx2:
            return avx2::kSlotKernels;
        case InstructionSet::kSse41:
            break;
    }
    return sse41::kSlotKernels;
}

const SlotKernels& slotKernels() {
    return slotKernels(instructionSet());
}

}  // namespace tessera::neighbours
