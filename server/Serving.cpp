#include "server/Serving.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <stop_token>
#include <thread>

#include <fmt/format.h>

#include "common/confine/Confinement.h"
#include "common/tls/KeyRing.h"
#include "server/Entrance.h"
#include "server/door/UploadFolder.h"
#include "server/sim/audit/AuditLog.h"

namespace tessera {
namespace {

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

}  // namespace

Expected<void> serve(const ServerArguments& arguments, const ServingProcess& process) {
    Log& log = process.log;
    Expected<ServerOptions> made =
        serverOptionsOf(arguments, std::filesystem::read_symlink("/proc/self/exe").string(), log);
    if (!made) return tl::unexpected(made.error());
    ServerOptions options = std::move(*made);
    options.service = process.service;
    if (process.service && !arguments.journal.empty()) process.service->status("reads the journal");
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
                      std::move(*panels), std::move(*tokens), options.wall.name, process.say, log);
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
        process.say(fmt::format("tessera-server: listening on {}\n", toString(bound)));
        entrance.describe(arguments.group);
        keepWatch();
        // Hosts may dial in. A long scene still loads: the wall waits, and no unit that needs this one has to.
        if (process.service) process.service->ready();
    };
    if (arguments.progress)
        options.onProgress = [&](std::uint64_t done, std::uint64_t total) {
            process.say(fmt::format("progress {} {}\n", done, total));
        };

    if (process.threadsBegin) process.threadsBegin();

    if (!arguments.audit.empty()) {
        Expected<std::unique_ptr<AuditLog>> opened = AuditLog::open(arguments.audit, log);
        if (!opened) return tl::unexpected(opened.error());
        auditLog = std::move(*opened);
        audit.emplace([&](std::vector<AuditLine> lines) { auditLog->write(std::move(lines)); });
        options.audit = &*audit;
    }

    for (const std::string& missing : missingForConfinement()) log.warning(missing);
    FrameLoop loop(std::move(options), log);
    const std::jthread watcher = process.watch(loop);
    std::jthread keeper;
    keepWatch = [&] { keeper = std::jthread([&](const std::stop_token& done) { entrance.keepWatch(done, loop); }); };
    return loop.run();
}

}  // namespace tessera
