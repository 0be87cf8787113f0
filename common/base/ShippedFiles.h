/// Files that come with the programs: walls and scenes that are known by their names.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/Error.h"

namespace tessera {

/// Folders of shipped files of one kind ("walls", "scenes"), as seen from a program: beside a build, installed, in the
/// sources. Not all of them exist.
[[nodiscard]] std::vector<std::string> shippedFolders(const std::string& kind, const std::string& executablePath);

/// A name without a slash is first looked for as NAME + `extension` in `folders`, then as a file here; anything else is
/// a path. kNotFound: neither is there. The nearest name and all others are listed; `what` ("wall") says of what.
[[nodiscard]] Expected<std::string> resolveShipped(std::string_view what, const std::string& nameOrPath,
                                                   std::span<const std::string> folders, std::string_view extension);

/// " (did you mean "a/hall.tsct"?)" of a path where nothing is: the nearest name in its folder; empty where none is
/// near. Only for what people say at their own machine: it tells names.
[[nodiscard]] std::string nearestFileHint(const std::string& path);

/// resolveShipped for scenes (`NAME.tsct`) and a program's folders. Names with a dot or a slash come back as they are,
/// as importers take assets and other places too, and say themselves that nothing is there. kNotFound also where
/// nothing is at a path, and a file of nearly that name is beside.
[[nodiscard]] Expected<std::string> findScene(const std::string& nameOrPath, const std::string& executablePath);

}  // namespace tessera
