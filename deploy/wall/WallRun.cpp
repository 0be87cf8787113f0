#include "deploy/wall/WallRun.h"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>

#include <algorithm>
#include <charconv>
#include <optional>

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
    bool killed = false;  ///< by us, and said so
};

class WallRun {
public:
    WallRun(const WallRunOptions& options, Signals& signals, Console& console)
        : options_(options), signals_(signals), console_(console) {
        for (const std::string& host : options.hosts)
            clients_.push_back({.host = host, .process = {}, .restartAt = {}, .lastEnd = {}});
    }

    Expected<WallRunResult> run() {
        Expected<Child> server =
            Child::start({.program = options_.serverProgram, .arguments = options_.serverArguments});
        if (!server) return tl::unexpected(server.error());
        server_ = std::move(*server);
        console_.fact(fmt::format("pid {} role server host -", server_->pid()));
        endServerAt_ = now() + options_.startDeadline;

        while (server_->running() || anyClientRuns() || anythingToRead()) {
            waitForSomething();
            if (signals_.takeStopRequest()) stopRequested();
            readServer();
            for (ClientSlot& client : clients_) readClient(client);
            if (auto started = startClients(); !started) return tl::unexpected(started.error());
            reapClients();
            if (std::optional<ChildEnd> end = server_->reap()) serverEnded(*end);
            if (auto restarted = restartClients(); !restarted) return tl::unexpected(restarted.error());
            keepDeadlines();
            noticeDesertion();
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
        for (const ClientSlot& client : clients_) until(client.restartAt);
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
        if (std::from_chars(space + 1, end, total).ec == std::errc()) console_.progress(done, total, "frames");
    }

    void readClient(ClientSlot& client) {
        if (!client.process) return;
        for (const std::string& line : client.process->readLines(Child::kOut)) console_.passOn(false, line);
        for (const std::string& line : client.process->readLines(Child::kError)) console_.passOn(true, line);
    }

    Expected<void> startClient(ClientSlot& client) {
        ChildCommand command{.program = options_.clientProgram,
                             .arguments = {"--server", address_, "--host", client.host},
                             .environment = options_.clientEnvironment};
        command.arguments.insert(command.arguments.end(), options_.clientArguments.begin(),
                                 options_.clientArguments.end());
        Expected<Child> child = Child::start(command);
        if (!child) return tl::unexpected(child.error());
        client.process = std::move(*child);
        client.restartAt.reset();
        console_.fact(fmt::format("pid {} role client host {}", client.process->pid(), client.host));
        return {};
    }

    Expected<void> startClients() {
        if (clientsStarted_ || address_.empty() || ending_ || !server_->running()) return {};
        clientsStarted_ = true;
        for (ClientSlot& client : clients_) {
            if (auto started = startClient(client); !started) return started;
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
            client.lastEnd = end;
            if (end->good() || client.killed || clientsToldToEnd_) continue;
            std::string text = fmt::format("client of host {} (pid {}) {}", client.host, pid, describe(*end));
            // A wrong option or configuration would be wrong again.
            const bool hopeless = !end->signalled && (end->value == exitCode(ErrorCode::kUsage) ||
                                                      end->value == exitCode(ErrorCode::kBadInput));
            if (options_.restart && server_->running() && !ending_ && !hopeless) {
                if (client.restarts < options_.mostRestarts) {
                    client.restartAt = now() + options_.restartDelay;
                    text += "; it is started again";
                } else {
                    text += fmt::format("; it has been started again {} times and is given up", client.restarts);
                }
            }
            console_.warning(text);
        }
    }

    void serverEnded(const ChildEnd& end) {
        readServer();
        result_.server = end;
        ending_ = true;
        endServerAt_.reset();
        killAt_.reset();
        for (ClientSlot& client : clients_) client.restartAt.reset();
        // A server that ended well has told its clients; one that did not leaves them waiting for its return.
        endClientsAt_ = now() + (end.good() ? options_.finishDeadline : milliseconds(0));
    }

    void stopRequested() {
        if (result_.interrupted) {  // asked twice: at once
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
        server_->send(SIGTERM);
        endServerAt_.reset();
        killAt_ = now() + options_.finishDeadline;
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
            killClientsAt_ = now() + options_.killAfter;
            eachRunning([](ClientSlot& client) { client.process->send(SIGTERM); });
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
            const bool gone = client.process && !client.process->running() && !client.restartAt && client.lastEnd &&
                              !client.lastEnd->good();
            if (!gone) return;
        }
        result_.deserted = true;
        result_.desertedCode = 1;
        for (const ClientSlot& client : clients_) {
            if (!client.lastEnd->signalled) result_.desertedCode = client.lastEnd->value;
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
    bool ending_ = false;  ///< the server has ended or was told to
    bool clientsToldToEnd_ = false;
    std::optional<SteadyTime> endServerAt_;   ///< until then it has to listen
    std::optional<SteadyTime> killAt_;        ///< the server, told to end
    std::optional<SteadyTime> endClientsAt_;  ///< by SIGTERM
    std::optional<SteadyTime> killClientsAt_;
    std::optional<SteadyTime> drainUntil_;
};

}  // namespace

Expected<WallRunResult> runWall(const WallRunOptions& options, Signals& signals, Console& console) {
    return WallRun(options, signals, console).run();
}

}  // namespace tessera
