#include "deploy/wall/Launch.h"

#include <fmt/format.h>
#include <sched.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "common/codec/WallCodec.h"
#include "common/image/Picture.h"
#include "common/wall/PictureLayout.h"
#include "deploy/wall/Film.h"
#include "deploy/wall/OutputImages.h"
#include "deploy/wall/RemoteWall.h"
#include "deploy/wall/Stitch.h"
#include "deploy/wall/TileImages.h"

namespace tessera {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kLargestReport = std::size_t{64} << 20;

/// The wall as the server sees it: same file, same size.
Expected<Wall> wallOf(const LaunchOptions& options, std::string& path) {
    Expected<std::string> found = findWall(options.wall, options.executable);
    if (!found) return tl::unexpected(found.error());
    path = *found;
    Expected<Wall> wall = loadWall(path);
    if (!wall || options.size.empty()) return wall;
    const Expected<ScreenPixels> size = parsePixels(options.size);
    if (!size) return failWith("--size", size.error());
    return withSize(*wall, size->width, size->height);
}

Expected<std::string> programBeside(const std::string& executable, const std::string& name) {
    const fs::path path = fs::path(executable).parent_path() / name;
    std::error_code ignored;
    if (!fs::is_regular_file(path, ignored)) {
        return fail(ErrorCode::kNotFound,
                    fmt::format("{} is missing: {} is looked for beside this program", path.string(), name));
    }
    return path.string();
}

/// llvmpipe takes all cores for itself; several clients on one machine share them.
std::string drawThreads(std::size_t clients) {
    cpu_set_t cores;
    const int count = ::sched_getaffinity(0, sizeof(cores), &cores) == 0 ? CPU_COUNT(&cores) : 1;
    return std::to_string(std::max(0, count / static_cast<int>(std::max<std::size_t>(1, clients)) - 1));
}

/// Of every client, wherever it runs.
std::vector<std::string> argumentsOfAllClients(const LaunchOptions& options) {
    std::vector<std::string> c;
    if (!options.culler.empty()) c.insert(c.end(), {"--culler", options.culler});
    if (options.window) c.emplace_back("--window");
    if (!options.surface.empty()) c.insert(c.end(), {"--surface", options.surface});
    if (options.device >= 0) c.insert(c.end(), {"--device", std::to_string(options.device)});
    if (options.anisotropy > 0) c.insert(c.end(), {"--anisotropy", std::to_string(options.anisotropy)});
    if (options.glMemoryMib > 0) c.insert(c.end(), {"--gl-memory", std::to_string(options.glMemoryMib)});
    if (!options.share.empty()) c.insert(c.end(), {"--share", options.share});
    if (!options.verbose) c.emplace_back("--quiet");
    return c;
}

/// `remote`: null where all clients run here.
Expected<WallRunOptions> runOptions(const LaunchOptions& options, const Wall& wall, const std::string& wallPath,
                                    const RemoteWall* remote, const std::string& keys) {
    const Expected<std::string> server = programBeside(options.executable, "tessera-server");
    if (!server) return tl::unexpected(server.error());
    const Expected<std::string> client = programBeside(options.executable, "tessera-client");
    if (!client) return tl::unexpected(client.error());

    WallRunOptions run;
    run.serverProgram = *server;
    run.clientProgram = *client;
    run.restart = options.restart;
    for (const WallHost& host : wall.hosts) run.hosts.push_back(host.name);

    std::vector<std::string>& s = run.serverArguments;
    s = {"--wall",    wallPath,
         "--listen",  remote != nullptr ? remote->listen : options.listen.empty() ? "127.0.0.1:0" : options.listen,
         "--report",  options.output + "/report.json",
         "--progress"};
    if (!options.verbose) s.emplace_back("--quiet");
    const auto add = [&](const std::string& option, const std::string& value) {
        if (!value.empty()) s.insert(s.end(), {option, value});
    };
    // Pictures of tiles elsewhere are fetched while the server runs: it is told to end when that is done.
    if (remote != nullptr) {
        const Expected<std::string> ctl = programBeside(options.executable, "tessera-ctl");
        if (!ctl) return tl::unexpected(ctl.error());
        run.remote = remote->clients;
        run.endAfterFrames = options.frames;
        run.beforeEnd = [ctl = *ctl, file = options.output + "/wall.png"](const std::string& address) {
            return ChildCommand{.program = ctl, .arguments = {"--server", address, "snapshot", file}};
        };
    }
    add("--keys", keys);
    if (options.insecure) s.push_back("--insecure");
    add("--frames", options.frames != 0 && remote == nullptr ? std::to_string(options.frames) : "");
    if (options.testPicture) s.push_back("--test-picture");
    for (const std::string& scene : options.scenes) add("--scene", scene);
    add("--up", options.up);
    add("--fit", options.fit);
    add("--point-radius", options.pointRadius);
    for (const std::string& variant : options.variants) add("--variant", variant);
    if (!options.at.empty()) {
        s.emplace_back("--at");
        s.insert(s.end(), options.at.begin(), options.at.end());
    }
    for (const std::string& folder : options.assets) add("--assets", folder);
    // Who is shown a scene may load what lies beside it; beside one in the root folder lies everything.
    std::set<std::string> allowed;
    for (const std::string& scene : options.scenes) {
        std::error_code error;  // the server says what is wrong with it
        const fs::path file = fs::absolute(scene, error);
        if (!error && scene.find("://") == std::string::npos && file.parent_path() != file.root_path())
            allowed.insert(file.parent_path().string());
    }
    for (const std::string& folder : allowed) add("--allow", folder);
    add("--size", options.size);
    add("--samples", options.samples != 0 ? std::to_string(options.samples) : "");
    add("--budget", options.budget);
    add("--camera", options.camera);
    add("--exposure", options.exposure);
    add("--tone-map", options.toneMap);
    add("--record", options.record);
    add("--journal", options.journal);
    add("--audit", options.audit);
    add("--uploads", options.uploads);
    add("--uploads-mib", options.uploadsMib != 0 ? std::to_string(options.uploadsMib) : "");
    add("--threads", options.threads != 0 ? std::to_string(options.threads) : "");
    add("--import-memory", options.importMemoryMib != 0 ? std::to_string(options.importMemoryMib) : "");
    if (options.plain) s.push_back("--plain");
    if (options.noInput) s.push_back("--no-input");
    if (options.noNotices) s.push_back("--no-notices");
    if (options.reload) s.push_back("--reload");
    if (options.allowUnconfined) s.push_back("--allow-unconfined-import");

    run.clientArguments = {"--output", options.output};
    const std::vector<std::string> ofAll = argumentsOfAllClients(options);
    run.clientArguments.insert(run.clientArguments.end(), ofAll.begin(), ofAll.end());
    if (!options.windowLog.empty())
        run.clientArguments.insert(run.clientArguments.end(), {"--window-log", options.windowLog});
    if (options.keepFrames) run.clientArguments.push_back("--keep-frames");
    if (std::getenv("LP_NUM_THREADS") == nullptr)
        run.clientEnvironment.emplace_back("LP_NUM_THREADS", drawThreads(wall.hosts.size() - run.remote.size()));
    return run;
}

/// What earlier runs left would look like this one's results.
Expected<void> prepareOutput(const std::string& output, const TileImages& images) {
    std::error_code error;
    fs::create_directories(output, error);
    if (error)
        return fail(ErrorCode::kFailed, fmt::format("{}: the folder cannot be made: {}", output, error.message()));
    for (const char* name :
         {"wall.png", "wall-bezels.png", "wall-right.png", "wall-right-bezels.png", "wall.mp4", "report.json"}) {
        fs::remove(fs::path(output) / name, error);
        if (error)
            return fail(ErrorCode::kFailed, fmt::format("{}/{}: cannot be removed: {}", output, name, error.message()));
    }
    return images.clear();
}

/// What each tile showed last.
class LastImages {
public:
    static Expected<LastImages> read(const std::vector<Tile>& tiles, const TileImages& images) {
        LastImages last;
        for (const Tile& tile : tiles) {
            Expected<std::optional<TileImages::Image>> image = images.last(tile.name);
            if (!image) return tl::unexpected(image.error());
            if (*image) last.newest_ = std::max(last.newest_.value_or(0), (*image)->frame);
            last.images_[tile.name] = std::move(*image);
        }
        return last;
    }
    /// Nothing when no tile has shown anything.
    [[nodiscard]] std::optional<std::uint64_t> newest() const { return newest_; }
    [[nodiscard]] const std::optional<TileImages::Image>& of(const std::string& tile) const { return images_.at(tile); }

    void sayWhatIsOld(const std::vector<Tile>& tiles, Console& console) const {
        for (const Tile& tile : tiles) {
            const std::optional<TileImages::Image>& image = of(tile.name);
            if (!image) {
                console.warning(fmt::format("tile {} of host {} never showed an image: it is dark in the pictures",
                                            tile.name, tile.host));
            } else if (image->frame < newest_) {
                console.warning(fmt::format("tile {} of host {} shows frame {}, others frame {}", tile.name, tile.host,
                                            image->frame, *newest_));
            }
        }
    }

private:
    std::map<std::string, std::optional<TileImages::Image>> images_;
    std::optional<std::uint64_t> newest_;
};

Expected<void> writePicture(const Wall& wall, PictureKind kind, Eye eye, const std::string& path,
                            const LastImages& last) {
    const Expected<Stitched> stitched =
        stitch(layoutPicture(wall, kind, eye), [&](const std::string& tile) -> Expected<std::optional<Picture>> {
            const std::optional<TileImages::Image>& image = last.of(tile);
            return image ? std::optional<Picture>(image->picture) : std::nullopt;
        });
    if (!stitched) return tl::unexpected(stitched.error());
    return writeFile(path, encodePng(stitched->picture, last.newest()));
}

Expected<void> writePictures(const Wall& wall, const std::string& output, const LastImages& last) {
    const auto both = [&](Eye eye, const std::string& stem) -> Expected<void> {
        if (auto ok = writePicture(wall, PictureKind::kMosaic, eye, fmt::format("{}/{}.png", output, stem), last); !ok)
            return ok;
        return writePicture(wall, PictureKind::kWithBezels, eye, fmt::format("{}/{}-bezels.png", output, stem), last);
    };
    if (auto ok = both(Eye::kLeft, "wall"); !ok) return ok;
    return isStereo(wall) ? both(Eye::kRight, "wall-right") : Expected<void>();
}

/// Which tile the others waited for longest. Nothing where the report does not say so.
void sayWaits(const nlohmann::json& report, Console& console) {
    const nlohmann::json::json_pointer first("/sync/waits/0");
    if (!report.contains(first) || !report[first].is_object()) return;
    const nlohmann::json& worst = report[first];
    for (const char* name : {"tile", "host", "reason"})
        if (!worst.contains(name) || !worst[name].is_string()) return;
    for (const char* name : {"frames", "ms"})
        if (!worst.contains(name) || !worst[name].is_number()) return;
    const auto frames = worst["frames"].get<std::uint64_t>();
    console.note(fmt::format("waited longest for tile {} of host {}: in {} frames, {:.1f} ms each; reason: {}",
                             worst["tile"].get<std::string>(), worst["host"].get<std::string>(), frames,
                             worst["ms"].get<double>() / static_cast<double>(std::max<std::uint64_t>(1, frames)),
                             worst["reason"].get<std::string>()));
}

/// The server's report is there and can be read; a word on what is in it.
/// Returns how many frames were shown.
Expected<std::uint64_t> sayReport(const std::string& path, Console& console) {
    const Expected<Bytes> bytes = readFile(path, kLargestReport);
    if (!bytes) return tl::unexpected(bytes.error());
    const nlohmann::json report = nlohmann::json::parse(asText(*bytes), nullptr, false);
    if (!report.is_object())
        return fail(ErrorCode::kFailed, fmt::format("{}: the server's report is no JSON object", path));
    const nlohmann::json faults = report.value("faults", nlohmann::json::array());
    const nlohmann::json times = report.value("frame_ms", nlohmann::json::object());
    const std::uint64_t frames =
        report.contains("frames") && report["frames"].is_number() ? report["frames"].get<std::uint64_t>() : 0;
    std::string text = fmt::format("{} frames", frames);
    if (times.is_object() && times.contains("p50") && times["p50"].is_number())
        text += fmt::format(", {:.1f} ms each (median)", times["p50"].get<double>());
    if (faults.is_array()) text += fmt::format(", {} {}", faults.size(), faults.size() == 1 ? "fault" : "faults");
    console.note(text);
    sayWaits(report, console);
    return frames;
}

void makeFilm(const LaunchOptions& options, const Wall& wall, const TileImages& images, Signals& signals,
              Console& console) {
    const std::optional<std::string> ffmpeg = findProgram("ffmpeg");
    if (!ffmpeg) {
        console.note(fmt::format("ffmpeg is not installed: no {}/wall.mp4", options.output));
        return;
    }
    const Expected<bool> written = writeFilm(*ffmpeg, options.output + "/wall.mp4",
                                             layoutPicture(wall, PictureKind::kMosaic), images, signals, console);
    if (!written) console.warning(fmt::format("no {}/wall.mp4: {}", options.output, written.error().message));
}

int judge(const WallRunResult& run, bool untilStopped, Console& console) {
    if (run.interrupted && !(untilStopped && run.server.good())) {
        console.error("stopped before all frames were shown");
        return exitCode(ErrorCode::kFailed);
    }
    if (run.deserted) return run.desertedCode;
    if (run.server.good()) return 0;
    console.error(fmt::format("the server {}{}", describe(run.server), adviceAfter(run.server, "tessera-server")));
    return run.server.signalled ? exitCode(ErrorCode::kFailed) : run.server.value;
}

/// The server's report, and the picture that was fetched before it ended.
int afterRemote(const LaunchOptions& options, int code, Console& console) {
    if (code != 0) return code;
    const std::string report = options.output + "/report.json", picture = options.output + "/wall.png";
    const Expected<std::uint64_t> frames = sayReport(report, console);
    if (!frames) {
        console.error(frames.error().message);
        return exitCode(frames.error().code);
    }
    // Who stops a wall before it has shown anything has what was wanted.
    if (*frames == 0 && options.frames > 0) {
        console.error("no host has shown a frame");
        return exitCode(ErrorCode::kFailed);
    }
    std::error_code ignored;
    console.note(fs::exists(picture, ignored) ? fmt::format("{}, {}", picture, report) : report);
    return 0;
}

}  // namespace

int launch(const LaunchOptions& options, Signals& signals, Console& console) {
    const auto failed = [&](const Error& error) {
        console.error(error.message);
        return exitCode(error.code);
    };
    std::string wallPath;
    const Expected<Wall> wall = wallOf(options, wallPath);
    if (!wall) return failed(wall.error());
    std::optional<RemoteWall> remote;
    std::optional<WallKeys> keys;
    const auto takeKeys = [&](Expected<WallKeys> made) {
        if (made) keys.emplace(std::move(*made));
        return made ? Expected<void>() : tl::unexpected(made.error());
    };
    if (!options.keys.empty())
        if (const Expected<void> taken = takeKeys(WallKeys::in(options.keys)); !taken) return failed(taken.error());
    if (options.start &&
        std::ranges::any_of(wall->hosts, [](const WallHost& host) { return host.machine.has_value(); })) {
        if (!keys && !options.insecure)
            if (const Expected<void> made = takeKeys(WallKeys::forThisRun(wall->name)); !made)
                return failed(made.error());
        auto prepared = prepareMachines(*wall,
                                        {.ssh = options.ssh,
                                         .listen = options.listen,
                                         .client = argumentsOfAllClients(options),
                                         .startAnyway = options.startAnyway,
                                         .keys = keys ? &*keys : nullptr},
                                        signals, console);
        if (!prepared) return failed(prepared.error());
        if (!*prepared) return failed({ErrorCode::kFailed, "stopped before anything was started"});
        remote = std::move(**prepared);
    } else if (options.start) {
        console.note("no host of this wall names a machine: all run here");
    }
    const Expected<WallRunOptions> runSetup =
        runOptions(options, *wall, wallPath, remote ? &*remote : nullptr, keys ? keys->folder() : "");
    if (!runSetup) return failed(runSetup.error());
    const std::vector<Tile> tiles = layoutTiles(*wall);
    const TileImages images(options.output + "/tiles");
    if (auto ok = prepareOutput(options.output, images); !ok) return failed(ok.error());
    const std::string outputs = options.output + "/outputs";
    if (auto ok = clearOutputImages(outputs); !ok) return failed(ok.error());

    const Expected<WallRunResult> run = runWall(*runSetup, signals, console);
    if (!run) return failed(run.error());
    const int code = judge(*run, options.frames == 0, console);

    if (remote) return afterRemote(options, code, console);
    const Expected<LastImages> last = LastImages::read(tiles, images);
    if (!last) return code != 0 ? code : failed(last.error());
    if (!last->newest()) return code != 0 ? code : failed({ErrorCode::kFailed, "no tile has shown anything"});
    // A run that broke off may have left pictures worth having; its exit code stays what it is.
    last->sayWhatIsOld(tiles, console);
    if (auto ok = writePictures(*wall, options.output, *last); !ok) return code != 0 ? code : failed(ok.error());
    if (options.outputs) {
        const auto ok = writeOutputImages(
            outputs, *wall,
            [&](const std::string& tile) -> const std::optional<TileImages::Image>& { return last->of(tile); },
            console);
        if (!ok) return code != 0 ? code : failed(ok.error());
    }
    if (options.keepFrames && !run->interrupted) makeFilm(options, *wall, images, signals, console);
    if (code != 0) return code;
    if (auto ok = sayReport(options.output + "/report.json", console); !ok) return failed(ok.error());
    console.note(fmt::format("{0}/wall.png, {0}/report.json", options.output));
    return 0;
}

}  // namespace tessera
