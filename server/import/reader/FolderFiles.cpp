#include "server/import/reader/FolderFiles.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <memory>

namespace tessera {

Expected<Bytes> readOrdinaryFile(const std::string& path, std::size_t maxBytes) {
    // Without O_NONBLOCK the opening of a pipe would wait for a writer.
    const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (fd < 0)
        return fail(errno == ENOENT ? ErrorCode::kNotFound : ErrorCode::kBadInput,
                    fmt::format("cannot be opened ({})", std::strerror(errno)));
    const auto closing = [](const int* open) { ::close(*open); };
    const std::unique_ptr<const int, decltype(closing)> guard(&fd, closing);
    // A link that came to stand on the way since the path was looked at leads to another file.
    char opened[4096];
    const ssize_t length = ::readlink(fmt::format("/proc/self/fd/{}", fd).c_str(), opened, sizeof(opened));
    if (length > 0 && static_cast<std::size_t>(length) < sizeof(opened) &&
        std::string_view(opened, static_cast<std::size_t>(length)) != path)
        return fail(ErrorCode::kRefused, "was replaced while it was opened");
    struct stat info {};
    if (::fstat(fd, &info) != 0 || !S_ISREG(info.st_mode)) return fail(ErrorCode::kBadInput, "is not an ordinary file");
    const auto size = static_cast<std::uint64_t>(info.st_size);
    if (size > maxBytes) return fail(ErrorCode::kLimit, fmt::format("is larger than {} MiB", maxBytes >> 20));
    Bytes bytes(size);
    std::size_t done = 0;
    while (done < bytes.size()) {
        const ssize_t got = ::read(fd, bytes.data() + done, bytes.size() - done);
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) return fail(ErrorCode::kBadInput, fmt::format("cannot be read ({})", std::strerror(errno)));
        if (got == 0) break;  // it became shorter meanwhile
        done += static_cast<std::size_t>(got);
    }
    bytes.resize(done);
    return bytes;
}

Expected<std::string> FolderFiles::resolve(const std::string& name) const {
    if (name.empty() || name.find('\0') != std::string::npos) return fail(ErrorCode::kBadInput, "an empty file name");
    const std::string path = name.front() == '/' ? name : folder_ + "/" + name;
    const std::unique_ptr<char, decltype(&std::free)> resolved(::realpath(path.c_str(), nullptr), &std::free);
    if (!resolved) return fail(ErrorCode::kNotFound, fmt::format("'{}': {}", name, std::strerror(errno)));
    const std::string found(resolved.get());
    if (found == folder_) return fail(ErrorCode::kBadInput, fmt::format("'{}' is a folder", name));
    const std::string prefix = folder_ == "/" ? folder_ : folder_ + "/";
    if (found.compare(0, prefix.size(), prefix) != 0)
        return fail(ErrorCode::kRefused, fmt::format("'{}' leads out of the file's own folder", name));
    return found;
}

Expected<Bytes> FolderFiles::read(const std::string& name) const {
    const Expected<std::string> path = resolve(name);
    if (!path) return tl::unexpected(path.error());
    Expected<Bytes> bytes = readOrdinaryFile(*path, maxBytes_);
    if (!bytes) return fail(bytes.error().code, fmt::format("'{}' {}", name, bytes.error().message));
    return bytes;
}

}  // namespace tessera
