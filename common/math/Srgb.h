/// sRGB's curve (IEC 61966-2-1): what a byte of a picture says, and how much light that is. Both from 0 to 1.
#pragma once

#include <cmath>

namespace tessera {

template <typename T>
[[nodiscard]] T linearOfSrgb(T signal) {
    return signal <= T(0.04045) ? signal / T(12.92) : std::pow((signal + T(0.055)) / T(1.055), T(2.4));
}
template <typename T>
[[nodiscard]] T srgbOfLinear(T light) {
    return light <= T(0.0031308) ? T(12.92) * light : T(1.055) * std::pow(light, T(1) / T(2.4)) - T(0.055);
}

}  // namespace tessera
