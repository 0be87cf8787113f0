#include "server/collision/spherical/FieldKernels.h"

namespace tessera::kernel {

namespace sse41 {
extern const FieldWalk kFieldWalk;
extern const LatticeWalk kLatticeWalk;
extern const PointDistance kPointDistance;
}  // namespace sse41
namespace avx2 {
extern const FieldWalk kFieldWalk;
extern const LatticeWalk kLatticeWalk;
extern const PointDistance kPointDistance;
}  // namespace avx2
namespace avx512 {
extern const FieldWalk kFieldWalk;
extern const LatticeWalk kLatticeWalk;
extern const PointDistance kPointDistance;
}  // namespace avx512

FieldKernels fieldKernels(InstructionSet set) {
    switch (set) {
        case InstructionSet::kAvx512:
            return {avx512::kFieldWalk, avx512::kLatticeWalk, avx512::kPointDistance};
        case InstructionSet::kAvx2:
            return {avx2::kFieldWalk, avx2::kLatticeWalk, avx2::kPointDistance};
        case InstructionSet::kSse41:
            break;
    }
    return {sse41::kFieldWalk, sse41::kLatticeWalk, sse41::kPointDistance};
}

}  // namespace tessera::kernel
