#include "server/sim/desk/FilmFiles.h"

#include <utility>

#include "common/confine/OrdinaryFile.h"

namespace tessera {

Movies::Opener filmOpener(std::shared_ptr<SceneFiles> files) {
    return [files = std::move(files)](const std::string& name) -> Expected<FileHandle> {
        const Expected<std::string> path = files->ofScene(name);
        if (!path) return tl::unexpected(path.error());
        Expected<OrdinaryFile> film = openOrdinaryFile(*path);
        if (!film) return failWith(name, film.error());
        return std::move(film->handle);
    };
}

}  // namespace tessera
