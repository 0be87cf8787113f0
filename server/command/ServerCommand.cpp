#include "server/command/ServerCommand.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "common/base/ShippedFiles.h"
#include "common/base/Version.h"
#include "common/codec/WallCodec.h"
#include "common/options/Options.h"
#include "common/wall/Exposure.h"
#include "common/wall/PictureLayout.h"
#include "common/wall/WallNotes.h"

namespace tessera {

namespace {

Expected<Wall> readWall(const ServerArguments& arguments, const std::string& executable) {
    const Expected<std::string> path = findWall(arguments.wall, executable);
    if (!path) return tl::unexpected(path.error());
    Expected<Wall> wall = loadWall(*path);
    if (!wall) return wall;
    if (arguments.samples != 0) wall->samples = arguments.samples;
    if (arguments.budget >= 0) wall->budgetMs = arguments.budget;
    if (!arguments.size.empty()) {
        const Expected<ScreenPixels> size = parsePixels(arguments.size);
        if (!size) return failWith("--size", size.error());
        wall = withSize(*wall, size->width, size->height);
    }
    return wall;
}

}  // namespace

std::optional<int> parseServerCommand(int argc, const char* const* argv, ServerArguments& arguments) {
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
        .range(0.0, 1000.0);
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
    if (const std::optional<int> code = options.parse(argc, argv)) return code;
    Placing& placing = arguments.placing;
    if (at.given()) placing.at = Vec3d(arguments.at[0], arguments.at[1], arguments.at[2]);
    if (fit.given()) placing.fit = arguments.fit;
    if (radius.given()) placing.pointRadius = arguments.pointRadius;
    if (!arguments.up.empty()) placing.up = arguments.up == "z" ? UpAxis::kZ : UpAxis::kY;
    if (const Expected<void> sound = checkPlacing(placing); !sound) {
        fmt::print(stderr, "tessera-server: {}: {}; see --help\n", optionsText(placing), sound.error().message);
        return exitCode(ErrorCode::kUsage);
    }
    return std::nullopt;
}

Expected<ServerOptions> serverOptionsOf(const ServerArguments& arguments, const std::string& executable, Log& log) {
    Expected<Wall> wall = readWall(arguments, executable);
    if (!wall) return tl::unexpected(wall.error());
    // A size that is said is wanted so.
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
    if (arguments.testPicture) options.showing = Showing::kTestPicture;
    options.studio = !arguments.plain;
    options.takesInput = !arguments.noInput;
    options.notices = !arguments.noNotices;
    options.reload = arguments.reload;
    return options;
}

}  // namespace tessera
