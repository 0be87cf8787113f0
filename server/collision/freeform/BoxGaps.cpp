#include "server/collision/freeform/BoxGaps.h"

namespace tessera::kernel {

namespace sse41 {
extern const GapsOfBoxes kGapsOfBoxes;
}
namespace avx2 {
extern const GapsOfBoxes kGapsOfBoxes;
}
namespace avx512 {
extern const GapsOfBoxes kGapsOfBoxes;
}

GapsOfBoxes gapsOfBoxes(InstructionSet set) {
    switch (set) {
        case InstructionSet::kAvx512:
            return avx512::kGapsOfBoxes;
        case InstructionSet::kAvx2:
            return avx2::kGapsOfBoxes;
        case InstructionSet::kSse41:
            break;
    }
    return sse41::kGapsOfBoxes;
}

}  // namespace tessera::kernel
