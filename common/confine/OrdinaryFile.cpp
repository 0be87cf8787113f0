#include "common/confine/OrdinaryFile.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/openat2.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <utility>

#include "common/base/Shortage.h"

namespace tessera {
namespace {

tl::unexpected<Error> notOpened(int reason) {
    noteFailedCall(reason);
    if (reason == ELOOP) return fail(ErrorCode::kRefused, "was replaced by a link while it was looked for");
    return fail(reason == ENOENT || reason == ENOTDIR ? ErrorCode::kNotFound : ErrorCode::kBadInput,
                fmt::format("cannot be opened ({})", std::strerror(reason)));
}

/// Folder by folder, each held while the next is opened in it: what is renamed meanwhile leads nowhere else.
Expected<FileHandle> openByFolders(std::string_view path, int flags) {
    FileHandle at(::open("/", O_PATH | O_DIRECTORY | O_CLOEXEC));
    if (at.get() < 0) return notOpened(errno);
    for (std::size_t begin = 1;;) {
        const std::size_t slash = path.find('/', begin);
        const bool last = slash == path.npos;
        const std::string part(path.substr(begin, last ? path.npos : slash - begin));
        FileHandle next(
            ::openat(at.get(), part.c_str(), O_NOFOLLOW | O_CLOEXEC | (last ? flags : O_PATH | O_DIRECTORY)));
        if (next.get() < 0) {
            const int reason = errno;
            struct stat there {};
            // Of a link that has to be a folder the kernel says that it is none.
            const bool link = reason == ENOTDIR &&
                              ::fstatat(at.get(), part.c_str(), &there, AT_SYMLINK_NOFOLLOW) == 0 &&
                              S_ISLNK(there.st_mode);
            return notOpened(link ? ELOOP : reason);
        }
        if (last) {
            // Of a place alone the link itself was opened.
            struct stat there {};
            if ((flags & O_PATH) != 0 && ::fstat(next.get(), &there) == 0 && S_ISLNK(there.st_mode))
                return notOpened(ELOOP);
            return next;
        }
        at = std::move(next);
        begin = slash + 1;
    }
}

/// Whole parts, none of which leads upwards or nowhere.
bool isPlain(std::string_view path) {
    if (path.size() < 2 || path.front() != '/' || path.find('\0') != path.npos) return false;
    for (std::size_t begin = 1; begin <= path.size();) {
        const std::size_t end = std::min(path.find('/', begin), path.size());
        const std::string_view part = path.substr(begin, end - begin);
        if (part.empty() || part == "." || part == "..") return false;
        begin = end + 1;
    }
    return true;
}

Expected<FileHandle> openWithoutLinks(const std::string& path, int flags) {
    if (!isPlain(path)) return fail(ErrorCode::kRefused, "is no whole path without links");
    open_how how{};
    how.flags = static_cast<std::uint64_t>(flags | O_CLOEXEC);
    how.resolve = RESOLVE_NO_SYMLINKS | RESOLVE_NO_MAGICLINKS;
    FileHandle file(static_cast<int>(::syscall(SYS_openat2, AT_FDCWD, path.c_str(), &how, sizeof how)));
    if (file.get() >= 0) return file;
    if (errno == ENOSYS || errno == EPERM || errno == EAGAIN) return openByFolders(path, flags);
    return notOpened(errno);
}

}  // namespace

Expected<OrdinaryFile> openOrdinaryFile(const std::string& path) {
    const auto ordinary = [](const FileHandle& file, struct stat& about) {
        return ::fstat(file.get(), &about) == 0 && S_ISREG(about.st_mode);
    };
    const Error other{ErrorCode::kBadInput, "is not an ordinary file"};
    struct stat about {};
    // First the place alone: to open a device or a pipe does something with it. What has come to its place since is
    // open a moment, and not read.
    const Expected<FileHandle> place = openWithoutLinks(path, O_PATH);
    if (!place) return tl::unexpected(place.error());
    if (!ordinary(*place, about)) return tl::unexpected(other);
    Expected<FileHandle> file = openWithoutLinks(path, O_RDONLY | O_NONBLOCK | O_NOCTTY);
    if (!file) return tl::unexpected(file.error());
    if (!ordinary(*file, about)) return tl::unexpected(other);
    return OrdinaryFile{std::move(*file), static_cast<std::uint64_t>(about.st_size)};
}

Expected<FileHandle> openPlace(const std::string& path) {
    return openWithoutLinks(path, O_PATH);
}

}  // namespace tessera
