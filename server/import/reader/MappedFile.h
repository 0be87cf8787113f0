/// A file's bytes without a copy of them.
#pragma once

#include <string>
#include <string_view>
#include <utility>

#include "common/base/Bytes.h"
#include "common/base/Error.h"

namespace tessera {

/// An ordinary file, mapped for reading. Who makes it shorter meanwhile ends the process that reads on (SIGBUS): the
/// importer's child, whose parent says so.
class MappedFile {
public:
    /// As readOrdinaryFile: pipes, devices and folders are refused without being read; messages do not repeat the path.
    [[nodiscard]] static Expected<MappedFile> open(const std::string& path, std::size_t maxBytes);

    MappedFile(MappedFile&& other) noexcept
        : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}
    MappedFile& operator=(MappedFile&&) = delete;
    MappedFile(const MappedFile&) = delete;
    MappedFile& operator=(const MappedFile&) = delete;
    ~MappedFile() { close(); }

    [[nodiscard]] ByteSpan bytes() const { return {static_cast<const std::byte*>(data_), size_}; }
    [[nodiscard]] std::string_view text() const { return asText(bytes()); }
    /// The first so many bytes have been read: their memory is given back, and comes again where somebody looks. Says
    /// so to who waits (ReadProgress.h).
    void passed(std::size_t bytes) const;
    /// Before its memory is needed for others; no views of it are good then.
    void close();

private:
    MappedFile(void* data, std::size_t size) : data_(data), size_(size) {}

    void* data_ = nullptr;
    std::size_t size_ = 0;
};

}  // namespace tessera
