/// Sine and cosine with the same bits on every machine.
///
/// A C library picks other code for other processors (with or without fused multiply-add), whose last bits may differ.
/// Hosts derive triangles for themselves and rest on all having the same, so nothing here is but additions, products
/// and a rounding, which IEEE 754 defines. Taylor series on |r| <= π/4, whose first term left out is below 1e-17; the
/// reduction's error is below 1e-16 up to |x| of 100.
#pragma once

#include <cmath>

namespace tessera {

namespace detail {

struct ReducedAngle {
    double r = 0;
    int quadrant = 0;
};
[[nodiscard]] inline ReducedAngle reduced(double x) {
    // π/2 in two parts: the first has so few bits that small multiples of it are exact (Cody and Waite).
    constexpr double kHalfPiHigh = 0x1.921fb544p+0, kHalfPiLow = 0x1.0b4611a626331p-34;
    const double turns = std::nearbyint(x * 0x1.45f306dc9c883p-1);
    return {(x - turns * kHalfPiHigh) - turns * kHalfPiLow, static_cast<int>(turns) & 3};
}
[[nodiscard]] inline double sineSeries(double r) {
    const double s = r * r;
    double sum = 0;
    for (int n = 17; n >= 3; n -= 2) sum = (1 + sum) * -s / (n * (n - 1));
    return r + r * sum;
}
[[nodiscard]] inline double cosineSeries(double r) {
    const double s = r * r;
    double sum = 0;
    for (int n = 18; n >= 2; n -= 2) sum = (1 + sum) * -s / (n * (n - 1));
    return 1 + sum;
}

}  // namespace detail

[[nodiscard]] inline double portableSin(double x) {
    const detail::ReducedAngle a = detail::reduced(x);
    const double value = a.quadrant % 2 ? detail::cosineSeries(a.r) : detail::sineSeries(a.r);
    return a.quadrant > 1 ? -value : value;
}
[[nodiscard]] inline double portableCos(double x) {
    const detail::ReducedAngle a = detail::reduced(x);
    const double value = a.quadrant % 2 ? detail::sineSeries(a.r) : detail::cosineSeries(a.r);
    return a.quadrant == 1 || a.quadrant == 2 ? -value : value;
}

}  // namespace tessera
