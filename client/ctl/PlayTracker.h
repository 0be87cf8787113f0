/// A tracker for people who have none: datagrams of DTrack or OSC, from a file or round in a circle.
#pragma once

#include "client/ctl/Answer.h"
#include "client/ctl/CommandLine.h"
#include "common/base/Bytes.h"

namespace tessera {

/// At `time` seconds after the start: metres, right-handed.
struct PlayedPose {
    double time = 0;
    Vec3d position = Vec3d::Zero();
    Quatd orientation = Quatd::Identity();
};

/// A circle of 0.3 m about (0, 1.7, 2), once in four seconds, looking along -Z.
[[nodiscard]] PlayedPose circlePose(double time);
/// Lines of TIME X Y Z, or TIME X Y Z QW QX QY QZ, times ascending; # begins a comment. kBadInput with the line.
[[nodiscard]] Expected<std::vector<PlayedPose>> readTrackerPoses(const std::string& path);
/// The file's pose at a time, between its lines; past its end it begins again.
[[nodiscard]] PlayedPose poseAt(const std::vector<PlayedPose>& poses, double time);

/// One datagram. DTrack's tells of body `sensor`, or of a flystick whose buttons are `buttons`.
[[nodiscard]] Bytes dtrackDatagram(std::uint64_t frame, int sensor, bool flystick, std::uint32_t buttons,
                                   const PlayedPose& pose);
[[nodiscard]] Bytes oscDatagram(int sensor, const PlayedPose& pose);

/// Sends for `seconds`. kNetwork: an address that cannot be reached from here.
[[nodiscard]] Expected<Answer> play(const verb::PlayTracker& wish);

}  // namespace tessera
