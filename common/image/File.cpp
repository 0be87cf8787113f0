#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string>

#include "common/image/Picture.h"

namespace tessera {
namespace {

tl::unexpected<Error> failedSystemCall(const std::string& path, const char* what) {
    const int error = errno;
    return fail(error == ENOENT || error == ENOTDIR ? ErrorCode::kNotFound : ErrorCode::kFailed,
                path + ": " + what + ": " + std::strerror(error));
}

bool writeAll(int fd, ByteSpan bytes) {
    while (!bytes.empty()) {
        const ssize_t n = ::write(fd, bytes.data(), bytes.size());
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) return false;
        bytes = bytes.subspan(static_cast<std::size_t>(n));
    }
    return true;
}

}  // namespace

Expected<void> writeFile(const std::string& said, ByteSpan bytes) {
    std::error_code ignored;  // a folder that is missing afterwards shows as an error of open
    // A link leads to the file: /dev/stdout does.
    std::string path = said;
    if (std::filesystem::is_symlink(said, ignored)) {
        std::filesystem::path led = std::filesystem::canonical(said, ignored);
        if (ignored)  // to what is not there yet
            led = std::filesystem::path(said).parent_path() / std::filesystem::read_symlink(said, ignored);
        if (!ignored) path = led.string();
    }
    // What takes a device's name takes its place: root could lay a picture where /dev/null is.
    struct stat there {};
    if (::stat(path.c_str(), &there) == 0 && !S_ISREG(there.st_mode))
        return fail(ErrorCode::kFailed, path + ": cannot write there: this is a folder, device, pipe or socket");
    std::filesystem::create_directories(std::filesystem::path(path).parent_path(), ignored);
    // Not mkstemp: it has the rights that the user's mask leaves.
    std::string temporary;
    int fd = -1;
    static std::atomic<unsigned> next{0};
    for (int i = 0; fd < 0 && i < 100; ++i) {
        temporary = path + '.' + std::to_string(::getpid()) + '.' + std::to_string(next++);
        fd = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (fd < 0 && errno != EEXIST) break;
    }
    if (fd < 0) return failedSystemCall(path, "cannot write there");
    const bool written = writeAll(fd, bytes);
    const int writeError = errno;
    if (::close(fd) != 0 || !written || ::rename(temporary.c_str(), path.c_str()) != 0) {
        if (!written) errno = writeError;
        auto error = failedSystemCall(path, "cannot write");
        ::unlink(temporary.c_str());
        return error;
    }
    return {};
}

Expected<Bytes> readFile(const std::string& path, std::size_t maxBytes) {
    const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (fd < 0) return failedSystemCall(path, "cannot read");
    struct stat status {};
    if (::fstat(fd, &status) == 0 && S_ISDIR(status.st_mode)) {
        ::close(fd);
        return fail(ErrorCode::kBadInput, path + ": this is a folder, a file is wanted");
    }
    // The size is not believed: a pipe has none, and a file may grow.
    Bytes bytes;
    std::size_t filled = 0;
    while (true) {
        if (filled == bytes.size()) bytes.resize(std::max<std::size_t>(64 * 1024, 2 * bytes.size()));
        const ssize_t n = ::read(fd, bytes.data() + filled, bytes.size() - filled);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) {
            auto error = failedSystemCall(path, "cannot read");
            ::close(fd);
            return error;
        }
        if (n == 0) break;
        filled += static_cast<std::size_t>(n);
        if (filled > maxBytes) {
            ::close(fd);
            return fail(ErrorCode::kLimit, path + ": larger than the limit of " + std::to_string(maxBytes) + " bytes");
        }
    }
    ::close(fd);
    bytes.resize(filled);
    return bytes;
}

}  // namespace tessera
