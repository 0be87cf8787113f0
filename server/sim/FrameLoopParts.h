/// What the frame loop is made of. For its own files.
#pragma once

#include "server/sim/FrameLoop.h"

#include <atomic>
#include <variant>

#include "common/base/FairQueue.h"
#include "server/sim/FrameMaker.h"
#include "server/sim/SessionActions.h"
#include "server/sim/StartScene.h"
#include "server/sim/frame/OutsideActors.h"
#include "server/sim/frame/Simulation.h"
#include "server/sim/peers/AnswerGate.h"
#include "server/sim/peers/MarkArrays.h"
#include "server/sim/tracking/TrackerInputs.h"

namespace tessera {

/// Something was worked out beside the frames. Named for the same reason.
struct BesideDone {
    WorkedOut then;
};

/// The journal has written what was awaited, or cannot. Named, because FrameLoop::Impl holds some.
struct JournalProgress {};

/// Other tokens let in from now on. Named for the same reason.
struct AccessRenewed {
    AccessTokens access;
};

struct FrameLoop::Impl {
    enum class Phase : std::uint8_t { kFrames, kGoodbye, kOver };
    using Event = std::variant<LinkEvent, Preparation, SnapshotMade, StateCompared, BesideDone, JournalProgress,
                               UploadFinished, AccessRenewed>;
    using Inbox = FairQueue<Event>;
    static constexpr Inbox::Source kOurselves = 0;  ///< no link has this id

    Impl(ServerOptions o, Log& l);
    // Whoever still delivers must not wait for room. The journal writes what is left while there is somebody to wake.
    ~Impl() {
        inbox.close();
        if (opened) opened->journal.reset();
    }

    [[nodiscard]] TimePoint now() const { return options.platform.now(); }
    Expected<void> begin();
    Expected<void> step();
    Expected<void> turn();
    Expected<void> failed(Expected<void> why);
    Expected<void> end();
    void sayGoodbye();

    /// Of any thread but the network's.
    void deliver(Event event) {
        if (inbox.push(kOurselves, std::move(event))) peers.wake();
    }
    void await(TimePoint until);
    [[nodiscard]] Expected<bool> serve(Inbox::Rank rank);
    void lookAtTheClock(TimePoint now);
    /// Who starts a wall with a large file looks at a terminal.
    void saySlowLoads(TimePoint now);

    Expected<void> take(const LinkEvent& event) { return done(peers.handle(event)); }
    Expected<void> take(Preparation made);
    Expected<void> take(SnapshotMade made) { return done(snapshots.made(std::move(made), now())); }
    Expected<void> take(const StateCompared& found);
    Expected<void> take(const BesideDone& made) { return done(made.then(now())); }
    void lookBeside(DeskSurroundings::Look look);
    void orderSurvey();
    Expected<void> take(UploadFinished finished) { return done(desk.uploaded(std::move(finished), now())); }
    Expected<void> done(ServerActions wanted) { return actions.carryOut(std::move(wanted)), Expected<void>(); }
    Expected<void> take(AccessRenewed renewed) {
        peers.session().renewAccess(std::move(renewed.access));
        return {};
    }
    Expected<void> take(JournalProgress) { return {}; }  // each turn looks
    void sceneIsThere();
    [[nodiscard]] Expected<Journal::Opened> openJournal();
    [[nodiscard]] FirstView firstView() const;
    [[nodiscard]] Stage stage() const;
    [[nodiscard]] ImportOptions importOptions() const;
    [[nodiscard]] Expected<void> goOnFromJournal();
    [[nodiscard]] ServerSessionConfig sessionConfig() const;
    [[nodiscard]] bool goesOn() const { return opened && opened->state.begun; }
    [[nodiscard]] Journal* journal() const { return opened ? opened->journal.get() : nullptr; }
    [[nodiscard]] std::optional<Error> trouble() const { return journal() ? journal()->trouble() : std::nullopt; }
    /// Keeps the replies in it until the journal has what it has been handed.
    [[nodiscard]] ServerActions untilWritten(ServerActions told);
    void openGate();

    [[nodiscard]] bool mayBegin(TimePoint now) const;
    [[nodiscard]] bool frameIsDue(TimePoint now) const { return mayBegin(now) && now >= pacing.earliest(); }
    [[nodiscard]] bool lastFrameShown() const;
    [[nodiscard]] bool allFramesShown() const {
        return options.frames > 0 && pacing.framesReleased() >= options.frames;
    }
    [[nodiscard]] TimePoint nextWake(TimePoint now) const;
    void makeFrame(TimePoint now);
    void moveHeads();
    [[nodiscard]] answer::Trackers describeTrackers() const;
    [[nodiscard]] std::string serviceStatus(TimePoint now);

    ServerOptions options;
    Log& log;
    Inbox inbox;
    std::function<bool(Inbox::Source)> mayServe = [this](Inbox::Source source) {
        return peers.mayServe(LinkId{source});
    };
    BlobStore blobs;
    /// Before all that its epoch is told to. Without --journal both are empty.
    Expected<Journal::Opened> opened;
    AnswerGate gate;
    Simulation simulation;
    ViewSource view;
    ManipulatorDrags drags;
    Steering steering;
    Report report;
    Tracking tracking;
    TrackerInputs trackers;
    notice::Poses poses;                ///< of the newest frame
    std::shared_ptr<SceneFiles> files;  ///< what may be read
    OutsideActors actors;
    FrameMaker maker;
    FramePacing pacing;
    PaceOfFrames pace;  ///< told to the service manager
    StartScene startScene;
    bool sceneReady = false, actorsReady = false;
    bool surveying = false;
    TimePoint loadsSaid = {};
    bool othersServed = false;           ///< since the last frame began
    std::atomic<bool> stopping = false;  ///< said by any thread
    Phase phase = Phase::kFrames;
    bool goodbyeSaid = false;
    TimePoint goodbyeUntil = {}, othersUntil = {};

    // Last: their threads deliver into what stands above.
    Peers peers;
    Loader loader;
    Workbench workbench, listings;
    Uploads uploads;
    Snapshots snapshots;
    MarkArrays marks;
    RequestDesk desk;
    SessionActions actions;
};

}  // namespace tessera
