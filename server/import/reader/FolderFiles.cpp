#include "server/import/reader/FolderFiles.h"

#include <dirent.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <memory>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "common/base/LowerCase.h"
#include "common/confine/Confinement.h"
#include "common/confine/OrdinaryFile.h"

namespace tessera {
namespace {

/// One thread, one file, one life.
std::set<std::string>& lookedFor() {
    static std::set<std::string> paths;
    return paths;
}

/// Its folders and its last part, in lower case, backslashes as slashes, without a drive and what leads upwards.
std::vector<std::string> partsOf(const std::string& name) {
    std::vector<std::string> parts(1);
    for (const char c : lowerCase(name)) {
        if (c == '/' || c == '\\')
            parts.emplace_back();
        else
            parts.back() += c;
    }
    std::erase_if(parts, [](const std::string& part) {
        return part.empty() || part == "." || part == ".." || part.back() == ':';
    });
    return parts;
}

/// Paths of ordinary files and links in a folder and below, by their last parts in lower case.
std::multimap<std::string, std::string> namesBelow(const std::string& folder) {
    constexpr std::size_t kMostNames = 20000, kMostDeep = 6;
    std::multimap<std::string, std::string> names;
    std::vector<std::string> open = {""}, below;
    std::size_t seen = 0;
    for (std::size_t depth = 0; depth < kMostDeep && !open.empty(); ++depth, open = std::exchange(below, {}))
        for (const std::string& inside : open) {
            // By opendir: what a std::filesystem iterator asks the kernel for besides, confinement does not grant.
            const std::unique_ptr<DIR, int (*)(DIR*)> listed(::opendir((folder + "/" + inside).c_str()), &::closedir);
            while (const dirent* entry = listed ? ::readdir(listed.get()) : nullptr) {
                const std::string name = entry->d_name;
                if (name == "." || name == "..") continue;
                if (++seen > kMostNames) return names;
                struct stat info {};
                if (::lstat((folder + "/" + inside + name).c_str(), &info) != 0) continue;
                if (S_ISDIR(info.st_mode))
                    below.push_back(inside + name + "/");
                else if (S_ISREG(info.st_mode) || S_ISLNK(info.st_mode))
                    names.emplace(lowerCase(name), inside + name);
            }
        }
    return names;
}

/// Whether a name, without links, is of something outside of the folder.
bool leadsOut(const std::string& name, const std::string& folder) {
    const std::filesystem::path whole = std::filesystem::path(folder) / name;
    const std::string plain = whole.lexically_normal().string();
    return !plain.starts_with(folder == "/" ? folder : folder + "/");
}

}  // namespace

void isLookedFor(const std::string& path) {
    if (lookedFor().size() < kMostFilesLookedFor) lookedFor().insert(path);
}

std::vector<std::string> filesLookedFor() {
    return {lookedFor().begin(), lookedFor().end()};
}

Expected<Bytes> readOrdinaryFile(const std::string& path, std::size_t maxBytes) {
    isLookedFor(path);
    const Expected<OrdinaryFile> file = openOrdinaryFile(path);
    if (!file) return tl::unexpected(file.error());
    const std::uint64_t size = file->bytes;
    if (size > maxBytes) return fail(ErrorCode::kLimit, fmt::format("is larger than {} MiB", maxBytes >> 20));
    Bytes bytes(size);
    std::size_t done = 0;
    while (done < bytes.size()) {
        const ssize_t got = ::read(file->handle.get(), bytes.data() + done, bytes.size() - done);
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) return fail(ErrorCode::kBadInput, fmt::format("cannot be read ({})", std::strerror(errno)));
        if (got == 0) break;  // it became shorter meanwhile
        done += static_cast<std::size_t>(got);
    }
    bytes.resize(done);
    grantTimeFor(done);
    return bytes;
}

Expected<std::string> FolderFiles::resolve(const std::string& name) const {
    if (name.empty() || name.find('\0') != std::string::npos) return fail(ErrorCode::kBadInput, "an empty file name");
    const std::string path = name.front() == '/' ? name : folder_ + "/" + name;
    const std::unique_ptr<char, decltype(&std::free)> resolved(::realpath(path.c_str(), nullptr), &std::free);
    if (!resolved) {
        const int why = errno;
        isLookedFor(path);
        // Whether there is such a file is nobody's business then.
        if (leadsOut(name, folder_))
            return fail(ErrorCode::kRefused, fmt::format("'{}' leads out of the file's own folder", name));
        return fail(ErrorCode::kNotFound, fmt::format("'{}': {}", name, std::strerror(why)));
    }
    const std::string found(resolved.get());
    if (found == folder_) return fail(ErrorCode::kBadInput, fmt::format("'{}' is a folder", name));
    const std::string prefix = folder_ == "/" ? folder_ : folder_ + "/";
    if (found.compare(0, prefix.size(), prefix) != 0)
        return fail(ErrorCode::kRefused, fmt::format("'{}' leads out of the file's own folder", name));
    return found;
}

Expected<Bytes> FolderFiles::read(const std::string& name) const {
    const Expected<std::string> path = resolve(name);
    if (!path) return tl::unexpected(path.error());
    Expected<Bytes> bytes = readOrdinaryFile(*path, maxBytes_);
    if (!bytes) return fail(bytes.error().code, fmt::format("'{}' {}", name, bytes.error().message));
    return bytes;
}

Expected<FolderFiles::Found> FolderFiles::find(const std::string& name) const {
    Expected<std::string> exact = resolve(name);
    if (exact) return Found{std::move(*exact), {}};
    const bool inside = name.starts_with(folder_ + "/");
    const std::vector<std::string> wanted = partsOf(inside ? name.substr(folder_.size() + 1) : name);
    if (wanted.empty()) return tl::unexpected(exact.error());
    if (!std::exchange(listed_, true)) names_ = namesBelow(folder_);
    const auto [first, last] = names_.equal_range(wanted.back());
    const std::string* best = nullptr;
    std::tuple<std::size_t, std::size_t, std::string> bestRank;
    for (auto it = first; it != last; ++it) {
        const std::vector<std::string> parts = partsOf(it->second);
        const auto [a, b] = std::mismatch(wanted.rbegin(), wanted.rend(), parts.rbegin(), parts.rend());
        const auto agreeing = static_cast<std::size_t>(a - wanted.rbegin());
        const std::tuple rank(wanted.size() - agreeing, parts.size(), it->second);
        if (best != nullptr && !(rank < bestRank)) continue;
        best = &it->second;
        bestRank = rank;
    }
    if (best == nullptr) return tl::unexpected(exact.error());
    Expected<std::string> found = resolve(*best);
    if (!found) return tl::unexpected(exact.error());
    return Found{std::move(*found),
                 fmt::format("'{}' was found as '{}'", inside ? name.substr(folder_.size() + 1) : name, *best)};
}

Expected<Bytes> FolderFiles::readFound(const Found& found) const {
    Expected<Bytes> bytes = readOrdinaryFile(found.path, maxBytes_);
    if (!bytes)
        return fail(bytes.error().code,
                    fmt::format("'{}' {}", found.path.substr(folder_.size() + (folder_ == "/" ? 0 : 1)),
                                bytes.error().message));
    return bytes;
}

}  // namespace tessera
