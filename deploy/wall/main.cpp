/// tessera-wall: a whole wall, on this machine or started from it: one server, one client process per host.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "common/base/RunProgram.h"
#include "common/base/ShippedFiles.h"
#include "common/base/Version.h"
#include "common/options/Options.h"
#include "common/wall/Culler.h"
#include "common/wall/Exposure.h"
#include "deploy/wall/Launch.h"

namespace {

constexpr const char* kEngine = "/usr/share/assimp/models";  // of Debian's package assimp-testmodels

/// Without a scene, one that is shipped. Shipped ones find their engine by themselves.
void showShipped(tessera::LaunchOptions& options) {
    std::error_code none;
    const bool hasEngine = std::filesystem::is_directory(kEngine, none);
    if (options.scenes.empty()) options.scenes = {hasEngine ? "engine-hall" : "materials"};
    const auto isName = [](const std::string& scene) { return scene.find_first_of("/.") == std::string::npos; };
    if (hasEngine && options.assets.empty() && std::ranges::all_of(options.scenes, isName))
        options.assets.emplace_back(kEngine);
}

}  // namespace

int main(int argc, char** argv) {
    using namespace tessera;
    LaunchOptions options;
    Options commandLine("tessera-wall",
                        "Runs a wall: one tessera-server here, one tessera-client per host;\nhere too, or with --start "
                        "on the machines that the wall file names.",
                        versionText("tessera-wall"));
    commandLine.option("--wall", options.wall, "Wall file, or a shipped wall's name (2x2)").typeName("W");
    // A variable of a script that is empty is no folder.
    const auto named = [](const std::string& text) { return text.empty() ? std::string("is empty") : std::string(); };
    commandLine
        .option("--scene", options.scenes,
                "Scene or model file, or a shipped scene's name;\nmay be repeated (engine-hall; materials where "
                "the\nengine is not installed)")
        .typeName("S")
        .check(named);
    // The server says what is wrong with a number.
    commandLine
        .option("--up", options.up,
                "Which axis is up in the scenes' files (as they\nsay; else +Z of .stl, .off and flat clouds "
                "of\npoints, +Y of others)")
        .typeName("y|z")
        .oneOf({"y", "z"}, ShowValues::kInErrorsAlone);
    commandLine
        .option("--at", options.at,
                "Where each file's origin comes, in metres of the\nwall, whose coordinates are then the world's; "
                "with\n--fit the middle of its underside")
        .typeName("X Y Z")
        .expected(3)
        .number();
    commandLine
        .option("--fit", options.fit,
                "So long becomes the longest side of each. With\n--fit or --at no camera of the files takes the\nview; "
                "--camera does")
        .typeName("METRES")
        .number();
    commandLine.option("--point-radius", options.pointRadius, "Of all their points, in their files' own units")
        .typeName("R")
        .number();
    commandLine
        .option("--variant", options.variants,
                "Of USD: prim P shows variant N of its set S, as\n/Chair:color=red; may be repeated")
        .typeName("P:S=N")
        .oneEach();
    const Option frames =
        commandLine.option("--frames", options.frames, "Frames to show (120; with --window or\n--start until stopped)")
            .typeName("N")
            .range(1, 100'000'000);
    commandLine.option("--size", options.size, "Visible pixels of the whole wall").typeName("WxH");
    commandLine.option("--samples", options.samples, "Samples per pixel: 1 or 4").typeName("N").oneOf({1, 4});
    commandLine
        .option("--budget", options.budget,
                "Milliseconds that a frame may take before detail\nis left away; 0: none is (the wall's, else 0)")
        .typeName("MS");
    commandLine.option("--camera", options.camera, "Node of the camera to use").typeName("C");
    // Two lines of the help.
    std::string cullers = cullerNames();
    if (const std::size_t middle = cullers.find(' ', 30); middle != std::string::npos) cullers[middle] = '\n';
    commandLine.option("--culler", options.culler, cullers + " (the wall's, else auto)")
        .typeName("K")
        .check([](const std::string& name) {
            const auto culler = tessera::parseCuller(name);
            return culler ? std::string() : culler.error().message;
        });
    commandLine.option("--surface", options.surface, "What draws: osmesa (default) or egl")
        .typeName("NAME")
        .oneOf({"osmesa", "egl"});
    commandLine
        .option("--device", options.device, "Of egl: the device, counted from 0 (the first GPU,\nelse Mesa's software)")
        .typeName("N")
        .range(0, 63);
    commandLine
        .option("--anisotropy", options.anisotropy,
                "Samples of an image that is seen at a grazing\nangle (16 on a GPU, 1 on Mesa's software)")
        .typeName("N")
        .range(1, 16);
    commandLine
        .option(
            "--gl-memory", options.glMemoryMib,
            "Of each client: for pictures, meshes and images\nin GL (3/4 of the card's; 1/4 of what is free, to\n3072)")
        .typeName("MIB")
        .range(64, 1 << 22);
    commandLine.flag("--window", options.window, "Show the tiles in windows of this machine");
    // For measurements (run-bench screen).
    commandLine.option("--window-log", options.windowLog).hidden();
    // "always" is for tests: every tile is divided, whether that pays or not.
    commandLine.option("--share", options.share, "Clients share arrays and parts of tiles:\nauto or off (auto)")
        .typeName("S")
        .oneOf({"auto", "off", "always"}, ShowValues::kInErrorsAlone);
    commandLine.option("--output", options.output, "Folder for pictures and report (out)").typeName("DIR");
    commandLine.option("--assets", options.assets, "Folders for asset://NAME").typeName("DIR");
    commandLine.option("--record", options.record, "Record the server, for tessera-replay").typeName("FILE");
    commandLine.option("--audit", options.audit, "Who changes what, a line each (deploy/security.md)")
        .typeName("FILE")
        .check(named);
    commandLine.option("--journal", options.journal, "Keep what is done here; the same command goes on\nfrom it")
        .typeName("DIR")
        .check(named);
    commandLine
        .option("--uploads", options.uploads,
                "Where files lie that pages bring (JOURNAL/uploads,\nelse a folder that goes with this run)")
        .typeName("DIR")
        .check(named);
    commandLine.option("--uploads-mib", options.uploadsMib, "All of them together (2048)")
        .typeName("MIB")
        .range(1, 1'000'000);
    commandLine.option("--threads", options.threads, "Of the server's collision pipeline (1)")
        .typeName("N")
        .range(1, 256);
    commandLine.flag("--keep-frames", options.keepFrames, "Keep every frame's tiles; with ffmpeg\nalso DIR/wall.mp4");
    commandLine.flag("--outputs", options.outputs,
                     "Also DIR/outputs/TILE.png: what each projector\ngets (stereo, warp, blend, colour)");
    const Option start = commandLine.flag("--start", options.start,
                                          "Start hosts on the machines that the wall names,\nby ssh (until stopped)");
    commandLine.flag("--start-anyway", options.startAnyway, "... without those whose machine lacks something")
        .needs(start);
    commandLine.option("--listen", options.listen, "Of the server (where the machines reach this one)")
        .typeName("ADDR:PORT");
    commandLine
        .option("--keys", options.keys,
                "Of the wall (tessera-keys); --start brings hosts\n"
                "theirs (some that are made for this run)")
        .typeName("DIR")
        .check(named);
    commandLine.flag("--insecure", options.insecure, "Nobody needs a key, and all that is sent is plain");
    commandLine.option("--ssh", options.ssh, "The program that is ssh (ssh)")
        .typeName("PROGRAM")
        .check(named)
        .needs(start);
    commandLine.flag("--test-picture", options.testPicture, "Show the test picture; a scene is not needed");
    commandLine.flag("--plain", options.plain,
                     "Models without light stand in no studio: as they\nare, on a plain background");
    commandLine
        .option("--exposure", options.exposure,
                "How bright the scene is shown, whatever it says:\nstops, metered (once for all tiles), or off")
        .typeName("EV")
        .check(exposureFault);
    commandLine.option("--tone-map", options.toneMap, "The curve for what is brighter than white")
        .typeName("NAME")
        .oneOf(std::vector<std::string>(kToneMapNames.begin(), kToneMapNames.end()));
    commandLine.flag("--restart", options.restart, "Start a client again that has died");
    commandLine.flag("--no-input", options.noInput,
                     "Nobody flies: windows and applications move the\nview by `view` alone");
    commandLine.flag("--no-notices", options.noNotices,
                     "The wall does not say what is wrong with programs\nof materials (the log does)");
    commandLine.flag("--reload", options.reload,
                     "Files that change on disk are taken in again in\ntheir place; what people changed since is kept");
    commandLine.flag("--verbose", options.verbose,
                     "Say what each process does; each start of one is a\nline for scripts, with its pid");
    commandLine
        .option("--import-memory", options.importMemoryMib,
                "What reading one file may take at least (2048);\nlarge scenes, OBJ, STL, PLY, DXF, 3MF and AMF may\n"
                "take more, up to half of the machine's")
        .typeName("MIB")
        .range(256, 1'000'000);
    commandLine.flag("--allow-unconfined-import", options.allowUnconfined,
                     "Import even where the importing process\ncannot be confined");
    if (const std::optional<int> code = commandLine.parse(argc, argv)) return *code;
    // A journal that has begun knows its scene.
    std::error_code none;
    const bool goesOn = !options.journal.empty() && !std::filesystem::is_empty(options.journal, none) && !none;
    options.executable = std::filesystem::read_symlink("/proc/self/exe").string();
    if (!options.testPicture && (!options.scenes.empty() || !goesOn)) showShipped(options);
    for (std::string& scene : options.scenes) {
        Expected<std::string> found = findScene(scene, options.executable);
        if (!found && !goesOn) {
            fmt::print(stderr, "tessera-wall: {}\n", found.error().message);
            return exitCode(found.error().code);
        }
        if (found) scene = std::move(*found);
    }
    if ((options.window || options.start) && !frames.given()) options.frames = 0;
    Console console = Console::standard(options.verbose);
    Expected<Signals> signals = Signals::take();
    if (!signals) {
        console.error(signals.error().message);
        return exitCode(signals.error().code);
    }
    return runProgram("tessera-wall", [&] { return launch(options, *signals, console); });
}
