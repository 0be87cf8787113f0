/// What an Application is made of. For its own files.
#pragma once

#include <algorithm>
#include <deque>
#include <map>
#include <variant>

#include "common/application/Application.h"
#include "common/application/Connection.h"
#include "common/application/Proposal.h"
#include "common/codec/ApplicationCodec.h"
#include "common/request/Check.h"

namespace tessera {

struct Application::Impl {
    Impl(ConnectionOptions c, const Options& o)
        : options(o), connectionOptions(std::move(c)), connection(std::make_unique<Connection>(connectionOptions)) {}

    /// Puts one value aside (a reply to who awaits it), and dials again where the connection broke. False: nothing came
    /// until `deadline`, or it is all over.
    bool take(TimePoint deadline);
    /// Applies what was put aside. The error that ended everything comes only once nothing is left to apply.
    Expected<bool> dispatch();
    Expected<void> apply(incoming::List list);
    void tell(const ApplicationNotice& notice);

    void configure(const incoming::Configured& configured);
    void lose(incoming::Ended end);
    /// A list for a scene that is about to come anew is not sent: it was made from another.
    [[nodiscard]] Expected<void> sceneIsHere() const;

    /// What answers this request; `arrays` go before it. What its description does not allow is not sent. `meanwhile`
    /// is called four times a second, and may ask others.
    template <typename Request>
    Expected<typename Request::Answer> ask(const Request& request,
                                           std::optional<std::chrono::milliseconds> timeout = std::nullopt,
                                           std::span<const Blob> arrays = {},
                                           const std::function<void()>& meanwhile = {}) {
        using Answer = typename Request::Answer;
        if (const Expected<void> sound = checkRequest(request); !sound) return tl::unexpected(sound.error());
        Expected<ApplicationAnswer> answer =
            answerTo(encodeRequest(request), timeout.value_or(options.timeout), arrays, meanwhile);
        if (!answer) return tl::unexpected(answer.error());
        if (auto* expected = std::get_if<Answer>(&*answer)) return std::move(*expected);
        return fail(ErrorCode::kBadInput,
                    "the server answered something else than was asked; is it of another version?");
    }
    Expected<ApplicationAnswer> answerTo(Bytes request, std::chrono::milliseconds timeout, std::span<const Blob> arrays,
                                         const std::function<void()>& meanwhile);
    /// Of what has no other answer.
    template <typename Request>
    Expected<void> done(const Request& request) {
        const Expected<answer::Done> done = ask(request);
        return done ? Expected<void>() : tl::unexpected(done.error());
    }
    /// Waits until `scene` holds the list that answers a proposal.
    Expected<answer::Committed> settled(Expected<answer::Committed> committed);
    template <typename Request>
    Expected<answer::Committed> edit(const Request& request) {
        return settled(ask(request));
    }
    Expected<answer::Committed> move(ObjectId node, const NodeMove& move, std::uint64_t gesture) {
        if (Expected<void> sound = checkMove(move); !sound) return tl::unexpected(sound.error());
        return edit(request::MoveNode{node, move, gesture});
    }
    Expected<void> subscribe();
    [[nodiscard]] TimePoint now() const { return connectionOptions.platform.now(); }

    Options options;
    ConnectionOptions connectionOptions;
    std::unique_ptr<Connection> connection;  ///< null between a dial that failed and the next
    Proposals proposals;
    std::optional<Wall> wall;
    std::optional<Error> wallFault;
    Aspect aspect;
    Sequence sequence;
    Sequence current;  ///< where the scene stood when it was sent to us
    bool haveScene = false;
    /// The connection broke; it is there again, and the scene with it.
    struct Lost {
        Error why;
    };
    struct Back {};
    std::deque<std::variant<incoming::List, incoming::Notice, Lost, Back>> aside;
    std::optional<incoming::Ended> ended;
    bool joined = false;  ///< `connect` has succeeded: what breaks now is dialled again
    /// While the connection is broken.
    struct Away {
        TimePoint since, dialAt;
        Duration pause;
        Error why;
    };
    std::optional<Away> away;
    bool dispatching = false;
    std::uint64_t lastRequest = 0;
    std::map<std::uint64_t, std::optional<message::Reply>> awaited;  ///< by the request's number
    Subscription subscription;
    std::optional<notice::Frame> lastFrame;
    std::function<void(const ChangeList&, Sequence)> changesCallback;
    std::function<void(const answer::Contacts&)> contactsCallback;
    std::function<void(const answer::PairEvents&)> eventsCallback;
    std::function<void(const answer::Distances&)> distancesCallback;
    std::function<void(const answer::Questions&)> questionsCallback;
    std::function<void(const answer::Picked&)> pickCallback;
    std::function<void(const notice::Frame&)> frameCallback;
    std::function<void(const notice::Poses&)> posesCallback;
    std::function<void(const notice::States&)> statesCallback;
    std::function<void(const Error&)> lostCallback;
    std::function<void()> backCallback;
};

}  // namespace tessera
