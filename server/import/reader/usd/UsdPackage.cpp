#include "server/import/reader/usd/UsdPackage.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <optional>

namespace tessera {
namespace {

constexpr std::size_t kEndBytes = 22, kEntryBytes = 46, kLocalBytes = 30, kLongestRemark = 65535;
/// What stands where a number of 64 bits stands elsewhere.
constexpr std::size_t kIsLong = 0xffffffff;

/// Little-endian, `size` bytes of it. The caller has looked whether they are there.
std::uint64_t number(ByteSpan bytes, std::size_t at, std::size_t size) {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < size; ++i) value |= std::to_integer<std::uint64_t>(bytes[at + i]) << (8 * i);
    return value;
}

/// Where the record at the archive's end begins.
std::optional<std::size_t> endRecord(ByteSpan bytes) {
    if (bytes.size() < kEndBytes) return std::nullopt;
    const std::size_t first = bytes.size() - std::min(bytes.size(), kEndBytes + kLongestRemark);
    for (std::size_t at = bytes.size() - kEndBytes + 1; at-- > first;)
        if (number(bytes, at, 4) == 0x06054b50) return at;
    return std::nullopt;
}

tl::unexpected<Error> broken(std::string what) {
    return fail(ErrorCode::kBadInput, "it is no sound usdz: " + std::move(what));
}

}  // namespace

ByteSpan UsdPackage::find(const std::string& name) const {
    const auto found = parts_.find(name);
    if (found == parts_.end() || !found->second.stored) return {};
    return ByteSpan(bytes_).subspan(found->second.begin, found->second.size);
}

bool UsdPackage::isPacked(const std::string& name) const {
    const auto found = parts_.find(name);
    return found != parts_.end() && !found->second.stored;
}

Expected<std::shared_ptr<const UsdPackage>> UsdPackage::open(Bytes owned) {
    auto package = std::make_shared<UsdPackage>();
    package->bytes_ = std::move(owned);
    const ByteSpan bytes = package->bytes_;
    const std::optional<std::size_t> end = endRecord(bytes);
    if (!end) return broken("the end of the archive is missing; it may be cut off");
    const std::size_t entries = number(bytes, *end + 10, 2), begin = number(bytes, *end + 16, 4);
    if (entries == 0) return broken("there is no file in it");
    if (entries == 0xffff || begin == kIsLong) return broken("it is an archive of 64 bits, which usdz are not");
    std::size_t at = begin;
    std::size_t earliest = bytes.size();
    for (std::size_t i = 0; i < entries; ++i) {
        if (at > *end || *end - at < kEntryBytes || number(bytes, at, 4) != 0x02014b50)
            return broken(fmt::format("entry {} of {} is not there", i, entries));
        const std::size_t nameBytes = number(bytes, at + 28, 2), extra = number(bytes, at + 30, 2),
                          remark = number(bytes, at + 32, 2), local = number(bytes, at + 42, 4);
        if (*end - at - kEntryBytes < nameBytes) return broken(fmt::format("the name of entry {} is cut off", i));
        const std::string name(asText(bytes.subspan(at + kEntryBytes, nameBytes)));
        const std::size_t packed = number(bytes, at + 20, 4), size = number(bytes, at + 24, 4);
        const bool stored = number(bytes, at + 10, 2) == 0 && (number(bytes, at + 8, 2) & 1) == 0;
        at += kEntryBytes + nameBytes + extra + remark;
        if (name.empty() || name.back() == '/') continue;
        if (packed == kIsLong || size == kIsLong || local == kIsLong)
            return broken(
                fmt::format("'{}' is an entry of 64 bits (zip64), which a usdz has not; pack it anew with "
                            "usdzip, or with zip -0",
                            name));
        if (local > bytes.size() || bytes.size() - local < kLocalBytes || number(bytes, local, 4) != 0x04034b50)
            return broken(fmt::format("'{}' does not begin where the archive says", name));
        Part part{local + kLocalBytes + number(bytes, local + 26, 2) + number(bytes, local + 28, 2), size, stored};
        if (stored && (packed != size || part.begin > bytes.size() || bytes.size() - part.begin < size))
            return broken(fmt::format("'{}' says that it has {} bytes, which are not there", name, size));
        if (local < earliest) {
            earliest = local;
            package->first_ = name;
        }
        package->parts_.emplace(name, part);
    }
    if (package->first_.empty()) return broken("there is no file in it");
    if (package->isPacked(package->first_))
        // How large it would become is its own word.
        return fail(ErrorCode::kUnsupported,
                    fmt::format("'{}' in it is compressed, to {} bytes as it says: files of a usdz are stored as they "
                                "are, so nothing is unpacked; pack it anew without compression",
                                package->first_, package->parts_.at(package->first_).size));
    return std::shared_ptr<const UsdPackage>(std::move(package));
}

}  // namespace tessera
