/// tessera-wall: a whole wall, on this machine or started from it: one server, one client process per host.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>

#include "common/base/Version.h"
#include "common/wall/Culler.h"
#include "deploy/wall/Launch.h"

int main(int argc, char** argv) {
    using namespace tessera;
    LaunchOptions options;
    CLI::App app("Runs a wall: one tessera-server here, one tessera-client per host;\nhere too, or with --start on the machines that the wall file names.",
                 "tessera-wall");
    app.set_version_flag("--version", versionText("tessera-wall"));
    app.add_option("--wall", options.wall, "Wall file, or a shipped wall's name (2x2)")->type_name("W");
    // A variable of a script that is empty is no folder.
    const CLI::Validator named([](std::string& text) { return text.empty() ? std::string("is empty") : std::string(); },
                               "");
    app.add_option("--scene", options.scenes, "Scene or model file; may be repeated")
        ->type_name("S")
        ->check(named);
    // The server says what is wrong with a number.
    app.add_option("--up", options.up, "Which axis is up in the scenes' files (as they\nsay; else +Z of .stl, .off and flat clouds of\npoints, +Y of others)")
        ->type_name("y|z")
        ->check(CLI::IsMember({"y", "z"}).description(""));
    app.add_option("--at", options.at, "Where each file's origin comes; with --fit the\nmiddle of its underside")->type_name("X Y Z")->expected(3)->check(CLI::Number.description(""));
    app.add_option("--fit", options.fit, "So long becomes the longest side of each")->type_name("METRES")->check(CLI::Number.description(""));
    app.add_option("--point-radius", options.pointRadius, "Of all their points, in their files' own units")->type_name("R")->check(CLI::Number.description(""));
    auto* const frames = app.add_option("--frames", options.frames, "Frames to show (120; with --window or\n--start until stopped)")
        ->type_name("N")
        ->check(CLI::Range(1, 100'000'000));
    app.add_option("--size", options.size, "Visible pixels of the whole wall")->type_name("WxH");
    app.add_option("--samples", options.samples, "Samples per pixel: 1 or 4")
        ->type_name("N")
        ->check(CLI::IsMember({1, 4}));
    app.add_option("--budget", options.budget, "Milliseconds that a frame may take before detail\nis left away; 0: none is (the wall's, else 0)")
        ->type_name("MS");
    app.add_option("--camera", options.camera, "Node of the camera to use")->type_name("C");
    // Two lines of the help.
    std::string cullers = cullerNames();
    if (const std::size_t middle = cullers.find(' ', 30); middle != std::string::npos) cullers[middle] = '\n';
    app.add_option("--culler", options.culler, cullers + " (the wall's, else auto)")
        ->type_name("K")
        ->check([](const std::string& name) {
            const auto culler = tessera::parseCuller(name);
            return culler ? std::string() : culler.error().message;
        });
    app.add_option("--surface", options.surface, "What draws: osmesa (default) or egl")
        ->type_name("NAME")
        ->check(CLI::IsMember({"osmesa", "egl"}));
    app.add_option("--device", options.device, "Of egl: the device, counted from 0 (the first GPU,\nelse Mesa's software)")
        ->type_name("N")
        ->check(CLI::Range(0, 63));
    app.add_flag("--window", options.window, "Show the tiles in windows of this machine");
    // For measurements (run-bench screen).
    app.add_option("--window-log", options.windowLog)->group("");
    // "always" is for tests: every tile is divided, whether that pays or not.
    app.add_option("--share", options.share, "Clients share arrays and parts of tiles:\nauto or off (auto)")
        ->type_name("S")
        ->check(CLI::IsMember({"auto", "off", "always"}).description(""));
    app.add_option("--output", options.output, "Folder for pictures and report (out)")->type_name("DIR");
    app.add_option("--assets", options.assets, "Folders for asset://NAME")->type_name("DIR");
    app.add_option("--record", options.record, "Record the server, for tessera-replay")->type_name("FILE");
    app.add_option("--journal", options.journal, "Keep what is done here; the same command goes on\nfrom it")
        ->type_name("DIR")
        ->check(named);
    app.add_option("--threads", options.threads, "Of the server's collision pipeline (1)")
        ->type_name("N")
        ->check(CLI::Range(1, 256));
    app.add_flag("--keep-frames", options.keepFrames, "Keep every frame's tiles; with ffmpeg\nalso DIR/wall.mp4");
    app.add_flag("--outputs", options.outputs, "Also DIR/outputs/TILE.png: what each projector\ngets (stereo, warp, blend, colour)");
    auto* const start = app.add_flag("--start", options.start, "Start hosts on the machines that the wall names,\nby ssh (until stopped)");
    app.add_flag("--start-anyway", options.startAnyway, "... without those whose machine lacks something")->needs(start);
    app.add_option("--listen", options.listen, "Of the server (where the machines reach this one)")->type_name("ADDR:PORT");
    app.add_option("--ssh", options.ssh, "The program that is ssh (ssh)")->type_name("PROGRAM")->check(named)->needs(start);
    app.add_flag("--test-picture", options.testPicture, "Show the test picture; a scene is not needed");
    app.add_flag("--restart", options.restart, "Start a client again that has died");
    app.add_flag("--no-input", options.noInput, "Nobody flies: windows and applications move the\nview by `view` alone");
    app.add_flag("--no-notices", options.noNotices, "The wall does not say what is wrong with programs\nof materials (the log does)");
    app.add_flag("--allow-unconfined-import", options.allowUnconfined,
                 "Import even where the importing process\ncannot be confined");
    try {
        app.parse(argc, argv);
    } catch (const CLI::CallForHelp& e) {
        return app.exit(e);
    } catch (const CLI::CallForVersion& e) {
        return app.exit(e);
    } catch (const CLI::ParseError& e) {
        fmt::print(stderr, "tessera-wall: {}; see --help\n", e.what());
        return exitCode(ErrorCode::kUsage);
    }
    if (options.scenes.empty() && !options.testPicture) {
        fmt::print(stderr, "tessera-wall: --scene is required; see --help\n");
        return exitCode(ErrorCode::kUsage);
    }
    if ((options.window || options.start) && frames->empty()) options.frames = 0;
    options.executable = std::filesystem::read_symlink("/proc/self/exe").string();
    Console console = Console::standard();
    Expected<Signals> signals = Signals::take();
    if (!signals) {
        console.error(signals.error().message);
        return exitCode(signals.error().code);
    }
    return launch(options, *signals, console);
}
