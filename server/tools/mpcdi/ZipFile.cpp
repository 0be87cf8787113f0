#include "server/tools/mpcdi/ZipFile.h"

#include <fmt/format.h>
#include <minizip/unzip.h>

#include <algorithm>
#include <filesystem>

namespace tessera {
namespace {

constexpr std::size_t kMostEntries = 4096, kLongestName = 512, kMostInAll = std::size_t{1} << 30;

bool leadsOut(const std::string& name) {
    if (name.empty() || name.front() == '/' || name.find('\\') != std::string::npos ||
        name.find(':') != std::string::npos || name.find('\0') != std::string::npos)
        return true;
    for (std::size_t at = 0; at <= name.size();) {
        const std::size_t end = std::min(name.find('/', at), name.size());
        if (name.compare(at, end - at, "..") == 0) return true;
        at = end + 1;
    }
    return false;
}

}  // namespace

struct ZipFile::Impl {
    std::string path;
    unzFile zip = nullptr;
    std::map<std::string, unz64_file_pos> entries;
    std::size_t taken = 0;
    ~Impl() {
        if (zip) unzClose(zip);
    }
};

ZipFile::ZipFile(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
ZipFile::~ZipFile() = default;
ZipFile::ZipFile(ZipFile&&) noexcept = default;
ZipFile& ZipFile::operator=(ZipFile&&) noexcept = default;

Expected<ZipFile> ZipFile::open(const std::string& path) {
    auto impl = std::make_unique<Impl>();
    impl->path = path;
    impl->zip = unzOpen64(path.c_str());
    std::error_code unread;
    if (!impl->zip && !std::filesystem::exists(path, unread))
        return fail(ErrorCode::kNotFound, path + ": there is no such file");
    if (!impl->zip)
        return fail(ErrorCode::kBadInput, path + ": it is no zip archive, as files of MPCDI are, or may not be read");
    const auto bad = [&](std::string what) { return fail(ErrorCode::kBadInput, fmt::format("{}: {}", path, what)); };
    for (int state = unzGoToFirstFile(impl->zip); state == UNZ_OK; state = unzGoToNextFile(impl->zip)) {
        if (impl->entries.size() == kMostEntries)
            return fail(ErrorCode::kLimit, fmt::format("{}: more than {} entries", path, kMostEntries));
        unz_file_info64 info{};
        char text[kLongestName + 1] = {};
        if (unzGetCurrentFileInfo64(impl->zip, &info, text, sizeof text - 1, nullptr, 0, nullptr, 0) != UNZ_OK)
            return bad("a damaged archive");
        if (info.size_filename > kLongestName) return bad(fmt::format("a name of {} bytes", info.size_filename));
        const std::string name(text, info.size_filename);
        if (leadsOut(name))
            return bad(fmt::format("an entry whose name leads out of the archive: \"{}\"", std::string(text)));
        unz64_file_pos place{};
        if (unzGetFilePos64(impl->zip, &place) != UNZ_OK) return bad("a damaged archive");
        if (!impl->entries.emplace(name, place).second) return bad(fmt::format("two entries \"{}\"", name));
    }
    if (impl->entries.empty()) return bad("an empty archive");
    return ZipFile(std::move(impl));
}

std::string ZipFile::firstWith(const std::string& ending) const {
    const auto at =
        std::ranges::find_if(impl_->entries, [&](const auto& entry) { return entry.first.ends_with(ending); });
    return at == impl_->entries.end() ? std::string() : at->first;
}

Expected<Bytes> ZipFile::read(const std::string& name, std::size_t atMost) {
    const auto at = impl_->entries.find(name);
    if (at == impl_->entries.end())
        return fail(ErrorCode::kNotFound, fmt::format("{}: there is no \"{}\" in it", impl_->path, name));
    const auto bad = [&] {
        return fail(ErrorCode::kBadInput,
                    fmt::format("{}: \"{}\" is damaged, or packed in a way that is not read", impl_->path, name));
    };
    unz64_file_pos place = at->second;
    if (unzGoToFilePos64(impl_->zip, &place) != UNZ_OK || unzOpenCurrentFile(impl_->zip) != UNZ_OK) return bad();
    // What an entry says of its size is not believed: memory grows with what comes.
    Bytes bytes;
    std::byte block[1 << 16];
    const std::size_t most = std::min(atMost, kMostInAll - impl_->taken);
    int count = 0;
    while ((count = unzReadCurrentFile(impl_->zip, block, sizeof block)) > 0) {
        bytes.insert(bytes.end(), block, block + count);
        if (bytes.size() <= most) continue;
        unzCloseCurrentFile(impl_->zip);
        return fail(ErrorCode::kLimit, fmt::format("{}: \"{}\" is larger than {} bytes", impl_->path, name, most));
    }
    impl_->taken += bytes.size();
    // It compares the sum over all bytes.
    if (unzCloseCurrentFile(impl_->zip) != UNZ_OK || count < 0) return bad();
    return bytes;
}

}  // namespace tessera
