#include "server/sim/journal/FileSystem.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>

#include "server/sim/recording/RecordBytes.h"

namespace tessera {
namespace {

int errorOf(int result) {
    return result == 0 ? 0 : errno;
}

}  // namespace

int FileSystem::create(const std::string& path, int& file) {
    // O_APPEND: what failed is cut off, and the next try begins where the file then ends.
    file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_APPEND | O_CLOEXEC, 0600);
    return file < 0 ? errno : 0;
}

int FileSystem::open(const std::string& path, int& file) {
    file = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
    return file < 0 ? errno : 0;
}

int FileSystem::append(int file, ByteSpan first, ByteSpan second) {
    return writeAll(file, first, second);
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

}  // namespace tessera
