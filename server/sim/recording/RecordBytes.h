/// Files of records: a header in front of each content, so that what was changed, left out, moved or cut off is found
/// where it stands.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <variant>

#include "common/base/Blob.h"
#include "common/base/Error.h"

namespace tessera {

/// Little-endian, as it lies in the file.
struct RecordHeader {
    std::uint64_t bytes = 0;
    std::uint64_t kind = 0;
    std::uint64_t contentHash = 0;
    std::uint64_t headerHash = 0;
};

/// A record's content. An array's bytes are shared, not copied.
struct RecordContent {
    std::uint64_t kind = 0;
    std::variant<Bytes, Blob> content;
    [[nodiscard]] ByteSpan bytes() const;
};

/// The header of the record with this number, counted from 0.
[[nodiscard]] RecordHeader headerFor(std::uint64_t kind, ByteSpan content, std::uint64_t number);
[[nodiscard]] RecordHeader headerFor(std::uint64_t kind, std::uint64_t bytes, std::uint64_t contentHash,
                                     std::uint64_t number);
[[nodiscard]] bool isIntact(const RecordHeader& header, std::uint64_t number);

/// Writes all of both, whatever it takes. An errno, or 0.
[[nodiscard]] int writeAll(int file, ByteSpan first, ByteSpan second = {});

/// Bytes by position, of a file or of memory. Errors are kBadInput and do not name the file.
class RecordSource {
public:
    explicit RecordSource(Bytes memory) : memory_(std::move(memory)), size_(memory_.size()) {}
    /// A regular file; what is appended later is not seen. kNotFound, or kBadInput: it is none.
    [[nodiscard]] static Expected<RecordSource> open(const std::string& path);
    RecordSource(RecordSource&& other) noexcept;
    RecordSource& operator=(RecordSource&&) = delete;
    ~RecordSource();

    [[nodiscard]] std::uint64_t size() const { return size_; }
    /// Only for ranges that lie within `size`.
    [[nodiscard]] Expected<Bytes> read(std::uint64_t offset, std::uint64_t bytes) const;
    [[nodiscard]] Expected<void> readInto(std::span<std::byte> out, std::uint64_t offset) const;

private:
    RecordSource(int file, std::uint64_t size) : file_(file), size_(size) {}

    int file_ = -1;  ///< none: memory
    Bytes memory_;
    std::uint64_t size_ = 0;
};

}  // namespace tessera
