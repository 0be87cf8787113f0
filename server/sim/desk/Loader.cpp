#include "server/sim/desk/Loader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <exception>
#include <filesystem>
#include <thread>

#include "common/base/Shortage.h"
#include "common/base/StartThread.h"
#include "common/base/Utf8.h"
#include "common/cores/LoadWords.h"
#include "common/scene/FieldTable.h"
#include "server/import/AssetFolders.h"
#include "server/sim/frame/InlineContents.h"
#include "server/sim/frame/LoadParts.h"
#include "server/sim/reload/FileChange.h"
#include "server/sim/reload/FileWatch.h"

namespace tessera {
namespace {

/// Says that what an Inline holds is there, in the list that brings it.
void addState(ChangeList& list, const Preparation::Content& content) {
    ChangeListBuilder state;
    setLoadState(state, content.core, content.type, LoadWords::kThere);
    const auto order = [](const FieldColumn& column) { return std::pair(column.type, column.field); };
    for (FieldColumn& said : state.take().columns) {
        const auto at = std::ranges::lower_bound(list.columns, order(said), {}, order);
        if (at != list.columns.end() && order(*at) == order(said))
            at->append(content.core, said.value(0));
        else
            list.columns.insert(at, std::move(said));
    }
}

/// A person reads some.
std::vector<std::string> inShort(std::vector<std::string> notes, const std::string& path) {
    constexpr std::size_t kMost = 10;
    if (notes.size() <= kMost) return notes;
    const std::size_t others = notes.size() - kMost;
    notes.resize(kMost);
    notes.push_back(fmt::format("{} more notes; tessera-check {} tells all", others, path));
    return notes;
}

}  // namespace

Loader::Loader(ImportOptions options, std::shared_ptr<SceneFiles> files, std::function<void(Preparation)> onFinished,
               const MakeLane& lane, const TimeSource& time)
    : options_(std::move(options)),
      files_(std::move(files)),
      onFinished_(std::move(onFinished)),
      time_(time),
      lane_(lane({.width = kAtOnce})) {}

bool Loader::order(Preparation order) {
    constexpr std::size_t kMostWaiting = 64;
    if (waiting_ >= kMostWaiting) return false;
    ++waiting_;
    order.watch = std::make_shared<ImportWatch>();
    underWay_.with([&](std::vector<UnderWay>& all) {
        all.push_back({.ticket = order.ticket, .path = order.path, .since = time_.now(), .watch = order.watch});
    });
    lane_->post([this, order = std::move(order)] {
        --waiting_;
        carryOutApart(order);
    });
    return true;
}

std::vector<Loader::UnderWay> Loader::underWay() const {
    std::vector<UnderWay> wanted = underWay_.copy();
    std::erase_if(wanted, [](const UnderWay& one) { return one.watch->cancelled().has_value(); });
    return wanted;
}

bool Loader::cancel(std::uint64_t ticket, const Error& why) {
    for (const UnderWay& one : underWay()) {
        if (one.ticket != ticket) continue;
        one.watch->cancel(why);
        return true;
    }
    return false;
}

void Loader::forget(const std::shared_ptr<ImportWatch>& watch) {
    underWay_.with([&](std::vector<UnderWay>& all) {
        std::erase_if(all, [&](const UnderWay& one) { return one.watch == watch; });
    });
}

/// From here on it is the frame thread's, and no import any more.
void Loader::finish(Preparation made) {
    forget(made.watch);
    onFinished_(std::move(made));
}

void Loader::carryOutApart(Preparation order) {
    constexpr std::size_t kMostWords = 4096;
    std::array<char, kMostWords> words{};
    std::size_t length = 0;  // there may be zeros among them
    std::optional<ErrorCode> refused;
    std::thread apart = startThread([&] {
        Preparation made = order;
        try {
            carryOut(made);
        } catch (const std::exception& shortage) {  // of threads, descriptors or memory
            made.refused = Error{ErrorCode::kLimit, fmt::format("the machine has no room for it: {}", shortage.what())};
            order.isShortage = true;
        }
        if (!made.refused) return finish(std::move(made));
        // Nothing of a refused load outlives its thread: one text at the far end of its heap would keep all of it.
        refused = made.refused->code;
        order.isShortage = order.isShortage || takeMetShortage();
        length = cutUtf8(made.refused->message, words.size()).copy(words.data(), words.size());
    });
    if (apart.joinable()) {
        apart.join();
        if (!refused) return;
        order.refused = Error{*refused, std::string(words.data(), length)};
    } else {
        order.refused = Error{ErrorCode::kLimit, kNoThread};
        order.isShortage = true;
    }
    finish(std::move(order));
}

void Loader::carryOut(Preparation& order) const {
    constexpr int kLowestPriority = 19;
    // Of this thread, on Linux; the importer that it starts inherits it. Where that is forbidden the load is as it
    // would be.
    if (order.asked || order.file) (void)::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), kLowestPriority);
    Expected<ImportedScene> scene = order.file ? readQuiet(order) : readWatched(order);
    if (!scene) {
        order.refused = scene.error();
        return;
    }
    if (std::optional<Error> why = order.watch->cancelled()) {
        order.refused = *std::move(why);
        return;
    }
    std::optional<HeldFile> held = HeldFile::of(scene->list);
    order.top = scene->top;
    order.objects = scene->nodes + scene->cores;
    order.triangles = scene->triangles;
    order.notes = inShort(std::move(scene->notes), order.path);
    order.exposures = std::move(scene->exposures);
    if (order.file) return compare(order, std::move(scene->list), std::move(held));
    if (held) order.held = std::make_shared<HeldFile>(*std::move(held));
    if (!order.asked) {
        order.lists.push_back(std::move(scene->list));
        return;
    }
    // All that takes long with a large scene is done here, to the freeing of what is not needed any more.
    order.arrays = blobsOf(scene->list);
    order.lists = cutForFrames(std::move(scene->list));
}

std::shared_ptr<const WatchedFiles> Loader::filesOf(const Preparation& order, std::vector<std::string> others) const {
    std::string file = order.path;
    WatchedFiles files{.paths = {}, .stamps = {}, .called = {file}};
    if (file.starts_with(kAssetScheme)) {
        file = findAsset(std::string_view(file).substr(kAssetScheme.size()), options_.assetFolders).value_or(file);
    } else {
        std::error_code error;
        files.called.push_back(std::filesystem::absolute(file, error).lexically_normal().string());
        files.called.push_back(std::filesystem::weakly_canonical(file, error).string());
    }
    others.insert(others.begin(), std::move(file));
    files.stamps = stampsOf(others);
    files.paths = std::move(others);
    return std::make_shared<const WatchedFiles>(std::move(files));
}

/// What is written while it is read is a change.
Expected<ImportedScene> Loader::readWatched(Preparation& order) const {
    const FileStamp before = filesOf(order, {})->stamps.front();
    Expected<ImportedScene> scene = read(order);
    if (!scene) return scene;
    WatchedFiles files = *filesOf(order, std::move(scene->files));
    files.stamps.front() = before;
    order.files = std::make_shared<const WatchedFiles>(std::move(files));
    return scene;
}

/// Whoever writes it may not be ready: what was read is one state of all its files, where they ever rest. Where they do
/// not, it is what came; its stamps are those of before, so that it is read again.
Expected<ImportedScene> Loader::readQuiet(Preparation& order) const {
    constexpr int kTries = 3;
    for (int left = kTries;;) {
        const std::vector<FileStamp> before = stampsOf(order.watched->paths);
        Expected<ImportedScene> scene = read(order);
        const bool rested = stampsOf(order.watched->paths) == before;
        if (!rested && !order.watch->cancelled() && --left > 0) {
            std::this_thread::sleep_for(FileWatch::kQuiet);
            continue;
        }
        if (!scene) return scene;
        WatchedFiles files = *filesOf(order, std::move(scene->files));
        const std::vector<std::string>& watched = order.watched->paths;
        for (std::size_t i = 0; !rested && i < files.paths.size(); ++i)
            if (const auto at = std::ranges::find(watched, files.paths[i]); at != watched.end())
                files.stamps[i] = before[static_cast<std::size_t>(at - watched.begin())];
        order.files = std::make_shared<const WatchedFiles>(std::move(files));
        return scene;
    }
}

void Loader::compare(Preparation& order, ChangeList list, std::optional<HeldFile> held) {
    if (!held) {
        order.refused = Error{ErrorCode::kUnsupported, order.path + ": what it holds cannot be compared; load it anew"};
    } else if (order.former) {
        order.change = std::make_shared<FileChange>(order.former, std::move(list), *std::move(held));
    } else {
        order.held = std::make_shared<HeldFile>(*std::move(held));
    }
}

Loader::~Loader() {
    for (const UnderWay& one : underWay()) one.watch->cancel({ErrorCode::kFailed, "the server ends"});
    lane_.reset();
}

/// Here and not where the order comes from: folders may be slow.
Expected<ImportedScene> Loader::read(const Preparation& order) const {
    if (order.content) return readContent(order);
    ImportOptions options = options_;
    options.placing = order.placing;
    options.gathers = order.asked;
    options.camerasEnabled = true;
    options.watch = order.watch;
    if (!order.asked) {
        Expected<ImportedScene> scene = importScene(order.path, order.node, options);
        if (scene) files_->add(scene->named);
        return scene;
    }
    const Expected<std::string> path = files_->ofApplication(order.path);
    if (!path) return tl::unexpected(path.error());
    options.resolved = path->find("://") == std::string::npos;
    return importScene(*path, order.node, options);
}

Expected<ImportedScene> Loader::readContent(const Preparation& order) const {
    const Expected<std::string> path = files_->ofScene(order.path);
    if (!path) return tl::unexpected(path.error());
    for (const std::string& outer : order.content->chain) {
        const Expected<std::string> known = files_->ofScene(outer);
        if (known && *known == *path)
            return fail(ErrorCode::kBadInput,
                        fmt::format("it inlines itself: {} → {}", fmt::join(order.content->chain, " → "), order.path));
    }
    ImportOptions options = options_;
    options.placing.reset();
    options.exposes = false;
    options.resolved = true;
    options.watch = order.watch;
    Expected<ImportedScene> scene = importScene(*path, order.node, options);
    if (!scene) return scene;
    files_->add(scene->named);
    if (!order.file) addState(scene->list, *order.content);
    return scene;
}

}  // namespace tessera
