/// Calibration beside matrices multiplied out, and what happens when trackers fall silent.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "TrackerBytes.h"
#include "server/sim/tracking/Tracking.h"
#include "tests/support/words/Words.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;

constexpr TimePoint kMorning = TimePoint{} + 5000s;

Wall trackedWall(WallTracker tracker, TrackedMount mount) {
    Wall wall;
    wall.users.push_back({.name = "viewer"});
    tracker.name = mount.tracker = "art";
    wall.tracking.trackers = {std::move(tracker)};
    wall.tracking.heads = {{.user = "viewer", .mount = mount}};
    return wall;
}
TrackerReading reading(TimePoint at, const SensorName& sensor, const Vec3d& position,
                       const Quatd& orientation = Quatd::Identity()) {
    return {.tracker = 0,
            .at = at,
            .reports = {{.sensor = sensor, .pose = RawPose{.position = position, .orientation = orientation}}}};
}

TEST(Tracking, PutsPosesIntoTheWallByFrameAxesUnitsAndOffset) {
    const unsigned seed = test::trackerSeed(7);
    TESSERA_TRACKER_SEED(seed, "Tracking.PutsPoses*");
    std::mt19937 random(seed);
    for (const char* axes : {"x y z", "x z -y", "-x y -z", "y z x", "x y -z", "-z x y", "z y x"}) {
        for (int round = 0; round < 30; ++round) {
            const test::SentPose frame = test::randomPose(random), sent = test::randomPose(random),
                                 offset = test::randomPose(random);
            WallTracker tracker;
            tracker.axes = axes;
            tracker.position = frame.position;
            tracker.orientation = frame.orientation;
            Tracking tracking(trackedWall(
                tracker,
                {.sensor = {SensorKind::kTool, 4}, .offset = 0.1 * offset.position, .turn = offset.orientation}));
            tracking.take(reading(kMorning, {SensorKind::kTool, 4}, 1000 * sent.position, sent.orientation));
            (void)tracking.advance(kMorning, kMorning);
            // As matrices: wall_T_head = frame · A · sensor · A⁻¹ · offset, where A takes coordinates of the tracker to
            // the wall's.
            Mat4d a = Mat4d::Identity();
            a.topLeftCorner<3, 3>() = *parseAxes(axes);
            const auto rigid = [](const Quatd& q, const Vec3d& p) {
                Mat4d m = Mat4d::Identity();
                m.topLeftCorner<3, 3>() = q.toRotationMatrix();
                m.topRightCorner<3, 1>() = p;
                return m;
            };
            const Mat4d expected = rigid(frame.orientation, frame.position) * a *
                                   rigid(sent.orientation, sent.position) * a.inverse() *
                                   rigid(offset.orientation, 0.1 * offset.position);
            const TrackedHead& head = tracking.heads().front();
            EXPECT_EQ(head.share, 1);
            EXPECT_LT((head.position - expected.topRightCorner<3, 1>()).norm(), 1e-9) << axes;
            EXPECT_LT((head.orientation.toRotationMatrix() - expected.topLeftCorner<3, 3>()).norm(), 1e-9) << axes;
        }
    }
}

TEST(Tracking, AxesAreEachNamedOnce) {
    for (const char* good : {"x y z", "x z -y", "-z +y x", "  y z x "})
        EXPECT_TRUE(parseAxes(good).has_value()) << good;
    for (const char* bad : {"", "x y", "x y y", "x y z w", "a b c", "x y --z", "x y z -"})
        EXPECT_FALSE(parseAxes(bad).has_value()) << bad;
}

TEST(Tracking, ASilentTrackerHoldsThenEasesBackAndSaysSo) {
    Tracking tracking(trackedWall({}, {}));
    EXPECT_TRUE(tracking.advance(kMorning, kMorning).empty());
    EXPECT_EQ(tracking.heads().front().share, 0);
    TimePoint at = kMorning;
    for (int i = 0; i < 60; ++i) tracking.take(reading(at += 16ms, {}, {100, 1700, 2000}));
    std::vector<std::string> said = tracking.advance(at, at + 16ms);
    ASSERT_EQ(said.size(), 1u);
    EXPECT_WORDS(said[0]);
    // Held for three seconds, where it was.
    EXPECT_TRUE(tracking.advance(at + 2900ms, at + 2916ms).empty());
    EXPECT_EQ(tracking.heads().front().share, 1);
    EXPECT_LT((tracking.heads().front().position - Vec3d(0.1, 1.7, 2)).norm(), 1e-6);
    said = tracking.advance(at + 3100ms, at + 3116ms);
    ASSERT_EQ(said.size(), 1u);
    EXPECT_WORDS(said[0]);
    double before = 1;
    for (auto silent = 3100ms; silent < 5100ms; silent += 16ms) {
        EXPECT_TRUE(tracking.advance(at + silent, at + silent).empty());
        const double share = tracking.heads().front().share;
        EXPECT_LE(share, before);
        EXPECT_GT(share, before - 0.02);
        before = share;
    }
    EXPECT_EQ(before, 0);
    tracking.take(reading(at + 60s, {}, {200, 1700, 2000}));
    said = tracking.advance(at + 60s, at + 60s);
    ASSERT_EQ(said.size(), 1u);
    EXPECT_WORDS(said[0]);
    EXPECT_EQ(tracking.heads().front().share, 1);
}

TEST(Tracking, AWandHasButtonsAxesAndAPlaceInTheWorldUntilItsTrackerIsSilent) {
    Wall wall = trackedWall({}, {});
    wall.tracking.wands = {{.name = "right", .mount = {.tracker = "art", .sensor = {SensorKind::kFlystick, 1}}}};
    Tracking tracking(wall);
    TrackerReading read =
        reading(kMorning, {SensorKind::kFlystick, 1}, {0, 1000, 0}, Quatd(Eigen::AngleAxisd(1, Vec3d::UnitY())));
    read.reports[0].buttons = 2;
    read.reports[0].buttonsSaid = 7;
    read.reports[0].axes[1] = -0.5;
    read.reports[0].axesSaid = 2;
    tracking.take(read);
    // A report of another button leaves the first pressed.
    tracking.take({.tracker = 0,
                   .at = kMorning,
                   .reports = {{.sensor = {SensorKind::kFlystick, 1}, .buttons = 4, .buttonsSaid = 4}}});
    (void)tracking.advance(kMorning, kMorning);
    View view;
    view.position = {10, 0, 0};
    view.orientation = Quatd(Eigen::AngleAxisd(0.5, Vec3d::UnitY()));
    view.worldUnitsPerMetre = 100;
    view.users = wall.users;
    notice::Poses poses = tracking.poses(FrameNumber(7), view);
    ASSERT_EQ(poses.wands.size(), 1u);
    const WandState& wand = poses.wands[0];
    EXPECT_TRUE(wand.tracked);
    EXPECT_EQ(wand.buttons, 6u);
    EXPECT_EQ(wand.axes, (std::vector<double>{0, -0.5}));
    EXPECT_LT((wand.worldPosition - Vec3d(10, 100, 0)).norm(), 1e-9);
    EXPECT_LT(wand.worldOrientation.angularDistance(Quatd(Eigen::AngleAxisd(1.5, Vec3d::UnitY()))), 1e-9);
    EXPECT_FALSE(poses.heads.at(0).tracked);
    (void)tracking.advance(kMorning + 10s, kMorning + 10s);
    poses = tracking.poses(FrameNumber(8), view);
    EXPECT_FALSE(poses.wands[0].tracked);
    EXPECT_EQ(poses.wands[0].buttons, 0u);
    EXPECT_EQ(poses.wands[0].axes, (std::vector<double>{0, 0}));
}

TEST(Tracking, VrpnsButtonsAreThoseOfAllItsWands) {
    WallTracker tracker;
    tracker.protocol = TrackerProtocol::kVrpn;
    Wall wall = trackedWall(tracker, {});
    wall.tracking.wands = {{.name = "right", .mount = {.tracker = "art", .sensor = {SensorKind::kBody, 1}}}};
    Tracking tracking(wall);
    tracking.take(reading(kMorning, {SensorKind::kBody, 1}, {1, 1, 1}));
    tracking.take({.tracker = 0, .at = kMorning, .reports = {{.buttons = 1, .buttonsSaid = 1}}});
    (void)tracking.advance(kMorning, kMorning);
    EXPECT_EQ(tracking.wands().front().buttons, 1u);
    EXPECT_EQ(tracking.wands().front().position, Vec3d(1, 1, 1));  // VRPN says metres
}

/// A wand at sensor 1 whose poses, stick and button come at the times that a test says.
struct HeldWand {
    explicit HeldWand(TrackerProtocol protocol = TrackerProtocol::kOsc)
        : tracking(wallWith(protocol)), hand(protocol == TrackerProtocol::kVrpn ? 0 : 1) {}
    static Wall wallWith(TrackerProtocol protocol) {
        WallTracker tracker;
        tracker.protocol = protocol;
        Wall wall = trackedWall(tracker, {});
        wall.tracking.wands = {{.name = "right", .mount = {.tracker = "art", .sensor = {SensorKind::kBody, 1}}}};
        return wall;
    }
    void pose(TimePoint at) { tracking.take(reading(at, {SensorKind::kBody, 1}, {1, 1, 1})); }
    void stick(TimePoint at, double value) {
        SensorReport said{.sensor = {SensorKind::kBody, hand}, .buttons = 1, .buttonsSaid = 1, .axesSaid = 2};
        said.axes[1] = value;
        tracking.take({.tracker = 0, .at = at, .reports = {said}});
    }
    /// What applications and the flight are told.
    const WandState& at(TimePoint now) {
        (void)tracking.advance(now, now);
        return tracking.wands().front();
    }
    Tracking tracking;
    int hand;
};
bool counts(const WandState& wand) {
    return wand.buttons == 1 && wand.axes == std::vector<double>{0, 1};
}
bool isLetGo(const WandState& wand) {
    return wand.buttons == 0 && std::ranges::all_of(wand.axes, [](double axis) { return axis == 0; });
}

/// At all rates of frames: what is between two frames is found in the times of what was said.
TEST(Tracking, AStickCountsAQuarterOfASecondAndIsForgottenWhenItsWandIsLost) {
    for (const TrackerProtocol protocol : {TrackerProtocol::kOsc, TrackerProtocol::kDtrack, TrackerProtocol::kVrpn})
        for (const auto frame : {5ms, 16ms, 250ms, 500ms, 8000ms}) {
            SCOPED_TRACE(testing::Message() << nameOf(protocol) << ", frames of " << frame.count() << " ms");
            HeldWand held(protocol);
            const auto from = kMorning, silent = from + 1s, again = silent + 6s, until = again + 2s;
            TimePoint heard = from;
            int held1 = 0, free = 0;
            for (TimePoint now = from; now < until; now += frame) {
                for (TimePoint at = now - frame + 1ms; at <= now; at += 1ms) {
                    if (at < from || (at > silent && at < again)) continue;
                    heard = at;
                    held.pose(at);
                    if (at <= silent) held.stick(at, 1);
                }
                const WandState& wand = held.at(now);
                const bool should = now <= silent + Tracking::kControlsCount && heard <= silent &&
                                    now - heard <= Tracking::kControlsCount;
                if (now == from) continue;  // nothing has come before the first millisecond
                EXPECT_TRUE(should ? counts(wand) : isLetGo(wand)) << (now - from).count() / 1'000'000 << " ms";
                ++(should ? held1 : free);
            }
            EXPECT_TRUE(free > 0 && (held1 > 0 || frame > 1s));
        }
}

TEST(Tracking, ADeviceThatTellsOfChangesAloneIsHeldWhilePosesGoOn) {
    for (const TrackerProtocol protocol : {TrackerProtocol::kOsc, TrackerProtocol::kVrpn}) {
        HeldWand held(protocol);
        held.pose(kMorning);
        held.stick(kMorning, 1);
        TimePoint at = kMorning;
        for (int i = 0; i < 1000; ++i) {
            held.pose(at += 16ms);
            ASSERT_TRUE(counts(held.at(at))) << i;
        }
        // Behind somebody's back for a second: nothing, nor later by itself. The hand may have let go there.
        EXPECT_TRUE(isLetGo(held.at(at + 1s)));
        EXPECT_TRUE(held.tracking.wands().front().tracked);
        EXPECT_EQ(held.tracking.describe(at + 1s)[0].sensors[static_cast<std::size_t>(held.hand)].buttons, 0u);
        held.pose(at += 1s);
        EXPECT_TRUE(isLetGo(held.at(at)));
        held.pose(at += 16ms);
        EXPECT_TRUE(isLetGo(held.at(at)));
        held.stick(at, 1);
        EXPECT_TRUE(counts(held.at(at)));
        // The same where no frame looked in between.
        held.pose(at += 1s);
        EXPECT_TRUE(isLetGo(held.at(at)));
        held.stick(at, 1);
        // What is no number is no wish, and not the one before.
        held.stick(at, std::numeric_limits<double>::infinity());
        EXPECT_EQ(held.at(at).axes.at(1), 0);
    }
}

/// Poses of a head are the same tracker's, and say nothing of the hand.
TEST(Tracking, AHeadDoesNotHoldAWandsStick) {
    HeldWand held(TrackerProtocol::kVrpn);
    held.pose(kMorning);
    held.stick(kMorning, 1);
    TimePoint at = kMorning;
    for (int i = 0; i < 30; ++i) held.tracking.take(reading(at += 16ms, {}, {0, 1, 0}));
    EXPECT_TRUE(isLetGo(held.at(at)));
}

TEST(Tracking, TheEndOfAConnectionLetsGoAndTheNextBeginsWithNothing) {
    HeldWand held(TrackerProtocol::kVrpn);
    held.pose(kMorning);
    held.stick(kMorning, 1);
    ASSERT_TRUE(counts(held.at(kMorning)));
    held.tracking.take({.tracker = 0, .at = kMorning + 1ms, .reports = {}, .connectionEnded = true});
    EXPECT_TRUE(isLetGo(held.at(kMorning + 2ms)));
    EXPECT_TRUE(held.tracking.wands().front().tracked) << "its place is held as any silent tracker's";
    held.pose(kMorning + 600ms);
    EXPECT_TRUE(isLetGo(held.at(kMorning + 600ms)));
    held.stick(kMorning + 610ms, 1);
    EXPECT_TRUE(counts(held.at(kMorning + 610ms)));
}

/// What waited somewhere comes at once, however it comes.
TEST(Tracking, RatesAreToldOverTimeNotOverBursts) {
    for (const int burst : {1, 2, 20, 100}) {
        Tracking tracking(trackedWall({}, {}));
        double most = 0;
        TimePoint at = kMorning;
        for (int i = 0; i < 600; ++i) {
            if (i % burst == 0) at += burst * 10ms;
            tracking.take(reading(at + std::chrono::nanoseconds(i % burst), {}, {0, 1700, 2000}));
            most = std::max(most, tracking.describe(at + 1us)[0].sensors[0].rateHz);
        }
        EXPECT_NEAR(tracking.describe(at + 1us)[0].sensors[0].rateHz, 100, 5) << burst;
        // In the first tenth of a second no two bursts count as more than they are.
        EXPECT_LT(most, 250) << burst;
    }
}

TEST(Tracking, TellsOfRatesAndRefusalsAndKeepsNoMoreSensorsThanItMay) {
    Tracking tracking(trackedWall({}, {}));
    TimePoint at = kMorning;
    for (int i = 0; i < 600; ++i) tracking.take(reading(at += 10ms, {}, {0, 1700, 2000}));
    tracking.take(reading(at, {}, {1e300, 0, 0}));
    TrackerReading many{.tracker = 0, .at = at};
    for (int i = 0; i < 500; ++i) many.reports.push_back({.sensor = {SensorKind::kMarker, i}, .pose = RawPose{}});
    tracking.take(many);
    const std::vector<TrackerInfo> told = tracking.describe(at + 20ms);
    ASSERT_EQ(told.size(), 1u);
    EXPECT_EQ(told[0].sensors.size(), Tracking::kMaxSensors);
    const SensorInfo& body = told[0].sensors.front();
    EXPECT_EQ(body.sensor, "body 0");
    EXPECT_EQ(body.moves, "head viewer");
    EXPECT_EQ(body.poses, 600u);
    EXPECT_EQ(body.refused, 1u);
    EXPECT_NEAR(body.rateHz, 100, 1);
    EXPECT_NEAR(body.ageMs, 20, 0.1);
}

}  // namespace
}  // namespace tessera
