/// The exposure of a wall's frames: what people ask for, and what is found by looking at the frames before.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "common/codec/FrameCodec.h"
#include "common/wall/Exposure.h"

namespace tessera {

/// Adds up how bright what all hosts have drawn is, and follows that with the exposure.
///
/// - What frame n shows counts for frame n + 1: all hosts are ready with n before n + 1 begins. So the exposure depends
///   on pictures alone, not on times, hosts, or tiles.
/// - The first frame that shows anything lit sets it at once. From then on it stays until it would be off by more than
///   kStays; then each frame comes nearer by a kEase-th of the rest, until it is there. Frames count, as everything
///   that moves by itself goes by them: 10 stops take 1.4 s at 60 frames/s.
/// - It is a whole number of steps, so a wall at rest comes to rest: its frames are the same ones again.
/// - Where a frame of a host is late, or the host is lost, its last one counts.
/// - A frame without anything lit changes nothing; one that no host has metered ends it, and the next one begins anew.
///
/// A state machine without a clock; frame thread only. Cost: 256 additions for each host and frame.
class ExposureMeter {
public:
    static constexpr std::int32_t kStays = Exposure::kStepsPerStop / 4;
    static constexpr std::int32_t kEase = 12;

    explicit ExposureMeter(const ExposureWish& wish) : exposure_{.wish = wish, .found = 0} {}

    /// From the next frame on; what is absent stays, but stops where it is to be metered. `reset`: first back to what
    /// the scene says.
    void ask(const ExposureWish& wish, bool reset);

    /// Of the next frame.
    [[nodiscard]] const Exposure& exposure() const { return exposure_; }
    /// Some host has metered the last frame.
    [[nodiscard]] bool meters() const { return !light_.empty(); }

    /// What one host drew of a frame; then that the frame is over. Frames come one after the other.
    void drawn(const std::string& host, const HostStats& stats);
    void released();

    /// How often `found` has changed.
    [[nodiscard]] std::uint64_t changes() const { return changes_; }

private:
    void take(std::int32_t found);

    Exposure exposure_;
    std::map<std::string, LightHistogram> light_;  ///< by host, of its last frame that was metered
    bool known_ = false;                           ///< something lit was seen
    bool moves_ = false;
    bool anyHost_ = false, anyMetered_ = false;  ///< of the frame that is open
    std::uint64_t changes_ = 0;
};

}  // namespace tessera
