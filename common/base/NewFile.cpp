#include "common/base/NewFile.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

namespace tessera {
namespace {

tl::unexpected<Error> failedFile(const std::string& said, std::string_view what) {
    return fail(ErrorCode::kFailed, fmt::format("{}: {}: {}", said, what, std::strerror(errno)));
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
    // Not mkstemp: a new file gets the rights that the user's mask leaves.
    int fd = -1;
    for (int i = 0; fd < 0 && i < 100; ++i) {
        file.temporary_ = fmt::format("{}.{}.{}", place.path, ::getpid(), i);
        fd = ::open(file.temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (fd < 0 && errno != EEXIST) break;
    }
    if (fd < 0) {
        file.temporary_.clear();
        return failedFile(file.said_, "cannot write there");
    }
    file.descriptor_ = fd;
    if (place.mode) ::fchmod(fd, *place.mode);
    return file;
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
    return {};
}

Expected<void> NewFile::takePlace() {
    // Some file systems say only now that there was no room.
    if (::close(std::exchange(descriptor_, -1)) != 0 || ::rename(temporary_.c_str(), path_.c_str()) != 0)
        return failedFile(said_, "cannot write");
    temporary_.clear();
    return {};
}

void NewFile::discard() {
    if (descriptor_ >= 0) ::close(std::exchange(descriptor_, -1));
    if (!temporary_.empty()) ::unlink(temporary_.c_str());
    temporary_.clear();
}

}  // namespace tessera
