/// Numbers of history, short enough for tests: `3_frame`, `5_seq`, `666_hash`, `7_epoch`.
#pragma once

#include "common/base/HistoryIds.h"

namespace tessera {

constexpr FrameNumber operator""_frame(unsigned long long n) {
    return FrameNumber(n);
}
constexpr Sequence operator""_seq(unsigned long long n) {
    return Sequence(n);
}
constexpr StateHash operator""_hash(unsigned long long n) {
    return StateHash(n);
}
constexpr Epoch operator""_epoch(unsigned long long n) {
    return Epoch(n);
}

}  // namespace tessera
