#include "server/import/AssetFolders.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>

#include "common/base/LowerCase.h"
#include "server/import/LoadedFile.h"

namespace tessera {
namespace {

std::optional<std::string> canonicalPath(const std::string& path) {
    const std::unique_ptr<char, decltype(&std::free)> resolved(::realpath(path.c_str(), nullptr), &std::free);
    if (!resolved) return std::nullopt;
    return std::string(resolved.get());
}

/// Relative, and no step of it leads upwards. What symbolic links do is checked on the result.
bool staysBelow(std::string_view name) {
    if (name.empty() || name.front() == '/' || name.find('\0') != std::string_view::npos) return false;
    const std::filesystem::path path(name);
    return std::none_of(path.begin(), path.end(), [](const auto& step) { return step == ".."; });
}

bool isBelow(const std::string& path, const std::string& folder) {
    const std::string prefix = folder == "/" ? folder : folder + "/";
    return path.size() > prefix.size() && path.compare(0, prefix.size(), prefix) == 0;
}

}  // namespace

Expected<std::string> ordinaryFile(const std::string& path, std::size_t maxBytes) {
    const std::optional<std::string> resolved = canonicalPath(path);
    if (!resolved) {
        const int reason = errno;
        return fail(reason == ENOENT || reason == ENOTDIR ? ErrorCode::kNotFound : ErrorCode::kBadInput,
                    reason == ENOENT ? "there is no such file" : std::strerror(reason));
    }
    struct stat info {};
    if (::stat(resolved->c_str(), &info) != 0) return fail(ErrorCode::kBadInput, std::strerror(errno));
    if (S_ISDIR(info.st_mode)) return fail(ErrorCode::kBadInput, "this is a folder; name a file in it");
    if (!S_ISREG(info.st_mode))
        return fail(ErrorCode::kBadInput, "this is a device, pipe or socket, not an ordinary file");
    if (info.st_size == 0) return fail(ErrorCode::kBadInput, "the file is empty");
    if (static_cast<std::uint64_t>(info.st_size) > maxBytes)
        return fail(ErrorCode::kLimit, fmt::format("the file is larger than {} MiB", maxBytes >> 20));
    return *resolved;
}

Expected<std::string> findAsset(std::string_view name, std::span<const std::string> folders) {
    if (!staysBelow(name))
        return fail(ErrorCode::kRefused, fmt::format("asset '{}' leads out of the asset folders", name));
    for (const std::string& folder : folders) {
        const std::optional<std::string> root = canonicalPath(folder);
        if (!root) continue;
        const std::optional<std::string> found = canonicalPath(*root + "/" + std::string(name));
        if (!found) continue;
        if (!isBelow(*found, *root))
            return fail(ErrorCode::kRefused, fmt::format("asset '{}' is a link that leads out of {}", name, folder));
        return *found;
    }
    const std::string searched =
        folders.empty() ? "no asset folder was named" : fmt::format("looked in {}", fmt::join(folders, ", "));
    return fail(
        ErrorCode::kNotFound,
        fmt::format("there is no asset '{}' ({}); name its folder with --assets, or, for the models that Debian "
                    "packages, install assimp-testmodels",
                    name, searched));
}

Expected<std::string> findBeside(std::string_view name, const std::string& folder) {
    if (!staysBelow(name))
        return fail(ErrorCode::kRefused, fmt::format("'{}' leads out of the file's own folder", name));
    const std::optional<std::string> found = canonicalPath(folder + "/" + std::string(name));
    if (!found) return fail(ErrorCode::kNotFound, fmt::format("there is no file '{}' in {}", name, folder));
    if (!isBelow(*found, folder))
        return fail(ErrorCode::kRefused, fmt::format("'{}' is a link that leads out of {}", name, folder));
    return *found;
}

namespace {

/// `orItself`: one of the folders too, and not only what lies below.
Expected<std::string> readable(const std::string& path, const ReadableFolders& where, bool orItself) {
    const auto refuse = [&] {
        return fail(ErrorCode::kRefused,
                    fmt::format("{}: the server may not read this file for an application; {}; start it with --allow "
                                "FOLDER for another",
                                path,
                                where.folders.empty() ? std::string("it may read assets alone")
                                                      : fmt::format("it may read assets, and what lies below {}",
                                                                    fmt::join(where.folders, ", "))));
    };
    if (path.empty() || path.find('\0') != std::string::npos) return refuse();
    // A file that is not there is looked for all the same: what is refused must not tell what there is.
    std::error_code error;
    const std::filesystem::path resolved = std::filesystem::weakly_canonical(path, error);
    if (error || !resolved.is_absolute()) return refuse();
    for (const std::vector<std::string>* folders : {&where.folders, &where.assets})
        for (const std::string& folder : *folders)
            if (const auto root = canonicalPath(folder);
                root && (isBelow(resolved.string(), *root) || (orItself && resolved == *root)))
                return resolved.string();
    return refuse();
}

}  // namespace

Expected<std::string> readableFile(const std::string& path, const ReadableFolders& where) {
    if (path.starts_with(kAssetScheme)) return path;
    return readable(path, where, false);
}

Expected<std::vector<std::string>> readableFolder(const std::string& path, const ReadableFolders& where) {
    std::vector<std::string> folders;
    if (!path.starts_with(kAssetScheme)) {
        // Its names end without a slash.
        const std::string name = path.substr(0, path.find_last_not_of('/') + 1);
        Expected<std::string> folder = readable(name.empty() ? path : name, where, true);
        if (!folder) return tl::unexpected(folder.error());
        folders.push_back(std::move(*folder));
        return folders;
    }
    const std::string name = path.substr(kAssetScheme.size());
    if (!name.empty() && !staysBelow(name))
        return fail(ErrorCode::kRefused, fmt::format("'{}' leads out of the asset folders", path));
    for (const std::string& folder : where.assets) {
        const std::optional<std::string> root = canonicalPath(folder);
        const std::optional<std::string> found = root ? canonicalPath(*root + "/" + name) : std::nullopt;
        if (found && (*found == *root || isBelow(*found, *root))) folders.push_back(*found);
    }
    return folders;
}

Expected<std::string> contentFile(const std::string& name, const ReadableFolders& where) {
    if (name.starts_with(kAssetScheme))
        return findAsset(std::string_view(name).substr(kAssetScheme.size()), where.assets);
    if (!name.starts_with('/'))
        return fail(ErrorCode::kBadInput, name + ": an edit names a file by its whole path, or as asset://NAME");
    return readableFile(name, where);
}

std::vector<std::string> foldersOfScenes(const std::vector<std::string>& scenes) {
    std::vector<std::string> folders;
    for (const std::string& scene : scenes) {
        if (scene.starts_with(kAssetScheme)) continue;
        std::error_code error;
        const std::filesystem::path path = std::filesystem::weakly_canonical(scene, error);
        // Beside a file in the root folder would be the whole system.
        if (!error && path.is_absolute() && path.has_relative_path() && path.parent_path() != path.root_path())
            folders.push_back(path.parent_path().string());
    }
    return folders;
}

Expected<std::string> pathBeside(const std::string& name, const std::string& folder) {
    if (name.starts_with(kAssetScheme)) return name;
    const std::filesystem::path said(name);
    if (name.find('\0') != std::string::npos || said.is_absolute() ||
        std::ranges::find(said, std::filesystem::path("..")) != said.end())
        return fail(ErrorCode::kBadInput,
                    fmt::format("'{}' is not in the scene file's own folder or below", readName(name, "")));
    return (std::filesystem::path(folder) / said).lexically_normal().string();
}

std::string folderOf(const std::string& path) {
    const std::size_t slash = path.rfind('/');
    return slash == 0 || slash == std::string::npos ? "/" : path.substr(0, slash);
}

std::string stemOf(const std::string& path) {
    return std::filesystem::path(path).stem().string();
}

std::string lowerCaseExtension(const std::string& path) {
    std::string extension = lowerCase(std::filesystem::path(path).extension().string());
    if (!extension.empty()) extension.erase(0, 1);
    return extension;
}

}  // namespace tessera
