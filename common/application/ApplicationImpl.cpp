#include "common/application/ApplicationImpl.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/codec/WallCodec.h"

namespace tessera {

namespace {

using std::chrono::milliseconds;

/// Between a dial that failed and the next.
constexpr milliseconds kFirstPause{50}, kLongestPause{1000};

/// A reply that is waited for, as long as this is there.
class Awaited {
public:
    using Replies = std::map<std::uint64_t, std::optional<message::Reply>>;
    Awaited(Replies& replies, std::uint64_t number) : replies_(replies), at_(replies.try_emplace(number).first) {}
    Awaited(const Awaited&) = delete;
    Awaited& operator=(const Awaited&) = delete;
    ~Awaited() { replies_.erase(at_); }
    [[nodiscard]] std::optional<message::Reply>& reply() const { return at_->second; }

private:
    Replies& replies_;
    Replies::iterator at_;
};

template <typename... F>
struct Each : F... {
    using F::operator()...;
};
template <typename... F>
Each(F...) -> Each<F...>;  // clang 14 does not find it by itself
}  // namespace

bool Application::Impl::take(TimePoint deadline) {
    if (ended) return false;
    if (!connection) {
        connectionOptions.platform.sleepUntil(std::min(deadline, away->dialAt));
        if (now() < away->dialAt) return false;
        connection = std::make_unique<Connection>(connectionOptions);
    }
    std::optional<Incoming> value = connection->next(deadline);
    if (!value) return false;
    if (auto* answer = std::get_if<incoming::Reply>(&*value)) {
        // Any other reply belongs to a request that was given up.
        if (const auto waiting = awaited.find(answer->reply.id); waiting != awaited.end())
            waiting->second = std::move(answer->reply);
    } else if (auto* end = std::get_if<incoming::Ended>(&*value)) {
        lose(std::move(*end));
    } else if (auto* configured = std::get_if<incoming::Configured>(&*value)) {
        configure(*configured);
    } else if (auto* list = std::get_if<incoming::List>(&*value)) {
        aside.emplace_back(std::move(*list));
    } else {
        aside.emplace_back(std::get<incoming::Notice>(std::move(*value)));
    }
    return true;
}

void Application::Impl::configure(const incoming::Configured& configured) {
    Expected<Wall> decoded = decodeWall(configured.wall);
    if (!decoded) {
        wallFault = Error{decoded.error().code, "the server's wall makes no sense: " + decoded.error().message};
        if (joined) ended = incoming::Ended{.error = *wallFault};
        return;
    }
    wall = std::move(*decoded);
    connectionOptions.seenEpoch = configured.epoch;
    if (!away) return;
    // What is still aside belongs to the scene that comes anew.
    away.reset();
    std::erase_if(aside, [](const auto& value) {
        return std::holds_alternative<incoming::List>(value) || std::holds_alternative<incoming::Notice>(value);
    });
    haveScene = false;
    current = Sequence();
    connection->request(++lastRequest, encodeRequest(request::SubscribeNews{subscription}));
    if (!options.followScene) aside.emplace_back(Back{});
}

void Application::Impl::lose(incoming::Ended end) {
    // Not where the fault is ours, or stays; a server that has just been started may refuse for the time being.
    const bool again = joined && end.retry && (end.error.code == ErrorCode::kNetwork || away);
    if (again && !away && options.redial > milliseconds::zero()) {
        away = Away{now(), now(), kFirstPause, end.error};
        aside.emplace_back(Lost{end.error});
    } else if (again && away) {
        away->dialAt = now() + away->pause;
        away->pause = std::min<Duration>(2 * away->pause, kLongestPause);
    }
    if (again && away && now() < away->since + options.redial) {
        connection.reset();
        return;
    }
    if (again && away)
        end.error.message = fmt::format("{}; nobody has answered there for {} ms since: {}", away->why.message,
                                        options.redial.count(), end.error.message);
    ended = std::move(end);
}

Expected<void> Application::Impl::sceneIsHere() const {
    if (!options.followScene || dispatching || ended || (!away && haveScene)) return {};
    return fail(ErrorCode::kNetwork,
                fmt::format("the connection to the server at {} broke and its scene is coming anew: "
                            "poll, look at it and propose again",
                            options.address));
}

Expected<bool> Application::Impl::dispatch() {
    bool any = false;
    dispatching = true;
    while (!aside.empty()) {
        auto value = std::move(aside.front());
        aside.pop_front();
        any = true;
        if (auto* list = std::get_if<incoming::List>(&value)) {
            if (auto applied = apply(std::move(*list)); !applied) {
                aside.clear();
                ended = incoming::Ended{.error = applied.error()};
            }
        } else if (const auto* notice = std::get_if<incoming::Notice>(&value)) {
            tell(notice->notice);
        } else if (const auto* lost = std::get_if<Lost>(&value)) {
            if (const auto callback = lostCallback) callback(lost->why);
        } else if (const auto callback = backCallback) {
            callback();
        }
    }
    dispatching = false;
    if (!any && ended) return tl::unexpected(ended->error);
    return any;
}

Expected<void> Application::Impl::apply(incoming::List list) {
    if (list.whole) {
        aspect = Aspect();
        current = list.current;
    }
    if (auto applied = aspect.apply(*list.list); !applied)
        return failWith(
            fmt::format("change list {} of the server does not fit the scene here", list.committed->sequence.value),
            applied.error());
    if (aspect.stateHash() != list.committed->stateHash)
        return fail(ErrorCode::kFailed,
                    fmt::format("after change list {} the scene here differs from the server's; connect again",
                                list.committed->sequence.value));
    sequence = list.committed->sequence;
    const bool complete = !haveScene && sequence >= current;
    haveScene = haveScene || complete;
    if (const auto callback = changesCallback) callback(*list.list, sequence);
    if (complete && joined) aside.emplace_front(Back{});
    return {};
}

void Application::Impl::tell(const ApplicationNotice& notice) {
    // Copies: a callback may set another in its own place.
    const auto pass = [](const auto callback, const auto& told) {
        if (callback) callback(told);
    };
    std::visit(Each{[&](const notice::Frame& told) { pass(frameCallback, lastFrame.emplace(told)); },
                    [&](const answer::Contacts& told) { pass(contactsCallback, told); },
                    [&](const answer::Picked& told) { pass(pickCallback, told); },
                    [&](const answer::PairEvents& told) { pass(eventsCallback, told); },
                    [&](const answer::Distances& told) { pass(distancesCallback, told); },
                    [&](const answer::Questions& told) { pass(questionsCallback, told); },
                    [&](const notice::Poses& told) { pass(posesCallback, told); },
                    [&](const notice::States& told) { pass(statesCallback, told); }},
               notice);
}

Expected<ApplicationAnswer> Application::Impl::answerTo(Bytes body, milliseconds timeout, std::span<const Blob> arrays,
                                                        const std::function<void()>& meanwhile) {
    if (body.size() > limits::kMaxRequestBytes)
        return fail(ErrorCode::kLimit,
                    fmt::format("the request has {} bytes, and {} is the most", body.size(), limits::kMaxRequestBytes));
    const TimePoint deadline = now() + timeout;
    while (away && !ended)
        if (!take(deadline) && now() >= deadline)
            return fail(ErrorCode::kNetwork, fmt::format("the server at {} did not come back within {} ms: {}",
                                                         options.address, timeout.count(), away->why.message));
    if (ended) return tl::unexpected(ended->error);
    connection->upload(arrays);
    const std::uint64_t number = ++lastRequest;
    connection->request(number, std::move(body));
    const Awaited waiting(awaited, number);
    constexpr milliseconds kLook{250};
    TimePoint look = now() + kLook;
    while (!waiting.reply()) {
        const bool came = take(meanwhile ? std::min(deadline, look) : deadline);
        if (meanwhile && !waiting.reply() && !ended && !away && now() >= look) {
            meanwhile();
            look = now() + kLook;
        }
        if (waiting.reply()) break;
        if (ended) return tl::unexpected(ended->error);
        if (away)
            return fail(ErrorCode::kNetwork, away->why.message + " (whether what was asked for was done is not known)");
        if (!came && now() >= deadline)
            return fail(ErrorCode::kNetwork,
                        fmt::format("the server at {} did not answer within {} ms", options.address, timeout.count()));
    }
    message::Reply& reply = *waiting.reply();
    if (!reply.error.empty()) return fail(reply.code, std::move(reply.error));
    return decodeAnswer(reply.body);
}

Expected<answer::Committed> Application::Impl::settled(Expected<answer::Committed> committed) {
    if (!committed || !options.followScene || dispatching) return committed;
    const TimePoint deadline = now() + options.timeout;
    for (;;) {
        if (const auto applied = dispatch(); !applied) return tl::unexpected(applied.error());
        if (!away && haveScene && sequence >= committed->sequence) return committed;
        if (!take(deadline) && !ended)
            return fail(ErrorCode::kNetwork, fmt::format("change list {} was committed but did not come within {} ms",
                                                         committed->sequence.value, options.timeout.count()));
    }
}

Expected<void> Application::Impl::subscribe() {
    return done(request::SubscribeNews{subscription});
}

}  // namespace tessera
