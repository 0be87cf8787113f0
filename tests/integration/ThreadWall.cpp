#include "tests/integration/ThreadWall.h"

#include <gtest/gtest.h>

#include <condition_variable>
#include <csignal>
#include <functional>
#include <mutex>
#include <stop_token>
#include <utility>

#include "client/ctl/Verbs.h"
#include "client/draw/surface/Surface.h"
#include "client/replica/HostProgram.h"
#include "common/access/LocalWalls.h"
#include "common/tls/KeyRing.h"
#include "server/Serving.h"
#include "tests/unit/Eventually.h"

namespace tessera::test {

using namespace std::chrono_literals;

// ---- ThreadProgram

ThreadProgram::ThreadProgram(const std::string& folder, const std::string& name, const std::string& program)
    : file_(std::fopen((folder + "/" + name + ".log").c_str(), "a")),
      log_(program, file_),
      path_(folder + "/" + name + ".log") {
    std::signal(SIGPIPE, SIG_IGN);  // as the programs do
}

ThreadProgram::~ThreadProgram() {
    join();
    std::fclose(file_);
}

void ThreadProgram::start(std::function<Expected<void>()> work) {
    thread_ = std::thread([this, done = std::move(work)] {
        const Expected<void> outcome = done();
        if (!outcome) log_.error(outcome.error().message);
        (void)log_.flush();
        end_.set_value(outcome ? 0 : exitCode(outcome.error().code));
    });
}

void ThreadProgram::say(const std::string& line) {
    std::fputs(line.c_str(), file_);
    std::fflush(file_);
}

void ThreadProgram::join() {
    if (thread_.joinable()) thread_.join();
}

std::string ThreadProgram::output() {
    (void)log_.flush();
    return readText(path_);
}

std::optional<std::string> ThreadProgram::waitForText(const std::string& text, std::chrono::milliseconds timeout) {
    std::optional<std::string> rest;
    (void)eventually(
        [&] {
            const bool ended = exit_.wait_for(0s) == std::future_status::ready;
            rest = restOfLine(output(), text);
            return ended || rest;
        },
        timeout);
    return rest;
}

std::optional<int> ThreadProgram::waitForExit(std::chrono::milliseconds timeout) {
    return exit_.wait_for(timeout) == std::future_status::ready ? std::optional(exit_.get()) : std::nullopt;
}

// ---- ThreadServer

namespace {

std::optional<int> parse(const std::vector<std::string>& words, ServerArguments& arguments) {
    std::vector<const char*> argv = {"tessera-server"};
    for (const std::string& word : words) argv.push_back(word.c_str());
    return parseServerCommand(static_cast<int>(argv.size()), argv.data(), arguments);
}

}  // namespace

Refused refusedWords(const std::vector<std::string>& words) {
    ServerArguments arguments;
    testing::internal::CaptureStderr();
    const std::optional<int> exitCode = parse(words, arguments);
    return {exitCode, testing::internal::GetCapturedStderr()};
}

/// Somebody wants the server to end.
class ThreadServer::Stopping {
public:
    void want() {
        const std::scoped_lock lock(mutex_);
        wanted_ = true;
        changed_.notify_all();
    }
    void wait(const std::stop_token& done, FrameLoop& loop) {
        std::unique_lock lock(mutex_);
        if (changed_.wait(lock, done, [&] { return wanted_; })) loop.stop();
    }

private:
    std::mutex mutex_;
    std::condition_variable_any changed_;
    bool wanted_ = false;
};

ThreadServer::ThreadServer(const std::string& folder, std::vector<std::string> words)
    : ThreadProgram(folder, "server", "tessera-server"), stopping_(std::make_shared<Stopping>()) {
    start([this, given = std::move(words)]() -> Expected<void> {
        ServerArguments arguments;
        if (parse(given, arguments)) return fail(ErrorCode::kUsage, "nothing to serve");
        return serve(arguments, {.log = log_,
                                 .say = [this](const std::string& line) { say(line); },
                                 .watch =
                                     [stopping = stopping_](FrameLoop& loop) {
                                         return std::jthread([stopping, &loop](const std::stop_token& done) {
                                             stopping->wait(done, loop);
                                         });
                                     }});
    });
}

ThreadServer::~ThreadServer() {
    stop();
    join();
}

void ThreadServer::stop() {
    stopping_->want();
}

// ---- ThreadHost

/// As tessera-client does for a server on loopback. Before any thread reads the environment.
[[maybe_unused]] const bool kDrawsAlone = (limitDrawThreads(0), true);

ThreadHost::ThreadHost(const std::string& folder, const Options& options)
    : ThreadProgram(folder, options.name, "tessera-client[" + options.name + "]") {
    start([this, options]() -> Expected<void> {
        HostOptions host{.server = options.server,
                         .name = options.name,
                         .output = options.output,
                         .surface = options.surface,
                         .injection = options.injection,
                         .share = ShareMode::kOff};
        auto access = accessLater({}, !options.keys.empty());
        if (!access) return tl::unexpected(access.error());
        host.access = std::move(*access);
        if (!options.keys.empty()) {
            Expected<CurrentKeys> keys = keysOfHost(options.keys, options.name);
            if (!keys) return failWith("--keys", keys.error());
            host.keys = std::move(*keys);
        }
        return runHost(host, log_);
    });
}

ThreadHost::~ThreadHost() {
    join();
}

void ThreadHost::settle() {
    (void)waitForText("joined the server", 60s);
}

// ---- ThreadWall

ThreadWall::ThreadWall(const LiveWallOptions& options)
    : server_(std::make_unique<ThreadServer>(folder_.path(), serverWords(options, folder_.path()))) {
    address_ = server_->waitForText("listening on ", 20s).value_or("");
}

ThreadWall::~ThreadWall() {
    stop();
    hosts_.clear();
}

void ThreadWall::stop() {
    if (!server_->waitForExit(0s))
        for (const auto& [name, host] : hosts_) host->settle();
    server_->stop();
}

ThreadHost& ThreadWall::startClient(const std::string& host, ThreadHost::Options more) {
    more.server = *parseAddress(address_);
    more.name = host;
    more.output = output();
    hosts_[host] = std::make_unique<ThreadHost>(folder_.path(), more);
    return *hosts_[host];
}

bool ThreadWall::waitForFrame(const std::string& tile, std::int64_t frame, std::chrono::milliseconds timeout) const {
    return eventually([&] { return shownFrame(tile) >= frame; }, timeout);
}

Outcome ThreadWall::ctl(std::vector<std::string> words) const {
    words.insert(words.begin(), {"--server", address_});
    return ctlHere(words);
}

nlohmann::json ThreadWall::finish() {
    stop();
    return waitForEnd(30s);
}

nlohmann::json ThreadWall::waitForEnd(std::chrono::milliseconds timeout) {
    if (!server_->waitForExit(timeout)) return {};
    hosts_.clear();
    return reportIn(folder_.path());
}

std::string ThreadWall::logs() const {
    std::string all = "--- server\n" + server_->output();
    for (const auto& [host, program] : hosts_) all += "--- " + host + "\n" + program->output();
    return all;
}

Outcome ctlHere(const std::vector<std::string>& words) {
    std::string printed;
    const auto print = [&](const std::string& lines) { printed += lines; };
    const CtlOutcome outcome = runCtl(words, print, print);
    return {outcome.exitCode, printed + outcome.out + outcome.err};
}

}  // namespace tessera::test
