/// Bytes as trackers send them, written from the protocols' descriptions and not with our own code; and random ones.
#pragma once

#include <bit>
#include <cstdint>
#include <cstdlib>
#include <random>
#include <string>

#include <fmt/format.h>

#include "common/base/Bytes.h"
#include "server/sim/tracking/SensorReport.h"

namespace tessera::test {

/// The seed of a random test: TESSERA_SEED where somebody repeats a finding.
[[nodiscard]] inline unsigned trackerSeed(unsigned usual) {
    const char* said = std::getenv("TESSERA_SEED");
    return said ? static_cast<unsigned>(std::stoul(said)) : usual;
}
#define TESSERA_TRACKER_SEED(seed, filter) \
    SCOPED_TRACE(fmt::format("TESSERA_SEED={} build/bin/unit_tracking --gtest_filter={}", seed, filter))

[[nodiscard]] inline Bytes bytesOf(const std::string& text) {
    const ByteSpan bytes = asBytes(text);
    return {bytes.begin(), bytes.end()};
}

struct SentPose {
    Vec3d position = Vec3d::Zero();
    Quatd orientation = Quatd::Identity();
};
[[nodiscard]] inline SentPose randomPose(std::mt19937& random) {
    std::uniform_real_distribution<double> place(-3, 3), part(-1, 1);
    Quatd q(part(random), part(random), part(random), part(random));
    while (q.norm() < 0.1) q = Quatd(part(random), part(random), part(random), part(random));
    return {.position = {place(random), place(random), place(random)}, .orientation = q.normalized()};
}

/// "[x y z eta theta phi][b0 … b8]" of DTrack, millimetres; the matrix column by column, worked out from the
/// quaternion's formula.
[[nodiscard]] inline std::string dtrackBlocks(const SentPose& pose, bool angles) {
    const double w = pose.orientation.w(), x = pose.orientation.x(), y = pose.orientation.y(), z = pose.orientation.z();
    const double columns[9] = {1 - 2 * (y * y + z * z), 2 * (x * y + w * z),     2 * (x * z - w * y),
                               2 * (x * y - w * z),     1 - 2 * (x * x + z * z), 2 * (y * z + w * x),
                               2 * (x * z + w * y),     2 * (y * z - w * x),     1 - 2 * (x * x + y * y)};
    std::string text = fmt::format("[{:.3f} {:.3f} {:.3f}{}][", 1000 * pose.position.x(), 1000 * pose.position.y(),
                                   1000 * pose.position.z(), angles ? " 10.0000 -20.0000 30.0000" : "");
    for (int i = 0; i < 9; ++i) text += fmt::format("{}{:.6f}", i == 0 ? "" : " ", columns[i]);
    return text + "]";
}

/// Big-endian words, and texts as OSC pads them.
class WireWriter {
public:
    WireWriter& u32(std::uint32_t value) {
        for (int shift = 24; shift >= 0; shift -= 8) bytes.push_back(static_cast<std::byte>(value >> shift & 0xff));
        return *this;
    }
    WireWriter& i32(std::int32_t value) { return u32(static_cast<std::uint32_t>(value)); }
    WireWriter& f32(float value) { return u32(std::bit_cast<std::uint32_t>(value)); }
    WireWriter& f64(double value) {
        const auto bits = std::bit_cast<std::uint64_t>(value);
        return u32(static_cast<std::uint32_t>(bits >> 32)).u32(static_cast<std::uint32_t>(bits));
    }
    WireWriter& text(const std::string& value) {
        for (const char c : value) bytes.push_back(static_cast<std::byte>(c));
        bytes.push_back(std::byte{0});
        return fill(4);
    }
    WireWriter& raw(ByteSpan more) {
        bytes.insert(bytes.end(), more.begin(), more.end());
        return *this;
    }
    WireWriter& fill(std::size_t multiple) {
        while (bytes.size() % multiple != 0) bytes.push_back(std::byte{0});
        return *this;
    }
    Bytes bytes;
};

[[nodiscard]] inline Bytes vrpnCookie(const std::string& text = "vrpn: ver. 07.33  0") {
    Bytes bytes = bytesOf(text);
    bytes.resize(24);
    return bytes;
}
/// A message of VRPN; `claim`: the length that it says, when that is to be a lie.
[[nodiscard]] inline Bytes vrpnMessage(std::int32_t sender, std::int32_t type, const Bytes& body,
                                       std::optional<std::uint32_t> claim = std::nullopt) {
    WireWriter out;
    out.u32(claim.value_or(24 + static_cast<std::uint32_t>(body.size()))).u32(1000).u32(5).i32(sender).i32(type).u32(7);
    return out.raw(body).fill(8).bytes;
}
[[nodiscard]] inline Bytes vrpnName(std::int32_t id, std::int32_t what, const std::string& name) {
    WireWriter body;
    body.u32(static_cast<std::uint32_t>(name.size()) + 1).raw(bytesOf(name + '\0'));
    return vrpnMessage(id, what, body.bytes);
}
[[nodiscard]] inline Bytes vrpnPose(std::int32_t sender, std::int32_t type, std::int32_t sensor, const SentPose& pose) {
    WireWriter body;
    body.i32(sensor).i32(0);
    for (int i = 0; i < 3; ++i) body.f64(pose.position[i]);
    return vrpnMessage(sender, type,
                       body.f64(pose.orientation.x())
                           .f64(pose.orientation.y())
                           .f64(pose.orientation.z())
                           .f64(pose.orientation.w())
                           .bytes);
}

inline void append(Bytes& to, const Bytes& more) {
    to.insert(to.end(), more.begin(), more.end());
}

/// Some bytes changed, cut, doubled or swapped.
[[nodiscard]] inline Bytes mutated(Bytes bytes, std::mt19937& random) {
    const auto below = [&](std::size_t count) {
        return static_cast<std::size_t>(random() % std::max<std::size_t>(count, 1));
    };
    for (std::size_t i = below(6) + 1; i > 0 && !bytes.empty(); --i) {
        switch (random() % 4) {
            case 0:
                bytes[below(bytes.size())] = static_cast<std::byte>(random());
                break;
            case 1:
                bytes.resize(below(bytes.size()) + 1);
                break;
            case 2:
                bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(below(bytes.size())),
                             static_cast<std::byte>("[]-9e/,\n"[random() % 8]));
                break;
            default:
                std::swap(bytes[below(bytes.size())], bytes[below(bytes.size())]);
                break;
        }
    }
    return bytes;
}

}  // namespace tessera::test
