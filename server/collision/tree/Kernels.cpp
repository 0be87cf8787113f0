#include "server/collision/tree/Kernels.h"

namespace tessera::kernel {

namespace sse41 {
extern const TreeKernels kTable;
}
namespace avx2 {
extern const TreeKernels kTable;
}
namespace avx512 {
extern const TreeKernels kTable;
}

const TreeKernels& treeKernels(InstructionSet set) {
    switch (set) {
        case InstructionSet::kAvx512:
            return avx512::kTable;
        case InstructionSet::kAvx2:
            return avx2::kTable;
        case InstructionSet::kSse41:
            break;
    }
    return sse41::kTable;
}

}  // namespace tessera::kernel
