/// What the newest frame found of collisions, and who is told of it.
#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <set>
#include <span>

#include "common/codec/FrameCodec.h"
#include "server/sim/desk/Answering.h"
#include "server/sim/desk/OpenQuestions.h"
#include "server/sim/frame/Frame.h"

namespace tessera {

/// Nobody who is told or asked is waited for. A notice is encoded once, and only where somebody subscribed to it. Frame
/// thread only.
class FrameNews {
public:
    struct Limits {
        /// Told in one frame, each; more are counted. Both fit into a Notice.
        std::size_t maxEventsTold = 50'000;
        std::size_t maxDistancesTold = 50'000;
    };

    FrameNews(ServerSession& session, const Limits& limits) : session_(session), limits_(limits) {}

    static constexpr std::chrono::milliseconds kStatesPeriod{50};  ///< between two looks at how the wall is

    /// Replaces what this application subscribed to. One that is new to questions is told of those that are open.
    [[nodiscard]] ServerActions subscribe(ConnectionId connection, const Subscription& wanted);
    void applicationLeft(ConnectionId connection) {
        subscriptions_.erase(connection);
        newToStates_.erase(connection);
    }

    /// `open`: ids of the questions that stand after this frame.
    [[nodiscard]] ServerActions committed(StepResult step, FrameNumber number, std::span<const std::uint64_t> open);
    /// What a host said with its Ready; before the frame's release where that came of it.
    void drawn(const std::string& host, FrameNumber frame, const HostStats& stats, TimePoint now);
    void seen(const server_action::FrameShown& shown);
    [[nodiscard]] ServerActions released(const server_action::FrameReleased& release, TimePoint now);
    [[nodiscard]] ServerActions picked(const answer::Picked& picked);
    [[nodiscard]] ServerActions poses(const notice::Poses& poses);
    /// Told where something of it is another than it was, and to who has not been told of any.
    [[nodiscard]] ServerActions states(notice::States states, TimePoint now);
    /// When `states` is to be called next; never, where nobody wants to know.
    [[nodiscard]] TimePoint nextDeadline() const;

    // Of the newest frame.
    [[nodiscard]] answer::Contacts contacts() const;
    [[nodiscard]] answer::PairEvents events() const;  ///< those that stay included
    [[nodiscard]] answer::Distances distances() const;
    /// All that are open, whenever they were asked.
    [[nodiscard]] answer::Questions questions() const;

    /// kRefused: the question has an answer already, or does not stand.
    [[nodiscard]] Expected<void> decide(const QuestionReply& decision);
    /// The answers for the frame that is about to be made.
    [[nodiscard]] std::vector<Reply> takeReplies() { return questions_.takeReplies(); }

private:
    [[nodiscard]] std::vector<QuestionValue> openQuestions() const;
    [[nodiscard]] ServerActions tellOfCollisions(std::span<const std::uint64_t> closedQuestions);
    /// To those who are `subscribed`.
    template <typename Subscribed, typename MakeNotice>
    void tell(ServerActions& actions, Subscribed subscribed, MakeNotice notice);

    ServerSession& session_;
    Limits limits_;
    std::map<ConnectionId, Subscription> subscriptions_;
    std::set<ConnectionId> newToStates_;
    std::optional<notice::States> states_;  ///< as they were told last
    TimePoint statesAt_{};
    struct Drawn {
        FrameNumber frame, seen;
        TimePoint at{};
        std::int64_t seenAtNs = 0;
        notice::HostWork work;
    };
    std::map<std::string, Drawn> drawn_;  ///< by host
    OpenQuestions questions_;
    FrameNumber frame_;
    StepResult step_;
    std::uint64_t contactsBegun_ = 0;  ///< over the run
};

}  // namespace tessera
