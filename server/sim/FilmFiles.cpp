#include "server/sim/FilmFiles.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "server/import/AssetFolders.h"

namespace tessera {

Movies::Opener filmOpener(std::vector<std::string> allowed, std::vector<std::string> assets, std::vector<std::string> scenes) {
    return [where = ReadableFolders{.folders = std::move(allowed), .assets = std::move(assets)}, scenes = std::move(scenes)](const std::string& name) -> Expected<FileHandle> {
        ReadableFolders all = where;
        for (std::string& folder : foldersOfScenes(scenes)) all.folders.push_back(std::move(folder));
        const Expected<std::string> path = contentFile(name, all);
        if (!path) return tl::unexpected(path.error());
        // What was no link a moment ago may be one now. A pipe would be waited for.
        FileHandle file(::open(path->c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
        struct stat about {};
        if (file.get() < 0 || ::fstat(file.get(), &about) != 0) return fail(ErrorCode::kNotFound, fmt::format("{}: {}", name, std::strerror(errno)));
        if (!S_ISREG(about.st_mode)) return fail(ErrorCode::kBadInput, name + ": not an ordinary file");
        return file;
    };
}

}  // namespace tessera
