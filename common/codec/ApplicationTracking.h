/// What applications are told of trackers, heads and wands.
#pragma once

#include <string>
#include <vector>

#include "common/base/HistoryIds.h"
#include "common/math/Types.h"

namespace tessera {

/// What a tracker says of one sensor, and how well.
struct SensorInfo {
    std::string sensor;         ///< "body 0"
    std::string moves;          ///< "head viewer, wand right"; empty: nobody
    std::uint64_t poses = 0;    ///< taken so far
    std::uint64_t refused = 0;  ///< no poses, or jumps that nobody makes
    double rateHz = 0;          ///< of late
    double ageMs = 0;           ///< since the last pose; negative: none yet
    double straysMm = 0;        ///< from where they were expected, along one axis, of late
    std::uint32_t buttons = 0;
};
struct TrackerInfo {
    std::string name, protocol, address;
    std::string trouble;  ///< the last thing that was wrong; empty: nothing was
    // So far. Of a stream: reads.
    std::uint64_t datagrams = 0;  ///< from who may say something
    std::uint64_t strangers = 0;  ///< from others
    std::uint64_t malformed = 0;  ///< refused as a whole
    std::uint64_t tooMany = 0;    ///< not looked at: too fast, or more than a frame takes
    std::vector<SensorInfo> sensors;
};

/// A head as a frame shows it: metres, in the wall's frame.
struct HeadState {
    std::string user;
    bool tracked = false;     ///< false: it stands where the file, tessera-ctl or a silent tracker has left it
    std::uint64_t poses = 0;  ///< of its sensor, that this frame knows of
    Vec3d position = Vec3d::Zero();
    Quatd orientation = Quatd::Identity();
};
/// A wand: its -Z points ahead. Metres in the wall's frame; world units in the world's.
struct WandState {
    std::string name;
    bool tracked = false;
    std::uint64_t poses = 0;
    Vec3d position = Vec3d::Zero();
    Quatd orientation = Quatd::Identity();
    Vec3d worldPosition = Vec3d::Zero();
    Quatd worldOrientation = Quatd::Identity();
    // None pressed, and 0, where it has been silent for a quarter of a second.
    std::uint32_t buttons = 0;  ///< bit i: button i is pressed
    std::vector<double> axes;   ///< -1 to 1 mostly: as the device says
};

namespace answer {
struct Trackers {
    std::vector<TrackerInfo> trackers;
};
}  // namespace answer

namespace notice {
/// Of each frame as it is made, before it is drawn.
struct Poses {
    FrameNumber frame;
    std::vector<HeadState> heads;  ///< all users, in the wall's order
    std::vector<WandState> wands;
};
}  // namespace notice

}  // namespace tessera
