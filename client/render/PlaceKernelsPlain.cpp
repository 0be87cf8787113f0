#include "client/render/PlaceKernels.h"

namespace tessera::places::plain {
namespace {

using Lanes = double;
using Floats = float;
constexpr std::size_t kLanes = 1;

inline Lanes all(double value) {
    return value;
}
inline Lanes magnitude(Lanes a) {
    return __builtin_fabs(a);
}
inline Floats rounded(Lanes a) {
    return static_cast<float>(a);
}
inline double of(Lanes a, std::size_t) {
    return a;
}
inline void load(const double* const (&from)[kLanes], int at, Lanes (&to)[4]) {
    for (int k = 0; k < 4; ++k) to[k] = from[0][at + k];
}
inline void store(float* const (&to)[kLanes], int at, Floats x, Floats y, Floats z, Floats w) {
    to[0][at] = x;
    to[0][at + 1] = y;
    to[0][at + 2] = z;
    to[0][at + 3] = w;
}

}  // namespace
}  // namespace tessera::places::plain

#define TESSERA_PLACES plain
#include "client/render/PlaceKernels.inl"
