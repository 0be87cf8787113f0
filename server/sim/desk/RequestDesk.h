/// What applications ask for, from the question to the answer.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "server/manipulators/ManipulatorDrags.h"
#include "server/sim/desk/FrameNews.h"
#include "server/sim/desk/ImageRequests.h"
#include "server/sim/desk/Loader.h"
#include "server/sim/desk/Uploads.h"
#include "server/sim/desk/ViewRequests.h"
#include "server/sim/frame/Copies.h"
#include "server/sim/frame/FrameBudget.h"
#include "server/sim/frame/ViewSource.h"
#include "server/sim/navigation/Steering.h"

namespace tessera {

class Simulation;

/// Answers what can be answered at once; collects edits for the next frame; waits for blobs, imports and images where
/// it must. An edit that names blobs is handed out only when every live host has them, so that no frame waits for bulk
/// data. Every request is answered exactly once, unless its application has gone. Nobody who is told of collisions, or
/// asked about them, is waited for. Frame thread only.
class RequestDesk {
public:
    struct Limits {
        /// Of one application, of what is not answered at once: edits, loads, pictures. And what its proposals and copies hold together;
        /// one may exceed it. Once copies that were made beside the frames hold as much, whoever wants them, no further one is made.
        std::size_t maxOpenRequests = 256;
        std::size_t maxOpenBytes = std::size_t{256} << 20;
        /// Of those who have left: edits that are still carried out.
        std::size_t maxLeftBehind = 256;
        std::chrono::milliseconds imageDeadline{5'000};
        /// Of the arrays that come with a list: they are copied and hashed between two frames. The others come before it (Uploads).
        std::size_t maxInlineArrayBytes = limits::kMaxInlineArrayBytes;
        /// Of one proposal, or of what a removal takes: a list is checked and applied between two frames.
        std::size_t maxProposalBytes = limits::kMaxProposalBytes;
        std::size_t maxProposalChanges = 500'000;
        /// Of all edits of a frame together, but for a single one: the others open the next frames, in their order.
        std::size_t maxFrameChanges = 50'000;
        FrameNews::Limits news;
    };
    /// What the desk asks and changes; all of it outlives the desk.
    struct Surroundings {
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
        /// Fills in which tiles the wall waits for; empty: nobody knows.
        std::function<void(answer::Status&)> describeWaits = {};
        std::function<answer::Trackers()> describeTrackers = {};  ///< empty: there are none
        std::function<std::vector<std::string>()> describePrograms = {};  ///< those of materials that are bad or heavy; empty: nobody knows
        std::function<double(ObjectId)> filmLength = {};  ///< of a Movie, s; 0: not known. Empty: of none
        std::function<notice::Poses()> poses = {};                ///< of the newest frame; empty: nobody is tracked
        Showing* showing = nullptr;  ///< of the frames to come; null: it is not to be changed
        Steering* steering = nullptr;  ///< null: nobody can be asked to fly
        InlineLoading* inlines = nullptr;  ///< is told what comes of its orders
        ViewRequests::Survey orderSurvey = {};
        /// Has `makeCopy` called beside the frames, with the scene as it is now; `copied` is told. Empty: copies are made at once.
        std::function<void(CopyOrder)> orderCopy = {};
        FrameBudget* budget = nullptr;     ///< null: frames have all of their detail, and nobody can change that
    };

    RequestDesk(const Surroundings& around, const Limits& limits);
    explicit RequestDesk(const Surroundings& around) : RequestDesk(around, Limits()) {}

    /// All return what the session wants done.
    [[nodiscard]] ServerActions received(const server_action::RequestReceived& request, TimePoint now);
    [[nodiscard]] ServerActions blobsEverywhere(std::uint64_t token);
    /// Arrays of an application's next proposal. Costs the same however large they are.
    void uploading(const server_action::UploadReceived& received);
    [[nodiscard]] ServerActions uploaded(UploadFinished finished, TimePoint now);
    /// A start scene is loaded without a question; its ticket is `kStartScene`.
    static constexpr std::uint64_t kStartScene = 0;
    [[nodiscard]] ServerActions loaded(LoadFinished finished, TimePoint now);
    [[nodiscard]] ServerActions copied(CopyMade made, TimePoint now);
    /// What an Inline holds is read and comes like any other load, but that nobody is answered and it is no step of undo.
    void loadContent(InlineOrder order);
    [[nodiscard]] ServerActions imageReceived(const server_action::ImageReceived& image) {
        return images_.imageReceived(image);
    }
    /// What was ordered by `orderSurvey`.
    [[nodiscard]] ServerActions surveyed(const Box& bounds, Sequence at) { return views_.surveyed(bounds, at); }
    [[nodiscard]] ServerActions advance(TimePoint now) { return images_.advance(now); }
    [[nodiscard]] TimePoint nextDeadline() const { return images_.nextDeadline(); }
    void applicationJoined(ConnectionId connection) { applications_.insert(connection); }
    void applicationLeft(ConnectionId connection);

    /// The edits for the frame that is about to be made.
    [[nodiscard]] std::vector<Edit> takeEdits();
    /// And the answers to questions for it.
    [[nodiscard]] std::vector<Reply> takeReplies() { return news_.takeReplies(); }
    /// `openQuestions`: ids of those that stand after this frame.
    [[nodiscard]] ServerActions committed(FrameResult frame, FrameNumber number,
                                          std::span<const std::uint64_t> openQuestions);
    /// Heads and wands of the frame that was made.
    [[nodiscard]] ServerActions heads(const notice::Poses& poses) { return news_.poses(poses); }
    [[nodiscard]] ServerActions frameReleased(const server_action::FrameReleased& release) {
        return news_.released(release);
    }

private:
    struct Open {
        Asker asker;
        Edit edit;  ///< waiting for blobs or a frame
        std::vector<Blob> announced;  ///< can be fetched until its outcome is known
        std::uint64_t removed = 0;    ///< of a removal: objects
        std::uint64_t created = 0;    ///< of a copy: objects
        ObjectId copy = {};           ///< of a copy: the placeholder of the node's copy
        std::size_t bytes = 0;  ///< of the proposal, or that a copy holds once it is made
        bool isCopy = false;    ///< one that is made beside the frames
        std::uint64_t upload = 0;  ///< whose room it takes (Uploads::handedOver); 0: none
        bool isLoad = false;
        ObjectId content = {};  ///< of what an Inline holds: its core; nobody asked
        std::vector<ChangeList> parts;  ///< of a load, or a large copy, that takes several frames
        std::size_t nextPart = 0;
        answer::Loaded loaded;  ///< `node` is a placeholder until the commit
    };

    // What each request means; one that is not here does not compile.
    [[nodiscard]] ServerActions on(const Asker&, const request::ProposeChanges&, TimePoint now);
    [[nodiscard]] ServerActions on(const Asker&, const request::UndoStep&, TimePoint now);
    [[nodiscard]] ServerActions on(const Asker&, const request::RedoStep&, TimePoint now);
    [[nodiscard]] ServerActions step(const Asker& asker, Edit::Kind kind, TimePoint now);
    [[nodiscard]] ServerActions on(const Asker&, const request::GetStatus&, TimePoint now);
    [[nodiscard]] ServerActions on(const Asker&, const request::LoadFile&, TimePoint now);
    [[nodiscard]] ServerActions on(const Asker&, const request::SetView&, TimePoint now);
    [[nodiscard]] ServerActions on(const Asker&, const request::PickAt&, TimePoint now);
    [[nodiscard]] ServerActions on(const Asker&, const request::GetContacts&, TimePoint now);
    [[nodiscard]] ServerActions on(const Asker&, const request::GetImages&, TimePoint now);
    [[nodiscard]] ServerActions on(const Asker&, const request::SubscribeNews&, TimePoint now);
    [[nodiscard]] ServerActions on(const Asker&, const request::GetEvents&, TimePoint now);
    [[nodiscard]] ServerActions on(const Asker&, const request::GetDistances&, TimePoint now);
    [[nodiscard]] ServerActions on(const Asker&, const request::GetQuestions&, TimePoint now);
    [[nodiscard]] ServerActions on(const Asker&, const request::AnswerQuestion&, TimePoint now);
    [[nodiscard]] ServerActions on(const Asker&, const request::GetObjects&, TimePoint now);
    [[nodiscard]] ServerActions on(const Asker&, const request::GetTree&, TimePoint now);
    [[nodiscard]] ServerActions on(const Asker&, const request::MoveNode&, TimePoint now);
    [[nodiscard]] ServerActions on(const Asker&, const request::RemoveNode&, TimePoint now);
    [[nodiscard]] ServerActions on(const Asker&, const request::CloneNode&, TimePoint now);
    [[nodiscard]] ServerActions on(const Asker&, const request::FindNodes&, TimePoint now);
    [[nodiscard]] ServerActions on(const Asker&, const request::GetTrackers&, TimePoint now);
    [[nodiscard]] ServerActions on(const Asker&, const request::ShowPicture&, TimePoint now);
    [[nodiscard]] ServerActions on(const Asker&, const request::SetBudget&, TimePoint now);
    [[nodiscard]] ServerActions on(const Asker&, const request::NavigateView&, TimePoint now);
    [[nodiscard]] ServerActions on(const Asker&, const request::LoadAsset&, TimePoint now);
    [[nodiscard]] ServerActions load(const Asker& asker, LoadOrder order);
    [[nodiscard]] ServerActions on(const Asker&, const request::GrabHandle&, TimePoint now);
    [[nodiscard]] ServerActions on(const Asker&, const request::DragHandle&, TimePoint now);
    [[nodiscard]] ServerActions on(const Asker&, const request::ReleaseHandle&, TimePoint now);

    [[nodiscard]] Expected<Ray> rayOf(const Aim& aim) const;
    [[nodiscard]] std::optional<Error> tooManyOpen(const Asker& asker) const;
    [[nodiscard]] ServerActions answer(const Asker& asker, const Expected<ApplicationAnswer>& answer) {
        return answerTo(around_.session, asker, answer);
    }
    [[nodiscard]] ServerActions refuse(const Asker& asker, Error error) {
        return answerTo(around_.session, asker, tl::unexpected(std::move(error)));
    }
    /// To whoever asked, or to who orders what Inlines hold.
    [[nodiscard]] ServerActions tell(const Open& open, const Expected<ApplicationAnswer>& outcome);
    [[nodiscard]] std::optional<Error> editsRefused() const {
        return around_.editsRefused ? around_.editsRefused() : std::nullopt;
    }
    [[nodiscard]] Expected<ChangeList> listFrom(const request::ProposeChanges& proposal);
    /// The arrays of its list are here.
    [[nodiscard]] ServerActions propose(std::uint64_t ticket, const request::ProposeChanges& proposal, TimePoint now);
    [[nodiscard]] ServerActions queueEdit(std::uint64_t ticket, std::vector<Blob> named, TimePoint now);
    void takePart(std::vector<Edit>& edits);
    /// Its outcome is known, or nobody wants it. What comes behind it.
    std::map<std::uint64_t, Open>::iterator close(std::map<std::uint64_t, Open>::iterator open);
    [[nodiscard]] Expected<ApplicationAnswer> outcomeOf(const Open& open, const EditOutcome& outcome,
                                                        Sequence sequence) const;

    Surroundings around_;
    Limits limits_;
    std::uint64_t nextTicket_ = kStartScene + 1;
    std::map<std::uint64_t, Open> open_;  ///< by ticket
    struct Awaiting {
        std::uint64_t ticket = 0;
        request::ProposeChanges proposal;
    };
    std::map<std::uint64_t, Awaiting> awaiting_;  ///< proposals whose arrays are being put together, by upload
    std::vector<std::uint64_t> ready_;    ///< tickets whose edits go into the next frame
    std::deque<std::uint64_t> loading_;   ///< tickets whose parts do, one at a time, those of the first one first
    void orderCopy();
    std::deque<CopyOrder> copies_;  ///< that wait for the one that is made
    bool copying_ = false;
    std::uint64_t copiedBytes_ = 0;  ///< that those hold which are made
    std::vector<ChangeList> dropped_;     ///< parts of loads that were refused: freed some at a time
    std::set<ConnectionId> applications_;
    ImageRequests images_;
    ViewRequests views_;
    FrameNews news_;
};

}  // namespace tessera
