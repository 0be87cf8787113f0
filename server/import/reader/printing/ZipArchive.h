/// Zip archives in memory, from anybody: what is in them is unpacked piece by piece. Written after PKWARE's APPNOTE
/// (6.3.10): stored and deflated entries, of 64 bits too.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>

#include "common/base/Bytes.h"
#include "common/base/Error.h"

namespace tessera {

struct ZipEntry {
    std::string name;        ///< as the archive has it
    std::size_t begin = 0;   ///< of its own head, in the archive
    std::size_t packed = 0;  ///< bytes in the archive
    std::size_t bytes = 0;   ///< unpacked, as the archive says
    std::uint32_t crc = 0;
    unsigned method = 0;  ///< 0: stored; 8: deflated
    bool encrypted = false;
};

class ZipArchive {
public:
    /// `bytes` have to stay. kBadInput says what is wrong, without naming the file: no archive, one that is cut off, an
    /// entry that lies elsewhere than it says. Of two entries of one name the first counts.
    [[nodiscard]] static Expected<ZipArchive> open(ByteSpan bytes);

    /// Names are compared as those of packages: whatever the case of ASCII letters, without a slash in front. Null:
    /// there is none.
    [[nodiscard]] const ZipEntry* find(std::string_view name) const;
    /// The first whose name ends so, in lower case; null: none does.
    [[nodiscard]] const ZipEntry* firstWith(std::string_view ending) const;
    /// How many bytes all take in the archive whose names end so.
    [[nodiscard]] std::size_t packedWith(std::string_view ending) const;

    /// Hands over what is in it, piece by piece, with how many bytes of the archive are behind it, until `take` is
    /// false. kLimit before anything is unpacked: all that has been taken out of the archive would be more than a
    /// hundred times its bytes, and 32 MiB. kBadInput: damaged, or longer or shorter than it says, of which the first
    /// pieces were handed over. kUnsupported: encrypted, or packed in another way.
    [[nodiscard]] Expected<void> unpack(const ZipEntry& entry,
                                        const std::function<bool(ByteSpan piece, std::size_t passed)>& take);
    /// All of it; kLimit: it is larger than `atMost`.
    [[nodiscard]] Expected<Bytes> read(const ZipEntry& entry, std::size_t atMost);

private:
    explicit ZipArchive(ByteSpan bytes);

    Expected<void> readDirectory();
    Expected<ByteSpan> packedBytesOf(const ZipEntry& entry) const;

    ByteSpan bytes_;
    std::map<std::string, ZipEntry> entries_;  ///< by their names as they are compared
    std::size_t left_ = 0;                     ///< that may still be unpacked
};

}  // namespace tessera
