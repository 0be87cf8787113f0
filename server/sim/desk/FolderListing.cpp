#include "server/sim/desk/FolderListing.h"

#include <dirent.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <map>
#include <memory>

#include "common/base/Utf8.h"
#include "server/import/FormatTable.h"

namespace tessera {
namespace {

constexpr std::size_t kMostPageBytes = std::size_t{256} << 10;  ///< of names and paths

/// The first names behind `after`, each with the first folder that has it.
class FirstNames {
public:
    FirstNames(std::string after, std::size_t most) : after_(std::move(after)), most_(most) {}
    void add(std::string_view name, std::size_t folder) {
        if (name <= after_) return;
        if (names_.size() > most_ && name > names_.rbegin()->first) return;
        names_.emplace(name, folder);
        if (names_.size() > most_ + 1)
            names_.erase(std::prev(names_.end()));  // one more: whether there is another page
    }
    [[nodiscard]] const std::map<std::string, std::size_t, std::less<>>& names() const { return names_; }

private:
    std::string after_;
    std::size_t most_;
    std::map<std::string, std::size_t, std::less<>> names_;
};

using OpenFolder = std::unique_ptr<DIR, int (*)(DIR*)>;

Expected<OpenFolder> openFolder(const std::string& path, const std::string& said) {
    const int file = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    OpenFolder folder(file >= 0 ? ::fdopendir(file) : nullptr, &::closedir);
    if (folder) return folder;
    const int reason = errno;
    if (file >= 0) ::close(file);
    if (reason == ENOENT) return fail(ErrorCode::kNotFound, fmt::format("{}: there is no such folder", said));
    return fail(ErrorCode::kBadInput,
                fmt::format("{}: {}", said, reason == ENOTDIR ? "this is no folder" : std::strerror(reason)));
}

std::string joined(const std::string& folder, const std::string& name) {
    return folder.empty() || folder.ends_with('/') ? folder + name : folder + "/" + name;
}

/// Nothing: it is not to be shown.
std::optional<FolderEntry> entryOf(const std::string& file, std::string name, std::string path,
                                   const ReadableFolders& where) {
    struct stat info {};
    if (::lstat(file.c_str(), &info) != 0) return std::nullopt;
    if (S_ISLNK(info.st_mode)) {
        const auto target = readableFolder(file, where);  // or a file: whatever may be seen
        if (!target || ::lstat(target->front().c_str(), &info) != 0) return std::nullopt;
    }
    const bool isFolder = S_ISDIR(info.st_mode);
    if (!isFolder && !S_ISREG(info.st_mode)) return std::nullopt;
    const bool loads = !isFolder && isModelEnding(lowerCaseExtension(name));
    return FolderEntry{.name = std::move(name),
                       .path = std::move(path),
                       .isFolder = isFolder,
                       .bytes = isFolder ? 0 : static_cast<std::uint64_t>(info.st_size),
                       .loads = loads};
}

/// The folders themselves; there are few.
answer::FolderPage roots(const ReadableFolders& where) {
    answer::FolderPage page;
    for (const std::string& folder : where.folders) {
        if (page.entries.size() == kMostFolderEntries) break;
        const Expected<std::vector<std::string>> resolved = readableFolder(folder, where);
        if (resolved && isUtf8(resolved->front()))
            page.entries.push_back({.name = resolved->front(), .path = resolved->front(), .isFolder = true});
    }
    if (!where.assets.empty())
        page.entries.push_back({.name = "assets", .path = std::string(kAssetScheme), .isFolder = true});
    return page;
}

}  // namespace

Expected<answer::FolderPage> listFolder(const FolderWish& wish, const ReadableFolders& where) {
    if (wish.folder.empty()) return roots(where);
    const Expected<std::vector<std::string>> folders = readableFolder(wish.folder, where);
    if (!folders) return tl::unexpected(folders.error());
    const std::size_t most = std::clamp<std::size_t>(wish.pageSize, 1, kMostFolderEntries);
    FirstNames first(wish.after, most);
    std::size_t looked = 0;
    if (folders->empty()) return fail(ErrorCode::kNotFound, fmt::format("{}: there is no such folder", wish.folder));
    for (std::size_t i = 0; i < folders->size(); ++i) {
        Expected<OpenFolder> folder = openFolder((*folders)[i], wish.folder);
        if (!folder) return tl::unexpected(folder.error());
        while (const dirent* entry = ::readdir(folder->get())) {
            const std::string_view name = entry->d_name;
            if (++looked > kMostLookedThrough)
                return fail(ErrorCode::kLimit,
                            fmt::format("{}: more than {} files lie there", wish.folder, kMostLookedThrough));
            if (!name.starts_with('.') && isUtf8(name)) first.add(name, i);
        }
    }
    answer::FolderPage page;
    std::size_t shown = 0;
    std::string last;
    std::size_t bytes = 0;
    for (const auto& [name, folder] : first.names()) {
        if (shown++ == most || bytes > kMostPageBytes) {
            page.next = last;
            break;
        }
        last = name;
        std::string path = joined(wish.folder, name);
        if (path.size() > ApplicationLimits().maxTextBytes) continue;  // no request could name it
        bytes += name.size() + path.size();
        if (std::optional<FolderEntry> entry = entryOf(joined((*folders)[folder], name), name, std::move(path), where))
            page.entries.push_back(std::move(*entry));
    }
    return page;
}

}  // namespace tessera
