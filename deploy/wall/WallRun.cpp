#include "deploy/wall/WallRun.h"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <optional>

#include "deploy/wall/Ssh.h"

namespace tessera {

namespace {

using SteadyTime = std::chrono::steady_clock::time_point;
using std::chrono::milliseconds;

constexpr std::string_view kListening = "tessera-server: listening on ";
constexpr std::string_view kProgress = "progress ";

/// One host's client, or its absence.
struct ClientSlot {
    std::string host;
    std::optional<Child> process;
    std::optional<SteadyTime> restartAt;
    std::optional<ChildEnd> lastEnd;
    int restarts = 0;
    int deathsInARow = 0;
    bool killed = false;                    ///< by us, and said so
    std::optional<SteadyTime> endedWellAt;  ///< before the server, as yet
    bool left = false;                      ///< long before the server
    const RemoteClient* remote = nullptr;   ///< null: it runs here
    SteadyTime startedAt{}, lastSign{};
    // Of lines passed on: those of the second that began then, and those left out of it.
    SteadyTime secondBegan{};
    int linesInSecond = 0;
    std::uint64_t linesLeftOut = 0;
};

class WallRun {
public:
    WallRun(const WallRunOptions& options, Signals& signals, Console& console)
        : options_(options), signals_(signals), console_(console) {
        for (const std::string& host : options.hosts) {
            const auto remote = options.remote.find(host);
            clients_.push_back({.host = host, .process = {}, .restartAt = {}, .lastEnd = {}});
            if (remote != options.remote.end()) clients_.back().remote = &remote->second;
        }
    }

    Expected<WallRunResult> run() {
        Expected<Child> server =
            Child::start({.program = options_.serverProgram, .arguments = options_.serverArguments});
        if (!server) return tl::unexpected(server.error());
        server_ = std::move(*server);
        console_.fact(fmt::format("tessera-wall: pid {} role server host -", server_->pid()));
        endServerAt_ = now() + options_.startDeadline;

        while (server_->running() || anyClientRuns() || anythingToRead()) {
            waitForSomething();
            if (signals_.takeStopRequest()) stopRequested();
            readServer();
            for (ClientSlot& client : clients_) readClient(client);
            if (auto started = startClients(); !started) return tl::unexpected(started.error());
            reapClients();
            noticeLeavers();
            keepAlive();
            if (std::optional<ChildEnd> end = server_->reap()) serverEnded(*end);
            followBeforeEnd();
            if (auto restarted = restartClients(); !restarted) return tl::unexpected(restarted.error());
            keepDeadlines();
            noticeDesertion();
            if (!underWay_ && !ending_) console_.preparing("reading the scene, drawing the first frame");
        }
        console_.finishProgress();
        for (const ClientSlot& client : clients_) {
            if (client.restarts > 0) result_.restarts[client.host] = client.restarts;
        }
        return result_;
    }

private:
    static SteadyTime now() { return std::chrono::steady_clock::now(); }
    [[nodiscard]] bool anyClientRuns() const {
        return std::any_of(clients_.begin(), clients_.end(),
                           [](const ClientSlot& c) { return c.process && c.process->running(); });
    }
    /// What a process said last is read after its end.
    [[nodiscard]] bool anythingToRead() const {
        const auto open = [](const Child& child) {
            return child.handle(Child::kOut) >= 0 || child.handle(Child::kError) >= 0;
        };
        if (drainUntil_ && now() >= *drainUntil_) return false;
        return open(*server_) || std::any_of(clients_.begin(), clients_.end(),
                                             [&](const ClientSlot& c) { return c.process && open(*c.process); });
    }

    void waitForSomething() {
        std::vector<pollfd> handles{{.fd = signals_.handle(), .events = POLLIN, .revents = 0}};
        const auto add = [&](const Child& child) {
            for (const Child::Stream stream : {Child::kOut, Child::kError}) {
                if (child.handle(stream) >= 0)
                    handles.push_back({.fd = child.handle(stream), .events = POLLIN, .revents = 0});
            }
        };
        add(*server_);
        for (const ClientSlot& client : clients_) {
            if (client.process) add(*client.process);
        }
        SteadyTime next = now() + milliseconds(500);
        const auto until = [&](const std::optional<SteadyTime>& time) {
            if (time) next = std::min(next, *time);
        };
        until(endServerAt_);
        until(endClientsAt_);
        until(killAt_);
        until(killClientsAt_);
        until(drainUntil_);
        until(beforeEndUntil_);
        for (const ClientSlot& client : clients_) {
            until(client.restartAt);
            if (client.endedWellAt) until(*client.endedWellAt + options_.leaveGrace);
        }
        const auto wait = std::chrono::ceil<milliseconds>(next - now());
        ::poll(handles.data(), handles.size(), static_cast<int>(std::max<std::int64_t>(0, wait.count())));
    }

    void readServer() {
        for (const std::string& line : server_->readLines(Child::kOut)) {
            if (line.starts_with(kListening) && address_.empty()) {
                address_ = line.substr(kListening.size());
                endServerAt_.reset();
                console_.passOn(false, line);
            } else if (line.starts_with(kProgress)) {
                showProgress(std::string_view(line).substr(kProgress.size()));
            } else {
                console_.passOn(false, line);
            }
        }
        for (const std::string& line : server_->readLines(Child::kError)) console_.passOn(true, line);
    }

    void showProgress(std::string_view numbers) {
        std::uint64_t done = 0, total = 0;
        const char* const end = numbers.data() + numbers.size();
        const auto [space, first] = std::from_chars(numbers.data(), end, done);
        if (first != std::errc() || space == end || *space != ' ') return;
        if (std::from_chars(space + 1, end, total).ec != std::errc()) return;
        underWay_ = true;
        console_.progress(done, options_.endAfterFrames > 0 ? options_.endAfterFrames : total, "frames");
        if (options_.endAfterFrames > 0 && done >= options_.endAfterFrames) endServer();
    }

    void readClient(ClientSlot& client) {
        if (!client.process) return;
        for (const std::string& line : client.process->readLines(Child::kOut)) passOn(client, false, line);
        for (const std::string& line : client.process->readLines(Child::kError)) passOn(client, true, line);
        if (client.linesLeftOut > 0 && now() - client.secondBegan >= std::chrono::seconds(1)) sayLeftOut(client);
    }

    /// What comes from elsewhere is anybody's: it says whose it is, and does not drown the others.
    void passOn(ClientSlot& client, bool error, std::string line) {
        if (client.remote == nullptr) return console_.passOn(error, line);
        if (line.ends_with('\r')) line.pop_back();  // as ssh ends its own
        if (now() - client.secondBegan >= std::chrono::seconds(1)) sayLeftOut(client);
        constexpr std::size_t kBytesOfALine = 200;
        client.linesInSecond += static_cast<int>(1 + line.size() / kBytesOfALine);
        if (client.linesInSecond > options_.mostLinesPerSecond) {
            ++client.linesLeftOut;
            return;
        }
        console_.passOn(error, line.starts_with("tessera-client[") ? line : fmt::format("[{}] {}", client.host, line));
    }
    void sayLeftOut(ClientSlot& client) {
        client.secondBegan = now();
        client.linesInSecond = 0;
        if (const std::uint64_t count = std::exchange(client.linesLeftOut, 0); count > 0)
            console_.warning(fmt::format("host {} talks too much: {} of its lines are left out", client.host, count));
    }
    /// Clients elsewhere end when nobody says anything to them (Ssh.h).
    void keepAlive() {
        for (ClientSlot& client : clients_) {
            if (clientsToldToEnd_ || client.remote == nullptr || !client.process || !client.process->running() ||
                now() - client.lastSign < kSignOfLife)
                continue;
            client.lastSign = now();
            (void)client.process->feed("\n", 1);  // where it fails, its end is near
        }
    }

    Expected<void> startClient(ClientSlot& client) {
        ChildCommand command{.program = options_.clientProgram,
                             .arguments = {"--server", address_, "--host", client.host},
                             .environment = options_.clientEnvironment};
        command.arguments.insert(command.arguments.end(), options_.clientArguments.begin(),
                                 options_.clientArguments.end());
        if (client.remote != nullptr) command = client.remote->command(address_.substr(address_.rfind(':') + 1));
        Expected<Child> child = Child::start(command);
        if (!child) return tl::unexpected(child.error());
        client.process = std::move(*child);
        client.restartAt.reset();
        client.left = false;
        client.startedAt = now();
        console_.fact(fmt::format("tessera-wall: pid {} role client host {}", client.process->pid(), client.host));
        return {};
    }

    Expected<void> startClients() {
        if (clientsStarted_ || address_.empty() || ending_ || !server_->running()) return {};
        clientsStarted_ = true;
        for (ClientSlot& client : clients_) {
            if (client.remote != nullptr && client.remote->lacking) {
                client.lastEnd = ChildEnd{.signalled = false, .value = 1};
                if (options_.restart) (void)planRestart(client);
            } else if (auto started = startClient(client); !started) {
                return started;
            }
        }
        return {};
    }

    Expected<void> restartClients() {
        for (ClientSlot& client : clients_) {
            if (!client.restartAt || now() < *client.restartAt) continue;
            ++client.restarts;
            if (auto started = startClient(client); !started) return started;
        }
        return {};
    }

    void reapClients() {
        for (ClientSlot& client : clients_) {
            if (!client.process) continue;
            const pid_t pid = client.process->pid();
            const std::optional<ChildEnd> end = client.process->reap();
            if (!end) continue;
            readClient(client);
            sayLeftOut(client);
            client.lastEnd = end;
            if (end->good() && !ending_ && !client.killed) client.endedWellAt = now();
            if (end->good() || client.killed || clientsToldToEnd_) continue;
            std::string text =
                client.remote != nullptr
                    ? fmt::format("client of host {} {}", client.host, describeRemote(*end, client.remote->destination))
                    : fmt::format("client of host {} (pid {}) {}", client.host, pid,
                                  describe(*end) + adviceAfter(*end, "tessera-client"));
            // A wrong option or configuration would be wrong again.
            const bool hopeless =
                !end->signalled &&
                (end->value == exitCode(ErrorCode::kUsage) || end->value == exitCode(ErrorCode::kBadInput) ||
                 (client.remote != nullptr && (end->value == 126 || end->value == 127)));
            if (options_.restart && server_->running() && !ending_ && !hopeless) text += planRestart(client);
            console_.warning(text);
        }
    }

    /// The server ends before its clients do, and is heard of a moment later. One that ends well in the middle was
    /// asked for something else
    /// (`--help`), or had its reasons.
    void noticeLeavers() {
        for (ClientSlot& client : clients_) {
            if (!client.endedWellAt) continue;
            if (ending_ || !server_->running()) client.endedWellAt.reset();
            if (!client.endedWellAt || now() - *client.endedWellAt < options_.leaveGrace) continue;
            client.endedWellAt.reset();
            client.left = true;
            std::string text =
                fmt::format("client of host {} ended with exit code 0, and the wall goes on", client.host);
            if (options_.restart) text += planRestart(client);
            console_.warning(text);
        }
    }

    /// Later each time: what is wrong there may take a person, or a machine's own start, to put right. Says what will
    /// be done.
    std::string planRestart(ClientSlot& client) {
        if (now() - client.startedAt >= options_.soundAfter) client.deathsInARow = 0;
        if (client.deathsInARow >= options_.mostRestarts)
            return fmt::format("; it has been started again {} times and is given up", client.restarts);
        const milliseconds delay =
            std::min(options_.longestRestartDelay,
                     milliseconds(options_.restartDelay * (1LL << std::min(client.deathsInARow, 20))));
        ++client.deathsInARow;
        client.restartAt = now() + delay;
        return delay < std::chrono::seconds(1) ? "; it is started again"
                                               : fmt::format("; it is started again in {} s", delay.count() / 1000.0);
    }

    void serverEnded(const ChildEnd& end) {
        readServer();
        result_.server = end;
        serverEndedAt_ = now();
        ending_ = true;
        endServerAt_.reset();
        killAt_.reset();
        for (ClientSlot& client : clients_) client.restartAt.reset();
        // A server that ended well has told the clients that had joined. The others wait for its return.
        const milliseconds patience = result_.interrupted ? options_.leaveDeadline : options_.finishDeadline;
        endClientsAt_ = now() + (end.good() ? patience : milliseconds(0));
    }

    void stopRequested() {
        if (result_.interrupted) {  // asked twice: at once
            beforeEnd_.reset();
            server_->send(SIGKILL);
            for (ClientSlot& client : clients_) {
                if (client.process) client.process->send(SIGKILL);
            }
            return;
        }
        result_.interrupted = true;
        console_.note("stopping; once more to stop at once");
        endServer();
    }

    /// The server ends in order: it tells the clients and writes its report.
    void endServer() {
        if (ending_ || !server_->running()) return;
        ending_ = true;
        for (ClientSlot& client : clients_) client.restartAt.reset();
        if (options_.beforeEnd && !address_.empty() && !result_.deserted) {
            Expected<Child> child = Child::start(options_.beforeEnd(address_));
            if (child) {
                beforeEnd_ = std::move(*child);
                beforeEndUntil_ = now() + options_.beforeEndDeadline;
                return;
            }
            console_.warning(child.error().message);
        }
        tellServerToEnd();
    }
    void tellServerToEnd() {
        server_->send(SIGTERM);
        endServerAt_.reset();
        killAt_ = now() + options_.finishDeadline;
    }
    /// Until it has ended, or has had its time, or there is no server any more.
    void followBeforeEnd() {
        if (!beforeEnd_) return;
        for (const Child::Stream stream : {Child::kOut, Child::kError})
            for (const std::string& line : beforeEnd_->readLines(stream)) console_.passOn(true, line);
        const bool late = beforeEndUntil_ && now() >= *beforeEndUntil_;
        if (!beforeEnd_->reap() && !late && server_->running()) return;
        beforeEnd_.reset();
        beforeEndUntil_.reset();
        if (server_->running()) tellServerToEnd();
    }

    void keepDeadlines() {
        if (endServerAt_ && now() >= *endServerAt_) {
            console_.error(fmt::format("the server was not ready after {} s; it is stopped",
                                       options_.startDeadline.count() / 1000.0));
            endServer();
        }
        if (killAt_ && now() >= *killAt_ && server_->running()) {
            console_.error("the server does not end; it is killed");
            killAt_.reset();
            server_->send(SIGKILL);
        }
        if (!server_->running()) endClients();
    }

    /// After the server: those that sleep, those that were not told or do not listen, those that do not end.
    void endClients() {
        const auto eachRunning = [&](auto action) {
            for (ClientSlot& client : clients_) {
                if (client.process && client.process->running()) action(client);
            }
        };
        const auto killed = [&](ClientSlot& client, std::string_view why) {
            console_.warning(
                fmt::format("client of host {} (pid {}) {}; it is killed", client.host, client.process->pid(), why));
            client.process->send(SIGKILL);
            client.killed = true;
        };
        eachRunning([&](ClientSlot& client) {
            if (!client.killed && client.process->stopped()) killed(client, "is stopped");
        });
        if (endClientsAt_ && now() >= *endClientsAt_) {
            clientsToldToEnd_ = true;
            endClientsAt_.reset();
            killClientsAt_ = std::max(now() + options_.killAfter, serverEndedAt_ + options_.finishDeadline);
            eachRunning([](ClientSlot& client) {
                // Where nobody feeds its input a client elsewhere ends, and ssh after it: so it is known to have ended.
                if (client.remote != nullptr)
                    client.process->closeInput();
                else
                    client.process->send(SIGTERM);
            });
        }
        if (killClientsAt_ && now() >= *killClientsAt_) {
            killClientsAt_.reset();
            eachRunning([&](ClientSlot& client) { killed(client, "does not end"); });
        }
        // A process of theirs may hold a stream open for ever: once all have ended, what they said is read for a
        // moment.
        if (!anyClientRuns() && !drainUntil_) drainUntil_ = now() + milliseconds(500);
    }

    /// Nobody is left to show anything, and nobody comes back.
    void noticeDesertion() {
        if (ending_ || !clientsStarted_ || !server_->running()) return;
        for (const ClientSlot& client : clients_) {
            const bool gone = (!client.process || !client.process->running()) && !client.restartAt && client.lastEnd &&
                              (client.left || !client.lastEnd->good());
            if (!gone) return;
        }
        result_.deserted = true;
        result_.desertedCode = 1;
        for (const ClientSlot& client : clients_) {
            if (client.lastEnd->signalled || client.lastEnd->good()) continue;
            const int code = client.lastEnd->value;
            // Of a shell or of ssh: numbers that none of our programs ends with.
            result_.desertedCode = client.remote == nullptr || code < 126 ? code
                                   : code == kSshFailed                   ? exitCode(ErrorCode::kNetwork)
                                                                          : 1;
        }
        console_.error("no render host is left; the server is stopped");
        endServer();
    }

    const WallRunOptions& options_;
    Signals& signals_;
    Console& console_;
    WallRunResult result_;
    std::optional<Child> server_;
    std::vector<ClientSlot> clients_;
    std::string address_;
    bool clientsStarted_ = false;
    bool underWay_ = false;  ///< a frame has been shown
    bool ending_ = false;    ///< the server has ended or was told to
    bool clientsToldToEnd_ = false;
    std::optional<SteadyTime> endServerAt_;  ///< until then it has to listen
    std::optional<SteadyTime> killAt_;       ///< the server, told to end
    SteadyTime serverEndedAt_ = {};
    std::optional<SteadyTime> endClientsAt_;  ///< by SIGTERM
    std::optional<SteadyTime> killClientsAt_;
    std::optional<SteadyTime> drainUntil_;
    std::optional<Child> beforeEnd_;
    std::optional<SteadyTime> beforeEndUntil_;
};

}  // namespace

Expected<WallRunResult> runWall(const WallRunOptions& options, Signals& signals, Console& console) {
    return WallRun(options, signals, console).run();
}

}  // namespace tessera
