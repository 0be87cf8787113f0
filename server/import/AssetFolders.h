/// Leads from names in files to files on disk, and lets no name lead anywhere else. The files are looked at here, not
/// opened. They are opened later, as paths without links (common/confine/OrdinaryFile.h). So a file that is swapped in
/// between leads nowhere else either.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/Error.h"

namespace tessera {

/// What the name of an asset begins with.
inline constexpr std::string_view kAssetScheme = "asset://";

/// The absolute path without symbolic links of an ordinary file: no folder, pipe or device. The file has at most
/// `maxBytes`. Messages do not repeat the path.
[[nodiscard]] Expected<std::string> ordinaryFile(const std::string& path, std::size_t maxBytes);

/// The file of `asset://NAME` in the first folder that has it. NAME must stay within the folder once symbolic links are
/// followed. kNotFound names the folders searched, and the package with Debian's models.
[[nodiscard]] Expected<std::string> findAsset(std::string_view name, std::span<const std::string> folders);

/// The file `name` in `folder` or below it, once symbolic links are followed.
[[nodiscard]] Expected<std::string> findBeside(std::string_view name, const std::string& folder);

/// Where an application may have the server read: a file below one of `folders`, or an asset.
struct ReadableFolders {
    std::vector<std::string> folders;  ///< of the server's --allow
    std::vector<std::string> assets;   ///< of its --assets
};
/// The file that an application asks for by `path`. The result has no "..", and no symbolic links as far as the path is
/// there. `asset://NAME` stays as it is. kRefused: `path` leads elsewhere, whether there is such a file or not. The
/// message names the option.
[[nodiscard]] Expected<std::string> readableFile(const std::string& path, const ReadableFolders& where);
/// The folder that an application asks for by `path`: one of `where` or a folder below one. Its form is that of
/// `readableFile`. `asset://NAME` may be several folders. Where several have a file, that of the first is meant. None:
/// no asset folder has it.
[[nodiscard]] Expected<std::vector<std::string>> readableFolder(const std::string& path, const ReadableFolders& where);

/// The file itself that a running scene loads by a name. `name` is a whole path, through links, "." and ".." too, or
/// `asset://NAME`.
[[nodiscard]] Expected<std::string> contentFile(const std::string& name, const ReadableFolders& where);
/// The folders of the scenes that are no assets. Files that these scenes name beside them may be read too. Never the
/// root folder.
[[nodiscard]] std::vector<std::string> foldersOfScenes(const std::vector<std::string>& scenes);
/// The whole path of a name in a scene file in `folder`, whether there is such a file or not. The reader looks for the
/// file, and follows links then.
[[nodiscard]] Expected<std::string> pathBeside(const std::string& name, const std::string& folder);

/// The folder part of an absolute path.
[[nodiscard]] std::string folderOf(const std::string& path);
/// "engine" of "/models/engine.glb".
[[nodiscard]] std::string stemOf(const std::string& path);
/// "glb" of "/models/engine.GLB"; empty where there is none.
[[nodiscard]] std::string lowerCaseExtension(const std::string& path);

}  // namespace tessera
