/// Requests about the wall itself: how it is, its trackers, and what an application wants to be told of.
#pragma once

#include "common/request/EditRequests.h"

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

    static constexpr std::string_view kName = "SensorInfo";
    static constexpr void members(auto&& take) {
        take(member<&SensorInfo::sensor>(1, "sensor"),
             member<&SensorInfo::moves>(2, "moves").said("whom; empty: nobody"),
             member<&SensorInfo::poses>(3, "poses").said("taken so far"),
             member<&SensorInfo::refused>(4, "refused").said("none, or jumps that nobody makes"),
             member<&SensorInfo::rateHz>(5, "rate_hz").in("Hz"),
             member<&SensorInfo::ageMs>(6, "age_ms").in("ms").said("since the last pose; negative: none yet"),
             member<&SensorInfo::straysMm>(7, "strays_mm").in("mm").said("from where they were expected"),
             member<&SensorInfo::buttons>(8, "buttons").said("bit i: button i is pressed"));
    }
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

    static constexpr std::string_view kName = "TrackerInfo";
    static constexpr void members(auto&& take) {
        take(member<&TrackerInfo::name>(1, "name"), member<&TrackerInfo::protocol>(2, "protocol"),
             member<&TrackerInfo::address>(3, "address"),
             member<&TrackerInfo::trouble>(4, "trouble").said("the last thing that was wrong"),
             member<&TrackerInfo::datagrams>(5, "datagrams").said("so far; of a stream reads"),
             member<&TrackerInfo::strangers>(6, "strangers").said("datagrams from others"),
             member<&TrackerInfo::malformed>(7, "malformed"),
             member<&TrackerInfo::tooMany>(8, "too_many").said("not looked at: too fast, or more than a frame takes"),
             member<&TrackerInfo::sensors>(9, "sensors").atMost(&ApplicationLimits::maxSensors));
    }
};

/// A head as a frame shows it: metres, in the wall's frame.
struct HeadState {
    std::string user;
    bool tracked = false;     ///< false: it stands where the file, tessera-ctl or a silent tracker has left it
    std::uint64_t poses = 0;  ///< of its sensor, that this frame knows of
    Vec3d position = Vec3d::Zero();
    Quatd orientation = Quatd::Identity();

    static constexpr std::string_view kName = "HeadState";
    static constexpr void members(auto&& take) {
        take(member<&HeadState::user>(1, "user"), member<&HeadState::tracked>(2, "tracked"),
             member<&HeadState::poses>(3, "poses").said("of its sensor, so far"),
             member<&HeadState::position>(4, "position").in("m").said("in the wall's frame"),
             member<&HeadState::orientation>(5, "orientation"));
    }
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

    static constexpr std::string_view kName = "WandState";
    static constexpr void members(auto&& take) {
        take(member<&WandState::name>(1, "name"), member<&WandState::tracked>(2, "tracked"),
             member<&WandState::poses>(3, "poses").said("of its sensor, so far"),
             member<&WandState::position>(4, "position").in("m").said("in the wall's frame"),
             member<&WandState::orientation>(5, "orientation").said("its -Z points ahead"),
             member<&WandState::worldPosition>(6, "world_position").in("world units"),
             member<&WandState::worldOrientation>(7, "world_orientation"),
             member<&WandState::buttons>(8, "buttons").said("bit i: button i is pressed"),
             member<&WandState::axes>(9, "axes").atMost(&ApplicationLimits::maxAxes).said("-1 to 1 mostly"));
    }
};

/// Each frame's data that is wanted from now on.
struct Subscription {
    bool contacts = false, picks = false, frames = false;
    bool events = false;
    bool stays = false;  ///< with `events`: in every frame, pairs that go on touching too
    bool distances = false;
    bool questions = false;
    bool poses = false;
    bool states = false;  ///< of the wall itself, not of a frame: told where something of it is another than before

    static constexpr std::string_view kName = "Subscription";
    static constexpr void members(auto&& take) {
        take(member<&Subscription::contacts>(1, "contacts"),
             member<&Subscription::picks>(2, "picks").said("whoever picks"),
             member<&Subscription::frames>(3, "frames").said("which hosts have shown it"),
             member<&Subscription::events>(4, "events"),
             member<&Subscription::stays>(5, "stays").said("among the events pairs that go on touching"),
             member<&Subscription::distances>(6, "distances"), member<&Subscription::questions>(7, "questions"),
             member<&Subscription::poses>(8, "poses").said("heads and wands"),
             member<&Subscription::states>(9, "states").said("how hosts are, whether edits are taken"));
    }
};

namespace answer {

struct HostInfo {
    std::string name, state;
    FrameNumber lastShown;
    double roundTripMs = 0;

    static constexpr std::string_view kName = "HostInfo";
    static constexpr void members(auto&& take) {
        take(member<&HostInfo::name>(1, "name"), member<&HostInfo::state>(2, "state"),
             member<&HostInfo::lastShown>(3, "last_shown").said("frame"),
             member<&HostInfo::roundTripMs>(4, "round_trip_ms").in("ms"));
    }
};
/// A tile that the others waited for, of late (512 frames at most).
struct TileWait {
    std::string tile, host;
    std::uint64_t frames = 0;
    double ms = 0;       ///< altogether
    std::string reason;  ///< what it spent more time on than they did, most of all; words of report.json

    static constexpr std::string_view kName = "TileWait";
    static constexpr void members(auto&& take) {
        take(member<&TileWait::tile>(1, "tile"), member<&TileWait::host>(2, "host"),
             member<&TileWait::frames>(3, "frames"), member<&TileWait::ms>(4, "ms").in("ms").said("altogether"),
             member<&TileWait::reason>(5, "reason").said("what it spent more time on than the others did"));
    }
};
/// Of all since the server has started.
struct Figures {
    std::uint64_t count = 0;
    double halfMs = 0, p99Ms = 0;  ///< that half, and 99 of 100, do not exceed

    static constexpr std::string_view kName = "Figures";
    static constexpr void members(auto&& take) {
        take(member<&Figures::count>(1, "count"),
             member<&Figures::halfMs>(2, "half_ms").in("ms").said("that half of them do not exceed"),
             member<&Figures::p99Ms>(3, "p99_ms").in("ms").said("that 99 of 100 do not exceed"));
    }
};
struct Status {
    std::string wallName;
    Epoch epoch;
    FrameNumber frame;
    Sequence sequence;
    StateHash stateHash;
    std::vector<HostInfo> hosts;
    std::vector<std::string> waitingFor;
    std::uint64_t objects = 0, nodes = 0, undoDepth = 0, redoDepth = 0, applications = 0;
    std::string journal;                ///< the server's folder; empty: what is done does not survive it
    std::string journalTrouble;         ///< why nothing is written at present, and no edit is taken; empty: all is well
    std::vector<TileWait> waits;        ///< those waited for longest first
    std::uint64_t waitFrames = 0;       ///< frames that `waits` looks at
    std::vector<std::string> trackers;  ///< a line for each
    std::string
        navigation;  ///< the mode in which people move: "fly", "orbit", "walk"; empty: the server takes no input
    std::vector<std::string> steering;  ///< who moves the wall now, or has in the last second: hosts and applications
    double budgetMs = 0;                ///< for a frame; 0: none
    unsigned detail = 0;                ///< step of kDetailSteps that the next frame is drawn at
    std::vector<std::string> programs;  ///< a line for each SurfaceProgram that is bad or heavy
    Figures frames;                     ///< released: from Begin to then
    Figures barrier;                    ///< of them: from the first host that was ready
    std::uint64_t sentBytes = 0, receivedBytes = 0;  ///< on all links, since the server has started
    std::uint64_t journalBytes = 0;                  ///< written to it so far
    std::vector<std::string> keys;       ///< a line for each that ends within 30 days, and where nobody needs one
    double keyDays = 0;                  ///< until the first ends; 0: the server has none, or one has ended
    ExposureWish exposure;               ///< what people want in place of what the scene says
    std::optional<double> meteredStops;  ///< what the wall has found; none: no exposure is metered

    static constexpr ToldInfo kInfo{.name = "Status", .answer = 3, .help = "How the wall is"};
    static constexpr void members(auto&& take) {
        take(member<&Status::wallName>(1, "wall_name"), fixedMember<&Status::epoch>(2, "epoch"),
             member<&Status::frame>(3, "frame").said("the next one"),
             member<&Status::sequence>(4, "sequence").said("of the newest list"),
             fixedMember<&Status::stateHash>(5, "state_hash"),
             member<&Status::hosts>(6, "hosts").atMost(&ApplicationLimits::maxHosts),
             member<&Status::waitingFor>(7, "waiting_for")
                 .atMost(&ApplicationLimits::maxHosts)
                 .said("hosts that the first frame waits for"),
             member<&Status::objects>(8, "objects"), member<&Status::nodes>(9, "nodes"),
             member<&Status::undoDepth>(10, "undo_depth"), member<&Status::applications>(11, "applications"),
             member<&Status::redoDepth>(12, "redo_depth"),
             member<&Status::journal>(13, "journal").said("folder of the server; empty: it has none"),
             member<&Status::journalTrouble>(14, "journal_trouble")
                 .said("why nothing is written at present, and no edit is taken"),
             member<&Status::waits>(15, "waits")
                 .atMost(&ApplicationLimits::maxHosts)
                 .said("tiles that the others waited for of late, longest first"),
             member<&Status::waitFrames>(16, "wait_frames").said("that the waits look at"),
             member<&Status::navigation>(17, "navigation").said("the mode; empty: no input is taken"),
             member<&Status::steering>(18, "steering").atMost(&ApplicationLimits::maxHosts).said("who moves the wall"),
             member<&Status::trackers>(20, "trackers").atMost(&ApplicationLimits::maxHosts).said("a line for each"),
             member<&Status::budgetMs>(21, "budget_ms").in("ms").said("for a frame; 0: none"),
             member<&Status::detail>(22, "detail").said("step that the next frame is drawn at (common/wall/Detail.h)"),
             member<&Status::programs>(23, "programs")
                 .atMost(&ApplicationLimits::maxHosts)
                 .said("a line for each that is bad or heavy"),
             member<&Status::frames>(24, "frames").said("from their beginning to their release"),
             member<&Status::barrier>(25, "barrier").said("of frames: from the first ready host to the release"),
             member<&Status::sentBytes>(26, "sent_bytes").in("bytes").said("on all links"),
             member<&Status::receivedBytes>(27, "received_bytes").in("bytes").said("on all links"),
             member<&Status::journalBytes>(28, "journal_bytes").in("bytes").said("written to the journal"),
             member<&Status::keys>(29, "keys")
                 .atMost(&ApplicationLimits::maxHosts)
                 .said("a line for each that ends within 30 days"),
             member<&Status::keyDays>(30, "key_days")
                 .in("days")
                 .said("until the first ends; 0: there are none, or one has ended"),
             member<&Status::exposure>(31, "exposure").said("what people want in place of what the scene says"),
             member<&Status::meteredStops>(32, "metered_stops")
                 .said("that the wall has found; absent: no exposure is metered"));
    }
};

struct Trackers {
    std::vector<TrackerInfo> trackers;

    static constexpr ToldInfo kInfo{
        .name = "Trackers", .answer = 20, .help = "What the wall's trackers say, and how well"};
    static constexpr void members(auto&& take) {
        take(member<&Trackers::trackers>(1, "trackers").atMost(&ApplicationLimits::maxTrackers));
    }
};

/// Who asks, as the server knows them.
struct Identity {
    std::string name;
    Role role = Role::kViewer;

    static constexpr ToldInfo kInfo{.name = "Identity", .answer = 15, .help = "Who asks, and what they may do"};
    static constexpr void members(auto&& take) {
        take(member<&Identity::name>(1, "name"),
             member<&Identity::role>(2, "role").said("each may do what those before it may"));
    }
};

/// Somebody who is connected as an application.
struct Person {
    std::string name;     ///< as proved: of a key, a token, the server's user; empty: nobody was asked for anything
    std::string program;  ///< as it calls itself
    Role role = Role::kViewer;
    double seconds = 0;  ///< since it came
    bool you = false;

    static constexpr std::string_view kName = "Person";
    static constexpr void members(auto&& take) {
        take(member<&Person::name>(1, "name").said("as proved: of a key, a token, the server's user"),
             member<&Person::program>(2, "program").said("as it calls itself"), member<&Person::role>(3, "role"),
             member<&Person::seconds>(4, "seconds").in("s").said("since it came"), member<&Person::you>(5, "you"));
    }
};
struct People {
    std::vector<Person> people;
    std::uint64_t leftOut = 0;

    static constexpr ToldInfo kInfo{.name = "People", .answer = 23, .help = "Who is connected, in which role"};
    static constexpr void members(auto&& take) {
        take(member<&People::people>(1, "people").atMost(&ApplicationLimits::maxPeople).said("in the order of coming"),
             member<&People::leftOut>(2, "left_out").said("who are there, but more than are listed"));
    }
};

}  // namespace answer

template <>
struct WordsOf<Role> {
    static constexpr std::array<std::string_view, 3> kWords{nameOf(Role::kViewer), nameOf(Role::kEditor),
                                                            nameOf(Role::kOperator)};
};

namespace notice {

/// What one host did for one frame. Durations are by its own clock, points in time by the server's.
struct HostWork {
    std::string host;
    double readyMs = 0;  ///< from the frame's beginning until the server heard that it had been drawn
    double workMs = 0;   ///< all of its work; the others are parts of it, those of several tiles added up
    double applyMs = 0, cullMs = 0, drawMs = 0, handOverMs = 0;
    FrameNumber lastShown;  ///< the newest of which the server has heard that people see it
    double shownMs = 0;     ///< for so long, at this frame's release

    static constexpr std::string_view kName = "HostWork";
    static constexpr void members(auto&& take) {
        take(
            member<&HostWork::host>(1, "host"),
            member<&HostWork::readyMs>(2, "ready_ms")
                .in("ms")
                .said("from the frame's beginning until the server heard that it had been drawn"),
            member<&HostWork::workMs>(3, "work_ms").in("ms").said("by the host's clock; the next four are parts of it"),
            member<&HostWork::applyMs>(4, "apply_ms").in("ms").said("changes of the scene"),
            member<&HostWork::cullMs>(5, "cull_ms").in("ms").said("choosing what is drawn, all tiles"),
            member<&HostWork::drawMs>(6, "draw_ms").in("ms").said("drawing, all tiles"),
            member<&HostWork::handOverMs>(7, "hand_over_ms")
                .in("ms")
                .said("to windows and to whoever looks, all tiles"),
            member<&HostWork::lastShown>(8, "last_shown")
                .said("the newest of which the server has heard that people see it"),
            member<&HostWork::shownMs>(9, "shown_ms").in("ms").said("for so long, at this frame's release"));
    }
};

struct Frame {
    FrameNumber frame;
    std::vector<std::string> shown, held;
    double frameMs = 0;           ///< from its beginning until it was released
    double releasedMs = 0;        ///< when that was, by the server's clock, which counts from some beginning
    std::vector<HostWork> works;  ///< of hosts that have shown it

    static constexpr ToldInfo kInfo{.name = "Frame", .notice = 1, .help = "A frame was shown"};
    static constexpr void members(auto&& take) {
        take(member<&Frame::frame>(1, "frame"),
             member<&Frame::shown>(2, "shown").atMost(&ApplicationLimits::maxHosts).said("hosts that have shown it"),
             member<&Frame::held>(3, "held")
                 .atMost(&ApplicationLimits::maxHosts)
                 .said("hosts that go on showing an earlier one"),
             member<&Frame::frameMs>(4, "frame_ms").in("ms").said("from its beginning until it was released"),
             member<&Frame::releasedMs>(5, "released_ms")
                 .in("ms")
                 .said("when it was released, by a clock of the server's that only goes forward"),
             member<&Frame::works>(6, "works")
                 .atMost(&ApplicationLimits::maxHosts)
                 .said("what hosts that have shown it did for it"));
    }
};

/// Of each frame as it is made, before it is drawn.
struct Poses {
    FrameNumber frame;
    std::vector<HeadState> heads;  ///< all users, in the wall's order
    std::vector<WandState> wands;

    static constexpr ToldInfo kInfo{
        .name = "Poses", .notice = 7, .help = "Heads and wands of a frame, before it is drawn"};
    static constexpr void members(auto&& take) {
        take(member<&Poses::frame>(1, "frame"),
             member<&Poses::heads>(2, "heads")
                 .atMost(&ApplicationLimits::maxPoses)
                 .said("of all users, in the wall's order"),
             member<&Poses::wands>(3, "wands").atMost(&ApplicationLimits::maxPoses));
    }
};

/// How the wall is, as far as that is faults and who is there: told at once to who subscribes, and then when something
/// of it is another than before; each kStatesPeriod at most.
struct States {
    std::vector<answer::HostInfo> hosts;
    std::string journalTrouble;  ///< Status::journalTrouble
    std::uint64_t applications = 0;
    std::uint64_t comings = 0;  ///< and goings of applications: another number, other people

    static constexpr ToldInfo kInfo{
        .name = "States", .notice = 8, .help = "How hosts are, and whether edits are taken"};
    static constexpr void members(auto&& take) {
        take(member<&States::hosts>(1, "hosts").atMost(&ApplicationLimits::maxHosts),
             member<&States::journalTrouble>(2, "journal_trouble")
                 .said("why nothing is written at present, and no edit is taken"),
             member<&States::applications>(3, "applications"),
             member<&States::comings>(4, "comings").said("and goings of applications, so far"));
    }
};

}  // namespace notice

namespace request {

struct GetStatus {
    using Answer = answer::Status;
    static constexpr RequestInfo kInfo{
        .number = 3, .name = "GetStatus", .help = "How the wall is: hosts, frame, scene, journal, detail"};
    static constexpr void members(auto&& take) { take(); }
};

struct GetTrackers {
    using Answer = answer::Trackers;
    static constexpr RequestInfo kInfo{
        .number = 20, .name = "GetTrackers", .help = "What the wall's trackers say, and how well"};
    static constexpr void members(auto&& take) { take(); }
};

/// Replaces what this application has subscribed to.
struct SubscribeNews {
    Subscription wanted;

    using Answer = answer::Done;
    static constexpr RequestInfo kInfo{.number = 9,
                                       .name = "SubscribeNews",
                                       .help = "What the application is told of every frame from now on",
                                       .ownLink = true,
                                       .example = R"({"frames":true,"contacts":true})"};
    static constexpr void members(auto&& take) { take(spreadMember<&SubscribeNews::wanted>(1)); }
};

struct WhoAmI {
    using Answer = answer::Identity;
    static constexpr RequestInfo kInfo{.number = 31,
                                       .name = "WhoAmI",
                                       .help = "As whom the server knows this application, and its role",
                                       .forPanels = true};
    static constexpr void members(auto&& take) { take(); }
};

struct GetPeople {
    using Answer = answer::People;
    static constexpr RequestInfo kInfo{
        .number = 36, .name = "GetPeople", .help = "Who is connected to this server, and in which role"};
    static constexpr void members(auto&& take) { take(); }
};

using OfStatus = std::variant<GetStatus, GetTrackers, SubscribeNews, WhoAmI, GetPeople>;

}  // namespace request

/// As the house calls it, where it asks by itself.
using StatusQuestion = request::GetStatus;

}  // namespace tessera
