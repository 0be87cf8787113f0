#include "server/sim/StartScene.h"

namespace tessera {

Expected<void> StartScene::order(Loader& loader, std::uint64_t ticket) const {
    for (const std::string& path : paths_)
        if (!loader.order({.ticket = ticket, .path = path, .parent = kRootNode, .asked = false}))
            return fail(ErrorCode::kUsage, "too many --scene options");
    return {};
}

Expected<std::optional<std::vector<ChangeList>>> StartScene::take(LoadFinished finished, Log& log) {
    if (!finished.scene) return tl::unexpected(finished.scene.error());
    for (const std::string& note : finished.scene->notes) log.info(note.starts_with(finished.path) ? note : finished.path + ": " + note);
    lists_.push_back(std::move(finished.scene->list));
    if (lists_.size() < paths_.size()) return std::nullopt;
    return std::exchange(lists_, {});
}

}  // namespace tessera
