#include "tests/support/wall/SimulatedWall.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <set>
#include <utility>

#include "client/ctl/Verbs.h"
#include "common/codec/ApplicationCodec.h"
#include "common/codec/WallCodec.h"
#include "common/image/SharedFrame.h"
#include "common/wall/PictureLayout.h"
#include "server/command/ServerCommand.h"
#include "tests/support/surface/PooledSurface.h"

namespace tessera::simulation {
namespace {

constexpr auto kStartTime = 120s;  ///< of simulated time, for anything to begin

const char* const kServer = "server";

std::optional<CullerKind> cullerOf(const WallOptions& options, const std::string& host) {
    const auto own = options.cullers.find(host);
    return own == options.cullers.end() ? options.culler : own->second;
}

Injection injectionOf(const WallOptions& options, const std::string& host) {
    const auto own = options.injections.find(host);
    return own == options.injections.end() ? Injection() : own->second;
}

std::optional<FrameNumber> showsNothingFrom(const Injection& injection) {
    if (injection.kind != Injection::Kind::kShowHang) return std::nullopt;
    return FrameNumber(injection.frame);
}

}  // namespace

// ---- a host

SimulatedHost::SimulatedHost(World& world, std::string name, const WallOptions& options, Address server,
                             const std::string& output)
    : world_(world), name_(std::move(name)) {
    if (options.draws) surface_ = test::pooledSurface();
    const auto pokeLink = [this] {
        if (linkProgram_) linkProgram_->poke();
    };
    Platform platform = world.platform(name_, pokeLink);
    host_ = std::make_unique<RenderHost>(RenderHostOptions{.name = name_,
                                                           .output = options.draws ? output : "",
                                                           .culler = cullerOf(options, name_),
                                                           .injection = injectionOf(options, name_),
                                                           .workWaits = [this] { return work_.more(); },
                                                           .time = platform.time,
                                                           .lane = platform.lane},
                                         surface_.get(), store_, words_.log,
                                         [this](Outcome outcome) { link_->tell(std::move(outcome)); });
    const Expected<std::uint64_t> probe = host_->probe();
    if (!probe) throw Violation(name_ + ": " + probe.error().message);
    link_ = std::make_unique<ServerLink>(
        ServerLinkOptions{.server = std::move(server),
                          .name = name_,
                          .pixelProbe = *probe,
                          .firstShare = static_cast<double>(world.random().below(64)) / 64,
                          .platform = std::move(platform),
                          .atOnce = [this](const Work& work) { return host_->again(work); },
                          .showsNothingFrom = showsNothingFrom(injectionOf(options, name_))},
        shelf_, nullptr, nullptr, events_, work_, words_.log);
    drawProgram_ =
        world.run([this] { draw(); }, [this, &world] { return ahead_ ? world.now() + 2ms : TimePoint::max(); });
    drawProgram_->slowness(5ms);
    linkProgram_ = world.run(
        [this, begun = false]() mutable {
            if (link_->over()) return;
            if (!std::exchange(begun, true)) link_->begin();
            link_->turn();
            if (!work_.idle() || work_.closed()) drawProgram_->poke();
            if (!link_->over()) return;
            if (const HostEnd end = link_->finish(); !end.over) words_.log.warning(end.error.message);
        },
        [this] { return link_->over() ? TimePoint::max() : link_->nextWake(); });
}

SimulatedHost::~SimulatedHost() {
    linkProgram_.reset();
    drawProgram_.reset();
}

/// A turn of the thread that draws: see runHost.
void SimulatedHost::draw() {
    if (drawEnded_) return;
    const std::optional<Work> next = work_.tryPop();
    if (!next && work_.closed()) {
        drawEnded_ = true;
        ahead_ = false;
        return link_->tell({Attempt{}, outcome::Ended{}});
    }
    if (!next) {
        if (ahead_) ahead_ = host_->workAhead(world_.now());
        return;
    }
    if (going_ = going_ && host_->perform(*next); going_) work_.done();
    ahead_ = going_;
    drawProgram_->poke();
}

// ---- an application

SimulatedApplication::SimulatedApplication(World& world, std::string name, Address server)
    : world_(world), name_(name) {
    const auto poke = [this] {
        if (program_) program_->poke();
    };
    transport_ = world.network().transportOf(name, poke)(
        ApplicationSession::limits(), [this](LinkEvent event) { events_.push_back(std::move(event)); });
    session_ = std::make_unique<ApplicationSession>(
        ApplicationSessionOptions{.address = std::move(server), .name = std::move(name), .blobs = true}, *transport_,
        [this](Incoming incoming) { take(std::move(incoming)); });
    program_ = world.run(
        [this] {
            for (; !events_.empty(); events_.pop_front()) session_->on(events_.front());
            if (!session_->ended()) session_->advance(world_.now());
        },
        [this] { return session_->ended() ? TimePoint::max() : session_->nextDeadline(); });
}

SimulatedApplication::~SimulatedApplication() {
    program_.reset();
    session_.reset();
    transport_.reset();
}

std::uint64_t SimulatedApplication::say(const ApplicationRequest& request) {
    return sayBytes(encodeRequest(request));
}

std::uint64_t SimulatedApplication::sayBytes(ByteSlice body) {
    const std::uint64_t id = ++lastRequest_;
    answers_[id] = std::nullopt;
    session_->request(id, std::move(body));
    return id;
}

void SimulatedApplication::upload(std::span<const Blob> blobs) {
    forEachUpload(blobs, [this](message::Upload piece) { session_->upload(std::move(piece)); });
}

const Expected<ApplicationAnswer>* SimulatedApplication::answer(std::uint64_t id) const {
    const auto found = answers_.find(id);
    return found == answers_.end() || !found->second ? nullptr : &*found->second;
}

Expected<ApplicationAnswer> SimulatedApplication::await(std::uint64_t id, Duration atMost) {
    if (!world_.runUntil([&] { return answer(id) != nullptr || ended(); }, atMost))
        return fail(ErrorCode::kNetwork, "no answer came");
    if (const auto* told = answer(id)) {
        Expected<ApplicationAnswer> taken = *told;
        answers_.erase(id);
        return taken;
    }
    return fail(ErrorCode::kNetwork, endedBecause_);
}

std::vector<std::pair<std::uint64_t, Expected<ApplicationAnswer>>> SimulatedApplication::takeAnswers() {
    std::vector<std::pair<std::uint64_t, Expected<ApplicationAnswer>>> taken;
    for (auto& [id, answer] : answers_)
        if (answer) taken.emplace_back(id, std::move(*answer));
    std::erase_if(answers_, [](const auto& entry) { return entry.second.has_value(); });
    return taken;
}

void SimulatedApplication::take(Incoming incoming) {
    if (auto* list = std::get_if<incoming::List>(&incoming)) {
        if (list->whole) scene_ = Aspect();
        if (const Expected<void> applied = scene_.apply(*list->list); !applied)
            throw Violation("a list cannot be applied: " + applied.error().message);
        if (scene_.stateHash() != list->committed->stateHash)
            throw Violation(fmt::format("after list {} a replica has another state", list->committed->sequence.value));
        sequence_ = list->committed->sequence;
        hasScene_ = true;
        if (onList) onList(list->whole);
    } else if (auto* reply = std::get_if<incoming::Reply>(&incoming)) {
        const auto awaited = answers_.find(reply->reply.id);
        if (awaited == answers_.end() || awaited->second)
            throw Violation("a request was answered twice, or never asked");
        if (!reply->reply.error.empty())
            awaited->second = Expected<ApplicationAnswer>(fail(reply->reply.code, reply->reply.error));
        else
            awaited->second = decodeAnswer(reply->reply.body);
    } else if (const auto* told = std::get_if<incoming::Notice>(&incoming)) {
        if (const auto* frame = std::get_if<notice::Frame>(&told->notice)) {
            ++framesTold_;
            lateFrames_ += frame->frameMs > kLateMs ? 1 : 0;
            lastFrame_ = frame->frame;
        }
    } else if (auto* ended = std::get_if<incoming::Ended>(&incoming)) {
        endedBecause_ = ended->error.message;
    }
}

// ---- the wall

SimulatedWall::SimulatedWall(WallOptions options) : options_(std::move(options)), world_(options_.seed) {
    limitDrawThreads(0);
    if (options_.scene.find('{') != std::string::npos) {
        std::ofstream(folder_ / "scene.tsct") << options_.scene;
        options_.scene = folder_ / "scene.tsct";
    }
    startServer();
    if (options_.hosts) startHosts();
}

SimulatedWall::~SimulatedWall() {
    applications_.clear();
    hosts_.clear();
    serverProgram_.reset();
    server_.reset();
}

ServerOptions SimulatedWall::serverOptions() {
    std::vector<std::string> words = {"tessera-server",
                                      "--wall",
                                      options_.wall,
                                      "--listen",
                                      fmt::format("127.0.0.1:{}", address_.port),
                                      "--report",
                                      folder_ / "report.json",
                                      "--frames",
                                      std::to_string(options_.frames),
                                      "--rate",
                                      fmt::format("{}", options_.rateHz)};
    if (!options_.scene.empty()) words.insert(words.end(), {"--scene", options_.scene});
    if (options_.widthPx > 0)
        words.insert(words.end(), {"--size", fmt::format("{}x{}", options_.widthPx, options_.heightPx)});
    if (!options_.journal.empty()) words.insert(words.end(), {"--journal", options_.journal});
    if (options_.reload) words.emplace_back("--reload");
    words.insert(words.end(), options_.server.begin(), options_.server.end());
    std::vector<const char*> argv;
    for (const std::string& word : words) argv.push_back(word.c_str());
    ServerArguments arguments;
    if (parseServerCommand(static_cast<int>(argv.size()), argv.data(), arguments))
        throw Violation(fmt::format("no command line: {}", fmt::join(words, " ")));
    Expected<ServerOptions> made =
        serverOptionsOf(arguments, std::string(TESSERA_BIN_DIR) + "/tessera-server", words_.log);
    if (!made) throw Violation(made.error().message);
    made->journalFiles = options_.journalFiles;
    made->import.importerProgram = std::string(TESSERA_BIN_DIR) + "/tessera-import";
    return std::move(*made);
}

void SimulatedWall::startServer() {
    if (const Expected<void> begun = tryToStartServer(); !begun) throw Violation(begun.error().message);
}

Expected<void> SimulatedWall::tryToStartServer() {
    ServerOptions options = serverOptions();
    wall_ = options.wall;
    if (std::string first = std::exchange(options_.record, {}); !first.empty()) options.recordPath = std::move(first);
    options.onListening = [this](const Address& bound) { address_ = bound; };
    options.platform = world_.platform(kServer, [this] {
        if (serverProgram_) serverProgram_->poke();
    });
    server_ = std::make_unique<FrameLoop>(std::move(options), words_.log);
    serverEnded_ = false;
    serverError_.clear();
    if (Expected<void> begun = server_->begin(); !begun) {
        killServer();
        return begun;
    }
    serverProgram_ = world_.run(
        [this] {
            if (serverEnded_) return;
            Expected<void> turned = server_->turn();
            if (turned && server_->over()) {
                serverEnded_ = true;
                turned = server_->end();
            }
            if (turned) return;
            serverEnded_ = true;
            serverError_ = turned.error().message;
        },
        [this] { return serverEnded_ ? TimePoint::max() : server_->nextWake(); });
    return {};
}

void SimulatedWall::killServer() {
    serverProgram_.reset();
    world_.kill(kServer);
    server_.reset();
    serverEnded_ = true;
}

void SimulatedWall::stopServer() {
    server_->stop();
}

nlohmann::json SimulatedWall::finish() {
    stopServer();
    const bool ended = world_.runUntil(
        [&] {
            return !serverLives() &&
                   std::ranges::all_of(hosts_, [](const auto& host) { return !host.second || host.second->ended(); });
        },
        30s);
    serverProgram_.reset();
    server_.reset();  // its recording ends
    if (!ended || !serverError_.empty()) return {};
    const Expected<Bytes> text = readFile(folder_ / "report.json", 64 << 20);
    return text ? nlohmann::json::parse(asText(*text)) : nlohmann::json();
}

Platform SimulatedWall::platform(const std::string& program) {
    Platform made = world_.platform(program, [] {});
    made.wait = [this](TimePoint until, const std::function<bool()>& done) {
        (void)world_.runUntil(done, std::max<Duration>(until - world_.now(), {}));
    };
    return made;
}

CommandOutcome SimulatedWall::ctl(std::vector<std::string> words) {
    words.insert(words.begin(), {"--server", toString(address_)});
    std::string printed;
    const auto print = [&](const std::string& lines) { printed += lines; };
    const CtlOutcome outcome = runCtl(words, print, print, platform("ctl"));
    return {outcome.exitCode, printed + outcome.out + outcome.err};
}

void SimulatedWall::startHost(const std::string& name, const std::optional<Injection>& injection) {
    hosts_[name] = nullptr;
    WallOptions options = options_;
    if (injection) options.injections[name] = *injection;
    hosts_[name] = std::make_unique<SimulatedHost>(world_, name, options, address_, folder_ / "out");
}

void SimulatedWall::startHosts() {
    for (const WallHost& host : wall_.hosts) startHost(host.name);
}

void SimulatedWall::killHost(const std::string& name) {
    world_.kill(name);
    hosts_.erase(name);
}

SimulatedApplication& SimulatedWall::application(const std::string& name) {
    std::unique_ptr<SimulatedApplication>& there = applications_[name];
    if (there && !there->ended()) return *there;
    there = nullptr;
    there = std::make_unique<SimulatedApplication>(world_, name, address_);
    if (!world_.runUntil([&] { return there->hasScene() || there->ended(); }, kStartTime) || there->ended())
        throw Violation(fmt::format("{} does not come in: {}\n{}", name, there->endedBecause(), logs()));
    return *there;
}

std::optional<std::uint64_t> SimulatedWall::shownFrame() const {
    if (world_.now() < lookAgain_) return shown_;
    lookAgain_ = world_.now() + 500us;
    shown_.reset();
    std::optional<std::uint64_t> frame;
    for (const Tile& tile : layoutTiles(wall_)) {
        const auto shown = SharedFrameReader::open(folder_ / ("out/tiles/" + tile.name + "/shown.frame"));
        if (!shown || (frame && *frame != shown->glance().number)) return std::nullopt;
        frame = shown->glance().number;
    }
    return shown_ = frame;
}

std::optional<std::uint64_t> SimulatedWall::shownFrame(const std::string& tile) const {
    const auto shown = SharedFrameReader::open(folder_ / ("out/tiles/" + tile + "/shown.frame"));
    return shown ? std::optional(shown->glance().number) : std::nullopt;
}

std::optional<Picture> SimulatedWall::picture(const std::string& screen) const {
    std::vector<PictureLayout::Place> places = layoutPicture(wall_, PictureKind::kMosaic).places;
    if (!screen.empty()) {
        std::set<std::string> wanted;
        for (const Tile& tile : layoutTiles(wall_))
            if (tile.screen == screen) wanted.insert(tile.name);
        std::erase_if(places, [&](const PictureLayout::Place& place) { return !wanted.contains(place.tile); });
    }
    constexpr int kFar = std::numeric_limits<int>::max();
    int left = kFar, right = 0, top = kFar, bottom = 0;
    for (const PictureLayout::Place& place : places) {
        left = std::min(left, place.xPx);
        right = std::max(right, place.xPx + place.widthPx);
        top = std::min(top, place.yPx);
        bottom = std::max(bottom, place.yPx + place.heightPx);
    }
    std::optional<std::uint64_t> frame;
    Picture whole = Picture::filled(right - left, bottom - top, 0, 0, 0);
    for (const PictureLayout::Place& place : places) {
        const auto shown = readSharedFrame(folder_ / ("out/tiles/" + place.tile + "/shown.frame"));
        if (!shown || (frame && *frame != shown->frame)) return std::nullopt;
        frame = shown->frame;
        paste(whole, shown->picture, place.xPx - left, place.yPx - top);
    }
    return whole;
}

Picture SimulatedWall::pictureOf(std::uint64_t frame, Duration atMost) {
    const bool shown = world_.runUntil(
        [&] {
            const auto now = shownFrame();
            return !serverLives() || (now && *now >= frame);
        },
        atMost);
    const std::optional<std::uint64_t> now = shownFrame();
    if (!shown || now != frame)
        throw Violation(fmt::format("frame {} is not shown by all (now {}): {}\n{}", frame,
                                    now ? std::to_string(*now) : "various", serverError_, logs()));
    return picture().value();
}

Picture SimulatedWall::tilePicture(const std::string& tile) const {
    Expected<ShownImage> shown = readSharedFrame(folder_ / ("out/tiles/" + tile + "/shown.frame"));
    if (!shown) throw Violation(shown.error().message);
    return std::move(shown->picture);
}

std::string SimulatedWall::logs() const {
    std::string all = words_.said();
    for (const auto& [name, host] : hosts_)
        if (host) all += "\n[" + name + "] " + host->log();
    return all;
}

}  // namespace tessera::simulation
