/// Imports files off the frame thread, one after the other.
#pragma once

#include <functional>
#include <string>
#include <thread>

#include "common/base/Channel.h"
#include "common/base/Error.h"
#include "server/import/Importer.h"

namespace tessera {

struct LoadOrder {
    std::uint64_t ticket = 0;
    std::string path;
    ObjectId parent;
};

struct LoadFinished {
    std::uint64_t ticket = 0;
    std::string path;
    Expected<ImportedScene> scene;
};

/// Owns the import thread. `onFinished` is called on it. Destruction waits for the import under way, which has a
/// deadline of its own.
class Loader {
public:
    Loader(ImportOptions options, std::function<void(LoadFinished)> onFinished);
    ~Loader();

    /// False when too many orders wait already.
    bool order(LoadOrder order) { return orders_.tryPush(std::move(order)); }

private:
    ImportOptions options_;
    std::function<void(LoadFinished)> onFinished_;
    Channel<LoadOrder> orders_{64};
    std::thread thread_;
};

}  // namespace tessera
