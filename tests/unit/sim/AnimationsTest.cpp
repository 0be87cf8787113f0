/// Animations in frames: what they drive, who wins, what stops them, what they cost; followed through histories beside
/// a look at all of them.
#include "common/cores/Inline.h"
#include "common/cores/Manipulator.h"
#include "common/cores/PointLight.h"
#include "server/sim/frame/Animations.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>

#include "server/sim/frame/Simulation.h"
#include "tests/property/Seeds.h"
#include "tests/support/words/Words.h"
#include "tests/unit/sim/SceneForTests.h"
#include "tests/unit/sim/SingleEdits.h"

namespace tessera {
namespace {

using test::ListMaker;
using test::moveTo;
using test::one;
using test::placeOf;
using test::transformAt;

Blob doublesOf(const std::vector<double>& numbers) {
    return Blob::of(std::span<const double>(numbers));
}

ObjectId keyFrames(ListMaker& make, ObjectId target, const std::string& field, const std::vector<double>& times,
                   const std::vector<double>& values, std::int64_t interpolation = KeyFrames::kLinear) {
    const ObjectId id = make.create<KeyFrames>();
    setField<&KeyFrames::target>(make.builder, id, target);
    setField<&KeyFrames::field>(make.builder, id, field);
    setField<&KeyFrames::times>(make.builder, id, doublesOf(times));
    setField<&KeyFrames::values>(make.builder, id, doublesOf(values));
    setField<&KeyFrames::interpolation>(make.builder, id, interpolation);
    return id;
}

ObjectId animation(ListMaker& make, const std::string& name, const RefList& channels) {
    const ObjectId id = make.create<Animation>();
    setField<&Animation::channels>(make.builder, id, channels);
    make.node(name, kRootNode, id);
    return id;
}

/// /crane goes from x = 0 to 6 in a second and turns; /lamp's intensity from 1 to 3; /wall stands in the way. One
/// animation plays both, in a loop.
ChangeList animatedScene(bool withInterest) {
    ListMaker make;
    const ObjectId place = make.transform(Vec3d::Zero());
    const ObjectId crane = make.node("crane", kRootNode, place);
    make.node("hook", crane, make.box(Vec3d::Ones()));
    make.node("bricks", make.node("wall", kRootNode, make.transform(Vec3d(4, 0, 0))), make.box(Vec3d(1, 4, 4)));
    const ObjectId lamp = make.create<PointLight>();
    make.node("lamp", kRootNode, lamp);
    animation(make, "take",
              {keyFrames(make, place, "translation", {0, 1}, {0, 0, 0, 6, 0, 0}),
               keyFrames(make, lamp, "intensity", {0, 1}, {1, 3})});
    if (withInterest) {
        const ObjectId interest = make.create<Interest>();
        make.builder.set(interest, typeOf<Interest>(), fieldId<&Interest::object>, crane);
        make.node("interest", kRootNode, interest);
    }
    return make.builder.take();
}

Simulation playing(ChangeList list) {
    Simulation simulation;
    const Expected<CommittedFrame> frame = simulation.load({std::move(list)});
    EXPECT_TRUE(frame) << (frame ? "" : frame.error().message);
    (void)simulation.step(true, {});
    return simulation;
}
ObjectId coreAt(const Simulation& simulation, const std::string& path) {
    return simulation.scene().get<Node>(findNode(simulation.scene(), path).value())->core;
}
const Animation& take(const Simulation& simulation) {
    return *simulation.scene().get<Animation>(coreAt(simulation, "/take"));
}
float lamp(const Simulation& simulation) {
    return simulation.scene().get<PointLight>(coreAt(simulation, "/lamp"))->intensity;
}
void frames(Simulation& simulation, int count) {
    for (int i = 0; i < count; ++i) (void)simulation.step(false, {});
}
template <auto kField, typename Value>
void setTake(Simulation& simulation, const Value& value) {
    ChangeListBuilder builder;
    setField<kField>(builder, coreAt(simulation, "/take"), value);
    const FrameResult frame = simulation.step(false, one(builder.take()));
    ASSERT_TRUE(frame.outcomes.front().result) << frame.outcomes.front().result.error().message;
}

TEST(Animations, DriveTransformsAndOtherFieldsASixtiethAFrame) {
    Simulation simulation = playing(animatedScene(false));
    EXPECT_EQ(placeOf(simulation.scene(), "/crane").x(), 0);
    EXPECT_EQ(lamp(simulation), 1);
    frames(simulation, 30);
    EXPECT_NEAR(placeOf(simulation.scene(), "/crane").x(), 3, 1e-9);
    EXPECT_NEAR(lamp(simulation), 2, 1e-6);
    EXPECT_NEAR(take(simulation).time, 0.5, 1e-12);
    frames(simulation, 45);  // around once
    EXPECT_NEAR(placeOf(simulation.scene(), "/crane").x(), 1.5, 1e-9);
    EXPECT_NEAR(take(simulation).time, 0.25, 1e-9);
    EXPECT_FALSE(simulation.step(false, one(Edit::Kind::kUndo)).outcomes.front().result)
        << "playing is no step of undo";
}

TEST(Animations, PauseSeekSpeedAndModesAreFieldsLikeOthers) {
    Simulation simulation = playing(animatedScene(false));
    setTake<&Animation::playing>(simulation, false);
    const double x = placeOf(simulation.scene(), "/crane").x();
    frames(simulation, 10);
    EXPECT_EQ(placeOf(simulation.scene(), "/crane").x(), x);
    setTake<&Animation::time>(simulation, 0.75);
    frames(simulation, 1);
    EXPECT_NEAR(placeOf(simulation.scene(), "/crane").x(), 4.5, 1e-12) << "what stands is shown where it was set to";
    EXPECT_NEAR(lamp(simulation), 2.5, 1e-6);
    (void)simulation.step(false, one(moveTo(transformAt(simulation.scene(), "/crane"), Vec3d(0, 9, 0))));
    frames(simulation, 5);
    EXPECT_EQ(placeOf(simulation.scene(), "/crane"), Vec3d(0, 9, 0)) << "it is shown once, and then left to others";

    setTake<&Animation::speed>(simulation, -2.0);
    setTake<&Animation::playing>(simulation, true);
    frames(simulation, 14);
    EXPECT_NEAR(take(simulation).time, 0.75 - 2 * 14.0 / 60, 1e-9);
    frames(simulation, 15);
    EXPECT_NEAR(take(simulation).time, 0.75 - 2 * 29.0 / 60 + 1, 1e-9) << "backwards around the loop";
    setTake<&Animation::mode>(simulation, Animation::kOnce);
    frames(simulation, 60);
    EXPECT_EQ(take(simulation).time, 0);
    setTake<&Animation::speed>(simulation, 1.0);
    frames(simulation, 100);
    EXPECT_EQ(take(simulation).time, 1);
    EXPECT_NEAR(placeOf(simulation.scene(), "/crane").x(), 6, 1e-12);
    setTake<&Animation::time>(simulation, 0.5);
    frames(simulation, 1);
    EXPECT_NEAR(take(simulation).time, 0.5 + 1.0 / 60, 1e-9) << "a seek while it plays";
    setTake<&Animation::mode>(simulation, Animation::kPingPong);
    frames(simulation, 60);
    EXPECT_LT(placeOf(simulation.scene(), "/crane").x(), 6 * 0.6) << "on the way back";
}

TEST(Animations, OneThatIsPausedHasTheTimeOfThePictureThatIsShown) {
    for (const bool byHand : {false, true}) {
        Simulation simulation = playing(animatedScene(false));
        frames(simulation, 7);
        if (byHand) {  // on the lamp, which leaves the crane where the animation has led it
            ChangeListBuilder bright;
            setField<&PointLight::intensity>(bright, coreAt(simulation, "/lamp"), 9.0f);
            (void)simulation.step(false, one(bright.take()));
        } else {
            setTake<&Animation::playing>(simulation, false);
        }
        ASSERT_FALSE(take(simulation).playing);
        const double told = take(simulation).time;
        EXPECT_NEAR(placeOf(simulation.scene(), "/crane").x(), 6 * told, 1e-12) << byHand;
        EXPECT_NEAR(lamp(simulation), byHand ? 9 : 1 + 2 * told, 1e-6) << "the hand's value stays";
        frames(simulation, 3);
        EXPECT_EQ(take(simulation).time, told);
        EXPECT_NEAR(placeOf(simulation.scene(), "/crane").x(), 6 * told, 1e-12) << byHand;
        EXPECT_NEAR(lamp(simulation), byHand ? 9 : 1 + 2 * told, 1e-6);
    }
}

TEST(Animations, OneThatIsPausedInItsFirstFrameIsShownWhereItIsSought) {
    Simulation simulation = playing(animatedScene(false));
    setTake<&Animation::playing>(simulation, false);
    setTake<&Animation::time>(simulation, 0.0);  // as it was when the pause came
    frames(simulation, 2);
    EXPECT_EQ(take(simulation).time, 0);
    EXPECT_EQ(placeOf(simulation.scene(), "/crane").x(), 0);
    EXPECT_EQ(lamp(simulation), 1);
}

TEST(Animations, OneThatIsPausedAndSoughtInOneFrameStandsWhereItWasSought) {
    for (const bool toWhereItIs : {false, true}) {
        Simulation simulation = playing(animatedScene(false));
        frames(simulation, 7);
        const double wanted = toWhereItIs ? take(simulation).time : 0.75;
        ChangeListBuilder builder;
        setField<&Animation::playing>(builder, coreAt(simulation, "/take"), false);
        setField<&Animation::time>(builder, coreAt(simulation, "/take"), wanted);
        (void)simulation.step(false, one(builder.take()));
        frames(simulation, 1);
        EXPECT_EQ(take(simulation).time, wanted);
        EXPECT_NEAR(placeOf(simulation.scene(), "/crane").x(), 6 * wanted, 1e-12);
    }
}

TEST(Animations, AWayBackThatIsLongerThanTimesGoEndsWhereTheyEnd) {
    ListMaker make;
    const ObjectId place = make.transform(Vec3d::Zero());
    make.node("crane", kRootNode, place);
    const ObjectId longest =
        animation(make, "take", {keyFrames(make, place, "translation", {0, kLatestKeySeconds}, {0, 0, 0, 6, 0, 0})});
    setField<&Animation::mode>(make.builder, longest, Animation::kPingPong);
    setField<&Animation::time>(make.builder, longest, kLatestKeySeconds);
    setField<&Animation::speed>(make.builder, longest, 1e6);
    Simulation simulation = playing(make.builder.take());
    frames(simulation, 3);
    EXPECT_EQ(take(simulation).time, kLatestKeySeconds);
    EXPECT_NEAR(placeOf(simulation.scene(), "/crane").x(), 6, 1e-9);
}

TEST(Animations, AHandOnWhatOneDrivesPausesItAndOnOtherFieldsDoesNot) {
    Simulation simulation = playing(animatedScene(false));
    frames(simulation, 6);
    ChangeListBuilder colour;
    setField<&PointLight::color>(colour, coreAt(simulation, "/lamp"), Vec3f(1, 0, 0));
    (void)simulation.step(false, one(colour.take()));
    EXPECT_TRUE(take(simulation).playing) << "nobody animates the colour";
    ChangeListBuilder bright;
    setField<&PointLight::intensity>(bright, coreAt(simulation, "/lamp"), 9.0f);
    (void)simulation.step(false, one(bright.take()));
    EXPECT_FALSE(take(simulation).playing);
    frames(simulation, 3);
    EXPECT_EQ(lamp(simulation), 9);
    (void)simulation.step(false, one(Edit::Kind::kUndo));
    EXPECT_TRUE(take(simulation).playing) << "undo gives it back";
    frames(simulation, 1);
    EXPECT_LT(lamp(simulation), 3);
    (void)simulation.step(false, one(moveTo(transformAt(simulation.scene(), "/crane"), Vec3d(0, 5, 0))));
    EXPECT_FALSE(take(simulation).playing);
    frames(simulation, 2);
    EXPECT_EQ(placeOf(simulation.scene(), "/crane"), Vec3d(0, 5, 0));
}

TEST(Animations, AHandOnAnotherPartOfATransformGoesTogetherWithOne) {
    Simulation simulation = playing(animatedScene(false));
    frames(simulation, 6);
    ChangeListBuilder scale;
    setField<&Transform::scale>(scale, transformAt(simulation.scene(), "/crane"), Vec3d(2, 2, 2));
    (void)simulation.step(false, one(scale.take()));
    EXPECT_TRUE(take(simulation).playing);
    frames(simulation, 1);
    EXPECT_EQ(simulation.scene().get<Transform>(transformAt(simulation.scene(), "/crane"))->scale, Vec3d(2, 2, 2));
    EXPECT_NEAR(placeOf(simulation.scene(), "/crane").x(), 0.8, 1e-9);
}

TEST(Animations, WhatTheyMoveIsStoppedByAWallAndTheirTimeStands) {
    Simulation simulation = playing(animatedScene(true));
    setTake<&Animation::mode>(simulation, Animation::kOnce);
    frames(simulation, 120);
    EXPECT_LE(placeOf(simulation.scene(), "/crane").x(), 3.0);
    EXPECT_GT(placeOf(simulation.scene(), "/crane").x(), 2.98);
    EXPECT_LT(take(simulation).time, 0.52);
    EXPECT_NEAR(lamp(simulation), 1 + 2 * take(simulation).time, 1e-6) << "as do all its values";
    const FrameResult held = simulation.step(false, {});
    EXPECT_FALSE(held.commit.list) << "nothing is sent meanwhile";
    (void)simulation.step(false, one(moveTo(transformAt(simulation.scene(), "/wall"), Vec3d(4, 20, 0))));
    for (int i = 0; i < 20; ++i) {
        frames(simulation, 1);
        EXPECT_NEAR(lamp(simulation), 1 + 2 * take(simulation).time, 1e-6);
    }
    frames(simulation, 40);
    EXPECT_NEAR(placeOf(simulation.scene(), "/crane").x(), 6, 1e-9) << "it goes on when the way is free";
}

TEST(Animations, OneThatIsPausedOrSoughtAtAWallHasTheValuesOfItsTime) {
    for (const bool seeks : {false, true}) {
        Simulation simulation = playing(animatedScene(true));
        frames(simulation, 45);
        EXPECT_LT(take(simulation).time, 0.52);
        if (seeks) {
            setTake<&Animation::time>(simulation, 0.9);
            frames(simulation, 1);
        }
        setTake<&Animation::playing>(simulation, false);
        EXPECT_NEAR(lamp(simulation), 1 + 2 * take(simulation).time, 1e-6);
        frames(simulation, 3);
        EXPECT_NEAR(lamp(simulation), 1 + 2 * take(simulation).time, 1e-6);
    }
}

TEST(Animations, ArraysTravelByTheBytesThatDiffer) {
    ListMaker make;
    const ObjectId box = make.box(Vec3d::Ones());
    make.node("box", kRootNode, box);
    const MeshArrays arrays = makeBox(Vec3d::Ones()).toArrays();
    std::vector<double> values(arrays.positions.as<float>().begin(), arrays.positions.as<float>().end());
    const std::size_t each = values.size();
    values.insert(values.end(), values.begin(), values.begin() + static_cast<std::ptrdiff_t>(each));
    values[each + 4] += 1;  // one coordinate of one vertex
    animation(make, "take", {keyFrames(make, box, "positions", {0, 1}, values)});
    Simulation simulation = playing(make.builder.take());
    const FrameResult frame = simulation.step(false, {});
    ASSERT_TRUE(frame.commit.list);
    ASSERT_EQ(frame.commit.list->ranges.size(), 1u);
    EXPECT_EQ(frame.commit.list->ranges[0].offset, 16u);
    EXPECT_EQ(frame.commit.list->ranges[0].bytes.sizeBytes(), 4u);
    frames(simulation, 29);
    EXPECT_NEAR(simulation.scene().get<Geometry>(coreAt(simulation, "/box"))->positions.as<float>()[4],
                arrays.positions.as<float>()[4] + 0.5f, 1e-5);
}

TEST(Animations, OfTwoOnOneFieldTheLaterOneDecidesAndSharedKeyFramesPlayAtEachOnesTime) {
    ListMaker make;
    const ObjectId lampCore = make.create<PointLight>();
    make.node("lamp", kRootNode, lampCore);
    const ObjectId rising = keyFrames(make, lampCore, "intensity", {0, 1}, {0, 1});
    animation(make, "first", {keyFrames(make, lampCore, "intensity", {0, 1}, {50, 60}), rising});
    animation(make, "take", {rising});
    Simulation simulation = playing(make.builder.take());
    frames(simulation, 30);
    EXPECT_NEAR(lamp(simulation), 0.5, 1e-6);
    setTake<&Animation::speed>(simulation, 0.0);
    frames(simulation, 6);
    EXPECT_NEAR(lamp(simulation), 31.0 / 60, 1e-6)
        << "the later one, though it stands still: a frame after the edit's own";
    setTake<&Animation::playing>(simulation, false);
    frames(simulation, 1);
    EXPECT_NEAR(lamp(simulation), 39.0 / 60, 1e-6) << "the first one's last channel, at its own time";
}

TEST(Animations, WhatTheSceneRefusesPausesThatOneAndIsNamed) {
    ListMaker make;
    const ObjectId box = make.box(Vec3d::Ones());
    make.node("box", kRootNode, box);
    const ObjectId lampCore = make.create<PointLight>();
    make.node("lamp", kRootNode, lampCore);
    animation(make, "bad", {keyFrames(make, box, "texcoords", {0, 1}, {0, 0, 1, 1})});  // one vertex's, of a box
    animation(make, "take", {keyFrames(make, lampCore, "intensity", {0, 1}, {0, 1})});
    Simulation simulation;
    ASSERT_TRUE(simulation.load({make.builder.take()}));
    const FrameResult frame = simulation.step(true, {});
    ASSERT_EQ(frame.remarks.size(), 1u);
    EXPECT_WORDS(frame.remarks[0]);
    EXPECT_FALSE(simulation.scene().get<Animation>(coreAt(simulation, "/bad"))->playing);
    EXPECT_TRUE(simulation.step(false, {}).remarks.empty());
    frames(simulation, 29);
    EXPECT_NEAR(lamp(simulation), 0.5, 1e-6) << "the other plays on";
}

TEST(Animations, UnsoundKeyFramesAreRefusedWhenTheSceneIsEdited) {
    Simulation simulation = playing(animatedScene(false));
    const ObjectId channel = take(simulation).channels[1];
    const auto refused = [&](auto&& edit) {
        ChangeListBuilder builder;
        edit(builder);
        const StateHash before = simulation.scene().stateHash();
        const Expected<answer::Committed> result = simulation.step(true, one(builder.take())).outcomes.front().result;
        ASSERT_FALSE(result);
        EXPECT_WORDS(result.error().message);
        EXPECT_EQ(simulation.scene().stateHash(), before) << "nothing of it is left";
    };
    refused([&](auto& b) { setField<&KeyFrames::field>(b, channel, "colour"); });
    refused([&](auto& b) { setField<&KeyFrames::times>(b, channel, doublesOf({1, 0})); });
    refused([&](auto& b) { setField<&KeyFrames::times>(b, channel, Blob()); });
    refused([&](auto& b) {
        setField<&KeyFrames::times>(b, channel, doublesOf({0, std::numeric_limits<double>::quiet_NaN()}));
    });
    refused([&](auto& b) { setField<&KeyFrames::values>(b, channel, doublesOf({0})); });
    refused([&](auto& b) { setField<&KeyFrames::target>(b, channel, ObjectId()); });
    refused(
        [&](auto& b) { b.setRange(channel, typeOf<KeyFrames>(), fieldId<&KeyFrames::values>, 0, doublesOf({-1})); });
    refused([&](auto& b) {
        const ObjectId fresh(kFirstPlaceholder), light(kFirstPlaceholder + 1);
        b.create(fresh, typeOf<KeyFrames>());
        b.create(light, typeOf<PointLight>());
        setField<&KeyFrames::target>(b, fresh, light);
        setField<&KeyFrames::field>(b, fresh, "translation");
        setField<&KeyFrames::times>(b, fresh, doublesOf({0}));
        setField<&KeyFrames::values>(b, fresh, doublesOf({0}));
    });
    // Fields that the server alone writes.
    const std::vector<std::pair<ObjectType, const char*>> ofServer{{typeOf<Node>(), "ofServer"},
                                                                   {typeOf<Manipulator>(), "held"},
                                                                   {typeOf<Manipulator>(), "sizes"},
                                                                   {typeOf<Inline>(), "state"}};
    for (const auto& [type, field] : ofServer)
        refused([&, of = type, name = field](auto& b) {
            const ObjectId fresh(kFirstPlaceholder), target(kFirstPlaceholder + 1);
            b.create(fresh, typeOf<KeyFrames>());
            b.create(target, of);
            setField<&KeyFrames::target>(b, fresh, target);
            setField<&KeyFrames::field>(b, fresh, std::string(name));
            setField<&KeyFrames::times>(b, fresh, doublesOf({0}));
            setField<&KeyFrames::values>(b, fresh, doublesOf({0}));
        });
    frames(simulation, 30);
    EXPECT_NEAR(lamp(simulation), 2, 1e-6);
    // A target cannot go while key frames name it.
    ChangeListBuilder gone;
    const ObjectId node = findNode(simulation.scene(), "/lamp").value();
    gone.detach(node);
    gone.destroy(node);
    gone.destroy(coreAt(simulation, "/lamp"));
    EXPECT_FALSE(simulation.step(false, one(gone.take())).outcomes.front().result);
}

TEST(Animations, CostWhatPlaysNotWhatIsThere) {
    std::vector<std::uint64_t> played, checked;
    for (const int nodes : {1'000, 100'000}) {
        ListMaker make;
        const ObjectId lampCore = make.create<PointLight>();
        make.node("lamp", kRootNode, lampCore);
        for (int i = 0; i < nodes; ++i) (void)make.node("n", kRootNode);
        for (int i = 0; i < nodes / 100; ++i) {
            const ObjectId resting = animation(make, "rest", {keyFrames(make, lampCore, "range", {0, 1}, {1, 2})});
            setField<&Animation::playing>(make.builder, resting, false);
        }
        animation(make, "take", {keyFrames(make, lampCore, "intensity", {0, 1}, {0, 1})});
        Simulation simulation = playing(make.builder.take());
        const std::uint64_t checkedBefore = simulation.animations().keysChecked(),
                            playedBefore = simulation.animations().framesPlayed();
        EXPECT_EQ(simulation.animations().playingCount(), 1u);
        frames(simulation, 50);
        checked.push_back(simulation.animations().keysChecked() - checkedBefore);
        played.push_back(simulation.animations().framesPlayed() - playedBefore);
    }
    EXPECT_EQ(checked, (std::vector<std::uint64_t>{0, 0})) << "keys are looked at when they change";
    EXPECT_EQ(played, (std::vector<std::uint64_t>{50, 50}));
}

// ---- histories

struct Wanted {
    std::vector<std::pair<ObjectId, double>> steps;
    std::map<std::pair<std::uint64_t, std::uint16_t>, std::vector<double>> poses;  // by transform and field
    bool operator==(const Wanted&) const = default;
};

void put(Wanted& wanted, ObjectId transform, const AnimatedTransform& is) {
    if (is.translation)
        wanted.poses[{transform.value, 0}] = {is.translation->x(), is.translation->y(), is.translation->z()};
    if (is.rotation)
        wanted.poses[{transform.value, 1}] = {is.rotation->w(), is.rotation->x(), is.rotation->y(), is.rotation->z()};
    if (is.scale) wanted.poses[{transform.value, 2}] = {is.scale->x(), is.scale->y(), is.scale->z()};
}

/// Every animation looked at, every key checked.
Wanted byLooking(const Aspect& scene) {
    Wanted wanted;
    for (const ObjectId id : scene.ids()) {
        const Animation* a = scene.get<Animation>(id);
        if (!a || !a->playing) continue;
        std::vector<std::pair<ObjectId, KeyTrack>> sound;
        double last = 0;
        for (const ObjectId channel : a->channels) {
            const KeyFrames& f = *scene.get<KeyFrames>(channel);
            const Object target = f.target ? scene.find(f.target) : Object();
            if (const Expected<KeyTrack> track = KeyTrack::of(f, target ? &target.info() : nullptr))
                sound.emplace_back(f.target, *track), last = std::max(last, track->lastTime());
        }
        const double time = foldedTime(a->time + a->speed * 0.25, last, a->mode);
        wanted.steps.emplace_back(id, time);
        for (const auto& [target, track] : sound) {
            const std::string_view field = track.field().name;
            wanted.poses[{target.value, field == "translation" ? 0
                                        : field == "rotation"  ? 1
                                                               : 2}] = track.at(shownTime(time, last, a->mode));
        }
    }
    return wanted;
}

TEST(Animations, FollowedThroughAnyHistoryTheyWantWhatALookAtAllSays) {
    std::size_t steps = 0, poses = 0;
    forSeeds(40, [&](Random& random) {
        Committer committer;
        Animations followed;
        std::vector<ObjectId> transforms, channels, animations;
        std::vector<ChangeList> back;
        const auto present = [&](std::vector<ObjectId>& ids) {
            std::erase_if(ids, [&](ObjectId id) { return !committer.scene().find(id); });
        };
        for (int step = 0; step < 120; ++step) {
            Expected<Committer::Applied> applied = fail(ErrorCode::kRefused, "");
            if (!back.empty() && oneIn(random, 6)) {
                applied = committer.applyInverse(std::make_shared<const ChangeList>(std::move(back.back())));
                back.pop_back();
            } else {
                ListMaker make;
                ChangeListBuilder& b = make.builder;
                const auto any = [&](const std::vector<ObjectId>& ids) {
                    return ids.empty() ? ObjectId() : ids[below(random, ids.size())];
                };
                const auto field = [&] {
                    return std::string(std::array{"translation", "rotation", "scale"}[below(random, 3)]);
                };
                const auto keys = [&](std::size_t width) {
                    std::vector<double> values;
                    for (std::size_t i = 0; i < 2 * width; ++i)
                        values.push_back(1 + static_cast<double>(below(random, 9)));
                    return values;
                };
                switch (below(random, 9)) {
                    case 0:
                        make.transform(Vec3d::Zero());
                        break;
                    case 1:
                        if (const ObjectId target = any(transforms)) {
                            const std::string name = field();
                            keyFrames(make, target, name, {0, 1.0 + static_cast<double>(below(random, 3))},
                                      keys(name == "rotation" ? 4 : 3));
                        } else {
                            make.create<KeyFrames>();
                        }
                        break;
                    case 2:
                        setField<&Animation::channels>(b, make.create<Animation>(),
                                                       channels.empty() ? RefList() : RefList{any(channels)});
                        break;
                    case 3:
                        if (const ObjectId id = any(animations)) setField<&Animation::playing>(b, id, oneIn(random, 2));
                        break;
                    case 4:
                        if (const ObjectId id = any(animations))
                            setField<&Animation::time>(b, id, static_cast<double>(below(random, 50)) / 10);
                        break;
                    case 5:
                        if (const ObjectId id = any(animations))
                            setField<&Animation::mode>(b, id, static_cast<std::int64_t>(below(random, 3)));
                        break;
                    case 6:
                        if (const ObjectId id = any(animations); id && !channels.empty()) {
                            RefList all;
                            for (const ObjectId channel : channels)
                                if (oneIn(random, 3)) all.push_back(channel);
                            setField<&Animation::channels>(b, id, all);
                        }
                        break;
                    case 7:
                        if (const ObjectId id = any(channels))
                            oneIn(random, 2)
                                ? setField<&KeyFrames::times>(
                                      b, id, doublesOf({0, 0.5 + static_cast<double>(below(random, 4))}))
                                : b.setRange(id, typeOf<KeyFrames>(), fieldId<&KeyFrames::values>, 8, doublesOf({3}));
                        break;
                    default:
                        if (const ObjectId id = any(oneIn(random, 2) ? animations : channels)) b.destroy(id);
                }
                if (b.empty()) continue;
                applied = committer.apply(b.take(), Committer::Inverse::kMade);
                if (applied) back.push_back(std::move(applied->inverse));
            }
            if (!applied) continue;
            for (const ObjectId id : committer.scene().ids()) {
                const Object object = committer.scene().find(id);
                auto* list = object.is<Transform>()   ? &transforms
                             : object.is<KeyFrames>() ? &channels
                             : object.is<Animation>() ? &animations
                                                      : nullptr;
                if (list && std::ranges::find(*list, id) == list->end()) list->push_back(id);
            }
            present(transforms), present(channels), present(animations);
            if (oneIn(random, 4)) (void)committer.closeFrame();
            followed.update(committer.scene(), oneIn(random, 25) ? nullptr : applied->list.get());
            Wanted now;
            Animations copy = followed;  // what stands is shown once, by the copy
            const auto plays = [&](ObjectId id) { return committer.scene().get<Animation>(id)->playing; };
            ASSERT_EQ(followed.playingCount(), static_cast<std::size_t>(std::ranges::count_if(animations, plays)));
            if (std::ranges::all_of(animations, plays)) {
                AnimationWishes wishes = copy.advance(committer.scene(), 0.25);
                for (const AnimationStep& s : wishes.steps) now.steps.emplace_back(s.animation, s.time);
                for (const auto& [id, transform] : wishes.transforms.ascending()) put(now, id, transform);
                ASSERT_EQ(now, byLooking(committer.scene())) << "step " << step;
                steps += now.steps.size();
                poses += now.poses.size();
            }
        }
    });
    if (std::getenv("TESSERA_SEED")) return;
    EXPECT_GT(steps, 300u);
    EXPECT_GT(poses, 200u);
}

}  // namespace
}  // namespace tessera
