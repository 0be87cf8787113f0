/// What the desk asks and changes, and how much of anything may wait at it.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/base/LaneThreads.h"
#include "common/base/TimeSource.h"
#include "common/codec/ApplicationCodec.h"
#include "common/session/Messages.h"
#include "server/manipulators/ManipulatorDrags.h"
#include "server/sim/desk/Answering.h"
#include "server/sim/desk/FrameNews.h"
#include "server/sim/desk/Loader.h"
#include "server/sim/desk/Uploads.h"
#include "server/sim/desk/ViewRequests.h"
#include "server/sim/desk/Workbench.h"
#include "server/sim/frame/Copies.h"
#include "server/sim/frame/InlineLoading.h"
#include "server/sim/navigation/Steering.h"
#include "server/sim/view/ExposureMeter.h"
#include "server/sim/view/FrameBudget.h"
#include "server/sim/view/ViewSource.h"

namespace tessera {

class Simulation;

struct DeskLimits {
    /// Of one application, of what is not answered at once: edits, loads, pictures. And what its proposals and copies
    /// hold together; one may exceed it. Once copies that were made beside the frames hold as much, whoever wants them,
    /// no further one is made.
    std::size_t maxOpenRequests = 256;
    std::size_t maxOpenBytes = std::size_t{256} << 20;
    /// Of those who have left: edits that are still carried out.
    std::size_t maxLeftBehind = 256;
    std::chrono::milliseconds imageDeadline{5'000};
    /// Of the arrays that come with a list: they are copied and hashed between two frames. The others come before it
    /// (Uploads).
    std::size_t maxInlineArrayBytes = limits::kMaxInlineArrayBytes;
    /// Of one proposal, or of what the removal of a node takes: a list is checked and applied between two frames.
    std::size_t maxProposalBytes = limits::kMaxProposalBytes;
    std::size_t maxProposalChanges = 500'000;  ///< and references in them
    /// Of all edits of a frame together, but for a single one: the others open the next frames, in their order.
    std::size_t maxFrameChanges = 50'000;
    std::size_t maxFrameBytes = std::size_t{128} << 20;  ///< of their proposals, likewise
    /// Of a pick or a search for the nearest surface, between two frames: boxes and faces that it looks at. What takes
    /// more is answered beside them.
    std::uint64_t maxPickWork = 20'000;
    FrameNews::Limits news;
};

/// All of it outlives the desk.
struct DeskSurroundings {
    const Wall& wall;
    BlobStore& blobs;
    ServerSession& session;
    Simulation& simulation;
    ViewSource& view;
    Loader& loader;
    Uploads* uploads = nullptr;  ///< null: proposals bring small arrays alone
    ManipulatorDrags& drags;
    std::string journal = {};  ///< its folder; empty: there is none
    /// Why no edit is taken at present; empty: none is ever refused for that.
    std::function<std::optional<Error>()> editsRefused = {};
    /// Fills in which tiles the wall waits for, how long frames take, and what has been sent; empty: nobody knows.
    std::function<void(answer::Status&)> describeWaits = {};
    std::function<answer::Trackers()> describeTrackers = {};  ///< empty: there are none
    /// Those of materials that are bad or heavy; empty: nobody knows.
    std::function<std::vector<std::string>()> describePrograms = {};
    std::function<double(ObjectId)> filmLength = {};  ///< of a Movie, s; 0: not known. Empty: of none
    std::function<notice::Poses()> poses = {};        ///< of the newest frame; empty: nobody is tracked
    Showing* showing = nullptr;                       ///< of the frames to come; null: it is not to be changed
    Steering* steering = nullptr;                     ///< null: nobody can be asked to fly
    InlineLoading* inlines = nullptr;                 ///< is told what comes of its orders
    ViewRequests::Survey orderSurvey = {};
    /// Has `makeCopy` called beside the frames, with the scene as it is now; `RequestDesk::prepared` is told. Empty:
    /// copies are made at once.
    std::function<void(Preparation)> orderCopy = {};
    /// Has `look` called beside the frames, with the scene as it is now and its list, and then on the frame thread what
    /// it returns. Empty: all is answered at once, however long it takes. So is `work`, which needs no scene.
    using Look = std::function<WorkedOut(const Aspect& scene, Sequence at)>;
    std::function<void(Look look)> lookBeside = {};
    std::function<void(std::function<WorkedOut()> work)> workBeside = {};
    std::function<void(std::function<WorkedOut()> work)> listBeside = {};  ///< as workBeside; waits for disks
    const SceneFiles* files = nullptr;  ///< with `listBeside`: what may be looked through; null: nothing
    FrameBudget* budget = nullptr;      ///< null: frames have all of their detail, and nobody can change that
    ExposureMeter* exposure = nullptr;  ///< null: frames are exposed as the scene says

    bool watchesFiles = false;  ///< those that are in the scene are taken in again when they change on disk
    /// Of any thread: has something done on the frame thread. Where files are watched.
    std::function<void(WorkedOut then)> deliver = {};
    std::function<void(const std::string& words, bool isWrong)> say = {};  ///< to the log; empty: nobody hears it
    AuditBook* audit = nullptr;  ///< is told who does what; null: nobody keeps it
    const TimeSource& time = machineTime();
    MakeLane lane = LaneThreads::make;  ///< for what is done beside the frames

    [[nodiscard]] Answers answers() const { return {session, audit}; }
    /// Why no edit is taken at present; none: edits are taken.
    [[nodiscard]] std::optional<Error> whyNoEdit() const { return editsRefused ? editsRefused() : std::nullopt; }
};

}  // namespace tessera
