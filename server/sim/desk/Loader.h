/// Imports files off the frame thread, a few at once.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "common/base/Channel.h"
#include "common/base/Error.h"
#include "server/import/Importer.h"
#include "server/sim/desk/SceneFiles.h"
#include "server/sim/frame/InlineLoading.h"
#include "server/sim/frame/LoadParts.h"

namespace tessera {

struct LoadOrder {
    std::uint64_t ticket = 0;
    std::string path;
    ObjectId parent;
    Placing placing = {};
    /// By an application, which may not have every file read, while frames are shown: it is read and cut (LoadParts.h) with the
    /// lowest priority that there is, and so is everything after it.
    bool asked = true;
    /// What an Inline holds: `path` is its file, `parent` its node; the list says too that it is there. It stands as the file has it.
    std::optional<InlineOrder> content = {};
};

struct LoadFinished {
    std::uint64_t ticket = 0;
    std::string path;
    Expected<ImportedScene> scene;  ///< of a load beside frames without its list
    LoadParts parts = {};           ///< of a load beside frames
    std::vector<Blob> arrays = {};  ///< that its parts name
    std::optional<InlineOrder> content = {};  ///< of the order
};

/// Owns the import threads. Orders begin in the order in which they came; a file that takes long holds up no other but where kAtOnce of
/// them do, so what was ordered later may be there earlier. `onFinished` is called on threads of the loader's, on several at once. Destruction
/// waits for the imports under way, which have deadlines of their own. What a refused load took of memory is given back.
class Loader {
public:
    /// Each may take the memory of `ImportOptions::maxMemoryBytes`.
    static constexpr std::size_t kAtOnce = 3;

    /// `files`: which may be read; told what those that are read name.
    Loader(ImportOptions options, std::shared_ptr<SceneFiles> files, std::function<void(LoadFinished)> onFinished);
    ~Loader();

    /// False when too many orders wait already.
    bool order(LoadOrder order) { return orders_.tryPush(std::move(order)); }

private:
    /// On a thread of its own, whose memory goes with it.
    void carryOutApart(const LoadOrder& order);
    [[nodiscard]] LoadFinished carryOut(const LoadOrder& order) const;
    [[nodiscard]] Expected<ImportedScene> read(const LoadOrder& order) const;
    [[nodiscard]] Expected<ImportedScene> readContent(const InlineOrder& content) const;

    ImportOptions options_;
    std::shared_ptr<SceneFiles> files_;
    std::function<void(LoadFinished)> onFinished_;
    Channel<LoadOrder> orders_{64};
    std::thread thread_;
};

}  // namespace tessera
