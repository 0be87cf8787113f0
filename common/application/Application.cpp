#include "common/application/Application.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "common/application/ApplicationImpl.h"

namespace tessera {

namespace {

using std::chrono::milliseconds;

/// In one request: what is asked for costs the server time between two frames.
constexpr std::size_t kNamesAtOnce = 64;

}  // namespace

Application::Application(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Application::~Application() = default;

Expected<std::unique_ptr<Application>> Application::connect(const Options& options) {
    return connect(options, Platform());
}

Expected<std::unique_ptr<Application>> Application::connect(const Options& options, const Platform& platform) {
    Expected<ConnectionOptions> connectionOptions = connectionOptionsOf(options);
    if (!connectionOptions) return tl::unexpected(connectionOptions.error());
    connectionOptions->platform = platform;
    Options known = options;  // messages name the server, whoever has named it
    known.address = addressText(*connectionOptions);
    auto impl = std::make_unique<Impl>(std::move(*connectionOptions), known);

    // A little more than the transport's own timeout, whose message is the better one.
    const TimePoint deadline = platform.now() + options.timeout + milliseconds(100);
    while (!impl->wall || (options.followScene && !impl->haveScene)) {
        if (!impl->take(deadline) && !impl->ended) {
            if (!impl->wall)
                return fail(ErrorCode::kNetwork,
                            fmt::format("no Tessera server at {}: something accepts connections there but "
                                        "did not answer within {} ms",
                                        known.address, options.timeout.count()));
            return fail(ErrorCode::kNetwork, fmt::format("the server at {} did not hand out its scene within {} ms",
                                                         known.address, options.timeout.count()));
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
    const TimePoint deadline = impl_->now() + timeout;
    while (impl_->aside.empty() && impl_->take(deadline)) continue;
    while (impl_->take(impl_->now())) continue;
    return impl_->dispatch();
}

Expected<notice::Frame> Application::waitForFrame(milliseconds timeout) {
    if (!impl_->subscription.frames) {
        impl_->subscription.frames = true;
        if (auto subscribed = impl_->subscribe(); !subscribed) return tl::unexpected(subscribed.error());
    }
    impl_->lastFrame.reset();
    const TimePoint deadline = impl_->now() + timeout;
    for (;;) {
        const auto polled =
            poll(std::chrono::ceil<milliseconds>(std::max<Duration>(deadline - impl_->now(), Duration::zero())));
        if (!polled) return tl::unexpected(polled.error());
        if (impl_->lastFrame) return *impl_->lastFrame;
        if (impl_->now() >= deadline)
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

Expected<void> Application::onStates(std::function<void(const notice::States&)> callback) {
    impl_->statesCallback = std::move(callback);
    impl_->subscription.states = impl_->statesCallback != nullptr;
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

Expected<answer::Committed> Application::moveNode(const std::string& node, const NodeMove& move,
                                                  std::uint64_t gesture) {
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
    const TimePoint deadline = impl_->now() + impl_->options.timeout;
    for (;;) {
        Expected<answer::FoundPage> page = impl_->ask(request::FindNodes{wanted});
        if (!page || !page->nodes.empty() || page->next.empty()) return page;
        if (impl_->now() >= deadline)
            return fail(ErrorCode::kNetwork,
                        fmt::format("the server at {} found nothing within {} ms, and has not looked everywhere",
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
    const TimePoint deadline = impl_->now() + impl_->options.timeout;
    wanted.after.clear();
    do {
        if (impl_->now() >= deadline)
            return fail(ErrorCode::kNetwork, fmt::format("the server at {} did not tell all of the tree within {} ms",
                                                         impl_->options.address, impl_->options.timeout.count()));
        Expected<answer::TreePage> page = impl_->ask(request::GetTree{wanted});
        if (!page) return tl::unexpected(page.error());
        if (auto added = excerpt.add(*page); !added) return tl::unexpected(added.error());
        wanted.after = std::move(page->next);
    } while (!wanted.after.empty());
    return excerpt;
}

Expected<answer::Loaded> Application::load(const std::string& path, ObjectId parent, milliseconds timeout,
                                           const Placing& placing, Reload reload) {
    return load(path, parent, timeout, placing, reload, {});
}

Expected<answer::Loaded> Application::load(const std::string& path, ObjectId parent, milliseconds timeout,
                                           const Placing& placing, Reload reload,
                                           const std::function<bool(const LoadState&)>& tell) {
    std::function<void()> meanwhile;
    bool isWanted = true, isCancelled = false;
    if (tell)
        meanwhile = [&] {
            if (isCancelled) return;
            // A server of an older version tells nothing, and reads the file all the same.
            const Expected<answer::Loads> told = loads();
            LoadState own{.path = path};
            if (told)
                for (const LoadState& one : told->loads)
                    if (one.yours && one.path == path) own = one;
            isWanted = isWanted && tell(own);
            // Before the server tells of the load there is nothing to cancel yet.
            isCancelled = !isWanted && own.load != 0 && cancelLoad(own.load).has_value();
        };
    constexpr std::string_view kAsset = request::LoadAsset::kPrefix;
    const bool again = reload == Reload::kIfThere;
    if (path.starts_with(kAsset))
        return impl_->ask(request::LoadAsset{path.substr(kAsset.size()), parent, placing, again, placing.variants},
                          timeout, {}, meanwhile);
    return impl_->ask(request::LoadFile{path, parent, placing, again, placing.variants}, timeout, {}, meanwhile);
}

Expected<answer::Loads> Application::loads() {
    return impl_->ask(request::GetLoads{});
}
Expected<void> Application::cancelLoad(std::uint64_t load) {
    return impl_->done(request::CancelLoad{load});
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
Expected<void> Application::setExposure(const ExposureWish& wish, bool reset) {
    return impl_->done(request::SetExposure{wish, reset});
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
Expected<answer::WallPlan> Application::plan() {
    return impl_->ask(request::GetWall{});
}
Expected<answer::Steps> Application::steps() {
    return impl_->ask(request::GetSteps{});
}
Expected<answer::Images> Application::images(milliseconds timeout) {
    return impl_->ask(request::GetImages{}, timeout);
}

}  // namespace tessera
