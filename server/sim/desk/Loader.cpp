#include "server/sim/desk/Loader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <iterator>

#include "common/cores/LoadWords.h"
#include "common/scene/FieldTable.h"

namespace tessera {
namespace {

/// Says that what an Inline holds is there, in the list that brings it.
void addState(ChangeList& list, const InlineOrder& content) {
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

}  // namespace

Loader::Loader(ImportOptions options, std::vector<std::string> allowed, std::function<void(LoadFinished)> onFinished,
               const std::vector<std::string>& scenes)
    : options_(std::move(options)),
      readable_{.folders = std::move(allowed), .assets = options_.assetFolders},
      readableContent_(readable_),
      onFinished_(std::move(onFinished)),
      thread_([this, folders = foldersOfScenes(scenes)] {
          std::ranges::copy(folders, std::back_inserter(readableContent_.folders));
          // From here on the folders stay as they are.
          const auto work = [this] {
              while (std::optional<LoadOrder> order = orders_.pop()) onFinished_(carryOut(*order));
          };
          std::vector<std::thread> others;
          for (std::size_t i = 1; i < kAtOnce; ++i) others.emplace_back(work);
          work();
          for (std::thread& other : others) other.join();
      }) {}

LoadFinished Loader::carryOut(const LoadOrder& order) const {
    constexpr int kLowestPriority = 19;
    // Of this thread, on Linux; the importer that it starts inherits it. Where that is forbidden the load is as it
    // would be.
    if (order.asked) (void)::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), kLowestPriority);
    LoadFinished finished{.ticket = order.ticket, .path = order.path, .scene = read(order), .content = order.content};
    if (!order.asked || !finished.scene) return finished;
    // All that takes long with a large scene is done here, to the freeing of what is not needed any more.
    finished.arrays = blobsOf(finished.scene->list);
    finished.parts = cutForFrames(std::exchange(finished.scene->list, {}));
    finished.scene->later = {};
    return finished;
}

Loader::~Loader() {
    orders_.close();
    while (orders_.tryPop()) {
    }
    thread_.join();
}

/// Here and not where the order comes from: folders may be slow.
Expected<ImportedScene> Loader::read(const LoadOrder& order) const {
    if (order.content) return readContent(*order.content);
    ImportOptions options = options_;
    options.placing = order.placing;
    options.gathers = order.asked;
    options.camerasEnabled = true;
    if (!order.asked) return importScene(order.path, order.parent, options);
    const Expected<std::string> path = readableFile(order.path, readable_);
    if (!path) return tl::unexpected(path.error());
    options.resolved = path->find("://") == std::string::npos;
    return importScene(*path, order.parent, options);
}

Expected<ImportedScene> Loader::readContent(const InlineOrder& content) const {
    const Expected<std::string> path = contentFile(content.file, readableContent_);
    if (!path) return tl::unexpected(path.error());
    for (const std::string& outer : content.chain) {
        const Expected<std::string> known = contentFile(outer, readableContent_);
        if (known && *known == *path)
            return fail(ErrorCode::kBadInput, fmt::format("it inlines itself: {} → {}", fmt::join(content.chain, " → "), content.file));
    }
    ImportOptions options = options_;
    options.placing.reset();
    options.resolved = true;
    Expected<ImportedScene> scene = importScene(*path, content.node, options);
    if (scene) addState(scene->list, content);
    return scene;
}

}  // namespace tessera
