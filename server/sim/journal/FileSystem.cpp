#include "server/sim/journal/FileSystem.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <fstream>

#include "server/sim/recording/RecordBytes.h"

namespace tessera {
namespace {

int errorOf(int result) {
    return result == 0 ? 0 : errno;
}

}  // namespace

int FileSystem::create(const std::string& path, int& file) {
    // O_APPEND: what failed is cut off, and the next try begins where the file then ends.
    file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_APPEND | O_CLOEXEC | O_NOFOLLOW, 0600);
    return file < 0 ? errno : 0;
}

int FileSystem::open(const std::string& path, int& file) {
    file = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
    return file < 0 ? errno : 0;
}

int FileSystem::append(int file, ByteSpan first, ByteSpan second) {
    return writeAll(file, first, second);
}

int FileSystem::overwrite(int file, ByteSpan bytes) {
    for (std::size_t done = 0; done < bytes.size();) {
        const ssize_t now = ::pwrite(file, bytes.data() + done, bytes.size() - done, static_cast<off_t>(done));
        if (now < 0 && errno != EINTR) return errno;
        done += static_cast<std::size_t>(std::max<ssize_t>(now, 0));
    }
    return 0;
}

int FileSystem::truncate(int file, std::uint64_t bytes) {
    return errorOf(::ftruncate(file, static_cast<off_t>(bytes)));
}

int FileSystem::sync(int file) {
    return errorOf(::fdatasync(file));
}

int FileSystem::syncFolder(const std::string& path) {
    const int folder = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (folder < 0) return errno;
    const int error = errorOf(::fsync(folder));
    ::close(folder);
    return error;
}

int FileSystem::rename(const std::string& from, const std::string& to) {
    return errorOf(std::rename(from.c_str(), to.c_str()));
}

int FileSystem::remove(const std::string& path) {
    return errorOf(::unlink(path.c_str()));
}

void FileSystem::close(int file) {
    ::close(file);
}

std::string FileSystem::boot() const {
    static const std::string boot = [] {
        std::string name;
        std::getline(std::ifstream("/proc/sys/kernel/random/boot_id"), name);
        return name;
    }();
    return boot;
}

bool standsFor(const std::string& path, int file, std::uint64_t leastBytes) {
    struct stat named = {}, open = {};
    if (::fstat(file, &open) != 0) return true;
    if (::stat(path.c_str(), &named) != 0) return errno != ENOENT && errno != ENOTDIR;
    return named.st_dev == open.st_dev && named.st_ino == open.st_ino &&
           static_cast<std::uint64_t>(open.st_size) >= leastBytes;
}

}  // namespace tessera
