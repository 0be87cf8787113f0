/// The scene files of the command line: they are the scene before the first frame.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/base/Log.h"
#include "server/sim/desk/Loader.h"

namespace tessera {

/// Orders the files and collects what comes of them, in their order.
class StartScene {
public:
    explicit StartScene(std::vector<std::string> paths) : paths_(std::move(paths)) {}

    /// Orders carry this ticket.
    [[nodiscard]] Expected<void> order(Loader& loader, std::uint64_t ticket) const;
    /// The lists of all files once the last one has come; nothing before. Fails as a file fails.
    [[nodiscard]] Expected<std::optional<std::vector<ChangeList>>> take(LoadFinished finished, Log& log);
    [[nodiscard]] bool empty() const { return paths_.empty(); }

private:
    std::vector<std::string> paths_;
    std::vector<ChangeList> lists_;
};

}  // namespace tessera
