#include "server/collision/query/ImpactKernelTable.h"

namespace tessera::kernel {

namespace sse41 {
extern const ImpactKernels kImpact;
}
namespace avx2 {
extern const ImpactKernels kImpact;
}
namespace avx512 {
extern const ImpactKernels kImpact;
}

const ImpactKernels& impactKernels(InstructionSet set) {
    switch (set) {
        case InstructionSet::kAvx512:
            return avx512::kImpact;
        case InstructionSet::kAvx2:
            return avx2::kImpact;
        case InstructionSet::kSse41:
            break;
    }
    return sse41::kImpact;
}

}  // namespace tessera::kernel
