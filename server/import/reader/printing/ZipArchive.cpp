#include "server/import/reader/printing/ZipArchive.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <limits>
#include <optional>

#include "common/base/LowerCase.h"

namespace tessera {
namespace {

constexpr std::size_t kEndBytes = 22, kLocatorBytes = 20, kLongEndBytes = 56, kEntryBytes = 46, kLocalBytes = 30;
constexpr std::size_t kLongestRemark = 65535;
constexpr std::uint32_t kEntry = 0x02014b50, kLocal = 0x04034b50, kEnd = 0x06054b50, kLongEnd = 0x06064b50,
                        kLocator = 0x07064b50;
/// What stands where a number of 64 bits stands elsewhere.
constexpr std::size_t kIsLong = 0xffffffff, kIsLongCount = 0xffff;
/// So much may be unpacked, or so many times the archive: texts are packed to a fifth or a fifteenth.
constexpr std::size_t kAlwaysUnpacked = std::size_t{32} << 20, kMostTimes = 100;
constexpr std::size_t kPiece = std::size_t{1} << 18;

/// Little-endian, `size` bytes of it. The caller has looked whether they are there.
std::uint64_t number(ByteSpan bytes, std::size_t at, std::size_t size) {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < size; ++i) value |= std::to_integer<std::uint64_t>(bytes[at + i]) << (8 * i);
    return value;
}

bool begins(ByteSpan bytes, std::size_t at, std::size_t size, std::uint32_t signature) {
    return at <= bytes.size() && bytes.size() - at >= size && number(bytes, at, 4) == signature;
}

std::optional<std::size_t> endRecord(ByteSpan bytes) {
    if (bytes.size() < kEndBytes) return std::nullopt;
    const std::size_t first = bytes.size() - std::min(bytes.size(), kEndBytes + kLongestRemark);
    for (std::size_t at = bytes.size() - kEndBytes + 1; at-- > first;)
        if (number(bytes, at, 4) == kEnd) return at;
    return std::nullopt;
}

tl::unexpected<Error> broken(std::string what) {
    return fail(ErrorCode::kBadInput, std::move(what));
}

/// What is wrong in a way that no program writes.
tl::unexpected<Error> damaged(const std::string& what) {
    return broken(what + ": the archive is damaged, or its copy is not complete; copy it anew, or save it again");
}

std::string comparedName(std::string_view name) {
    while (name.starts_with('/')) name.remove_prefix(1);
    return lowerCase(name);
}

/// Numbers that are too long for the entry stand in its extra field, those that are, one after the other.
void readLongNumbers(ByteSpan extra, ZipEntry& entry) {
    for (std::size_t at = 0; at + 4 <= extra.size();) {
        const std::size_t kind = number(extra, at, 2), size = number(extra, at + 2, 2);
        at += 4;
        if (extra.size() - at < size) return;
        if (kind == 1) {
            std::size_t next = at;
            for (std::size_t* value : {&entry.bytes, &entry.packed, &entry.begin})
                if (*value == kIsLong && next + 8 <= at + size) {
                    *value = number(extra, next, 8);
                    next += 8;
                }
            return;
        }
        at += size;
    }
}

}  // namespace

ZipArchive::ZipArchive(ByteSpan bytes)
    : bytes_(bytes),
      left_(std::max(kAlwaysUnpacked, bytes.size() < std::numeric_limits<std::size_t>::max() / kMostTimes
                                          ? kMostTimes * bytes.size()
                                          : bytes.size())) {}

Expected<ZipArchive> ZipArchive::open(ByteSpan bytes) {
    ZipArchive archive(bytes);
    if (Expected<void> read = archive.readDirectory(); !read) return tl::unexpected(read.error());
    return archive;
}

Expected<void> ZipArchive::readDirectory() {
    if (!begins(bytes_, 0, 4, kLocal) && !begins(bytes_, 0, 4, kEnd))
        return broken("it is no zip archive, as such files are: save it again in the program that made it");
    const std::optional<std::size_t> end = endRecord(bytes_);
    if (!end)
        return broken(
            fmt::format("the list of its files, at the end of the archive, is not there: it is cut off "
                        "after {} bytes; copy it anew",
                        bytes_.size()));
    std::size_t count = number(bytes_, *end + 10, 2), at = number(bytes_, *end + 16, 4), until = *end;
    if (*end >= kLocatorBytes && (count == kIsLongCount || at == kIsLong) &&
        begins(bytes_, *end - kLocatorBytes, kLocatorBytes, kLocator)) {
        const std::size_t longEnd = number(bytes_, *end - kLocatorBytes + 8, 8);
        if (!begins(bytes_, longEnd, kLongEndBytes, kLongEnd))
            return damaged(
                fmt::format("the list of its files does not end at byte {}, where the archive says", longEnd));
        count = number(bytes_, longEnd + 32, 8);
        at = number(bytes_, longEnd + 48, 8);
        until = longEnd;
    }
    for (std::size_t i = 0; i < count; ++i) {
        if (at > until || until - at < kEntryBytes || number(bytes_, at, 4) != kEntry)
            return damaged(fmt::format("file {} of {} is not in the archive's list, at byte {}", i + 1, count, at));
        const std::size_t nameBytes = number(bytes_, at + 28, 2), extra = number(bytes_, at + 30, 2),
                          remark = number(bytes_, at + 32, 2);
        if (until - at - kEntryBytes < nameBytes + extra + remark)
            return damaged(fmt::format("file {} of {} is cut off in the archive's list, at byte {}", i + 1, count, at));
        ZipEntry entry{.name = std::string(asText(bytes_.subspan(at + kEntryBytes, nameBytes))),
                       .begin = number(bytes_, at + 42, 4),
                       .packed = number(bytes_, at + 20, 4),
                       .bytes = number(bytes_, at + 24, 4),
                       .crc = static_cast<std::uint32_t>(number(bytes_, at + 16, 4)),
                       .method = static_cast<unsigned>(number(bytes_, at + 10, 2)),
                       .encrypted = (number(bytes_, at + 8, 2) & 1) != 0};
        readLongNumbers(bytes_.subspan(at + kEntryBytes + nameBytes, extra), entry);
        at += kEntryBytes + nameBytes + extra + remark;
        if (entry.name.empty() || entry.name.back() == '/') continue;
        std::string name = comparedName(entry.name);
        entries_.emplace(std::move(name), std::move(entry));
    }
    return {};
}

const ZipEntry* ZipArchive::find(std::string_view name) const {
    const auto found = entries_.find(comparedName(name));
    return found == entries_.end() ? nullptr : &found->second;
}

const ZipEntry* ZipArchive::firstWith(std::string_view ending) const {
    const auto found = std::ranges::find_if(entries_, [&](const auto& entry) { return entry.first.ends_with(ending); });
    return found == entries_.end() ? nullptr : &found->second;
}

std::size_t ZipArchive::packedWith(std::string_view ending) const {
    std::size_t sum = 0;
    for (const auto& [name, entry] : entries_)
        if (name.ends_with(ending)) sum += std::min(entry.packed, bytes_.size());
    return sum;
}

Expected<ByteSpan> ZipArchive::packedBytesOf(const ZipEntry& entry) const {
    if (!begins(bytes_, entry.begin, kLocalBytes, kLocal))
        return damaged(fmt::format("'{}' does not begin at byte {}, where the archive says", entry.name, entry.begin));
    const std::size_t head = kLocalBytes + number(bytes_, entry.begin + 26, 2) + number(bytes_, entry.begin + 28, 2);
    if (bytes_.size() - entry.begin < head || bytes_.size() - entry.begin - head < entry.packed)
        return damaged(
            fmt::format("'{}' says that it has {} bytes, which are not in the archive", entry.name, entry.packed));
    return bytes_.subspan(entry.begin + head, entry.packed);
}

Expected<void> ZipArchive::unpack(const ZipEntry& entry,
                                  const std::function<bool(ByteSpan piece, std::size_t passed)>& take) {
    constexpr unsigned kStored = 0, kDeflated = 8;
    if (entry.encrypted)
        return fail(ErrorCode::kUnsupported, fmt::format("'{}' is encrypted: save it without a password", entry.name));
    if (entry.method != kStored && entry.method != kDeflated)
        return fail(ErrorCode::kUnsupported,
                    fmt::format("'{}' is packed in a way (number {}) that is not read: pack it anew by zip", entry.name,
                                entry.method));
    if (entry.bytes > left_)
        return fail(ErrorCode::kLimit,
                    fmt::format("'{}' becomes {} MiB, and with the other files in it more than {} times its bytes, as "
                                "zip bombs do: if it is none, pack it anew without compression (zip -0)",
                                entry.name, entry.bytes >> 20, kMostTimes));
    const Expected<ByteSpan> packed = packedBytesOf(entry);
    if (!packed) return tl::unexpected(packed.error());
    left_ -= entry.bytes;
    const auto wrongSize = [&] {
        return broken(fmt::format("'{}' is not of {} bytes, as the archive says: it is damaged; copy it anew",
                                  entry.name, entry.bytes));
    };
    uLong sum = ::crc32(0, nullptr, 0);
    const auto addToSum = [&](ByteSpan piece) {
        sum = ::crc32(sum, reinterpret_cast<const Bytef*>(piece.data()), static_cast<uInt>(piece.size()));
    };
    std::size_t out = 0;
    if (entry.method == kStored) {
        if (packed->size() != entry.bytes) return wrongSize();
        for (; out < packed->size();) {
            const ByteSpan piece = packed->subspan(out, std::min(kPiece, packed->size() - out));
            addToSum(piece);
            out += piece.size();
            if (!take(piece, out)) return {};
        }
    } else {
        z_stream stream{};
        if (::inflateInit2(&stream, -MAX_WBITS) != Z_OK) throw std::bad_alloc();
        struct Ended {
            z_stream& stream;
            ~Ended() { ::inflateEnd(&stream); }
        } ended{stream};
        Bytes piece(kPiece);
        std::size_t in = 0;
        for (int state = Z_OK; state != Z_STREAM_END;) {
            const ByteSpan next = packed->subspan(in, std::min(kPiece, packed->size() - in));
            stream.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(next.data()));
            stream.avail_in = static_cast<uInt>(next.size());
            stream.next_out = reinterpret_cast<Bytef*>(piece.data());
            stream.avail_out = static_cast<uInt>(piece.size());
            state = ::inflate(&stream, Z_NO_FLUSH);
            in += next.size() - stream.avail_in;
            const ByteSpan made = ByteSpan(piece).first(piece.size() - stream.avail_out);
            if (state != Z_OK && state != Z_STREAM_END)
                return broken(fmt::format("'{}' is damaged, at byte {} of its {} in the archive: copy it anew",
                                          entry.name, in, packed->size()));
            out += made.size();
            if (out > entry.bytes) return wrongSize();
            addToSum(made);
            if (!made.empty() && !take(made, in)) return {};
        }
        if (out != entry.bytes) return wrongSize();
    }
    if (sum != entry.crc)
        return broken(fmt::format("'{}' is damaged: its checksum is another one; copy it anew", entry.name));
    return {};
}

Expected<Bytes> ZipArchive::read(const ZipEntry& entry, std::size_t atMost) {
    if (entry.bytes > atMost)
        return fail(ErrorCode::kLimit,
                    fmt::format("'{}' is larger than {} MiB: save it smaller", entry.name, atMost >> 20));
    Bytes all;
    Expected<void> done = unpack(entry, [&](ByteSpan piece, std::size_t) {
        all.insert(all.end(), piece.begin(), piece.end());
        return true;
    });
    if (!done) return tl::unexpected(done.error());
    return all;
}

}  // namespace tessera
