#include "client/render/PlaceKernels.h"

namespace tessera::places::avx2 {
namespace {

using Lanes = double __attribute__((vector_size(32)));
using Floats = float __attribute__((vector_size(16)));
using Bits = long long __attribute__((vector_size(32)));
// As they lie in memory.
using LanesAnywhere = double __attribute__((vector_size(32), aligned(8), may_alias));
using FloatsAnywhere = float __attribute__((vector_size(16), aligned(4), may_alias));
constexpr std::size_t kLanes = 4;

inline Lanes all(double value) {
    return Lanes{value, value, value, value};
}
inline Lanes magnitude(Lanes a) {
    return reinterpret_cast<Lanes>(reinterpret_cast<Bits>(a) & 0x7fffffffffffffffll);
}
inline Floats rounded(Lanes a) {
    return __builtin_convertvector(a, Floats);
}
inline double of(Lanes a, std::size_t lane) {
    return a[lane];
}
/// Four numbers of each of four items become the items' numbers side by side.
inline void load(const double* const (&from)[kLanes], int at, Lanes (&to)[4]) {
    const auto four = [&](std::size_t lane) -> Lanes {
        return *reinterpret_cast<const LanesAnywhere*>(from[lane] + at);
    };
    const Lanes item0 = four(0), item1 = four(1), item2 = four(2), item3 = four(3);
    const Lanes a = __builtin_shufflevector(item0, item1, 0, 4, 2, 6);
    const Lanes b = __builtin_shufflevector(item0, item1, 1, 5, 3, 7);
    const Lanes c = __builtin_shufflevector(item2, item3, 0, 4, 2, 6);
    const Lanes d = __builtin_shufflevector(item2, item3, 1, 5, 3, 7);
    to[0] = __builtin_shufflevector(a, c, 0, 1, 4, 5);
    to[1] = __builtin_shufflevector(b, d, 0, 1, 4, 5);
    to[2] = __builtin_shufflevector(a, c, 2, 3, 6, 7);
    to[3] = __builtin_shufflevector(b, d, 2, 3, 6, 7);
}
/// And back, a row to each item.
inline void store(float* const (&to)[kLanes], int at, Floats x, Floats y, Floats z, Floats w) {
    const Floats a = __builtin_shufflevector(x, y, 0, 4, 1, 5), b = __builtin_shufflevector(x, y, 2, 6, 3, 7);
    const Floats c = __builtin_shufflevector(z, w, 0, 4, 1, 5), d = __builtin_shufflevector(z, w, 2, 6, 3, 7);
    const auto row = [&](std::size_t lane) -> FloatsAnywhere& {
        return *reinterpret_cast<FloatsAnywhere*>(to[lane] + at);
    };
    row(0) = __builtin_shufflevector(a, c, 0, 1, 4, 5);
    row(1) = __builtin_shufflevector(a, c, 2, 3, 6, 7);
    row(2) = __builtin_shufflevector(b, d, 0, 1, 4, 5);
    row(3) = __builtin_shufflevector(b, d, 2, 3, 6, 7);
}

}  // namespace
}  // namespace tessera::places::avx2

#define TESSERA_PLACES avx2
#include "client/render/PlaceKernels.inl"
