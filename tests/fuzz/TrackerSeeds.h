/// Inputs of the target `trackers` to begin with: what each protocol says when all is well.
#pragma once

#include "tests/unit/tracking/TrackerBytes.h"

namespace tessera::fuzz {

/// Packets as TrackerFuzz reads them: time since the last, kind, length, bytes.
[[nodiscard]] inline std::vector<Bytes> trackerSeeds() {
    const auto packet = [](int kind, const Bytes& bytes) {
        Bytes all = {std::byte{16}, static_cast<std::byte>(kind), static_cast<std::byte>(bytes.size() & 0xff),
                     static_cast<std::byte>(bytes.size() >> 8)};
        test::append(all, bytes);
        return all;
    };
    const test::SentPose pose{.position = {0.1, 1.7, 2}, .orientation = Quatd(0.8, 0, 0.6, 0)};
    const Bytes dtrack = packet(
        0, test::bytesOf("fr 1\r\n6dcal 1\r\n6d 1 [0 1.000]" + test::dtrackBlocks(pose, true) +
                         "\r\n6df 1 [0 1.000 3]" + test::dtrackBlocks(pose, true) + "\r\n6df2 1 1 [0 1.000 8 2]" +
                         test::dtrackBlocks(pose, false) + "[3 0.10 -0.20]\r\n6dmt 1 [0 1.000 1]" +
                         test::dtrackBlocks(pose, false) + "\r\n3d 1 [1 1.000][1.0 2.0 3.0]\r\n"));
    const Bytes message = test::WireWriter()
                              .text("/tessera/0/pose")
                              .text(",fffffff")
                              .f32(0)
                              .f32(1.7f)
                              .f32(2)
                              .f32(0)
                              .f32(0)
                              .f32(0)
                              .f32(1)
                              .bytes;
    const Bytes button = test::WireWriter().text("/tessera/flystick/0/button").text(",iT").i32(2).bytes;
    test::WireWriter bundle;
    bundle.text("#bundle")
        .u32(0)
        .u32(1)
        .u32(static_cast<std::uint32_t>(message.size()))
        .raw(message)
        .u32(static_cast<std::uint32_t>(button.size()))
        .raw(button);
    Bytes stream = test::vrpnCookie();
    test::append(stream, test::vrpnName(1, -1, "Tracker0"));
    test::append(stream, test::vrpnName(1, -2, "vrpn_Tracker Pos_Quat"));
    test::append(stream, test::vrpnName(2, -2, "vrpn_Button Change"));
    test::append(stream, test::vrpnName(3, -2, "vrpn_Analog Channel"));
    test::append(stream, test::vrpnPose(1, 1, 0, pose));
    test::append(stream, test::vrpnMessage(1, 2, test::WireWriter().i32(1).i32(1).bytes));
    test::append(stream, test::vrpnMessage(1, 3, test::WireWriter().f64(1).f64(0.5).bytes));
    Bytes all = dtrack;
    test::append(all, packet(1, bundle.bytes));
    test::append(all, packet(2, stream));
    return {dtrack, packet(1, bundle.bytes), packet(2, stream), all};
}

}  // namespace tessera::fuzz
