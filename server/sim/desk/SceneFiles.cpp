#include "server/sim/desk/SceneFiles.h"

#include <algorithm>
#include <utility>

namespace tessera {

SceneFiles::SceneFiles(ImportOptions options, std::vector<std::string> allowed, std::vector<std::string> scenes,
                       bool goesOn)
    : options_(std::move(options)),
      allowed_{.folders = std::move(allowed), .assets = options_.assetFolders},
      withScenes_(allowed_),
      goesOn_(goesOn) {
    options_.placing.reset();
    std::ranges::copy(foldersOfScenes(scenes), std::back_inserter(withScenes_.folders));
    State state;
    if (goesOn_) state.unread.assign(scenes.begin(), scenes.end());
    (void)state_.push(std::move(state));
}

Expected<std::string> SceneFiles::ofScene(const std::string& name) {
    Expected<std::string> file = contentFile(name, allowed_);
    if (file || file.error().code != ErrorCode::kRefused) return file;
    State state = *state_.pop();
    const bool named = isNamed(state, name);
    (void)state_.push(std::move(state));
    return named ? contentFile(name, withScenes_) : file;
}

void SceneFiles::add(const std::vector<std::string>& named) {
    State state = *state_.pop();
    note(state, named);
    (void)state_.push(std::move(state));
}

void SceneFiles::note(State& state, const std::vector<std::string>& named) const {
    for (const std::string& name : named) {
        const std::string extension = lowerCaseExtension(name);
        if (state.named.insert(name).second && goesOn_ && (extension == "tsct" || extension == "tsc"))
            state.unread.push_back(name);
    }
}

bool SceneFiles::isNamed(State& state, const std::string& name) const {
    while (!state.named.contains(name) && !state.unread.empty() && state.read < kMostRead) {
        const std::string next = std::exchange(state.unread.front(), {});
        state.unread.pop_front();
        ++state.read;
        if (const Expected<ImportedScene> scene = importScene(next, kRootNode, options_)) note(state, scene->named);
    }
    return state.named.contains(name);
}

}  // namespace tessera
