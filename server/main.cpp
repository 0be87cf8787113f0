/// tessera-server: the authority over one scene and one wall.
#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <stop_token>
#include <thread>

#include <fmt/format.h>

#include "common/base/Log.h"
#include "common/base/PrintText.h"
#include "common/base/RunProgram.h"
#include "common/base/ServiceNotifier.h"
#include "common/confine/Confinement.h"
#include "common/tls/KeyRing.h"
#include "server/Entrance.h"
#include "server/command/ServerCommand.h"
#include "server/door/UploadFolder.h"
#include "server/sim/FrameLoop.h"
#include "server/sim/audit/AuditLog.h"

namespace {

using namespace tessera;

/// Large edits are made and let go again in each frame. Their blocks stay in the heap: mapped anew each time, page by
/// page, they cost a frame of 10,000 moves as much as all else (tests/bench/figures.md). No more stays than that: with
/// a pad of a whole heap (64 MiB) glibc's heaps of threads would never be given back, and a refused load would keep its
/// gigabyte.
void keepBlocks() {
    constexpr int kLargest = 32 << 20, kSpare = 32 << 20, kStep = 4 << 20;
    mallopt(M_MMAP_THRESHOLD, kLargest);
    mallopt(M_TRIM_THRESHOLD, kSpare);
    mallopt(M_TOP_PAD, kStep);
}

/// Beyond this machine nobody comes in without a key, but where a person says so.
Expected<void> takeKeys(const ServerArguments& arguments, ServerOptions& options) {
    if (!arguments.keys.empty()) {
        const KeyFolder folder(arguments.keys);
        Expected<std::unique_ptr<KeyRing>> keys = KeyRing::open(folder.path(), [folder] { return folder.ofServer(); });
        if (!keys) return failWith("--keys", keys.error());
        const Certificate& own = *(*keys)->current()->own();
        if (own.holder->kind != Identity::Kind::kServer || own.holder->wall != options.wall.name)
            return fail(ErrorCode::kBadInput, fmt::format("--keys {}: the key is of {}, and this is the wall '{}'",
                                                          arguments.keys, describe(*own.holder), options.wall.name));
        if (const std::string fault = (*keys)->current()->faultOf(own, std::chrono::system_clock::now(), {});
            !fault.empty())
            return fail(ErrorCode::kBadInput, fmt::format("--keys {}: {}", arguments.keys, fault));
        options.keys = std::move(*keys);
        return {};
    }
    if (options.listen.isLoopback() || arguments.insecure) return {};
    return fail(ErrorCode::kUsage,
                fmt::format("--listen {}: whoever reaches that address could come in. `tessera-keys --keys DIR init "
                            "--wall {}` makes keys, and --keys DIR takes them; --insecure lets anybody in",
                            arguments.listen, arguments.wall));
}

/// Where people's files lie. What a scene of a journal names of them is there after a restart, with a console or
/// without. Null: there is nobody to bring any, or no place for them.
Expected<std::shared_ptr<UploadFolder>> takeUploads(const ServerArguments& arguments, Log& log) {
    std::error_code error;
    const std::string kept = arguments.journal + "/uploads";
    const bool isKept = !arguments.journal.empty() && std::filesystem::is_directory(kept, error);
    if (arguments.noConsole && arguments.uploads.empty() && !isKept) return nullptr;
    UploadLimits limits;
    if (arguments.uploadsMib > 0) limits.maxBytes = arguments.uploadsMib << 20;
    if (!arguments.uploads.empty()) {
        Expected<std::shared_ptr<UploadFolder>> folder = UploadFolder::open(arguments.uploads, limits);
        return folder ? std::move(folder) : failWith("--uploads", folder.error());
    }
    if (!arguments.journal.empty()) std::filesystem::create_directory(arguments.journal, error);
    Expected<std::shared_ptr<UploadFolder>> folder =
        arguments.journal.empty() ? UploadFolder::openOwn(limits) : UploadFolder::open(kept, limits);
    if (folder) return folder;
    log.warning(fmt::format("the console takes no files: {}", folder.error().message));
    return nullptr;
}

Expected<void> serve(const ServerArguments& arguments, ServiceNotifier& service, Log& log) {
    Expected<ServerOptions> made =
        serverOptionsOf(arguments, std::filesystem::read_symlink("/proc/self/exe").string(), log);
    if (!made) return tl::unexpected(made.error());
    ServerOptions options = std::move(*made);
    options.service = &service;
    if (!arguments.journal.empty()) service.status("reads the journal");
    const Expected<Address> console = parseAddress(arguments.console);
    if (!console) return failWith("--console", console.error());
    if (!arguments.noConsole && !console->isLoopback() && arguments.keys.empty() && !arguments.insecure)
        return fail(ErrorCode::kUsage,
                    fmt::format("--console {}: others could read on the way what is said there, tokens too. "
                                "`tessera-keys --keys DIR init --wall {}` makes keys, and --keys DIR takes them; "
                                "--insecure opens the console without",
                                arguments.console, arguments.wall));
    options.insecure = arguments.insecure;
    if (options.insecure)
        log.warning("--insecure: whoever reaches this server may do all, and others may read and change what is sent");
    if (const Expected<void> good = takeKeys(arguments, options); !good) return good;
    DoorReach reach{.keys = {}, .open = options.insecure};
    if (options.keys) reach.keys = [keys = options.keys] { return keys->current(); };
    if (arguments.noConsole && !arguments.panels.empty())
        return fail(ErrorCode::kUsage, "--panel: its page is the console's, and --no-console leaves that away");
    Expected<std::vector<ServedPanel>> panels = readPanels(arguments.panels);
    if (!panels) return tl::unexpected(panels.error());
    options.panelOf = [served = *panels](const std::string& name) {
        const auto known = std::ranges::find(served, name, [](const ServedPanel& panel) { return panel.door.name; });
        return known == served.end() ? nullptr : known->text;
    };
    std::unique_ptr<AuditLog> auditLog;  // outlives the door
    std::optional<AuditBook> audit;
    ServerTokensOptions access{.wall = options.wall.name,
                               .listen = arguments.listen,
                               .group = arguments.group,
                               .tokenFile = arguments.tokenFile,
                               .insecure = options.insecure,
                               .keysFolder = arguments.keys};
    if (options.keys) access.authority = [keys = options.keys] { return keys->current()->authorityFingerprint(); };
    Expected<ServerTokens> tokens =
        ServerTokens::make(std::move(access), [&](const std::string& words) { log.warning(words); });
    if (!tokens) return tl::unexpected(tokens.error());
    Entrance entrance(arguments.noConsole ? std::nullopt : std::optional(*console), std::move(reach),
                      std::move(*panels), std::move(*tokens), options.wall.name, log);
    Expected<std::shared_ptr<UploadFolder>> uploads = takeUploads(arguments, log);
    if (!uploads) return tl::unexpected(uploads.error());
    if (*uploads) options.allowed.push_back((*uploads)->path());
    entrance.setFiles(*uploads, [&](const Entrant& who, std::string_view did, const std::string& path) {
        if (auditLog)
            auditLog->write({{.at = std::chrono::system_clock::now(),
                              .who = who,
                              .program = "console",
                              .from = who.from,
                              .did = std::string(did),
                              .objects = {path}}});
    });
    options.access = entrance.tokens();
    options.owner = nameOfUser();
    options.onBound = [&](const Address& bound) { entrance.open(bound); };
    std::function<void()> keepWatch;
    options.onListening = [&](const Address& bound) {
        printText(fmt::format("tessera-server: listening on {}\n", toString(bound)));
        entrance.describe(arguments.group);
        std::fflush(stdout);
        keepWatch();
        // Hosts may dial in. A long scene still loads: the wall waits, and no unit that needs this one has to.
        service.ready();
    };
    if (arguments.progress)
        options.onProgress = [](std::uint64_t done, std::uint64_t total) {
            printText(fmt::format("progress {} {}\n", done, total));
            std::fflush(stdout);
        };

    // SIGINT and SIGTERM end the show in order, and SIGHUP, unless who started this ignores it (nohup). They are
    // blocked in every thread but the one that waits for them.
    sigset_t signals;
    sigemptyset(&signals);
    sigaddset(&signals, SIGINT);
    sigaddset(&signals, SIGTERM);
    struct sigaction hangUp = {};
    if (sigaction(SIGHUP, nullptr, &hangUp) == 0 && hangUp.sa_handler != SIG_IGN) sigaddset(&signals, SIGHUP);
    pthread_sigmask(SIG_BLOCK, &signals, nullptr);
    std::signal(SIGPIPE, SIG_IGN);
    std::signal(SIGXFSZ, SIG_IGN);  // a recording as long as the system lets it be is told by write, and ends alone

    if (!arguments.audit.empty()) {
        Expected<std::unique_ptr<AuditLog>> opened = AuditLog::open(arguments.audit, log);
        if (!opened) return tl::unexpected(opened.error());
        auditLog = std::move(*opened);
        audit.emplace([&](std::vector<AuditLine> lines) { auditLog->write(std::move(lines)); });
        options.audit = &*audit;
    }

    for (const std::string& missing : missingForConfinement()) log.warning(missing);
    FrameLoop loop(std::move(options), log);
    std::jthread watcher([&](const std::stop_token& done) {
        // No tick: at the end it gets a signal of its own.
        const std::stop_callback wake(done, [self = pthread_self()] { pthread_kill(self, SIGTERM); });
        while (!done.stop_requested())
            if (sigwaitinfo(&signals, nullptr) > 0) loop.stop();
    });
    std::jthread keeper;
    keepWatch = [&] { keeper = std::jthread([&](const std::stop_token& done) { entrance.keepWatch(done, loop); }); };
    return loop.run();
}

int run(int argc, char** argv) {
    keepBlocks();
    ServiceNotifier service = ServiceNotifier::ofThisProcess();
    ServerArguments arguments;
    if (const std::optional<int> code = parseServerCommand(argc, argv, arguments)) return *code;
    Log log("tessera-server");
    if (arguments.quiet) log.quieten();
    const Expected<void> served = serve(arguments, service, log);
    if (served) return 0;
    log.error(served.error().message);
    return exitCode(served.error().code);
}

}  // namespace

int main(int argc, char** argv) {
    return runProgram("tessera-server", [&] { return run(argc, argv); });
}
