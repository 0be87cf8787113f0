/// A server's frames with people who steer: the parts of the frame loop, without sockets.
#pragma once

#include <gtest/gtest.h>

#include <deque>
#include <functional>
#include <utility>
#include <vector>

#include "server/sim/FrameMaker.h"
#include "server/sim/frame/OutsideActors.h"
#include "server/sim/frame/Simulation.h"
#include "server/sim/view/AnimatedBounds.h"
#include "tests/unit/ReadableLog.h"
#include "tests/unit/session/ServerFixture.h"
#include "tests/unit/sim/SceneForTests.h"

namespace tessera::test {

/// `work` hands over what is found beside the frames, so that a seed always makes the same frames. Each look is held
/// to the scene that the frame thread had when it asked.
class SteeredShow {
public:
    explicit SteeredShow(Wall ofWhom = wallOfOne(), std::vector<ChangeList> scene = {}) : wall(std::move(ofWhom)) {
        simulation.actWith(outside);
        view.surveyElsewhere([this] { return orderSurvey(), simulation.sequence(); });
        snapshots.follow({.sent = nothingCommitted(), .list = std::make_shared<const ChangeList>()});
        if (scene.empty()) return;
        EXPECT_TRUE(maker.load(std::move(scene)));
    }

    /// Makes a frame as the desk and the loop do.
    FrameResult frame(std::vector<Edit> edits = {}) {
        const bool isStepAmong = std::ranges::any_of(edits, isStep, &Edit::kind);
        if (!isStepAmong) {
            for (Edit& edit : steering.takeEdits()) edits.push_back(std::move(edit));
            if (ChangeList held = drags.corrections(simulation.scene(), simulation.manipulators()); !held.empty())
                edits.push_back({.ticket = kCorrections, .list = std::move(held), .undoable = false});
        }
        FrameResult made = maker.make(FrameNumber(next_++), std::move(edits), {}, now += frameLength);
        steering.wands(wands);
        return made;
    }
    void play(int count) {
        for (int i = 0; i < count; ++i) {
            (void)frame();
            work();
        }
    }
    /// Waits for all that was ordered beside the frames, and for what that orders, and hands it over.
    void work() {
        while (ordered_ > 0 || !works_.empty()) {
            if (!works_.empty()) {
                const LooksBeside::Work work = std::move(works_.front());
                works_.pop_front();
                work()();
                continue;
            }
            --ordered_;
            const std::optional<Found> found = found_.pop();
            ASSERT_TRUE(found);
            EXPECT_EQ(found->at, found->askedAt) << "a look found the scene of another list";
            EXPECT_EQ(found->hash, found->askedHash);
            ++looks;
            found->then();
        }
    }

    static constexpr std::uint64_t kCorrections = 5;
    Wall wall;
    Simulation simulation;
    ViewSource view{wall, ""};
    ManipulatorDrags drags;
    OutsideActors outside{wall, drags, {}};
    BlobStore blobs;
    Report report{wall, ""};
    ReadableLog log;
    Steering steering{
        {.wall = wall,
         .simulation = simulation,
         .view = view,
         .drags = &drags,
         .beside = {.look =
                        [this](LooksBeside::Look look) {
                            lookBeside([look = std::move(look)](const Aspect& scene, Sequence) { return look(scene); });
                        },
                    .work = [this](LooksBeside::Work work) { works_.push_back(std::move(work)); }}}};
    FrameMaker maker{{.simulation = simulation,
                      .view = view,
                      .blobs = blobs,
                      .report = report,
                      .log = log.log,
                      .snapshots = &snapshots,
                      .steering = &steering}};
    std::vector<WandState> wands;
    std::uint64_t looks = 0;
    Duration frameLength = std::chrono::nanoseconds(16'666'667);
    TimePoint now = TimePoint{} + std::chrono::hours(5);

private:
    struct Found {
        Sequence askedAt, at;
        StateHash askedHash, hash;
        LooksBeside::Then then;
    };
    void lookBeside(std::function<LooksBeside::Then(const Aspect& scene, Sequence at)> look) {
        ++ordered_;
        snapshots.lookAtNewest([this, look = std::move(look), askedAt = simulation.sequence(),
                                askedHash = simulation.scene().stateHash()](const Aspect& scene, Sequence at) {
            found_.push({.askedAt = askedAt,
                         .at = at,
                         .askedHash = askedHash,
                         .hash = scene.stateHash(),
                         .then = look(scene, at)});
        });
    }
    void orderSurvey() {
        if (std::exchange(surveying_, true)) return;
        lookBeside([this](const Aspect& scene, Sequence at) -> LooksBeside::Then {
            return [this, at, bounds = animatedBounds(scene)] {
                surveying_ = false;
                view.surveyed(bounds, at);
            };
        });
    }

    ServerFixture server_;
    Channel<Found> found_{1024};
    std::deque<LooksBeside::Work> works_;
    std::uint64_t next_ = 0;  ///< frame
    int ordered_ = 0;         ///< looks that have not been handed over
    bool surveying_ = false;

public:
    Snapshots snapshots{server_.session, blobs, [](SnapshotMade) {}};  ///< last: its thread fills `found_`
};

}  // namespace tessera::test
