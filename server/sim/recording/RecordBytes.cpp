#include "server/sim/recording/RecordBytes.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include <fmt/format.h>

namespace tessera {

ByteSpan RecordContent::bytes() const {
    if (const auto* blob = std::get_if<Blob>(&content)) return blob->bytes();
    return std::get<Bytes>(content);
}

RecordHeader headerFor(std::uint64_t kind, ByteSpan content, std::uint64_t number) {
    return headerFor(kind, content.size(), hash64(content), number);
}

RecordHeader headerFor(std::uint64_t kind, std::uint64_t bytes, std::uint64_t contentHash, std::uint64_t number) {
    RecordHeader header{.bytes = bytes, .kind = kind, .contentHash = contentHash, .headerHash = 0};
    header.headerHash = hash64(std::as_bytes(std::span(&header, 1)), number);
    return header;
}

bool isIntact(const RecordHeader& header, std::uint64_t number) {
    RecordHeader plain = header;
    plain.headerHash = 0;
    return header.headerHash == hash64(std::as_bytes(std::span(&plain, 1)), number);
}

int writeAll(int file, ByteSpan first, ByteSpan second) {
    while (!first.empty() || !second.empty()) {
        const std::array<iovec, 2> parts{iovec{const_cast<std::byte*>(first.data()), first.size()},
                                         iovec{const_cast<std::byte*>(second.data()), second.size()}};
        const ssize_t done = ::writev(file, parts.data(), parts.size());
        if (done < 0) {
            if (errno == EINTR) continue;
            return errno;
        }
        const std::size_t ofFirst = std::min(static_cast<std::size_t>(done), first.size());
        first = first.subspan(ofFirst);
        second = second.subspan(static_cast<std::size_t>(done) - ofFirst);
    }
    return 0;
}

Expected<RecordSource> RecordSource::open(const std::string& path) {
    // A pipe that nobody writes to would wait forever.
    const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (file < 0) return fail(ErrorCode::kNotFound, std::strerror(errno));
    RecordSource source(file, 0);
    struct stat info {};
    if (::fstat(file, &info) != 0 || !S_ISREG(info.st_mode)) return fail(ErrorCode::kBadInput, "it is no regular file");
    source.size_ = static_cast<std::uint64_t>(info.st_size);
    return source;
}

RecordSource::RecordSource(RecordSource&& other) noexcept
    : file_(std::exchange(other.file_, -1)), memory_(std::move(other.memory_)), size_(other.size_) {}

RecordSource::~RecordSource() {
    if (file_ >= 0) ::close(file_);
}

Expected<Bytes> RecordSource::read(std::uint64_t offset, std::uint64_t bytes) const {
    Bytes out(bytes);
    if (Expected<void> done = readInto(out, offset); !done) return tl::unexpected(done.error());
    return out;
}

Expected<void> RecordSource::readInto(std::span<std::byte> out, std::uint64_t offset) const {
    if (file_ < 0) {
        std::ranges::copy(ByteSpan(memory_).subspan(offset, out.size()), out.begin());
        return {};
    }
    for (std::uint64_t done = 0; done < out.size();) {
        const ssize_t got = ::pread(file_, out.data() + done, out.size() - done, static_cast<off_t>(offset + done));
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) return fail(ErrorCode::kBadInput, fmt::format("cannot be read: {}", std::strerror(errno)));
        if (got == 0) return fail(ErrorCode::kBadInput, "became shorter while it was read");
        done += static_cast<std::uint64_t>(got);
    }
    return {};
}

}  // namespace tessera
