/// Datagrams of A.R.T. trackers: DTrack's ASCII output.
///
/// Source: "DTrack User Manual, Technical Appendix", output of measurement data via Ethernet. Lines end in CR LF, or
/// LF; each begins with what it tells of. Positions are millimetres, right-handed; matrices stand column by column.
///     fr 21753
///     6d 1 [0 1.000][326.848 -187.216 109.503 -160.4704 -3.6963 -7.0913][-0.940508 -0.339238 -0.019025 …]
///     6df2 1 1 [0 1.000 8 2][…3…][…9…][buttons, 32 a number; joystick axes -1 to 1]
/// Read: 6d, 6df (buttons in the first block), 6df2, 6dmt (button in the first block), 3d. Other lines are not ours to
/// judge.
#pragma once

#include <vector>

#include "server/sim/tracking/SensorReport.h"

namespace tessera {

/// Whole or not at all: a datagram with a line that is not what it says is refused (kBadInput, with words), one that
/// tells of more than kMostReports too (kLimit). A body that is not seen at present (quality -1) is left out, but for
/// its buttons. Pure.
[[nodiscard]] Expected<std::vector<SensorReport>> parseDtrack(ByteSpan datagram);

}  // namespace tessera
