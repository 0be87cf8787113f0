/// Datagrams of Open Sound Control 1.0 that tell of sensors.
///
/// Source: "The Open Sound Control 1.0 Specification" (Wright 2002): texts end in zero bytes and fill words of 4 bytes,
/// numbers are big-endian, a message is an address, a text of types and its arguments, a bundle "#bundle", a time and
/// elements with their sizes. Times of bundles are not looked at: what comes counts when it comes.
///
/// Addresses, N the sensor's number (a body's, unless the address says /tessera/flystick/N, /tessera/tool/N,
/// /tessera/marker/N):
///     /tessera/N/pose         x y z qx qy qz qw
///     /tessera/N/position     x y z
///     /tessera/N/orientation  qx qy qz qw
///     /tessera/N/button       which pressed      0 and 1, or T and F
///     /tessera/N/axis         which value        -1 to 1
/// Numbers may be of any OSC type (i f h d T F). Other addresses are not ours to judge.
#pragma once

#include <vector>

#include "server/sim/tracking/SensorReport.h"

namespace tessera {

inline constexpr int kMostNestedBundles = 8;

/// Whole or not at all, as parseDtrack. Pure.
[[nodiscard]] Expected<std::vector<SensorReport>> parseOsc(ByteSpan datagram);

}  // namespace tessera
