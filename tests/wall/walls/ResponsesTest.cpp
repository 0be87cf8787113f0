/// The ways in which a wall answers to what would touch: the lanes of
/// tests/data/scenes/collisions.tsct, beside what their measures say.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "common/application/Application.h"
#include "common/cores/Transform.h"
#include "common/scene/FieldTable.h"
#include "tests/support/wall/AskedWall.h"

namespace tessera::simulation {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

// How far from the obstacle a motion may end: 1e-4 sizes of the moving geometry; a cart is 1 x 0.8 x 1 m.
const double kStopTolerance = 1e-4 * std::sqrt(1 + 0.64 + 1);
// How deep a free body rests in another: 2e-3 sizes of the smaller one (RigidBodyStage's slop), a box of 0.8 m, and a
// tenth for what still swings.
const double kRest = 1.1 * 2e-3 * std::sqrt(3 * 0.64);

/// The entry that speaks of these two.
const json* entryOf(const json& entries, const std::string& a, const std::string& b) {
    const auto found = std::ranges::find_if(entries, [&](const json& entry) { return between(entry, a, b); });
    return found == entries.end() ? nullptr : &*found;
}

/// An application of this wall.
std::unique_ptr<Application> join(AskedWall& wall, const std::string& name) {
    auto connected = Application::connect({.address = toString(wall.address()), .name = name}, wall.platform(name));
    EXPECT_TRUE(connected) << connected.error().message;
    return connected ? std::move(*connected) : nullptr;
}

/// Keeps what it is told of pairs and distances, frame by frame.
void follow(Application& application, std::vector<json>& frames) {
    const auto entryOf = [&application](ObjectId a, ObjectId b, TouchPhase phase) {
        return json{{"objects", {pathOf(application.scene(), a), pathOf(application.scene(), b)}},
                    {"phase", WordsOf<TouchPhase>::kWords[static_cast<std::size_t>(phase)]}};
    };
    EXPECT_TRUE(application.onPairEvents([&frames, entryOf](const answer::PairEvents& told) {
        json events = json::array();
        for (const PairEventValue& event : told.events) {
            json& entry = events.emplace_back(entryOf(event.objectA, event.objectB, event.phase));
            entry["through"] = event.through;
            entry["first_time"] = event.firstTime;
        }
        frames.push_back({{"events", std::move(events)}});
    }));
    EXPECT_TRUE(application.onDistances([&frames, entryOf](const answer::Distances& told) {
        json distances = json::array();
        for (const PairDistanceValue& near : told.distances)
            distances.push_back(entryOf(near.objectA, near.objectB, near.phase));
        frames.push_back({{"distances", std::move(distances)}});
    }));
}

/// The phases of a pair, in order, from its frames' events or distances.
std::vector<std::string> phasesOf(const std::vector<json>& frames, const std::string& list, const std::string& a,
                                  const std::string& b) {
    std::vector<std::string> phases;
    for (const json& frame : frames)
        if (frame.contains(list))
            for (const json& entry : frame[list])
                if (between(entry, a, b) && entry["phase"] != "stays")
                    phases.push_back(entry.value("through", false) ? "through" : entry["phase"].get<std::string>());
    return phases;
}

/// When in their frames' motion the two began to touch.
std::vector<double> firstTimesOf(const std::vector<json>& frames, const std::string& a, const std::string& b) {
    std::vector<double> times;
    for (const json& frame : frames)
        if (frame.contains("events"))
            for (const json& entry : frame["events"])
                if (between(entry, a, b) && (entry["phase"] == "began" || entry["through"] == true))
                    times.push_back(entry["first_time"]);
    return times;
}

TEST(Responses, SlideRollbackAndDistanceAreThoseOfTheScenesMeasures) {
    AskedWall wall({.widthPx = 160, .heightPx = 90});
    const std::unique_ptr<Application> follower = join(wall, "follower");
    ASSERT_TRUE(follower);
    std::vector<json> frames;
    follow(*follower, frames);
    // 2 m is the post's place, 0.15 half its thickness, 0.5 half the cart's length.
    const double stop = 2 - 0.15 - 0.5;
    const AskedWall::Moved stopped = wall.move("/stop/cart", {"10", "0", "0", "--by"});
    EXPECT_TRUE(stopped.stopped);
    EXPECT_LE(stopped.place.x(), stop + 1e-7);
    EXPECT_GE(stopped.place.x(), stop - kStopTolerance);
    wall.settle();
    const json contacts = wall.contacts();
    const json* contact = entryOf(contacts, "/stop/cart", "/stop/post");
    ASSERT_NE(contact, nullptr);
    EXPECT_NEAR((*contact)["time"].get<double>(), (stop + 3) / 10, kStopTolerance)
        << "of the stop, in later frames too, as long as both stay";
    EXPECT_NEAR((*contact)["point"][0].get<double>(), 1.85, kStopTolerance);
    EXPECT_EQ((*contact)["interest"], "/stop/interest");

    // The same lane, reported only: into the post, out of it, through it.
    wall.tell({"set", "/stop/interest", "response", "report"});
    wall.tell({"move", "/stop/cart", "-3", "0.45", "2"});
    EXPECT_FALSE(wall.move("/stop/cart", {"5", "0", "0", "--by"}).stopped);
    const json events = wall.ask({"contacts", "--events"})["events"];
    const json* touching = entryOf(events, "/stop/cart", "/stop/post");
    ASSERT_NE(touching, nullptr);
    EXPECT_EQ((*touching)["interest"], "/stop/interest");
    wall.tell({"move", "/stop/cart", "-3", "0.45", "2"});
    EXPECT_FALSE(wall.move("/stop/cart", {"10", "0", "0", "--by"}).stopped);

    // The wall of the second lane is 0.2 m thick and turned by 45° about y: it meets the cart where their distance
    // along its normal n = (1, 0, 1)/√2 is its half thickness and the cart's extent, and takes the rest of the way's n.
    const double half = std::numbers::sqrt2 / 2;
    const double reach = 0.1 + 0.5 * half + 0.5 * half;
    const double meets = 1.5 + 0.5 - reach / half, wanted = -3 + 5;
    const Vec3d end(meets + (wanted - meets) / 2, 0.45, -(wanted - meets) / 2);
    EXPECT_NEAR(end.x(), 1.429, 1e-3);
    const AskedWall::Moved slid = wall.move("/slide/cart", {"5", "0", "0", "--by"});
    EXPECT_NEAR(slid.place.x(), end.x(), 2 * kStopTolerance);
    EXPECT_NEAR(slid.place.y(), 0.45, 1e-9);
    EXPECT_NEAR(slid.place.z(), end.z(), 2 * kStopTolerance);
    const double apart = -((slid.place.x() - 1.5) * half + (slid.place.z() - 0.5) * half) - reach;
    EXPECT_GE(apart, -1e-7) << "it is not within the wall";

    // Of two that come towards each other both go back to when they would touch: 3.35 m between them, 8 m wanted.
    const std::unique_ptr<Application> joined = join(wall, "two hands");
    ASSERT_TRUE(joined);
    Application& hands = *joined;
    const auto transformOf = [&](const std::string& path) {
        const Expected<ObjectId> node = findNode(hands.scene(), path);
        return node ? hands.scene().get<Node>(*node)->core : ObjectId{};
    };
    ChangeListBuilder both;
    both.set(transformOf("/rollback/cart"), typeOf<Transform>(), fieldId<&Transform::translation>,
             toValue(Vec3d(3, 0.45, -2)));
    both.set(transformOf("/rollback/post"), typeOf<Transform>(), fieldId<&Transform::translation>,
             toValue(Vec3d(-1, 0.75, -2)));
    const auto committed = hands.propose(both.take());
    ASSERT_TRUE(committed) << committed.error().message;
    EXPECT_EQ(committed->stopped.size(), 2u);
    const double first = (0.85 - -2.5) / 8;
    const Vec3d cart = wall.placeOf("/rollback/cart"), post = wall.placeOf("/rollback/post");
    EXPECT_NEAR(cart.x(), -3 + first * 6, 2 * kStopTolerance);
    EXPECT_NEAR(post.x(), 1 - first * 2, 2 * kStopTolerance);
    EXPECT_NEAR((cart.x() + 3) / 6, (1 - post.x()) / 2, 1e-9) << "one time for both";
    EXPECT_LE(cart.x() + 0.5, post.x() - 0.15 + 1e-7);

    // Nearer than 1.5 m is near; the probe's front is 0.2 m ahead of it, the target's face at 0.8.
    const auto nearness = [&] { return wall.ask({"contacts", "--distances"})["distances"]; };
    EXPECT_TRUE(nearness().empty()) << nearness().dump(2);
    wall.tell({"move", "/distance/probe", "-1", "0.45", "-4"});
    EXPECT_TRUE(nearness().empty()) << "1.6 m is not near";
    wall.tell({"move", "/distance/probe", "-0.5", "0.45", "-4"});
    const json near = nearness();
    ASSERT_EQ(near.size(), 1u) << near.dump(2);
    EXPECT_NEAR(near[0]["distance"].get<double>(), 1.1, 1e-6);
    EXPECT_EQ(near[0]["interest"], "/distance/interest");
    EXPECT_NEAR(near[0]["points"][0][0].get<double>(), -0.3, 1e-6);
    EXPECT_NEAR(near[0]["points"][1][0].get<double>(), 0.8, 1e-6);
    wall.tell({"move", "/distance/probe", "-2", "0.45", "-4"});
    wall.settle();  // the frame in which nearness ends still tells of it
    EXPECT_TRUE(nearness().empty());
    EXPECT_FALSE(wall.move("/distance/probe", {"1.1", "0.45", "-4"}).stopped) << "it is reported, not stopped";
    ASSERT_EQ(nearness().size(), 1u);
    EXPECT_EQ(nearness()[0]["distance"].get<double>(), 0) << "one is in the other";

    wall.settle();
    const json report = wall.finish();
    ASSERT_FALSE(report.is_null());
    while (follower->poll(0ms)) continue;
    EXPECT_TRUE(follower->serverIsOver());
    using Phases = std::vector<std::string>;
    EXPECT_EQ(phasesOf(frames, "events", "/stop/cart", "/stop/post"),
              (Phases{"began", "ended", "began", "ended", "through"}));
    const std::vector<double> times = firstTimesOf(frames, "/stop/cart", "/stop/post");
    ASSERT_EQ(times.size(), 3u);
    EXPECT_NEAR(times[0], (stop + 3) / 10, kStopTolerance / 10) << "what stopped it";
    EXPECT_NEAR(times[1], (stop + 3) / 5, kStopTolerance / 5);
    EXPECT_NEAR(times[2], (stop + 3) / 10, kStopTolerance / 10);
    EXPECT_EQ(phasesOf(frames, "distances", "/distance/probe", "/distance/target"),
              (Phases{"began", "ended", "began"}));
    const json& told = report["collision"];
    ASSERT_EQ(told["distances"].size(), 1u);
    EXPECT_EQ(told["distances"][0]["distance"], 0.0);
    EXPECT_EQ(entryOf(told["contact_list"], "/stop/cart", "/stop/post"), nullptr) << "it is through";
    EXPECT_EQ(told["events"]["left_out"], 0);
    EXPECT_EQ(told["not_looked_at"]["count"], 0);
}

TEST(Responses, FreeBodiesFallBounceAndComeToRestByTheirFrames) {
    AskedWall wall({.wall = "1x1", .widthPx = 160, .heightPx = 90, .starts = false});
    // Who follows before there is a host has seen every frame.
    const std::unique_ptr<Application> joined = join(wall, "follower");
    ASSERT_TRUE(joined);
    Application& follower = *joined;
    const auto idOf = [&](const std::string& path) { return findNode(follower.scene(), path).value_or(ObjectId{}); };
    const ObjectId ball = idOf("/bodies/ball"), pushed = idOf("/bodies/pushed"), pusher = idOf("/pusher");
    ASSERT_TRUE(ball && pushed && pusher);
    const auto placeOf = [&](ObjectId node) {
        return follower.scene().coreOf<Transform>(*follower.scene().get<Node>(node))->translation;
    };
    std::vector<std::uint64_t> bounces;
    bool wasPushed = false;
    FrameNumber frame;
    ASSERT_TRUE(follower.onPairEvents([&](const answer::PairEvents& told) {
        frame = told.frame;
        for (const PairEventValue& event : told.events) {
            if (event.phase != TouchPhase::kBegan) continue;
            if (event.objectA == ball || event.objectB == ball) bounces.push_back(told.frame.value);
            wasPushed |= (event.objectA == pusher && event.objectB == pushed) ||
                         (event.objectA == pushed && event.objectB == pusher);
        }
    }));
    double lowest = 10, highestAfterFirst = 0;
    follower.onChanges([&](const ChangeList&, Sequence) {
        const double height = placeOf(ball).y();
        lowest = std::min(lowest, height);
        if (bounces.size() == 1) highestAfterFirst = std::max(highestAfterFirst, height);
    });
    wall.start();
    const TimePoint deadline = wall.world().now() + 60s;
    while (frame < FrameNumber(300) && wall.world().now() < deadline) ASSERT_TRUE(follower.poll(1s));
    ASSERT_GE(frame.value, 300u) << wall.logs();

    // It falls 2.1 m and keeps 0.6 of its speed at each bounce; frame n is at n/60 s, and tells what it finds there.
    const double fall = std::sqrt(2 * 2.1 / 9.81);
    double at = fall;
    ASSERT_GE(bounces.size(), 4u);
    for (int bounce = 0; bounce < 4; ++bounce) {
        EXPECT_NEAR(static_cast<double>(bounces[static_cast<std::size_t>(bounce)]), std::ceil(60 * at), 1)
            << "bounce " << bounce;
        at += 2 * fall * std::pow(0.6, bounce + 1);
    }
    // Frames are 1/60 s apart: what is seen of the height is short of the top by at most g/2 (1/120 s)².
    EXPECT_NEAR(highestAfterFirst, 0.4 + 0.36 * 2.1, 0.02);
    EXPECT_GT(lowest, 0.4 - kRest) << "never into the floor";
    EXPECT_NEAR(placeOf(ball).y(), 0.4, kRest);
    EXPECT_NEAR(placeOf(pushed).y(), 0.4, kRest);
    // The block's front ends at -2 + 0.3; the crate is 0.8 m long and slides on from there, if at all.
    EXPECT_TRUE(wasPushed);
    EXPECT_GE(placeOf(pushed).x(), -2 + 0.3 + 0.4 - kRest);

    (void)wall.waitForRest();
    const json events = wall.ask({"contacts", "--events"})["events"];
    for (const char* body : {"/bodies/ball", "/bodies/crate", "/bodies/pushed"})
        EXPECT_NE(entryOf(events, body, "/floor"), nullptr) << body;
    const json report = wall.finish();
    ASSERT_FALSE(report.is_null());
    EXPECT_EQ(report["collision"]["free_bodies"], 3);
    EXPECT_EQ(report["collision"]["asleep"], 3);
    EXPECT_EQ(report["collision"]["not_looked_at"]["count"], 0);
}

}  // namespace
}  // namespace tessera::simulation
