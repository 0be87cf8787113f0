#include "common/application/Application.h"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <iterator>
#include <thread>
#include <variant>

#include "common/application/Connection.h"
#include "common/application/Proposal.h"
#include "common/codec/ApplicationCodec.h"
#include "common/codec/WallCodec.h"
#include "common/request/Check.h"

namespace tessera {

namespace {

using std::chrono::milliseconds;

/// In one request: what is asked for costs the server time between two frames.
constexpr std::size_t kNamesAtOnce = 64;
/// Between a dial that failed and the next.
constexpr milliseconds kFirstPause{50}, kLongestPause{1000};

/// Time left until `deadline`, never negative.
Duration until(TimePoint deadline) {
    return std::max<Duration>(deadline - clockNow(), Duration::zero());
}

template <typename... F>
struct Each : F... {
    using F::operator()...;
};
template <typename... F> Each(F...) -> Each<F...>;  // clang 14 does not find it by itself
}  // namespace

struct Application::Impl {
    Impl(ConnectionOptions c, const Options& o)
        : options(o), connectionOptions(std::move(c)), connection(std::make_unique<Connection>(connectionOptions)) {}

    /// Puts one value aside (a reply is given back), and dials again where the connection broke. False: nothing came until
    /// `deadline`, or it is all over.
    bool take(TimePoint deadline, std::optional<message::Reply>* reply = nullptr);
    /// Applies what was put aside. The error that ended everything comes only once nothing is left to apply.
    Expected<bool> dispatch();
    Expected<void> apply(incoming::List list);
    void tell(const ApplicationNotice& notice);

    void configure(const incoming::Configured& configured);
    void lose(incoming::Ended end);
    /// A list for a scene that is about to come anew is not sent: it was made from another.
    [[nodiscard]] Expected<void> sceneIsHere() const;

    /// What answers this request; `arrays` go before it. What its description does not allow is not sent.
    template <typename Request>
    Expected<typename Request::Answer> ask(const Request& request, std::optional<milliseconds> timeout = std::nullopt,
                                           std::span<const Blob> arrays = {}) {
        using Answer = typename Request::Answer;
        if (const Expected<void> sound = checkRequest(request); !sound) return tl::unexpected(sound.error());
        auto answer = answerTo(encodeRequest(request), timeout.value_or(options.timeout), arrays);
        if (!answer) return tl::unexpected(answer.error());
        if (auto* expected = std::get_if<Answer>(&*answer)) return std::move(*expected);
        return fail(ErrorCode::kBadInput,
                    "the server answered something else than was asked; is it of another version?");
    }
    Expected<ApplicationAnswer> answerTo(Bytes request, milliseconds timeout, std::span<const Blob> arrays);
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
    std::function<void(const Error&)> lostCallback;
    std::function<void()> backCallback;
};

bool Application::Impl::take(TimePoint deadline, std::optional<message::Reply>* reply) {
    if (ended) return false;
    if (!connection) {
        std::this_thread::sleep_until(std::min(deadline, away->dialAt));
        if (clockNow() < away->dialAt) return false;
        connection = std::make_unique<Connection>(connectionOptions);
    }
    std::optional<Incoming> value = connection->next(until(deadline));
    if (!value) return false;
    if (auto* answer = std::get_if<incoming::Reply>(&*value)) {
        if (reply != nullptr && answer->reply.id == lastRequest) *reply = std::move(answer->reply);
        // Any other reply belongs to a request that was given up.
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
        away = Away{clockNow(), clockNow(), kFirstPause, end.error};
        aside.emplace_back(Lost{end.error});
    } else if (again && away) {
        away->dialAt = clockNow() + away->pause;
        away->pause = std::min<Duration>(2 * away->pause, kLongestPause);
    }
    if (again && away && clockNow() < away->since + options.redial) {
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
    return fail(ErrorCode::kNetwork, fmt::format("the connection to the server at {} broke and its scene is coming anew: "
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
                    [](const notice::States&) {}},  // for pages: nothing here subscribes to them
               notice);
}

Expected<ApplicationAnswer> Application::Impl::answerTo(Bytes body, milliseconds timeout,
                                                        std::span<const Blob> arrays) {
    if (body.size() > limits::kMaxRequestBytes)
        return fail(ErrorCode::kLimit, fmt::format("the request has {} bytes, and {} is the most", body.size(), limits::kMaxRequestBytes));
    const TimePoint deadline = clockNow() + timeout;
    while (away && !ended)
        if (!take(deadline) && clockNow() >= deadline)
            return fail(ErrorCode::kNetwork,
                        fmt::format("the server at {} did not come back within {} ms: {}", options.address,
                                    timeout.count(), away->why.message));
    if (ended) return tl::unexpected(ended->error);
    connection->upload(arrays);
    connection->request(++lastRequest, std::move(body));
    std::optional<message::Reply> reply;
    while (!reply) {
        const bool came = take(deadline, &reply);
        if (ended) return tl::unexpected(ended->error);
        if (away)
            return fail(ErrorCode::kNetwork, away->why.message + " (whether what was asked for was done is not known)");
        if (!came)
            return fail(ErrorCode::kNetwork,
                        fmt::format("the server at {} did not answer within {} ms", options.address, timeout.count()));
    }
    if (!reply->error.empty()) return fail(reply->code, std::move(reply->error));
    return decodeAnswer(reply->body);
}

Expected<answer::Committed> Application::Impl::settled(Expected<answer::Committed> committed) {
    if (!committed || !options.followScene || dispatching) return committed;
    const TimePoint deadline = clockNow() + options.timeout;
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

Application::Application(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Application::~Application() = default;

Expected<std::unique_ptr<Application>> Application::connect(const Options& options) {
    Expected<ConnectionOptions> connectionOptions = connectionOptionsOf(options);
    if (!connectionOptions) return tl::unexpected(connectionOptions.error());
    auto impl = std::make_unique<Impl>(std::move(*connectionOptions), options);

    // A little more than the transport's own timeout, whose message is the better one.
    const TimePoint deadline = clockNow() + options.timeout + milliseconds(100);
    while (!impl->wall || (options.followScene && !impl->haveScene)) {
        if (!impl->take(deadline) && !impl->ended) {
            if (!impl->wall)
                return fail(ErrorCode::kNetwork,
                            fmt::format("no Tessera server at {}: something accepts connections there but "
                                        "did not answer within {} ms",
                                        options.address, options.timeout.count()));
            return fail(ErrorCode::kNetwork, fmt::format("the server at {} did not hand out its scene within {} ms",
                                                         options.address, options.timeout.count()));
        }
        if (impl->wallFault) return tl::unexpected(*impl->wallFault);
        if (const auto applied = impl->dispatch(); !applied) return tl::unexpected(applied.error());
    }
    impl->joined = true;
    return std::unique_ptr<Application>(new Application(std::move(impl)));
}

const Aspect& Application::scene() const {
    return impl_->aspect;
}
Sequence Application::sequence() const {
    return impl_->sequence;
}
const Wall& Application::wall() const {
    return *impl_->wall;
}
bool Application::connected() const {
    return !impl_->away && !impl_->ended;
}
bool Application::serverIsOver() const {
    return impl_->ended && impl_->ended->over;
}

Expected<bool> Application::poll(milliseconds timeout) {
    if (impl_->dispatching) return fail(ErrorCode::kRefused, "poll was called from within a callback");
    const TimePoint deadline = clockNow() + timeout;
    while (impl_->aside.empty() && impl_->take(deadline)) continue;
    while (impl_->take(clockNow())) continue;
    return impl_->dispatch();
}

Expected<notice::Frame> Application::waitForFrame(milliseconds timeout) {
    if (!impl_->subscription.frames) {
        impl_->subscription.frames = true;
        if (auto subscribed = impl_->subscribe(); !subscribed) return tl::unexpected(subscribed.error());
    }
    impl_->lastFrame.reset();
    const TimePoint deadline = clockNow() + timeout;
    for (;;) {
        const auto polled = poll(std::chrono::ceil<milliseconds>(until(deadline)));
        if (!polled) return tl::unexpected(polled.error());
        if (impl_->lastFrame) return *impl_->lastFrame;
        if (clockNow() >= deadline)
            return fail(ErrorCode::kNetwork, fmt::format("the wall showed no frame within {} ms", timeout.count()));
    }
}

void Application::onChanges(std::function<void(const ChangeList&, Sequence)> callback) {
    impl_->changesCallback = std::move(callback);
}
Expected<void> Application::onContacts(std::function<void(const answer::Contacts&)> callback) {
    impl_->contactsCallback = std::move(callback);
    impl_->subscription.contacts = impl_->contactsCallback != nullptr;
    return impl_->subscribe();
}
Expected<void> Application::onPairEvents(std::function<void(const answer::PairEvents&)> callback,
                                         PairEventOptions options) {
    impl_->eventsCallback = std::move(callback);
    impl_->subscription.events = impl_->eventsCallback != nullptr;
    impl_->subscription.stays = impl_->subscription.events && options.stays;
    return impl_->subscribe();
}
Expected<void> Application::onDistances(std::function<void(const answer::Distances&)> callback) {
    impl_->distancesCallback = std::move(callback);
    impl_->subscription.distances = impl_->distancesCallback != nullptr;
    return impl_->subscribe();
}
Expected<void> Application::onQuestions(std::function<void(const answer::Questions&)> callback) {
    impl_->questionsCallback = std::move(callback);
    impl_->subscription.questions = impl_->questionsCallback != nullptr;
    return impl_->subscribe();
}
Expected<void> Application::onPick(std::function<void(const answer::Picked&)> callback) {
    impl_->pickCallback = std::move(callback);
    impl_->subscription.picks = impl_->pickCallback != nullptr;
    return impl_->subscribe();
}
Expected<void> Application::onFrame(std::function<void(const notice::Frame&)> callback) {
    impl_->frameCallback = std::move(callback);
    impl_->subscription.frames = impl_->frameCallback != nullptr;
    return impl_->subscribe();
}
Expected<void> Application::onPoses(std::function<void(const notice::Poses&)> callback) {
    impl_->posesCallback = std::move(callback);
    impl_->subscription.poses = impl_->posesCallback != nullptr;
    return impl_->subscribe();
}

void Application::onLost(std::function<void(const Error&)> callback) {
    impl_->lostCallback = std::move(callback);
}
void Application::onBack(std::function<void()> callback) {
    impl_->backCallback = std::move(callback);
}

Expected<answer::Committed> Application::propose(const ChangeList& list, std::uint64_t gesture) {
    if (auto here = impl_->sceneIsHere(); !here) return tl::unexpected(here.error());
    const auto known = [&](const BlobId& array) { return impl_->connection && impl_->connection->has(array); };
    const auto ask = [&](const Proposal& proposal, std::span<const Blob> arrays) {
        return impl_->ask(proposal, std::nullopt, arrays);
    };
    return impl_->settled(impl_->proposals.propose(list, gesture, known, ask));
}

Expected<answer::Committed> Application::undo() {
    return impl_->edit(request::UndoStep{});
}
Expected<answer::Committed> Application::redo() {
    return impl_->edit(request::RedoStep{});
}

Expected<answer::Committed> Application::moveNode(const std::string& node, const NodeMove& move, std::uint64_t gesture) {
    if (impl_->options.followScene) {
        if (auto here = impl_->sceneIsHere(); !here) return tl::unexpected(here.error());
        const Expected<ObjectId> found = findNode(impl_->aspect, node);
        if (!found) return tl::unexpected(found.error());
        return impl_->move(*found, move, gesture);
    }
    const Expected<ObjectInfo> info = describeNode(node);
    if (!info) return tl::unexpected(info.error());
    return moveNode(*info, move, gesture);
}

Expected<answer::Committed> Application::moveNode(const ObjectInfo& node, const NodeMove& move, std::uint64_t gesture) {
    return impl_->move(node.id, move, gesture);
}
Expected<answer::Committed> Application::removeNode(ObjectId node) {
    return impl_->edit(request::RemoveNode{node});
}
Expected<answer::Committed> Application::cloneNode(const CloneWish& wish) {
    return impl_->edit(request::CloneNode{wish});
}

Expected<answer::FoundPage> Application::find(NodeSearch wanted) {
    const TimePoint deadline = clockNow() + impl_->options.timeout;
    for (;;) {
        Expected<answer::FoundPage> page = impl_->ask(request::FindNodes{wanted});
        if (!page || !page->nodes.empty() || page->next.empty()) return page;
        if (clockNow() >= deadline)
            return fail(ErrorCode::kNetwork, fmt::format("the server at {} found nothing within {} ms, and has not looked everywhere",
                                                         impl_->options.address, impl_->options.timeout.count()));
        wanted.after = std::move(page->next);
    }
}

Expected<ObjectInfo> Application::describe(const std::string& name) {
    Expected<std::vector<ObjectInfo>> infos = describe(std::span(&name, 1));
    if (!infos) return tl::unexpected(infos.error());
    if (!infos->front().id) return fail(ErrorCode::kNotFound, std::move(infos->front().path));
    return std::move(infos->front());
}

Expected<ObjectInfo> Application::describeNode(const std::string& name) {
    Expected<ObjectInfo> info = describe(name);
    if (!info || info->type == typeOf<Node>()) return info;
    const TypeInfo* type = findType(info->type);
    return fail(ErrorCode::kNotFound,
                fmt::format("node {}: it is a {}, not a node", name, type ? type->name : std::string_view("object")));
}

Expected<std::vector<ObjectInfo>> Application::describe(std::span<const std::string> names) {
    std::vector<ObjectInfo> infos;
    while (infos.size() < names.size()) {
        const auto some = names.subspan(infos.size(), std::min(names.size() - infos.size(), kNamesAtOnce));
        Expected<answer::Objects> told = impl_->ask(request::GetObjects{{.names = {some.begin(), some.end()}}});
        if (!told) return tl::unexpected(told.error());
        if (told->objects.size() != some.size())
            return fail(ErrorCode::kBadInput, "the server told of other objects than it was asked for");
        std::ranges::move(told->objects, std::back_inserter(infos));
    }
    return infos;
}

Expected<SceneExcerpt> Application::fetch(std::span<const ObjectId> objects) {
    SceneExcerpt excerpt;
    for (std::size_t done = 0; done < objects.size(); done += kNamesAtOnce) {
        ObjectsWish wanted{.names = {}, .paths = false, .content = true};
        for (const ObjectId id : objects.subspan(done, std::min(objects.size() - done, kNamesAtOnce)))
            wanted.names.push_back(fmt::format("#{}", id.value));
        const Expected<answer::Objects> told = impl_->ask(request::GetObjects{wanted});
        if (!told) return tl::unexpected(told.error());
        if (auto added = excerpt.add(told->content); !added) return tl::unexpected(added.error());
    }
    return excerpt;
}

Expected<SceneExcerpt> Application::fetchTree(TreeWish wanted) {
    SceneExcerpt excerpt;
    const TimePoint deadline = clockNow() + impl_->options.timeout;
    wanted.after.clear();
    do {
        if (clockNow() >= deadline)
            return fail(ErrorCode::kNetwork, fmt::format("the server at {} did not tell all of the tree within {} ms",
                                                         impl_->options.address, impl_->options.timeout.count()));
        Expected<answer::TreePage> page = impl_->ask(request::GetTree{wanted});
        if (!page) return tl::unexpected(page.error());
        if (auto added = excerpt.add(*page); !added) return tl::unexpected(added.error());
        wanted.after = std::move(page->next);
    } while (!wanted.after.empty());
    return excerpt;
}

Expected<answer::Loaded> Application::load(const std::string& path, ObjectId parent, milliseconds timeout, const Placing& placing, Reload reload) {
    constexpr std::string_view kAsset = request::LoadAsset::kPrefix;
    const bool again = reload == Reload::kIfThere;
    if (path.starts_with(kAsset)) return impl_->ask(request::LoadAsset{path.substr(kAsset.size()), parent, placing, again}, timeout);
    return impl_->ask(request::LoadFile{path, parent, placing, again}, timeout);
}

Expected<void> Application::setView(const ViewWish& view) {
    return impl_->done(request::SetView{view});
}
Expected<void> Application::show(Showing showing) {
    return impl_->done(request::ShowPicture{showing});
}
Expected<void> Application::setBudget(double milliseconds) {
    return impl_->done(request::SetBudget{milliseconds});
}
Expected<void> Application::navigate(const NavigationWish& wish) {
    return impl_->done(request::NavigateView{wish});
}
Expected<answer::Picked> Application::pick(const Aim& aim) {
    return impl_->ask(request::PickAt{aim});
}
Expected<answer::Measured> Application::measure(const Vec3d& from, const std::optional<Vec3d>& to, ObjectId node) {
    return impl_->ask(request::MeasureDistance{.from = from, .to = to, .node = node});
}
Expected<answer::Picked> Application::grab(const Aim& aim) {
    return impl_->ask(request::GrabHandle{aim});
}
Expected<answer::Committed> Application::drag(const Aim& aim) {
    return impl_->edit(request::DragHandle{aim});
}
Expected<void> Application::release() {
    return impl_->done(request::ReleaseHandle{});
}
Expected<answer::FolderPage> Application::files(const FolderWish& wish) {
    return impl_->ask(request::GetFiles{wish});
}
Expected<answer::Trackers> Application::trackers() {
    return impl_->ask(request::GetTrackers{});
}
Expected<answer::Contacts> Application::contacts() {
    return impl_->ask(request::GetContacts{});
}
Expected<answer::PairEvents> Application::pairEvents() {
    return impl_->ask(request::GetEvents{});
}
Expected<answer::Distances> Application::distances() {
    return impl_->ask(request::GetDistances{});
}
Expected<answer::Questions> Application::questions() {
    return impl_->ask(request::GetQuestions{});
}
Expected<void> Application::respond(const QuestionReply& reply) {
    return impl_->done(request::AnswerQuestion{reply});
}
Expected<answer::Status> Application::status() {
    return impl_->ask(request::GetStatus{});
}
Expected<answer::Identity> Application::whoAmI() {
    return impl_->ask(request::WhoAmI{});
}
Expected<answer::People> Application::people() {
    return impl_->ask(request::GetPeople{});
}
Expected<answer::Steps> Application::steps() {
    return impl_->ask(request::GetSteps{});
}
Expected<answer::WallPlan> Application::wallPlan() { return impl_->ask(request::GetWall{}); }
Expected<answer::Images> Application::images() {
    return impl_->ask(request::GetImages{});
}

}  // namespace tessera
