// Included once per instruction set (../Kernels*.cpp, which bring the headers), with TESSERA_KERNELS naming its
// namespace.

namespace tessera::kernel::TESSERA_KERNELS {
namespace {

// In this order: each needs what stands before it.
// clang-format off
#include "server/collision/tree/kernel/Simd.inl"
#include "server/collision/tree/kernel/Volumes.inl"
#include "server/collision/tree/kernel/Triangles.inl"
#include "server/collision/tree/kernel/Pairs.inl"
#include "server/collision/tree/kernel/Measure.inl"
#include "server/collision/tree/kernel/Touch.inl"
#include "server/collision/tree/kernel/Distance.inl"
#include "server/collision/tree/kernel/Fit.inl"
#include "server/collision/tree/kernel/FitDop.inl"
#include "server/collision/tree/kernel/FitObb.inl"
#include "server/collision/tree/kernel/FitSphere.inl"
#include "server/collision/tree/kernel/Divide.inl"
// clang-format on

using Dop6 = Dop<6, true>;
using Dop14 = Dop<14, true>;
using Dop18 = Dop<18, true>;
using Dop26 = Dop<26, true>;

}  // namespace

extern const TreeKernels kTable;
const TreeKernels kTable = {
    &decidePairs,
    &measurePairs,
    {&Touching<Sphere>::walk, &Touching<Obb>::walk, &Touching<Dop6>::walk, &Touching<Dop14>::walk,
     &Touching<Dop18>::walk, &Touching<Dop26>::walk},
    {&Touching<Sphere>::overlap, &Touching<Obb>::overlap, &Touching<Dop6>::overlap, &Touching<Dop14>::overlap,
     &Touching<Dop18>::overlap, &Touching<Dop26>::overlap},
    {nullptr, nullptr, nullptr, &Touching<DopByTable<14>>::walk, &Touching<DopByTable<18>>::walk,
     &Touching<DopByTable<26>>::walk},
    {nullptr, nullptr, nullptr, &Touching<DopByTable<14>>::overlap, &Touching<DopByTable<18>>::overlap,
     &Touching<DopByTable<26>>::overlap},
    {&Nearing<Sphere>::walk, &Nearing<Obb>::walk, &Nearing<Dop6>::walk, &Nearing<Dop14>::walk, &Nearing<Dop18>::walk,
     &Nearing<Dop26>::walk},
    {&fitAll<SphereFit>, &fitAll<ObbFit>, &fitAll<DopFit<6>>, &fitAll<DopFit<14>>, &fitAll<DopFit<18>>,
     &fitAll<DopFit<26>>},
    {&fillBins, &partItems, &divideIntoLeaves},
};

}  // namespace tessera::kernel::TESSERA_KERNELS
