#include "client/ctl/LoadVerbs.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include "client/ctl/RawTerminal.h"
#include "client/ctl/TextTable.h"

namespace tessera {
namespace {

using Json = nlohmann::ordered_json;

/// "reading, 43 %"
std::string stageOf(const LoadState& state) {
    if (state.part < 0) return state.stage;
    return fmt::format("{}, {:.0f} %", state.stage, 100 * state.part);
}

/// How far a load is, on stderr, where that is a terminal; the same line again and again.
class ProgressLine {
public:
    explicit ProgressLine(std::string file) : file_(std::move(file)), leave_(std::in_place) {}

    /// False: the person does not want it any more.
    bool tell(const LoadState& state) {
        if (isTerminal_ && !state.stage.empty()) {
            const std::string line =
                withoutControls(fmt::format("{}: {}, {:.0f} s (Ctrl-C cancels)", file_, stageOf(state), state.seconds));
            fmt::print(stderr, "\r{}\x1b[K", line);
            std::fflush(stderr);
            isBegun_ = true;
        }
        if (!leave_ || !WishToLeave::there()) return true;
        leave_.reset();
        return false;
    }
    void end() {
        if (isBegun_) fmt::print(stderr, "\r\x1b[K");
        leave_.reset();
    }

private:
    std::string file_;
    std::optional<WishToLeave> leave_;  ///< gone: the next Ctrl-C ends the program
    bool isTerminal_ = ::isatty(STDERR_FILENO) == 1, isBegun_ = false;
};

bool isOnItsWay(Application& application, const std::string& path) {
    const Expected<answer::Loads> told = application.loads();
    return told &&
           std::ranges::any_of(told->loads, [&](const LoadState& one) { return one.yours && one.path == path; });
}

}  // namespace

Expected<Answer> run(Application& application, const verb::Load& load) {
    ObjectId parent;
    if (!load.under.empty()) {
        const Expected<ObjectInfo> found = application.describeNode(load.under);
        if (!found) return tl::unexpected(found.error());
        parent = found->id;
    }
    // The server may stand in another folder than the person does.
    std::string path = load.file;
    if (path.find("://") == std::string::npos) {
        std::error_code error;
        path = std::filesystem::absolute(load.file, error).string();
        if (error)
            return fail(ErrorCode::kUsage,
                        fmt::format("load \"{}\": this is no path of a file ({})", load.file, error.message()));
    }
    const auto reload = load.reload ? Application::Reload::kIfThere : Application::Reload::kNever;
    ProgressLine line(load.file);
    const Expected<answer::Loaded> loaded = application.load(path, parent, load.patience, load.placing, reload,
                                                             [&](const LoadState& state) { return line.tell(state); });
    line.end();
    // Where the connection is gone nobody is left to ask: that would wait for its return.
    if (!loaded && loaded.error().code == ErrorCode::kNetwork && application.connected() &&
        isOnItsWay(application, path))
        return fail(ErrorCode::kNetwork,
                    fmt::format("{} is not loaded after {} s, and goes on: loads says how far it is, cancel ends it",
                                load.file, load.patience.count() / 1000));
    if (!loaded) return tl::unexpected(loaded.error());
    // Somebody may have taken it away again already.
    const std::string number = fmt::format("#{}", loaded->node.value);
    const Expected<ObjectInfo> node = application.describeNode(number);
    const std::string where = node && !node->path.empty() ? node->path : number;
    std::string text = fmt::format("loaded {} as {}: {} objects, {} triangles\n", load.file, where, loaded->objects,
                                   loaded->triangles);
    if (loaded->reloaded)
        text = fmt::format(
            "took {} in again at {}: {} values changed, {} objects made, {} removed, {} values kept as they are\n",
            load.file, where, loaded->changed, loaded->created, loaded->removed, loaded->kept);
    for (const std::string& note : loaded->notes) text += fmt::format("  {}\n", note);
    Json told = {{"node", loaded->node.value},
                 {"path", where},
                 {"objects", loaded->objects},
                 {"triangles", loaded->triangles},
                 {"notes", loaded->notes}};
    if (loaded->reloaded)
        told["reloaded"] = {{"changed", loaded->changed},
                            {"created", loaded->created},
                            {"removed", loaded->removed},
                            {"kept", loaded->kept}};
    return Answer{std::move(text), std::move(told), {}};
}

Expected<Answer> run(Application& application, const verb::Loads&) {
    const Expected<answer::Loads> told = application.loads();
    if (!told) return tl::unexpected(told.error());
    Answer answer;
    Json loads = Json::array();
    TextTable table({"load", "stage", "seconds", "whose", "file"});
    for (const LoadState& one : told->loads) {
        table.add({std::to_string(one.load), stageOf(one), fmt::format("{:.1f}", one.seconds),
                   withoutControls(one.person.empty() ? "-" : one.person), withoutControls(one.path)});
        loads.push_back({{"load", one.load},
                         {"path", one.path},
                         {"stage", one.stage},
                         {"part", one.part < 0 ? Json() : Json(one.part)},
                         {"seconds", one.seconds},
                         {"person", one.person}});
    }
    answer.text = loads.empty() ? "no file is on its way\n" : table.text();
    answer.json = {{"loads", std::move(loads)}};
    return answer;
}

Expected<Answer> run(Application& application, const verb::Cancel& cancel) {
    const Expected<answer::Loads> told = application.loads();
    if (!told) return tl::unexpected(told.error());
    std::optional<std::uint64_t> load = cancel.load;
    if (!load) {
        if (told->loads.empty()) return fail(ErrorCode::kNotFound, "cancel: no file is on its way");
        if (told->loads.size() > 1)
            return fail(ErrorCode::kUsage, fmt::format("cancel: {} files are on their way; say which, by its number "
                                                       "(tessera-ctl loads)",
                                                       told->loads.size()));
        load = told->loads.front().load;
    }
    if (const Expected<void> done = application.cancelLoad(*load); !done) return failWith("cancel", done.error());
    std::string path;
    for (const LoadState& one : told->loads)
        if (one.load == *load) path = one.path;
    return Answer{fmt::format("cancelled load {}{}{}\n", *load, path.empty() ? "" : ": ", path),
                  {{"load", *load}, {"path", path}},
                  {}};
}

}  // namespace tessera
