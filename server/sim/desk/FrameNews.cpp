#include "server/sim/desk/FrameNews.h"

#include <algorithm>
#include <type_traits>

#include "common/session/HeartbeatClock.h"
#include "server/sim/desk/CollisionAnswers.h"

namespace tessera {
namespace {

/// Frames and round trips are news of each frame.
bool sameStates(const notice::States& a, const notice::States& b) {
    const auto same = [](const answer::HostInfo& x, const answer::HostInfo& y) {
        return x.state == y.state && x.name == y.name;
    };
    return a.comings == b.comings && a.journalTrouble == b.journalTrouble && std::ranges::equal(a.hosts, b.hosts, same);
}

}  // namespace

template <typename Subscribed, typename MakeNotice>
void FrameNews::tell(ServerActions& actions, Subscribed subscribed, MakeNotice notice) {
    ByteSlice body;
    for (const auto& [connection, subscription] : subscriptions_) {
        if constexpr (std::is_invocable_v<Subscribed, const Subscription&>) {
            if (!subscribed(subscription)) continue;
        } else if (!subscribed(connection, subscription)) {
            continue;
        }
        if (body.empty()) body = encodeNotice(notice());
        append(actions, session_.notify(connection, {.body = body}));
    }
}

ServerActions FrameNews::subscribe(ConnectionId connection, const Subscription& wanted) {
    Subscription& subscription = subscriptions_[connection];
    const bool newToQuestions = wanted.questions && !subscription.questions;
    if (wanted.states && !subscription.states) newToStates_.insert(connection);
    if (!wanted.states) newToStates_.erase(connection);
    subscription = wanted;
    if (!newToQuestions || questions_.unanswered().empty()) return {};
    const ApplicationNotice open =
        answer::Questions{.frame = frame_, .questions = openQuestions(), .closed = {}, .unanswered = 0};
    return session_.notify(connection, {.body = encodeNotice(open)});
}

ServerActions FrameNews::committed(StepResult step, FrameNumber number, std::span<const std::uint64_t> open) {
    frame_ = number;
    contactsBegun_ += step.contactsBegun;
    step_ = std::move(step);
    return tellOfCollisions(questions_.frameDone(step_.questions, open));
}

ServerActions FrameNews::tellOfCollisions(std::span<const std::uint64_t> closedQuestions) {
    ServerActions actions;
    tell(
        actions, [](const Subscription& s) { return s.contacts; }, [&] { return contacts(); });
    for (const bool stays : {false, true})
        tell(
            actions, [&](const Subscription& s) { return s.events && s.stays == stays; },
            [&] { return eventsOf(step_, frame_, stays, limits_.maxEventsTold); });
    tell(
        actions, [](const Subscription& s) { return s.distances; }, [&] { return distances(); });
    if (step_.questions.empty() && closedQuestions.empty()) return actions;
    tell(
        actions, [](const Subscription& s) { return s.questions; },
        [&] {
            answer::Questions told{.frame = frame_,
                                   .questions = {},
                                   .closed = {closedQuestions.begin(), closedQuestions.end()},
                                   .unanswered = step_.counters.unanswered};
            for (const Question& question : step_.questions) told.questions.push_back(valueOf(question));
            return told;
        });
    return actions;
}

void FrameNews::drawn(const std::string& host, FrameNumber frame, const HostStats& stats, TimePoint now) {
    Drawn& drawn = drawn_[host];
    drawn.frame = frame;
    drawn.at = now;
    drawn.work = {.host = host, .workMs = stats.workMs, .applyMs = stats.applyMs};
    for (const TileStats& tile : stats.tiles) {
        drawn.work.cullMs += tile.cullMs;
        drawn.work.drawMs += tile.drawMs;
        drawn.work.handOverMs += tile.handOverMs;
    }
}

void FrameNews::seen(const server_action::FrameShown& shown) {
    Drawn& drawn = drawn_[shown.host];
    drawn.seen = shown.frame;
    drawn.seenAtNs = shown.shownAtNs;
}

ServerActions FrameNews::released(const server_action::FrameReleased& release, TimePoint now) {
    ServerActions actions;
    tell(
        actions, [](const Subscription& s) { return s.frames; },
        [&] {
            notice::Frame told{.frame = release.frame,
                               .shown = release.shown,
                               .held = release.held,
                               .frameMs = toMilliseconds(release.frameTime),
                               .releasedMs = toMilliseconds(now.time_since_epoch()),
                               .works = {}};
            for (const std::string& host : release.shown) {
                const auto drawn = drawn_.find(host);
                if (drawn == drawn_.end() || drawn->second.frame != release.frame) continue;
                notice::HostWork& work = told.works.emplace_back(drawn->second.work);
                work.readyMs = std::max(0.0, told.frameMs - toMilliseconds(now - drawn->second.at));
                work.lastShown = drawn->second.seen;
                // Clocks are estimated: a picture may seem to be seen a little later than now.
                if (drawn->second.seenAtNs != 0)
                    work.shownMs = std::max(
                        0.0, (static_cast<double>(toNs(now)) - static_cast<double>(drawn->second.seenAtNs)) * 1e-6);
            }
            return told;
        });
    return actions;
}

ServerActions FrameNews::picked(const answer::Picked& picked) {
    ServerActions actions;
    tell(
        actions, [](const Subscription& s) { return s.picks; }, [&] { return picked; });
    return actions;
}

ServerActions FrameNews::poses(const notice::Poses& poses) {
    ServerActions actions;
    tell(
        actions, [](const Subscription& s) { return s.poses; }, [&] { return poses; });
    return actions;
}

ServerActions FrameNews::states(notice::States states, TimePoint now) {
    statesAt_ = now;
    const bool changed = !states_ || !sameStates(*states_, states);
    ServerActions actions;
    tell(
        actions,
        [&](ConnectionId connection, const Subscription& s) {
            return s.states && (changed || newToStates_.contains(connection));
        },
        [&] { return states; });
    newToStates_.clear();
    states_ = std::move(states);
    return actions;
}

TimePoint FrameNews::nextDeadline() const {
    if (!newToStates_.empty()) return TimePoint::min();
    const bool anybody = std::ranges::any_of(subscriptions_, [](const auto& one) { return one.second.states; });
    return anybody ? statesAt_ + kStatesPeriod : TimePoint::max();
}

answer::Contacts FrameNews::contacts() const {
    return contactsOf(step_, frame_, contactsBegun_);
}
answer::PairEvents FrameNews::events() const {
    return eventsOf(step_, frame_, true, limits_.maxEventsTold);
}
answer::Distances FrameNews::distances() const {
    return distancesOf(step_, frame_, limits_.maxDistancesTold);
}
answer::Questions FrameNews::questions() const {
    return {.frame = frame_, .questions = openQuestions(), .closed = {}, .unanswered = step_.counters.unanswered};
}

Expected<void> FrameNews::decide(const QuestionReply& decision) {
    const auto word = [&] {
        switch (decision.decision) {
            case QuestionReply::Decision::kPass:
                return Reply::Decision::kPass;
            case QuestionReply::Decision::kMove:
                return Reply::Decision::kMove;
            case QuestionReply::Decision::kStop:
                break;
        }
        return Reply::Decision::kStop;
    };
    return questions_.answer({.question = decision.question, .decision = word(), .pose = decision.pose});
}

std::vector<QuestionValue> FrameNews::openQuestions() const {
    std::vector<QuestionValue> values;
    for (const Question& question : questions_.unanswered()) values.push_back(valueOf(question));
    return values;
}

}  // namespace tessera
