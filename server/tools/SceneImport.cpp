#include "server/tools/SceneImport.h"

#include <filesystem>

#include "common/base/ShippedFiles.h"
#include "server/tools/TerminalProgress.h"

namespace tessera {

Expected<FileScene> importAsScene(const std::string& path, ImportOptions options) {
    options.watch = progressOnTerminal(path);
    Expected<ImportedScene> imported = importScene(path, kRootNode, options);
    if (!imported) {
        Error error = imported.error();
        std::error_code none;
        if (error.code == ErrorCode::kNotFound && !std::filesystem::exists(path, none))
            error.message += nearestFileHint(path);
        return tl::unexpected(std::move(error));
    }
    // In an aspect of its own the new objects can have any ids.
    const auto real = [](ObjectId id) {
        return isPlaceholder(id) ? ObjectId{id.value - kFirstPlaceholder + kRootNode.value + 1} : id;
    };
    FileScene file{Aspect(), std::move(*imported)};
    replaceIds(file.imported.list, real);
    file.imported.later.replaceIds(real);
    file.imported.top = real(file.imported.top);
    for (ObjectId& top : file.imported.tops) top = real(top);
    if (const Expected<void> applied = file.scene.apply(file.imported.list); !applied)
        return failWith(path, applied.error());
    file.imported.list = {};
    return file;
}

}  // namespace tessera
