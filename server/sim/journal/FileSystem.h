/// The calls by which a journal changes its folder: the seam at which a test makes them fail.
#pragma once

#include <cstdint>
#include <string>

#include "common/base/Bytes.h"

namespace tessera {

/// Each call gives an errno; 0: it is done. From any thread. What only reads goes past it.
class FileSystem {
public:
    FileSystem() = default;
    FileSystem(const FileSystem&) = delete;
    FileSystem& operator=(const FileSystem&) = delete;
    virtual ~FileSystem() = default;

    /// A file to append to; emptied where it is there.
    [[nodiscard]] virtual int create(const std::string& path, int& file);
    /// One that is there, to be shortened or synced.
    [[nodiscard]] virtual int open(const std::string& path, int& file);
    /// Both at the end of the file. After an error a part of them may be there.
    [[nodiscard]] virtual int append(int file, ByteSpan first, ByteSpan second);
    /// At the beginning of one that was opened: as many bytes as it has. Within a sector it is all or nothing.
    [[nodiscard]] virtual int overwrite(int file, ByteSpan bytes);
    [[nodiscard]] virtual int truncate(int file, std::uint64_t bytes);
    /// The disk has what is in the file.
    [[nodiscard]] virtual int sync(int file);
    /// The disk has the names in the folder.
    [[nodiscard]] virtual int syncFolder(const std::string& path);
    /// What has the new name is replaced.
    [[nodiscard]] virtual int rename(const std::string& from, const std::string& to);
    [[nodiscard]] virtual int remove(const std::string& path);
    virtual void close(int file);
    /// Names the time since the machine was started: for so long the kernel keeps what was written and not synced.
    /// Empty: nobody knows.
    [[nodiscard]] virtual std::string boot() const;
};

/// Whether the name stands for the open file, which has at least so many bytes. A name that cannot be looked at is not
/// known to be gone.
[[nodiscard]] bool standsFor(const std::string& path, int file, std::uint64_t leastBytes);

}  // namespace tessera
