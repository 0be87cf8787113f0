/// Descriptions of values that other modules own: their members as they stand in requests, answers and records.
#pragma once

#include "common/change/Value.h"
#include "common/input/InputState.h"
#include "common/math/NodeMove.h"
#include "common/math/Placing.h"
#include "common/math/Pose.h"
#include "common/math/Ray.h"
#include "common/request/Members.h"
#include "common/wall/Exposure.h"
#include "common/wall/Navigation.h"
#include "common/wall/Showing.h"

namespace tessera {

template <>
struct WordsOf<UpAxis> {
    static constexpr std::array<std::string_view, 3> kWords{"of_file", "y", "z"};
};
template <>
struct WordsOf<NavigationMode> {
    static constexpr std::array<std::string_view, 3> kWords = kNavigationModeNames;
};
template <>
struct WordsOf<ToneMap> {
    static constexpr std::array kWords = kToneMapNames;
};
template <>
struct WordsOf<Showing> {
    static constexpr std::array<std::string_view, 3> kWords{"scene", "test_picture", "counted_test_picture"};
};

template <>
struct MembersOf<Placing> {
    static constexpr std::string_view kName = "Placing";
    static constexpr void members(auto&& take) {
        constexpr double kMost = kMaxPlacingCoordinate, kScale = kMaxPlacingScale;
        take(member<&Placing::at>(1, "at")
                 .in("units of the parent")
                 .between(-kMost, kMost)
                 .said("where the file's origin comes; with fit the middle of its underside"),
             member<&Placing::scale>(2, "scale").between(1 / kScale, kScale).said("of the file's lengths"),
             member<&Placing::fit>(3, "fit")
                 .in("units of the parent")
                 .between(1 / kScale, kScale)
                 .said("instead of a scale: how long the longest side becomes"),
             member<&Placing::up>(4, "up").said("which way is up in the file"),
             member<&Placing::pointRadius>(5, "point_radius")
                 .in("units of the file")
                 .between(0, kMaxPlacedRadius)
                 .butNotZero()
                 .said("of all its points"));
    }
};

template <>
struct MembersOf<ExposureWish> {
    static constexpr std::string_view kName = "ExposureWish";
    static constexpr void members(auto&& take) {
        take(member<&ExposureWish::stops>(1, "stops")
                 .between(-kMostStops, kMostStops)
                 .said("of radiance, on top of what is metered; absent: it stays"),
             member<&ExposureWish::metered>(2, "metered").said("once for all tiles; absent: it stays"),
             member<&ExposureWish::toneMap>(3, "tone_map").said("absent: it stays"));
    }
};

template <>
struct MembersOf<NodeMove> {
    static constexpr std::string_view kName = "NodeMove";
    static constexpr void members(auto&& take) {
        take(member<&NodeMove::translation>(1, "translation").in("units of the parent").said("absent: it stays"),
             member<&NodeMove::rotation>(2, "rotation").said("of any length but zero; absent: it stays"),
             member<&NodeMove::scale>(3, "scale").butNotZero().said("absent: it stays"),
             member<&NodeMove::relative>(4, "relative").said("from where it is in the frame that makes the edit"));
    }
};

template <>
struct MembersOf<Pose> {
    static constexpr std::string_view kName = "Pose";
    static constexpr void members(auto&& take) {
        take(member<&Pose::translation>(1, "translation").in("units of the parent"),
             member<&Pose::rotation>(2, "rotation"), member<&Pose::scale>(3, "scale"));
    }
};

template <>
struct MembersOf<Ray> {
    static constexpr std::string_view kName = "Ray";
    static constexpr void members(auto&& take) {
        take(member<&Ray::origin>(1, "origin").in("world units"),
             member<&Ray::direction>(2, "direction").said("of any length but zero"));
    }
};

template <>
struct MembersOf<InputState> {
    static constexpr std::string_view kName = "InputState";
    static constexpr void members(auto&& take) {
        take(member<&InputState::source>("source").said("does not count: an application has one"),
             member<&InputState::held>("held").said("bit 0: faster"),
             member<&InputState::lookRight>("look_right")
                 .in("1/65536 of a window's height")
                 .said("turned so far, counted around; in JSON also below 0")
                 .countedAround(),
             member<&InputState::lookDown>("look_down").in("1/65536 of a window's height").countedAround(),
             member<&InputState::panRight>("pan_right")
                 .in("1/65536 of a window's height")
                 .said("shifted so far, counted around")
                 .countedAround(),
             member<&InputState::panDown>("pan_down").in("1/65536 of a window's height").countedAround(),
             member<&InputState::wheel>("wheel")
                 .in("1/65536 of a click")
                 .said("turned away so far, counted around")
                 .countedAround(),
             member<&InputState::right>("right").in("1/32767 of all the way"),
             member<&InputState::up>("up").in("1/32767 of all the way"),
             member<&InputState::back>("back").in("1/32767 of all the way"),
             member<&InputState::turnRight>("turn_right").in("1/32767 of all the way"),
             member<&InputState::turnUp>("turn_up").in("1/32767 of all the way"),
             member<&InputState::rollRight>("roll_right").in("1/32767 of all the way"),
             member<&InputState::cursorX>("cursor_x")
                 .in("1/65535 of the tile")
                 .said("of an application of the first screen's mosaic"),
             member<&InputState::cursorY>("cursor_y").in("1/65535 of the tile").said("from above"),
             member<&InputState::asked>("asked").said("how often each action has been asked for, counted around"));
    }
};

/// Of what a commit made of placeholders.
template <>
struct MembersOf<std::pair<ObjectId, ObjectId>> {
    static constexpr std::string_view kName = "GivenId";
    using GivenId = std::pair<ObjectId, ObjectId>;
    static constexpr void members(auto&& take) {
        take(member<&GivenId::first>("placeholder"), member<&GivenId::second>("id"));
    }
};

}  // namespace tessera
