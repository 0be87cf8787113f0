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

/// resolveShipped for scenes (`NAME.tsct`) and a program's folders. Names with a dot or a slash come back as they are,
/// as importers take assets and other places too, and say themselves that nothing is there.
[[nodiscard]] Expected<std::string> findScene(const std::string& nameOrPath, const std::string& executablePath);

}  // namespace tessera
