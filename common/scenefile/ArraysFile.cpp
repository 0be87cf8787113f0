#include "common/scenefile/ArraysFile.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

#include "common/base/Controls.h"
#include "common/base/FileHandle.h"
#include "common/base/Hash.h"
#include "common/base/Utf8.h"

namespace tessera {
namespace {

constexpr std::string_view kMagic = "TSARRAY1", kEnding = ".arrays";
constexpr std::size_t kEntryBytes = 24;

void addNumber(std::string& bytes, std::uint64_t number) {
    for (int i = 0; i < 8; ++i) bytes.push_back(static_cast<char>(number >> (8 * i)));
}

std::uint64_t numberAt(ByteSpan bytes, std::size_t at) {
    std::uint64_t number = 0;
    for (std::size_t i = 0; i < 8; ++i) number |= static_cast<std::uint64_t>(bytes[at + i]) << (8 * i);
    return number;
}

tl::unexpected<Error> damaged(std::string_view what) {
    return fail(ErrorCode::kBadInput, fmt::format("is damaged: {}", what));
}

/// `_` for whatever cannot stand in quotes as it is. A file's name may be any bytes.
std::string plainName(std::string_view name) {
    std::string plain;
    while (!name.empty()) {
        const std::size_t length = utf8CharacterLength(name);
        const std::string_view character = name.substr(0, std::max<std::size_t>(length, 1));
        const bool isPlain =
            length > 0 && !isControl(numberOfCharacter(character)) && character != "\"" && character != "\\";
        plain += isPlain ? character : "_";
        name.remove_prefix(character.size());
    }
    return plain;
}

}  // namespace

ArraysHead arraysHead(std::span<const Blob> arrays) {
    ArraysHead head;
    head.bytes = kMagic;
    addNumber(head.bytes, arrays.size());
    for (const Blob& array : arrays) {
        const Hash128 hash = hash128(array.bytes());
        addNumber(head.bytes, array.sizeBytes());
        addNumber(head.bytes, hash.low);
        addNumber(head.bytes, hash.high);
        head.total += array.sizeBytes();
    }
    const std::uint64_t id = hash64(asBytes(head.bytes));
    head.id = toHex(id);
    addNumber(head.bytes, id);
    head.total += head.bytes.size();
    return head;
}

std::string arraysNameFor(const std::string& textPath, std::string_view id) {
    std::string name = plainName(std::string_view(textPath).substr(textPath.rfind('/') + 1));
    if (name.ends_with(".tsct")) name.resize(name.size() - 5);
    constexpr std::size_t kLongestStem = 200;  // a name has at most 255 bytes
    while (name.starts_with('.')) name.erase(0, 1);
    return fmt::format("{}.{}{}", name.empty() ? "scene" : cutUtf8(name, kLongestStem), id, kEnding);
}

bool isArraysName(std::string_view name) {
    return name.size() > kEnding.size() && name.ends_with(kEnding) && name.find('/') == std::string_view::npos &&
           name.find('\0') == std::string_view::npos && name.front() != '.';
}

std::optional<std::string> headOfText(const std::string& path) {
    constexpr std::size_t kMost = 65'536;
    const FileHandle file(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC | O_NOFOLLOW));
    struct stat info {};
    if (file.get() < 0 || ::fstat(file.get(), &info) != 0 || !S_ISREG(info.st_mode)) return std::nullopt;
    std::string head(kMost, '\0');
    std::size_t filled = 0;
    while (filled < kMost) {
        const ssize_t got = ::read(file.get(), head.data() + filled, kMost - filled);
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) return std::nullopt;
        if (got == 0) break;
        filled += static_cast<std::size_t>(got);
    }
    head.resize(filled);
    return head;
}

Expected<std::vector<Bytes>> readArrays(ByteSpan file, std::string_view id) {
    if (file.size() < kMagic.size() || asText(file.first(kMagic.size())) != kMagic)
        return fail(ErrorCode::kBadInput, "is no file of arrays");
    std::size_t at = kMagic.size() + 8;
    if (file.size() < at) return damaged("it ends too early");
    const std::uint64_t count = numberAt(file, kMagic.size());
    if (count > (file.size() - at) / kEntryBytes) return damaged("it ends too early");
    at += static_cast<std::size_t>(count) * kEntryBytes;
    if (file.size() - at < 8) return damaged("it ends too early");
    const std::uint64_t sum = hash64(file.first(at));
    if (numberAt(file, at) != sum) return damaged("its head is not what was written");
    if (toHex(sum) != id)
        return fail(ErrorCode::kBadInput, fmt::format("holds the arrays of another save ({}, not {})", toHex(sum), id));
    std::vector<Bytes> arrays;
    arrays.reserve(static_cast<std::size_t>(count));
    std::size_t from = at + 8;
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t entry = kMagic.size() + 8 + i * kEntryBytes;
        const std::uint64_t size = numberAt(file, entry);
        if (size > file.size() - from) return damaged("it ends too early");
        const ByteSpan bytes = file.subspan(from, static_cast<std::size_t>(size));
        if (hash128(bytes) != Hash128{numberAt(file, entry + 8), numberAt(file, entry + 16)})
            return damaged(fmt::format("array {} is not what was written", i + 1));
        arrays.emplace_back(bytes.begin(), bytes.end());
        from += bytes.size();
    }
    if (from != file.size()) return damaged("it has more bytes than arrays");
    return arrays;
}

}  // namespace tessera
