/// What applications ask for, from the question to the answer.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/codec/ApplicationCodec.h"
#include "server/sim/Loader.h"
#include "server/sim/OpenQuestions.h"
#include "server/sim/Peers.h"
#include "server/sim/Simulation.h"
#include "server/sim/ViewSource.h"

namespace tessera {

/// Answers what can be answered at once; collects edits for the next frame; waits for blobs, imports and images where
/// it must. An edit that names blobs is handed out only when every live host has them, so that no frame waits for bulk
/// data. Every request is answered exactly once, unless its application has gone. Nobody who is told of collisions, or
/// asked about them, is waited for. Frame thread only.
class RequestDesk {
public:
    struct Limits {
        std::size_t maxOpenRequests = 1024;
        std::chrono::milliseconds imageDeadline{5'000};
        std::size_t maxUploadBytes = std::size_t{512} << 20;
        /// Of one proposal: a list is checked and applied between two frames.
        std::size_t maxProposalBytes = std::size_t{64} << 20;
        std::size_t maxProposalChanges = 500'000;
        /// Told in one frame, each; more are counted. Both fit into a Notice.
        std::size_t maxEventsTold = 50'000;
        std::size_t maxDistancesTold = 50'000;
    };

    RequestDesk(const Wall& wall, BlobStore& blobs, Peers& peers, Simulation& simulation, ViewSource& view,
                Loader& loader, Limits limits);
    RequestDesk(const Wall& wall, BlobStore& blobs, Peers& peers, Simulation& simulation, ViewSource& view,
                Loader& loader)
        : RequestDesk(wall, blobs, peers, simulation, view, loader, Limits()) {}

    /// All return what is left for the frame loop of the actions they caused.
    [[nodiscard]] ServerActions received(const server_action::RequestReceived& request, TimePoint now);
    [[nodiscard]] ServerActions blobsEverywhere(std::uint64_t token);
    /// A start scene is loaded without a question; its ticket is `kStartScene`.
    static constexpr std::uint64_t kStartScene = 0;
    [[nodiscard]] ServerActions loaded(LoadFinished finished, TimePoint now);
    [[nodiscard]] ServerActions imageReceived(const server_action::ImageReceived& image);
    [[nodiscard]] ServerActions advance(TimePoint now);
    [[nodiscard]] TimePoint nextDeadline() const;
    void applicationLeft(ConnectionId connection);

    /// The edits for the frame that is about to be made.
    [[nodiscard]] std::vector<Edit> takeEdits();
    /// And the answers to questions for it.
    [[nodiscard]] std::vector<Reply> takeReplies() { return questions_.takeReplies(); }
    /// `openQuestions`: ids of those that stand after this frame.
    [[nodiscard]] ServerActions committed(const FrameResult& frame, FrameNumber number,
                                          std::span<const std::uint64_t> openQuestions);
    [[nodiscard]] ServerActions committed(const FrameResult& frame, FrameNumber number) {
        return committed(frame, number, simulation_.openQuestions());
    }
    [[nodiscard]] ServerActions frameReleased(const server_action::FrameReleased& release);

private:
    struct Open {
        ConnectionId connection;
        std::uint64_t request = 0;
        Edit edit;  ///< waiting for blobs or a frame
        bool isLoad = false;
        answer::Loaded loaded;  ///< `node` is a placeholder until the commit
    };
    struct OpenImages {
        ConnectionId connection;
        std::uint64_t request = 0;
        TimePoint deadline;
        std::vector<std::string> awaited;  ///< tiles
        answer::Images answer;
    };

    [[nodiscard]] Expected<ApplicationAnswer> answerNow(const request::GetStatus&);
    [[nodiscard]] Expected<ApplicationAnswer> pick(ConnectionId connection, const request::Pick& wish,
                                                   ServerActions& actions);
    [[nodiscard]] Expected<Edit> editFrom(const request::Propose& proposal);
    [[nodiscard]] ServerActions queueEdit(std::uint64_t ticket, TimePoint now);
    [[nodiscard]] ServerActions askForImages(const server_action::RequestReceived& request, TimePoint now);
    [[nodiscard]] ServerActions finishImages(std::map<std::uint64_t, OpenImages>::iterator images);
    void answerTo(ServerActions& actions, ConnectionId connection, std::uint64_t request,
                  const Expected<ApplicationAnswer>& answer);
    [[nodiscard]] ServerActions subscribe(ConnectionId connection, const request::Subscribe& wanted);
    [[nodiscard]] Expected<ApplicationAnswer> decide(const request::Respond& decision);
    [[nodiscard]] std::vector<QuestionValue> openQuestions() const;
    void tellOfCollisions(ServerActions& actions, std::span<const std::uint64_t> closedQuestions);
    /// To those who are `subscribed`; `notice` is made only where there are any.
    template <typename Subscribed, typename MakeNotice>
    void tell(ServerActions& actions, Subscribed subscribed, MakeNotice notice);
    static void append(ServerActions& to, ServerActions more);

    Wall wall_;
    BlobStore& blobs_;
    Peers& peers_;
    Simulation& simulation_;
    ViewSource& view_;
    Loader& loader_;
    Limits limits_;
    std::uint64_t nextTicket_ = kStartScene + 1;
    std::map<std::uint64_t, Open> open_;          ///< by ticket
    std::vector<std::uint64_t> ready_;            ///< tickets whose edits go into the next frame
    std::map<std::uint64_t, OpenImages> images_;  ///< by ticket
    std::map<ConnectionId, request::Subscribe> subscriptions_;
    OpenQuestions questions_;
    // Of the newest frame.
    FrameNumber frame_;
    StepResult collision_;             ///< contacts, events, distances, questions, counters
    std::uint64_t contactsBegun_ = 0;  ///< over the run
};

}  // namespace tessera
