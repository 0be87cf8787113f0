/// The scene's part of a frame: from what everybody wants to what everybody gets.
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/base/Log.h"
#include "common/session/ServerSession.h"
#include "common/wall/Showing.h"
#include "server/sim/journal/Journal.h"
#include "server/sim/navigation/Steering.h"
#include "server/sim/recording/RecordingWriter.h"
#include "server/sim/records/Snapshots.h"
#include "server/sim/report/Report.h"
#include "server/sim/view/ViewSource.h"

namespace tessera {

class Simulation;

/// Makes frames of edits and replies, with the view, and sees to it that they are recorded and reported. Whoever else
/// acts on the scene has a row in the simulation's table (frame/Actors.h). Frame thread only.
class FrameMaker {
public:
    /// All outlive it.
    struct Surroundings {
        Simulation& simulation;
        ViewSource& view;
        BlobStore& blobs;
        Report& report;
        Log& log;
        Journal* journal = nullptr;      ///< null: none is kept
        Snapshots* snapshots = nullptr;  ///< null: nobody joins, and nobody looks at the scene beside the frames
        /// Called in each frame, when nothing but the view is left to be found: heads that are as new as can be. May be
        /// empty.
        std::function<void()> moveHeads = {};
        const Showing* showing = nullptr;  ///< null: the scene
        Steering* steering = nullptr;      ///< null: the view moves by hand and camera alone
        MakeLane lane = LaneThreads::make;
    };
    explicit FrameMaker(const Surroundings& around) : around_(around) {}

    /// Before anything else, if at all. Fails when the file cannot be written.
    [[nodiscard]] Expected<void> record(const std::string& path, unsigned threads);
    /// The scene before the first frame. Fails when a list is refused or the named camera is not there: errors of the
    /// command line, found before anybody draws.
    [[nodiscard]] Expected<void> load(std::vector<ChangeList> lists);

    /// The scene that a journal has, instead of loading one. Fails where the named camera is not there.
    [[nodiscard]] Expected<void> goOnFrom(Journal::Opened& opened);

    /// Once the scene is there, before the first frame: whether all that acts on it is ready to show it as the last
    /// frame will: its programs tried, its films begun. Never waits: asked again and again, it says yes after 10 s
    /// whatever is left.
    [[nodiscard]] bool ready(TimePoint now);

    /// `now`: of the steady clock, for what people do; nothing that is recorded depends on it.
    [[nodiscard]] FrameResult make(FrameNumber number, std::vector<Edit> edits, const std::vector<Reply>& replies,
                                   TimePoint now);
    /// Of the frame that was made last.
    [[nodiscard]] const View& view() const { return lastView_; }
    /// What hosts are told of that frame.
    [[nodiscard]] message::Begin begin(FrameNumber number, const FrameResult& frame) const;

private:
    /// Tells what was committed to those who are asked about the newest scene. Called before anything else can ask:
    /// they know it as soon as the simulation does.
    void follow(const CommittedFrame& committed) const;
    [[nodiscard]] Expected<void> sceneIsThere();
    /// Whoever is handed a list may ask for the arrays that it names, though a later part of it, or a later frame, has
    /// replaced them in the scene.
    /// `unneeded`: is given what it held long enough.
    void hold(FrameNumber frame, const ChangeList& list, std::vector<std::shared_ptr<const void>>& unneeded);
    struct Named {
        FrameNumber frame;
        std::vector<Blob> blobs;
        std::uint64_t bytes = 0;
    };

    Surroundings around_;
    std::deque<Named> named_;  ///< of the frames up to now, within bounds
    std::uint64_t namedBytes_ = 0;
    std::unique_ptr<RecordingWriter> recording_;  ///< null: none wanted
    View lastView_;
    bool cameraComplaint_ = false;
    std::optional<TimePoint> readyUntil_;
};

}  // namespace tessera
