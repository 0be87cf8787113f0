/// tessera-server: the authority over one scene and one wall.
#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <stop_token>
#include <thread>

#include <fmt/format.h>

#include "common/base/Log.h"
#include "common/base/ServiceNotifier.h"
#include "common/base/ShippedFiles.h"
#include "common/base/Version.h"
#include "common/codec/WallCodec.h"
#include "common/confine/Confinement.h"
#include "common/options/Options.h"
#include "common/tls/KeyRing.h"
#include "common/wall/Exposure.h"
#include "common/wall/WallNotes.h"
#include "server/Entrance.h"
#include "server/door/UploadFolder.h"
#include "server/sim/FrameLoop.h"
#include "server/sim/audit/AuditLog.h"

namespace {

using namespace tessera;

struct Arguments {
    std::string wall = "1x1";
    std::vector<std::string> scenes;
    std::vector<double> at;
    double fit = 0, pointRadius = 0;
    std::string up;
    Placing placing;
    std::string listen = "127.0.0.1:0";
    std::string console = "127.0.0.1:0";
    bool noConsole = false;
    std::string tokenFile, group, keys;
    std::vector<std::string> assets, allowed, panels;
    std::string uploads;
    std::uint64_t uploadsMib = UploadLimits().maxBytes >> 20;
    std::uint64_t frames = 0;
    double rate = -1;
    std::string size;
    int samples = 0;
    double budget = -1;
    std::string camera;
    std::string exposure, toneMap;
    std::string report;
    std::string record;
    std::string journal, audit;
    unsigned threads = 1;
    bool noInput = false, noNotices = false, reload = false;
    bool progress = false, quiet = false;
    bool testPicture = false, plain = false;
    bool allowUnconfined = false;
    std::size_t importMemoryMib = 0;
    bool insecure = false;
    ServiceNotifier* service = nullptr;
};

Expected<Wall> readWall(const Arguments& arguments, const std::string& executable) {
    const Expected<std::string> path = findWall(arguments.wall, executable);
    if (!path) return tl::unexpected(path.error());
    Expected<Wall> wall = loadWall(*path);
    if (!wall) return wall;
    if (arguments.samples != 0) wall->samples = arguments.samples;
    if (arguments.budget >= 0) wall->budgetMs = arguments.budget;
    if (!arguments.size.empty()) {
        int width = 0, height = 0, used = 0;
        if (std::sscanf(arguments.size.c_str(), "%dx%d%n", &width, &height, &used) != 2 ||
            static_cast<std::size_t>(used) != arguments.size.size())
            return fail(ErrorCode::kUsage,
                        fmt::format("--size '{}' is not WIDTHxHEIGHT, e.g. 1920x1080", arguments.size));
        wall = withSize(*wall, width, height);
    }
    return wall;
}

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
Expected<void> takeKeys(const Arguments& arguments, ServerOptions& options) {
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
Expected<std::shared_ptr<UploadFolder>> takeUploads(const Arguments& arguments, Log& log) {
    std::error_code error;
    const std::string kept = arguments.journal + "/uploads";
    const bool isKept = !arguments.journal.empty() && std::filesystem::is_directory(kept, error);
    if (arguments.noConsole && arguments.uploads.empty() && !isKept) return nullptr;
    const UploadLimits limits{.maxBytes = arguments.uploadsMib << 20};
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

Expected<void> serve(const Arguments& arguments, const std::string& executable, Log& log) {
    Expected<Wall> wall = readWall(arguments, executable);
    if (!wall) return tl::unexpected(wall.error());
    // Who says a size wants it so.
    if (arguments.size.empty())
        for (const std::string& note : wallNotes(*wall)) log.info(fmt::format("{}: {}", arguments.wall, note));
    const Expected<Address> address = parseAddress(arguments.listen);
    if (!address) return failWith("--listen", address.error());

    ServerOptions options;
    options.wall = std::move(*wall);
    // A journal that has begun knows its scene: its files may be gone.
    std::error_code none;
    const bool goesOn = !arguments.journal.empty() && !std::filesystem::is_empty(arguments.journal, none) && !none;
    for (const std::string& scene : arguments.scenes) {
        Expected<std::string> found = findScene(scene, executable);
        if (!found && !goesOn) return tl::unexpected(found.error());
        options.scenes.push_back(found ? std::move(*found) : scene);
    }
    options.placing = arguments.placing;
    options.listen = *address;
    options.import.assetFolders = arguments.assets;
    options.allowed = arguments.allowed;
    options.import.allowUnconfined = arguments.allowUnconfined;
    if (arguments.importMemoryMib > 0) options.import.maxMemoryBytes = arguments.importMemoryMib << 20;
    options.frames = arguments.frames;
    options.rateHz = arguments.rate >= 0 ? arguments.rate : arguments.frames > 0 ? 0 : 60;
    options.camera = arguments.camera;
    if (!arguments.exposure.empty()) options.exposure = parseExposure(arguments.exposure).value();
    if (!arguments.toneMap.empty()) options.exposure.toneMap = parseToneMap(arguments.toneMap).value();
    options.reportPath = arguments.report;
    options.recordPath = arguments.record;
    options.journalPath = arguments.journal;
    options.threads = arguments.threads;
    options.service = arguments.service;
    if (!arguments.journal.empty()) arguments.service->status("reads the journal");
    if (arguments.testPicture) options.showing = Showing::kTestPicture;
    options.studio = !arguments.plain;
    options.takesInput = !arguments.noInput;
    options.notices = !arguments.noNotices;
    options.reload = arguments.reload;
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
        fmt::print("tessera-server: listening on {}\n", toString(bound));
        entrance.describe(arguments.group);
        std::fflush(stdout);
        keepWatch();
        // Hosts may dial in. A long scene still loads: the wall waits, and no unit that needs this one has to.
        arguments.service->ready();
    };
    if (arguments.progress)
        options.onProgress = [](std::uint64_t done, std::uint64_t total) {
            fmt::print("progress {} {}\n", done, total);
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

}  // namespace

int main(int argc, char** argv) {
    keepBlocks();
    ServiceNotifier service = ServiceNotifier::ofThisProcess();
    Arguments arguments{.service = &service};
    Options options("tessera-server",
                    "Owns a scene and a wall; render hosts (tessera-client) and\napplications (tessera-ctl) dial in.",
                    versionText("tessera-server"));
    options.option("--wall", arguments.wall, "Wall file, or a shipped wall's name (1x1)").typeName("W");
    // A variable of a script that is empty is no folder.
    const auto named = [](const std::string& text) { return text.empty() ? std::string("is empty") : std::string(); };
    options.option("--scene", arguments.scenes, "Scene or model file, or a shipped scene's name;\nmay be repeated")
        .typeName("S")
        .check(named);
    options
        .option("--up", arguments.up,
                "Which axis is up in the scenes' files (as they\nsay; else +Z of .stl, .off and flat clouds "
                "of\npoints, +Y of others)")
        .typeName("y|z")
        .oneOf({"y", "z"}, ShowValues::kInErrorsAlone);
    const Option at = options
                          .option("--at", arguments.at,
                                  "Where each file's origin comes, in metres of the\nwall, whose coordinates are then "
                                  "the world's; with\n--fit the middle of its underside")
                          .typeName("X Y Z")
                          .expected(3);
    const Option fit = options
                           .option("--fit", arguments.fit,
                                   "So long becomes the longest side of each. With\n--fit or --at no camera of the "
                                   "files takes the\nview; --camera does")
                           .typeName("METRES");
    const Option radius =
        options.option("--point-radius", arguments.pointRadius, "Of all their points, in their files' own units")
            .typeName("R");
    options
        .option("--variant", arguments.placing.variants,
                "Of USD: prim P shows variant N of its set S, as\n/Chair:color=red; may be repeated")
        .typeName("P:S=N")
        .oneEach();
    options.option("--listen", arguments.listen, "Where hosts dial in (127.0.0.1:0)").typeName("ADDR:PORT");
    options
        .option("--console", arguments.console,
                "Where browsers and programs of other languages\ncome in (127.0.0.1:0); with --keys by https")
        .typeName("ADDR:PORT");
    options.flag("--no-console", arguments.noConsole, "They do not");
    options
        .option("--panel", arguments.panels,
                "A page of controls for visitors (server/panel);\nits link is printed. May be repeated")
        .typeName("FILE")
        .check(named);
    options
        .option("--token-file", arguments.tokenFile,
                "Its first line lets programs of this machine in\n(a word that this user's programs find)")
        .typeName("FILE");
    options
        .option("--keys", arguments.keys, "Of this wall (tessera-keys init): who comes from\nanother machine needs one")
        .typeName("DIR")
        .check(named);
    options.flag("--insecure", arguments.insecure, "Whoever comes from another machine may do all");
    options.option("--group", arguments.group, "Its people's programs find it too").typeName("NAME").check(named);
    options.option("--assets", arguments.assets, "Folders for asset://NAME").typeName("DIR");
    options.option("--allow", arguments.allowed, "Folders whose files applications may load\n(assets alone)")
        .typeName("DIR")
        .check(named);
    options
        .option("--uploads", arguments.uploads,
                "Where files lie that pages bring (JOURNAL/uploads,\nelse a folder that goes with this run)")
        .typeName("DIR")
        .check(named);
    options.option("--uploads-mib", arguments.uploadsMib, "All of them together (2048)")
        .typeName("MIB")
        .range(1, 1'000'000);
    options.option("--frames", arguments.frames, "Stop after N frames").typeName("N");
    options.option("--rate", arguments.rate, "Frames per second at most; 0: no limit")
        .typeName("HZ")
        .range(0.0, 1000.0)
        .check([](const std::string& text) {
            return std::isnan(std::strtod(text.c_str(), nullptr)) ? "not a number" : "";
        });
    const auto budgetFault = [](const std::string& text) {
        char* end = nullptr;
        const double number = std::strtod(text.c_str(), &end);
        return end != text.c_str() && *end == '\0' && isBudget(number) ? "" : "0, or 0.1 to 60000 milliseconds";
    };
    options.option("--size", arguments.size, "Visible pixels of the whole wall").typeName("WxH");
    options.option("--samples", arguments.samples, "Samples per pixel: 1 or 4").typeName("N").oneOf({1, 4});
    options
        .option("--budget", arguments.budget,
                "Milliseconds that a frame may take before detail\nis left away; 0: none is (the wall's, else 0)")
        .typeName("MS")
        .check(budgetFault);
    options.option("--camera", arguments.camera, "Node of the camera to use").typeName("NODE");
    options
        .option("--exposure", arguments.exposure,
                "How bright the scene is shown, whatever it says:\nstops, metered (once for all tiles), or off")
        .typeName("EV")
        .check(exposureFault);
    options.option("--tone-map", arguments.toneMap, "The curve for what is brighter than white")
        .typeName("NAME")
        .oneOf(std::vector<std::string>(kToneMapNames.begin(), kToneMapNames.end()));
    options.option("--report", arguments.report, "Write report.json here at the end").typeName("FILE");
    options.option("--record", arguments.record, "Write what happens here, for tessera-replay").typeName("FILE");
    options.option("--journal", arguments.journal, "Keep what is done here; the same command goes on\nfrom it")
        .typeName("DIR")
        .check(named);
    options.option("--audit", arguments.audit, "Who changed what, a line each; FILE.1 is the one\nbefore it, and so on")
        .typeName("FILE")
        .check(named);
    options.option("--threads", arguments.threads, "Of the collision pipeline (1)").typeName("N").range(1, 256);
    options.flag("--test-picture", arguments.testPicture, "Show the test picture at first (tessera-ctl show)");
    options.flag("--plain", arguments.plain,
                 "Models without light stand in no studio: as they\nare, on a plain background");
    options.flag("--no-input", arguments.noInput,
                 "Nobody flies: windows and applications move the\nview by `view` alone");
    options.flag("--no-notices", arguments.noNotices,
                 "The wall does not say what is wrong with programs\nof materials (the log does)");
    options.flag("--reload", arguments.reload,
                 "Files that change on disk, those of --scene and\nothers, are taken in again in their place; "
                 "what\npeople changed since is kept");
    options.flag("--quiet", arguments.quiet, "Nothing on stderr of what goes as it should");
    options.flag("--progress", arguments.progress, "Print 'progress DONE TOTAL' lines");
    options
        .option("--import-memory", arguments.importMemoryMib,
                "What reading one file may take at least (2048);\nlarge scenes, OBJ, STL, PLY, DXF, 3MF and AMF may\n"
                "take more, up to half of the machine's")
        .typeName("MIB")
        .range(256, 1'000'000);
    options.flag("--allow-unconfined-import", arguments.allowUnconfined,
                 "Import even where the child cannot\nbe confined");
    if (const std::optional<int> code = options.parse(argc, argv)) return *code;
    Placing& placing = arguments.placing;
    if (at.given()) placing.at = Vec3d(arguments.at[0], arguments.at[1], arguments.at[2]);
    if (fit.given()) placing.fit = arguments.fit;
    if (radius.given()) placing.pointRadius = arguments.pointRadius;
    if (!arguments.up.empty()) placing.up = arguments.up == "z" ? UpAxis::kZ : UpAxis::kY;
    if (const Expected<void> sound = checkPlacing(placing); !sound) {
        fmt::print(stderr, "tessera-server: {}: {}; see --help\n", optionsText(placing), sound.error().message);
        return exitCode(ErrorCode::kUsage);
    }
    Log log("tessera-server");
    if (arguments.quiet) log.quieten();
    const Expected<void> served = serve(arguments, std::filesystem::read_symlink("/proc/self/exe").string(), log);
    if (served) return 0;
    log.error(served.error().message);
    return exitCode(served.error().code);
}
