/// Files whose names others say, opened so that nobody leads astray.
#pragma once

#include <cstdint>
#include <string>

#include "common/base/Error.h"
#include "common/base/FileHandle.h"

namespace tessera {

/// Open for reading; what it is was looked at after it was opened.
struct OrdinaryFile {
    FileHandle handle;
    std::uint64_t bytes = 0;
};

/// Opens exactly the file that a path names, where no part of the path is a link. A caller looks first: it has links
/// resolved (realpath), and decides by the words of the result whether that may be read. Whatever has been swapped
/// since then leads to a refusal, never to another file: openat2's RESOLVE_NO_SYMLINKS, or, where the kernel or a
/// filter of system calls has no openat2, folder by folder from the root with O_NOFOLLOW.
///
/// `path`: absolute, without "." and "..". Never waits for whoever is at the other end of a pipe. kRefused: a link has
/// come to stand on the way; kBadInput: a folder, pipe, device or socket; kNotFound. Messages do not repeat the path.
/// Any thread.
[[nodiscard]] Expected<OrdinaryFile> openOrdinaryFile(const std::string& path);

/// The place itself, a folder or a file, in the same way and not for reading (O_PATH): for rules about it.
[[nodiscard]] Expected<FileHandle> openPlace(const std::string& path);

}  // namespace tessera
