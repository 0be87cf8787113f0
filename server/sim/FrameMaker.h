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
#include "server/movies/Movies.h"
#include "server/programs/ProgramNotices.h"
#include "server/programs/ProgramTrials.h"
#include "server/sim/Report.h"
#include "server/sim/frame/FrameBudget.h"
#include "server/sim/frame/HandleSizes.h"
#include "server/sim/frame/InlineLoading.h"
#include "server/sim/frame/LevelChoice.h"
#include "server/sim/frame/ViewSource.h"
#include "server/sim/journal/Journal.h"
#include "server/sim/navigation/Steering.h"
#include "server/sim/recording/RecordingWriter.h"

namespace tessera {

class Simulation;

/// Makes frames of edits and replies, with the view, and sees to it that they are recorded and reported. Frame thread
/// only.
class FrameMaker {
public:
    /// All outlive it.
    struct Surroundings {
        Simulation& simulation;
        ViewSource& view;
        BlobStore& blobs;
        Report& report;
        Log& log;
        Journal* journal = nullptr;  ///< null: none is kept
        /// Called in each frame, when nothing but the view is left to be found: heads that are as new as can be. May be
        /// empty.
        std::function<void()> moveHeads = {};
        const Showing* showing = nullptr;  ///< null: the scene
        Steering* steering = nullptr;  ///< null: the view moves by hand and camera alone
        LevelChoice* levels = nullptr;  ///< null: nobody chooses levels of detail
        HandleSizes* handleSizes = nullptr;  ///< null: handles have no size on the screen
        ProgramTrials* programs = nullptr;  ///< null: nobody tries programs of materials, and none is drawn
        ProgramNotices* notices = nullptr;  ///< null: walls do not say what is wrong with programs
        InlineLoading* inlines = nullptr;  ///< null: nothing is loaded for Inlines
        const FrameBudget* budget = nullptr;  ///< null: frames have all of their detail
        Movies* movies = nullptr;  ///< null: no film plays
    };
    explicit FrameMaker(const Surroundings& around) : around_(around) {}

    /// Before anything else, if at all. Fails when the file cannot be written.
    [[nodiscard]] Expected<void> record(const std::string& path, unsigned threads);
    /// The scene before the first frame. Fails when a list is refused or the named camera is not there: errors of the
    /// command line, found before anybody draws.
    [[nodiscard]] Expected<CommittedFrame> load(std::vector<ChangeList> lists);

    /// The scene that a journal has, instead of loading one; it is returned as one list. Fails where the named camera is not there.
    [[nodiscard]] Expected<CommittedFrame> goOnFrom(Journal::Opened& opened);

    /// Once the scene is there, before the first frame: whether the programs that it brings have been tried, so that the first frame shows them as the last
    /// one does. Never waits: asked again and again, it says yes after 10 s whatever is left.
    [[nodiscard]] bool programsTried(TimePoint now);

    /// The same of the films that it brings: whether each has a first picture, or a problem.
    [[nodiscard]] bool filmsBegun(TimePoint now);

    struct Made {
        FrameResult result;
        FrameContent content;
        View view;
    };
    /// `now`: of the steady clock, for what people do; nothing that is recorded depends on it.
    [[nodiscard]] Made make(FrameNumber number, std::vector<Edit> edits, const std::vector<Reply>& replies, TimePoint now);

private:
    [[nodiscard]] Expected<void> sceneIsThere();
    /// What has come out of programs goes into the frame as an edit of the server's own.
    void addVerdicts(std::vector<Edit>& edits);
    /// What the wall says of bad programs, by where the reader stood in the frame before, likewise.
    void addNotices(std::vector<Edit>& edits);
    /// What films show next, likewise.
    void addPictures(bool first, std::vector<Edit>& edits, TimePoint now);
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
    std::vector<Edit> firstVerdicts_;  ///< of what the scene brings, for the first frame
    std::optional<TimePoint> triedUntil_, begunUntil_;
};

}  // namespace tessera
