/// What lies in the folders from which applications may load.
#pragma once

#include "common/request/FileRequests.h"
#include "server/import/AssetFolders.h"

namespace tessera {

/// A page of a folder, or of the folders themselves. What is hidden, no ordinary file, or a link that leads out of
/// `where` is left away. kRefused: the folder lies elsewhere, whether there is one or not; kLimit: too much lies there.
/// Takes as long as a folder takes to be read, and the memory of a page.
[[nodiscard]] Expected<answer::FolderPage> listFolder(const FolderWish& wish, const ReadableFolders& where);

/// Of one folder: whoever wants to look through more looks at the disk itself.
inline constexpr std::size_t kMostLookedThrough = 100'000;

}  // namespace tessera
