/// tessera-client: one render host.
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <thread>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "client/replica/HostProgram.h"
#include "common/base/Version.h"

namespace {

using namespace tessera;

struct Arguments {
    std::string server, host, output, surface = "osmesa", culler, cache, inject, share = "auto";
    bool keepFrames = false;
    int threads = -1;
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
    HostOptions options{.server = *server,
                        .name = arguments.host,
                        .output = arguments.output,
                        .surface = arguments.surface,
                        .culler = culler,
                        .cache = arguments.cache,
                        .keepFrames = arguments.keepFrames};
    if (!arguments.inject.empty()) {
        const auto injection = parseInjection(arguments.inject);
        if (!injection) return tl::unexpected(injection.error());
        options.injection = *injection;
    }
    const auto share = parseShareMode(arguments.share);
    if (!share) return failWith("--share", share.error());
    options.share = *share;
    options.threads = static_cast<unsigned>(std::max(1, setDrawThreads(arguments.threads, *server)));
    return runHost(options, log);
}

}  // namespace

int main(int argc, char** argv) {
    Arguments arguments;
    CLI::App app(
        "One render host of a wall: dials a tessera-server, draws its tiles,\nand shows each frame when all hosts have "
        "drawn it.",
        "tessera-client");
    app.set_version_flag("--version", versionText("tessera-client"));
    app.add_option("--server", arguments.server, "Where the server listens")->type_name("ADDR:PORT")->required();
    app.add_option("--host", arguments.host, "Name of this host in the wall")->type_name("NAME")->required();
    app.add_option("--output", arguments.output, "Keep images below DIR/tiles")->type_name("DIR");
    app.add_flag("--keep-frames", arguments.keepFrames, "Write every shown image, not only the last");
    app.add_option("--surface", arguments.surface, "What draws: osmesa (default), or\nnone: follow the scene without drawing")->type_name("NAME");
    app.add_option("--culler", arguments.culler, cullerNames() + " (the wall's, else auto)")->type_name("K");
    app.add_option("--cache", arguments.cache, "Keep meshes and images in DIR/NAME")->type_name("DIR");
    app.add_option("--threads", arguments.threads,
                   "Draw threads beside the main one (0 with\na server on loopback, else cores - 1)")
        ->type_name("N")
        ->check(CLI::Range(0, 256));
    app.add_option("--share", arguments.share,
                   "Arrays, and parts of tiles, with hosts on this\nmachine: auto (default) or off")
        ->type_name("S");
    // For tests of the rest of the wall; see client/replica/README.md.
    app.add_option("--inject", arguments.inject)->group("");
    try {
        app.parse(argc, argv);
    } catch (const CLI::CallForHelp& e) {
        return app.exit(e);
    } catch (const CLI::CallForVersion& e) {
        return app.exit(e);
    } catch (const CLI::ParseError& e) {
        fmt::print(stderr, "tessera-client: {}; see --help\n", e.what());
        return exitCode(ErrorCode::kUsage);
    }
    // A file larger than the system lets it be is an error of the call that makes it, and what wants it does without.
    std::signal(SIGXFSZ, SIG_IGN);
    Log log("tessera-client[" + arguments.host + "]");
    const auto served = serve(arguments, log);
    if (served) return 0;
    Log("tessera-client").error(served.error().message);
    return exitCode(served.error().code);
}
