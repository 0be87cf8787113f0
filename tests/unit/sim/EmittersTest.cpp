/// Clocks of particle emitters: how they go on, who wins, and that undo, journals, replays and whoever joins have the
/// same particles.
#include "server/sim/frame/Emitters.h"

#include <gtest/gtest.h>

#include "common/drawable/Drawable.h"
#include "server/sim/FrameMaker.h"
#include "server/sim/frame/Simulation.h"
#include "server/sim/recording/RecordingReplay.h"
#include "tests/support/words/Words.h"
#include "tests/unit/ReadableLog.h"
#include "tests/unit/TestFolder.h"
#include "tests/unit/sim/SceneForTests.h"
#include "tests/unit/sim/SingleEdits.h"

namespace tessera {
namespace {

/// /fountain, of 60 particles a second that live two seconds.
ChangeList fountain(const ParticleEmitter& like = {.rate = 60}) {
    test::ListMaker make;
    const ObjectId core = make.create<ParticleEmitter>();
    setAllFields(make.builder, core, Object::of(like));
    make.node("fountain", kRootNode, core);
    return make.builder.take();
}
ObjectId fountainIn(const Aspect& scene) {
    return scene.get<Node>(findNode(scene, "/fountain").value())->core;
}
const ParticleEmitter& emitterIn(const Aspect& scene) {
    return *scene.get<ParticleEmitter>(fountainIn(scene));
}
/// All that hosts make of it, by name.
MeshKey particlesIn(const Aspect& scene) {
    return drawableOf(scene, fountainIn(scene)).key();
}
template <auto kField, typename Value>
ChangeList fountainEdit(const Aspect& scene, const Value& value) {
    ChangeListBuilder list;
    setField<kField>(list, fountainIn(scene), value);
    return list.take();
}
void playOn(Simulation& simulation, int count) {
    for (int i = 0; i < count; ++i) (void)simulation.step(false, {});
}

/// A server's frames, recorded and kept where that is asked for.
struct FountainShow {
    explicit FountainShow(Journal* journal = nullptr)
        : maker({.simulation = simulation,
                 .view = view,
                 .blobs = blobs,
                 .report = report,
                 .log = log.log,
                 .journal = journal}) {}
    FrameResult frame(std::vector<Edit> edits = {}) {
        FrameResult result = maker.make(FrameNumber(next++), std::move(edits), {}, {});
        for (const EditOutcome& outcome : result.outcomes)
            EXPECT_TRUE(outcome.result) << outcome.result.error().message;
        return result;
    }
    [[nodiscard]] const Aspect& scene() const { return simulation.scene(); }

    Wall wall = test::wallOfOne();
    Simulation simulation;
    ViewSource view{wall, ""};
    BlobStore blobs;
    Report report{wall, ""};
    test::ReadableLog log;
    FrameMaker maker;
    std::uint64_t next = 0;  ///< frame
};

TEST(Emitters, TimeGoesOnBySixtiethsWhileTheyPlay) {
    Simulation simulation;
    ASSERT_TRUE(simulation.load({fountain({.speed = 2})}));
    EXPECT_FALSE(simulation.step(true, {}).commit.list) << "in the first frame all stands";
    playOn(simulation, 30);
    EXPECT_NEAR(emitterIn(simulation.scene()).time, 1, 1e-12);
    (void)simulation.step(false, test::one(fountainEdit<&ParticleEmitter::playing>(simulation.scene(), false)));
    const double stands = emitterIn(simulation.scene()).time;
    EXPECT_FALSE(simulation.step(false, {}).commit.list) << "what stands says nothing";
    EXPECT_EQ(emitterIn(simulation.scene()).time, stands);
}

TEST(Emitters, GoBackToTheBeginningAndNoFurther) {
    Simulation simulation;
    ASSERT_TRUE(simulation.load({fountain({.time = 0.5, .speed = -6})}));
    playOn(simulation, 20);
    EXPECT_EQ(emitterIn(simulation.scene()).time, 0);
    EXPECT_FALSE(simulation.step(false, {}).commit.list);
}

TEST(Emitters, AnEditOfTheTimeIsASeekThatHasTheLastWord) {
    Simulation simulation;
    ASSERT_TRUE(simulation.load({fountain()}));
    playOn(simulation, 3);
    (void)simulation.step(false, test::one(fountainEdit<&ParticleEmitter::time>(simulation.scene(), 20.0)));
    EXPECT_EQ(emitterIn(simulation.scene()).time, 20);
    playOn(simulation, 1);
    EXPECT_EQ(emitterIn(simulation.scene()).time, 20 + kSecondsPerFrame) << "and it plays on";
}

TEST(Emitters, ComeAndGoWithEditsAndFollowThem) {
    Simulation simulation;
    (void)simulation.step(true, {});
    const FrameResult made = simulation.step(false, test::one(fountain()));
    ASSERT_TRUE(made.outcomes[0].result) << made.outcomes[0].result.error().message;
    playOn(simulation, 6);
    EXPECT_NEAR(emitterIn(simulation.scene()).time, 6 * kSecondsPerFrame, 1e-12);
    ASSERT_TRUE(simulation.step(false, test::one(Edit::Kind::kUndo)).outcomes[0].result);
    EXPECT_FALSE(findNode(simulation.scene(), "/fountain"));
    EXPECT_FALSE(simulation.step(false, {}).commit.list);
    ASSERT_TRUE(simulation.step(false, test::one(Edit::Kind::kRedo)).outcomes[0].result);
    EXPECT_NEAR(emitterIn(simulation.scene()).time, 7 * kSecondsPerFrame, 1e-12) << "it comes back as it went";
    playOn(simulation, 3);
    EXPECT_NEAR(emitterIn(simulation.scene()).time, 10 * kSecondsPerFrame, 1e-12);
}

TEST(Emitters, TooManyParticlesAreRefusedAndLeaveTheStreamAsItWas) {
    Simulation simulation;
    ASSERT_TRUE(simulation.load({fountain()}));
    const EditOutcome refused =
        simulation.step(false, test::one(fountainEdit<&ParticleEmitter::rate>(simulation.scene(), 1e6))).outcomes[0];
    ASSERT_FALSE(refused.result);
    EXPECT_WORDS(refused.result.error().message);
    EXPECT_EQ(emitterIn(simulation.scene()).rate, 60);
}

TEST(Emitters, UndoTakesBackWhatAPersonDidAndTheClockGoesOn) {
    Simulation simulation;
    ASSERT_TRUE(simulation.load({fountain()}));
    playOn(simulation, 30);
    (void)simulation.step(false, test::one(fountainEdit<&ParticleEmitter::rate>(simulation.scene(), 30.0)));
    playOn(simulation, 30);
    EXPECT_EQ(simulation.history().undoDepth(), 1u) << "playing is no step";
    const double before = emitterIn(simulation.scene()).time;
    ASSERT_TRUE(simulation.step(false, test::one(Edit::Kind::kUndo)).outcomes[0].result);
    EXPECT_EQ(emitterIn(simulation.scene()).rate, 60);
    EXPECT_NEAR(emitterIn(simulation.scene()).time, before + kSecondsPerFrame, 1e-12);
    // The same as if nobody had ever done it.
    Simulation other;
    ASSERT_TRUE(other.load({fountain()}));
    playOn(other, 62);
    EXPECT_EQ(particlesIn(other.scene()), particlesIn(simulation.scene()));
}

TEST(Emitters, WhoJoinsLaterSeesTheSameParticlesFromThenOn) {
    Simulation simulation;
    ASSERT_TRUE(simulation.load({fountain()}));
    playOn(simulation, 100);
    Aspect late;
    ASSERT_TRUE(late.apply(snapshot(simulation.scene())));
    for (int i = 0; i < 50; ++i) {
        const FrameResult frame = simulation.step(false, {});
        ASSERT_TRUE(frame.commit.list);
        EXPECT_TRUE(blobsOf(*frame.commit.list).empty()) << "no array travels";
        ASSERT_TRUE(late.apply(*frame.commit.list));
        ASSERT_EQ(particlesIn(late), particlesIn(simulation.scene()));
    }
    EXPECT_GT(drawableOf(late, fountainIn(late)).arrays().positions.sizeBytes(), 12u * 100);
    EXPECT_EQ(late.stateHash(), simulation.scene().stateHash());
}

TEST(Emitters, AReplayMakesTheSameFrames) {
    const test::TestFolder folder;
    const std::string file = folder / "show.tsr";
    std::vector<MeshKey> seen;
    {
        FountainShow show;
        ASSERT_TRUE(show.maker.record(file, 1));
        ASSERT_TRUE(show.maker.load({fountain()}));
        for (int i = 0; i < 40; ++i) {
            show.frame(i == 20 ? test::one(fountainEdit<&ParticleEmitter::seed>(show.scene(), std::int64_t{5}))
                               : std::vector<Edit>());
            seen.push_back(particlesIn(show.scene()));
        }
    }
    Expected<RecordingReader> recording = RecordingReader::open(file);
    ASSERT_TRUE(recording) << recording.error().message;
    std::vector<MeshKey> again;
    const ReplayResult result =
        replay(*recording, {.onFrame = [&](FrameNumber, const FrameResult&, const Aspect& scene) {
            again.push_back(particlesIn(scene));
        }});
    EXPECT_EQ(result.frames, 40u);
    EXPECT_FALSE(result.firstDifference) << result.firstDifference->what[0];
    EXPECT_EQ(again, seen);
}

TEST(Emitters, AServerThatGoesOnFromItsJournalGoesOnWithTheStream) {
    const test::TestFolder folder;
    test::ReadableLog log;
    MeshKey left;
    StateHash hash;
    {
        BlobStore arrays;
        Expected<Journal::Opened> opened = Journal::open({.folder = folder / "journal"}, arrays, log.log, {});
        ASSERT_TRUE(opened) << opened.error().message;
        FountainShow show(opened->journal.get());
        ASSERT_TRUE(show.maker.load({fountain()}));
        for (int i = 0; i < 40; ++i) show.frame();
        left = particlesIn(show.scene());
        hash = show.scene().stateHash();
    }
    BlobStore arrays;
    Expected<Journal::Opened> opened = Journal::open({.folder = folder / "journal"}, arrays, log.log, {});
    ASSERT_TRUE(opened) << opened.error().message;
    FountainShow show(opened->journal.get());
    ASSERT_TRUE(show.maker.goOnFrom(*opened));
    EXPECT_EQ(show.scene().stateHash(), hash);
    EXPECT_EQ(particlesIn(show.scene()), left);
    show.next = opened->state.nextFrame.value;
    const double time = emitterIn(show.scene()).time;
    show.frame();
    EXPECT_EQ(emitterIn(show.scene()).time, time + kSecondsPerFrame);
}

/// A journal may have been written under other rules, or by hand.
TEST(Emitters, OfALeftSceneThatTheRulesRefuseStandStillAndOthersPlay) {
    Simulation before;
    ASSERT_TRUE(before.load({fountain(), fountain()}));
    Aspect left;
    ASSERT_TRUE(left.apply(snapshot(before.scene())));
    ChangeListBuilder many;
    setField<&ParticleEmitter::rate>(many, fountainIn(left), 1e6);
    setField<&ParticleEmitter::life>(many, fountainIn(left), 1e6);
    ASSERT_TRUE(left.apply(many.take()));
    Simulation after;
    after.goOnFrom({.scene = std::move(left), .sequence = before.sequence(), .history = {}, .display = {}});
    const auto timesIn = [&] {
        std::vector<double> times;
        for (const ObjectId id : after.scene().ids())
            if (const ParticleEmitter* emitter = after.scene().get<ParticleEmitter>(id)) times.push_back(emitter->time);
        return times;
    };
    const std::vector<double> first = timesIn();
    const FrameResult frame = after.step(false, {});
    ASSERT_EQ(frame.remarks.size(), 1u);
    EXPECT_WORDS(frame.remarks.front());
    const std::vector<double> second = timesIn();
    ASSERT_EQ(second.size(), 2u);
    EXPECT_NE(first[0] == second[0], first[1] == second[1]);
    EXPECT_TRUE(after.step(false, {}).remarks.empty());
}

}  // namespace
}  // namespace tessera
