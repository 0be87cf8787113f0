/// tessera-client: one render host.
#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <unistd.h>

#include "client/draw/surface/Surface.h"
#include "client/replica/HostCheck.h"
#include "client/replica/HostProgram.h"
#include "client/replica/LifeLine.h"
#include "common/access/LocalWalls.h"
#include "common/base/RunProgram.h"
#include "common/base/Version.h"
#include "common/options/Options.h"
#include "common/tls/KeyRing.h"

namespace {

using namespace tessera;

struct Arguments {
    std::string server, host, tokenFile, keys, output, surface = "osmesa", culler, cache, inject, share = "auto";
    std::string windowLog;
    std::vector<std::string> monitors;
    bool keepFrames = false, window = false, fullScreen = false, vsync = false;
    bool check = false, quiet = false;
    ServiceNotifier* service = nullptr;
    int threads = -1, device = -1, whileInput = 0, anisotropy = 0, glMemoryMib = 0;
};

/// The name becomes that of a folder, before the server has said whether it knows it.
Expected<void> checkName(const std::string& name) {
    const bool good = !name.empty() && name.size() <= 64 && name.front() != '.' && name.find('/') == std::string::npos;
    if (good) return {};
    return fail(
        ErrorCode::kUsage,
        fmt::format("--host '{}' is not the name of a host: 1 to 64 characters, no '/', no dot in front", name));
}

/// Several hosts of one wall on one machine share its cores; a machine of its own is all there for its host.
/// How many there will be beside the main one.
int setDrawThreads(int wanted, const Address& server) {
    if (const char* given = std::getenv("LP_NUM_THREADS"); given && wanted < 0) return std::atoi(given);
    if (wanted < 0) wanted = server.isLoopback() ? 0 : static_cast<int>(std::thread::hardware_concurrency()) - 1;
    limitDrawThreads(wanted);
    return wanted;
}

/// A folder of this process alone, in memory where there is room: the pictures that its windows show.
class OwnFolder {
public:
    static Expected<OwnFolder> make() {
        for (const std::string& in : {std::string("/dev/shm"), std::filesystem::temp_directory_path().string()}) {
            OwnFolder folder;
            folder.path_ = in + "/tessera-XXXXXX";
            if (::mkdtemp(folder.path_.data())) return folder;
            folder.path_.clear();
        }
        return fail(ErrorCode::kFailed,
                    fmt::format("no folder for the pictures of --window can be made ({}); --output names one",
                                std::strerror(errno)));
    }
    ~OwnFolder() {
        std::error_code ignored;
        if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
    }
    OwnFolder(OwnFolder&& other) noexcept : path_(std::exchange(other.path_, {})) {}
    OwnFolder& operator=(OwnFolder&& other) noexcept {
        std::swap(path_, other.path_);
        return *this;
    }
    [[nodiscard]] const std::string& path() const { return path_; }

private:
    OwnFolder() = default;
    std::string path_;
};

/// Where the program is that shows windows.
std::string windowProgram() {
    std::error_code error;
    const auto self = std::filesystem::read_symlink("/proc/self/exe", error);
    return (self.parent_path() / "tessera-window").string();
}

/// A line per fact and per thing that is lacking, for people and for tessera-wall --start.
Expected<void> check(const Arguments& arguments) {
    limitDrawThreads(0);
    HostOptions options;
    options.surface = arguments.surface;
    if (arguments.device >= 0) options.device = arguments.device;
    options.window = arguments.window;
    options.windows.program = windowProgram();
    options.windows.monitors = arguments.monitors;
    const HostCheck found = checkHost(options);
    fmt::print("{}\n", versionText("tessera-client"));
    for (const std::string& fact : found.facts) fmt::print("check: {}\n", fact);
    for (const std::string& lack : found.lacks) fmt::print("check: trouble {}\n", lack);
    std::fflush(stdout);
    if (found.lacks.empty()) return {};
    return fail(ErrorCode::kUnsupported, "this machine cannot show what is asked for");
}

/// "-": what tessera-wall --start brings, on the standard input, before its signs of life.
Expected<CurrentKeys> keysFor(const Arguments& arguments) {
    constexpr std::chrono::seconds kPatience(30);
    if (arguments.keys != "-") return keysOfHost(arguments.keys, arguments.host);
    Expected<TlsKeys> brought = KeyFolder::readBundle(STDIN_FILENO, kPatience);
    return brought ? keysThatStay(std::move(*brought)) : tl::unexpected(brought.error());
}

Expected<void> serve(const Arguments& arguments, Log& log) {
    if (auto good = checkName(arguments.host); !good) return good;
    const auto server = parseAddress(arguments.server);
    if (!server) return failWith("--server", server.error());
    std::optional<CullerKind> culler;
    if (!arguments.culler.empty()) {
        const auto parsed = parseCuller(arguments.culler);
        if (!parsed) return failWith("--culler", parsed.error());
        culler = *parsed;
    }
    auto access = accessLater(arguments.tokenFile, !arguments.keys.empty());
    if (!access) return tl::unexpected(access.error());
    CurrentKeys keys;
    if (!arguments.keys.empty()) {
        Expected<CurrentKeys> read = keysFor(arguments);
        if (!read) return failWith("--keys", read.error());
        keys = std::move(*read);
    }
    HostOptions options{.server = *server,
                        .name = arguments.host,
                        .access = std::move(*access),
                        .keys = std::move(keys),
                        .output = arguments.output,
                        .surface = arguments.surface,
                        .device = arguments.device < 0 ? std::nullopt : std::optional(arguments.device),
                        .anisotropy = arguments.anisotropy,
                        .glMemoryBytes = static_cast<std::size_t>(arguments.glMemoryMib) << 20,
                        .culler = culler,
                        .cache = arguments.cache,
                        .keepFrames = arguments.keepFrames,
                        .service = arguments.service};
    if (!arguments.inject.empty()) {
        const auto injection = parseInjection(arguments.inject);
        if (!injection) return tl::unexpected(injection.error());
        options.injection = *injection;
    }
    const auto share = parseShareMode(arguments.share);
    if (!share) return failWith("--share", share.error());
    options.share = *share;
    options.threads = static_cast<unsigned>(std::max(1, setDrawThreads(arguments.threads, *server)));
    std::optional<OwnFolder> own;
    if (options.window = arguments.window; options.window) {
        if (options.surface == "none")
            return fail(ErrorCode::kUsage, "--window shows pictures, and --surface none draws none");
        if (options.output.empty()) {
            auto made = OwnFolder::make();
            if (!made) return tl::unexpected(made.error());
            own = std::move(*made);
            options.output = own->path();
        }
        options.windows = {.program = windowProgram(),
                           .output = options.output,
                           .fullScreen = arguments.fullScreen,
                           .monitors = arguments.monitors,
                           .vsync = arguments.vsync,
                           .logFolder = arguments.windowLog};
        std::error_code error;
        if (!std::filesystem::exists(options.windows.program, error))
            return fail(ErrorCode::kNotFound,
                        options.windows.program + " is missing: it is looked for beside this program");
    }
    std::optional<LifeLine> lifeLine;
    if (arguments.whileInput > 0) {
        auto held = LifeLine::hold(
            std::chrono::seconds(arguments.whileInput), [&own] { own.reset(); }, log);
        if (!held) return tl::unexpected(held.error());
        lifeLine.emplace(std::move(*held));
    }
    return runHost(options, log);
}

int run(int argc, char** argv) {
    ServiceNotifier service = ServiceNotifier::ofThisProcess();
    Arguments arguments{.service = &service};
    Options options(
        "tessera-client",
        "One render host of a wall: dials a tessera-server, draws its tiles,\nand shows each frame when all hosts have "
        "drawn it.",
        versionText("tessera-client"));
    const Option server =
        options.option("--server", arguments.server, "Where the server listens").typeName("ADDR:PORT");
    const Option host = options.option("--host", arguments.host, "Name of this host in the wall").typeName("NAME");
    options
        .option("--token-file", arguments.tokenFile,
                "With the server's token (TESSERA_TOKEN, else in\n"
                "TESSERA_TOKEN_FILE, else of this user's server on\nthis machine)")
        .typeName("FILE");
    options
        .option(
            "--keys", arguments.keys,
            "With this host's key (tessera-keys host NAME):\nlinks are sealed, and only the wall's server is\nbelieved")
        .typeName("DIR");
    options.option("--output", arguments.output, "Keep images below DIR/tiles").typeName("DIR");
    options.flag("--keep-frames", arguments.keepFrames, "Write every shown image, not only the last");
    options
        .option("--surface", arguments.surface,
                "What draws: osmesa (default), egl, or\nnone: follow the scene without drawing")
        .typeName("NAME");
    options
        .option("--device", arguments.device,
                "Of egl: the device to draw on, counted from 0\n(the first GPU, else Mesa's software)")
        .typeName("N")
        .range(0, 63);
    options
        .option("--anisotropy", arguments.anisotropy,
                "Samples of an image seen at a grazing angle\n(16 on a GPU, 1 on Mesa's software)")
        .typeName("N")
        .range(1, 16);
    options
        .option(
            "--gl-memory", arguments.glMemoryMib,
            "Of GL, for pictures, meshes and images (3/4 of\nwhat the card has for it; else 1/4 of free memory,\nto "
            "3072)")
        .typeName("MIB")
        .range(64, 1 << 22);
    // Two lines of the help.
    std::string cullers = cullerNames();
    if (const std::size_t middle = cullers.find(' ', 30); middle != std::string::npos) cullers[middle] = '\n';
    options.option("--culler", arguments.culler, cullers + " (the wall's, else auto)").typeName("K");
    options.option("--cache", arguments.cache, "Keep meshes and images in DIR/NAME").typeName("DIR");
    options
        .option("--threads", arguments.threads,
                "Draw threads beside the main one (0 with\na server on loopback, else cores - 1)")
        .typeName("N")
        .range(0, 256);
    options
        .option("--share", arguments.share,
                "Arrays, and parts of tiles, with hosts on this\nmachine: auto (default) or off")
        .typeName("S");
    const Option window =
        options
            .option("--window", arguments.monitors,
                    "Show each tile on this machine; on the monitors M,\nby number or name, first tile first")
            .typeName("[M...]")
            .expected(0, 64);
    options.flag("--full-screen", arguments.fullScreen, "Windows take their whole monitor");
    options.flag("--vsync", arguments.vsync, "Windows in step with the monitor, by the\ngraphics driver");
    options
        .option("--while-input", arguments.whileInput,
                "End when the standard input ends, or is silent for\nS seconds: so does tessera-wall --start end it")
        .typeName("S")
        .range(1, 86'400);
    options.flag("--quiet", arguments.quiet, "Nothing on stderr of what goes as it should");
    options.flag("--check", arguments.check, "Say what this machine lacks for this, and end");
    // For tests of the rest of the wall; see client/replica/README.md.
    options.option("--inject", arguments.inject).hidden();
    options.option("--window-log", arguments.windowLog).hidden();
    if (const std::optional<int> code = options.parse(argc, argv)) return *code;
    for (const Option& needed : {server, host}) {
        if (arguments.check || needed.given()) continue;
        fmt::print(stderr, "tessera-client: {} is required; see --help\n", needed.name());
        return exitCode(ErrorCode::kUsage);
    }
    arguments.window = window.given();
    std::erase(arguments.monitors, std::string());
    if (!arguments.window && (arguments.fullScreen || arguments.vsync)) {
        fmt::print(stderr, "tessera-client: --full-screen and --vsync say how a --window is; see --help\n");
        return exitCode(ErrorCode::kUsage);
    }
    if (arguments.fullScreen) {
        for (auto monitor = arguments.monitors.begin(); monitor != arguments.monitors.end(); ++monitor) {
            if (std::find(arguments.monitors.begin(), monitor, *monitor) == monitor) continue;
            fmt::print(stderr,
                       "tessera-client: --window names monitor \"{}\" twice: with --full-screen one window would lie "
                       "on the other\n",
                       *monitor);
            return exitCode(ErrorCode::kUsage);
        }
    }
    // A file larger than the system lets it be is an error of the call that makes it, and what wants it does without.
    std::signal(SIGXFSZ, SIG_IGN);
    Log log(arguments.check ? "tessera-client" : "tessera-client[" + arguments.host + "]");
    if (arguments.quiet) log.quieten();
    const auto served = arguments.check ? check(arguments) : serve(arguments, log);
    if (served) return 0;
    Log("tessera-client").error(served.error().message);
    return exitCode(served.error().code);
}

}  // namespace

int main(int argc, char** argv) {
    return runProgram("tessera-client", [&] { return run(argc, argv); });
}
