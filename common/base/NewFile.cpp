#include "common/base/NewFile.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/sendfile.h>
#include <sys/stat.h>
#include <sys/xattr.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace tessera {
namespace {

tl::unexpected<Error> failedFile(const std::string& said, std::string_view what) {
    return fail(ErrorCode::kFailed, fmt::format("{}: {}: {}", said, what, std::strerror(errno)));
}

/// Of a new file, before the user's mask.
constexpr mode_t kMostRights = 0666;

/// By which a file without a name gets one.
std::string handleName(int descriptor) {
    return fmt::format("/proc/self/fd/{}", descriptor);
}

/// Of this process, asked without changing it, as threads share it. Nothing: /proc does not say it.
std::optional<mode_t> currentMask() {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);)
        if (line.starts_with("Umask:"))
            return static_cast<mode_t>(std::strtoul(line.c_str() + std::strlen("Umask:"), nullptr, 8));
    return std::nullopt;
}

/// Linux before 6.0 forgets the mask for files without names where a file system has no access control lists. In a
/// folder with a default list that counts in place of the mask.
void applyMask(int descriptor, const char* folder) {
    struct stat info {};
    if (::fstat(descriptor, &info) != 0 || (info.st_mode & 0777) != kMostRights) return;
    if (::getxattr(folder, "system.posix_acl_default", nullptr, 0) >= 0) return;
    if (const std::optional<mode_t> mask = currentMask(); mask && (*mask & kMostRights) != 0)
        ::fchmod(descriptor, kMostRights & ~*mask);
}

/// A file without a name beside the place: it goes with its process, however that ends. Below 0: not to be had here.
int openNameless(const FilePlace& place) {
    std::string folder = std::filesystem::path(place.path).parent_path().string();
    if (folder.empty()) folder = ".";
    const int fd = ::open(folder.c_str(), O_RDWR | O_TMPFILE | O_CLOEXEC, kMostRights);
    if (fd >= 0) applyMask(fd, folder.c_str());
    if (fd < 0 || ::access(handleName(fd).c_str(), F_OK) == 0) return fd;
    ::close(fd);
    return -1;
}

}  // namespace

Expected<FilePlace> placeOfFile(const std::string& path) {
    FilePlace place{.path = path, .mode = {}};
    struct stat there {};
    std::error_code unknown;
    if (::stat(path.c_str(), &there) != 0) {
        // A link to what is not there yet: the file is made where it leads.
        constexpr int kMostLinks = 40;  // as many as the kernel follows
        for (int i = 0; i < kMostLinks && std::filesystem::is_symlink(place.path, unknown); ++i) {
            const std::filesystem::path link(place.path), to = std::filesystem::read_symlink(link, unknown);
            if (unknown) break;
            place.path = (link.parent_path() / to).string();
        }
        if (std::filesystem::is_symlink(place.path, unknown))
            return fail(ErrorCode::kFailed, fmt::format("{}: cannot write there: links lead in a circle", path));
        return place;
    }
    if (!S_ISREG(there.st_mode)) return fail(ErrorCode::kFailed, fmt::format("{}: {}", path, kNoFilePlace));
    place.mode = there.st_mode & 07777;
    if (std::filesystem::is_symlink(path, unknown))
        if (const std::filesystem::path real = std::filesystem::canonical(path, unknown); !unknown)
            place.path = real.string();
    return place;
}

Expected<FilePlace> placeBeside(const FilePlace& main, const std::string& path) {
    struct stat there {};
    if (::lstat(path.c_str(), &there) == 0 && !S_ISREG(there.st_mode) && !S_ISLNK(there.st_mode))
        return fail(ErrorCode::kFailed, fmt::format("{}: {}", path, kNoFilePlace));
    return FilePlace{.path = path, .mode = main.mode};
}

std::string targetOfLink(const std::string& path) {
    std::error_code unknown;
    if (!std::filesystem::is_symlink(path, unknown)) return {};
    const std::filesystem::path target = std::filesystem::weakly_canonical(path, unknown);
    return unknown ? std::string() : target.string();
}

Expected<NewFile> NewFile::beside(const FilePlace& place, std::string said) {
    NewFile file;
    file.said_ = std::move(said);
    file.path_ = place.path;
    // Else only the rename would say so, when other files of the same save have taken their places.
    struct stat there {};
    if (::lstat(place.path.c_str(), &there) != 0 && errno == ENAMETOOLONG)
        return failedFile(file.said_, "cannot write there");
    file.descriptor_ = openNameless(place);
    if (file.descriptor_ < 0 && !file.openNamed()) return failedFile(file.said_, "cannot write there");
    if (place.mode) ::fchmod(file.descriptor_, *place.mode);
    return file;
}

bool NewFile::openNamed() {
    // Not mkstemp: a new file gets the rights that the user's mask leaves.
    return takeName([this](const char* name) {
        descriptor_ = ::open(name, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, kMostRights);
        return descriptor_ >= 0;
    });
}

template <typename Take>
bool NewFile::takeName(Take take) {
    // Counted on: many files of one save have names at once. The target's name is no part of it: together they might be
    // too long.
    static std::atomic<unsigned> next = 0;
    for (int i = 0; i < 100; ++i) {
        const std::string name = fmt::format(".tessera.{}.{}", ::getpid(), next++);
        temporary_ = (std::filesystem::path(path_).parent_path() / name).string();
        if (take(temporary_.c_str())) return true;
        if (errno != EEXIST) break;
    }
    temporary_.clear();
    return false;
}

Expected<void> NewFile::write(std::string_view bytes) {
    while (!bytes.empty()) {
        const ssize_t done = ::write(descriptor_, bytes.data(), bytes.size());
        if (done > 0)
            bytes.remove_prefix(static_cast<std::size_t>(done));
        else if (done < 0 && errno != EINTR)
            return failedFile(said_, "cannot write");
    }
    return {};
}

Expected<void> NewFile::sync() {
    if (::fdatasync(descriptor_) != 0) return failedFile(said_, "cannot write");
    isOnDisk_ = true;
    return {};
}

Expected<void> NewFile::giveName() {
    if (descriptor_ < 0) return {};
    if (temporary_.empty())
        if (Expected<void> linked = linkOrCopy(); !linked) {
            discard();  // a part of a copy must not take the place
            return linked;
        }
    // Some file systems say only now that there was no room.
    if (::close(std::exchange(descriptor_, -1)) != 0) return failedFile(said_, "cannot write");
    return {};
}

/// A link cannot replace a file, and a rename can: so it gets a name of its own first.
Expected<void> NewFile::linkOrCopy() {
    const std::string handle = handleName(descriptor_);
    const auto link = [&](const char* name) {
        return ::linkat(AT_FDCWD, handle.c_str(), AT_FDCWD, name, AT_SYMLINK_FOLLOW) == 0;
    };
    // A log of changes, as btrfs keeps one, may pass over files without links.
    if (takeName(link)) return isOnDisk_ ? sync() : Expected<void>();
    // Some file systems have files without names, and no links.
    const int nameless = std::exchange(descriptor_, -1);
    Expected<void> copied = copyOf(nameless);
    ::close(nameless);
    return copied;
}

Expected<void> NewFile::copyOf(int file) {
    struct stat info {};
    if (!openNamed() || ::fstat(file, &info) != 0) return failedFile(said_, "cannot write there");
    ::fchmod(descriptor_, info.st_mode & 07777);
    off_t at = 0;
    while (at < info.st_size) {
        errno = 0;
        if (::sendfile(descriptor_, file, &at, static_cast<std::size_t>(info.st_size - at)) <= 0 && errno != EINTR)
            return failedFile(said_, "cannot write");
    }
    return isOnDisk_ ? sync() : Expected<void>();
}

Expected<void> NewFile::takePlace() {
    if (Expected<void> named = giveName(); !named) return named;
    if (::rename(temporary_.c_str(), path_.c_str()) != 0) return failedFile(said_, "cannot write");
    temporary_.clear();
    return {};
}

void NewFile::discard() {
    if (descriptor_ >= 0) ::close(std::exchange(descriptor_, -1));
    if (!temporary_.empty()) ::unlink(temporary_.c_str());
    temporary_.clear();
}

}  // namespace tessera
