/// Names in files to files on disk, without letting a name lead anywhere else. What is found here is looked at, not opened: it is opened as a path without
/// links (common/confine/OrdinaryFile.h), so that what is swapped since leads nowhere else either.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/Error.h"

namespace tessera {

/// What the name of an asset begins with.
inline constexpr std::string_view kAssetScheme = "asset://";

/// An absolute path without symbolic links, and sure to be an ordinary file (no folder, pipe or device) of at most
/// `maxBytes`. Messages do not repeat the path.
[[nodiscard]] Expected<std::string> ordinaryFile(const std::string& path, std::size_t maxBytes);

/// The file of `asset://NAME` in the first folder that has it. NAME must stay within the folder, symbolic links
/// followed. kNotFound says where it was looked for and which package has Debian's models.
[[nodiscard]] Expected<std::string> findAsset(std::string_view name, std::span<const std::string> folders);

/// The file `name` in `folder` or below it, symbolic links followed.
[[nodiscard]] Expected<std::string> findBeside(std::string_view name, const std::string& folder);

/// Where an application may have the server read: a file below one of `folders`, or an asset.
struct ReadableFolders {
    std::vector<std::string> folders;  ///< of the server's --allow
    std::vector<std::string> assets;   ///< of its --assets
};
/// The file that an application asks for by `path`, without "..", and without symbolic links as far as it is there;
/// `asset://NAME` as it is. kRefused where it lies elsewhere, whether there is such a file or not; names the option.
[[nodiscard]] Expected<std::string> readableFile(const std::string& path, const ReadableFolders& where);
/// The folder that an application asks for by `path`, itself one of `where` or below one, as `readableFile` has it.
/// `asset://NAME` may be several: what the first has is meant. None: no asset folder has it.
[[nodiscard]] Expected<std::vector<std::string>> readableFolder(const std::string& path, const ReadableFolders& where);

/// The file itself of what is loaded into a running scene by a name that the scene says, whatever it is called: through links, "." and "..", or as an asset. A whole
/// path, or `asset://NAME`.
[[nodiscard]] Expected<std::string> contentFile(const std::string& name, const ReadableFolders& where);
/// The folders of the scenes that are no assets: what they name beside them may be read too. Never the root folder.
[[nodiscard]] std::vector<std::string> foldersOfScenes(const std::vector<std::string>& scenes);
/// The whole path of a name in a scene file in `folder`, whether there is such a file or not: whoever reads it looks, and where links lead is looked at then.
[[nodiscard]] Expected<std::string> pathBeside(const std::string& name, const std::string& folder);

/// The folder part of an absolute path.
[[nodiscard]] std::string folderOf(const std::string& path);
/// "engine" of "/models/engine.glb".
[[nodiscard]] std::string stemOf(const std::string& path);
/// "glb" of "/models/engine.GLB"; empty where there is none.
[[nodiscard]] std::string lowerCaseExtension(const std::string& path);

}  // namespace tessera
