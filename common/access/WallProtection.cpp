#include "common/access/WallProtection.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <string_view>

#include "common/base/AccessToken.h"
#include "common/base/FileHandle.h"

namespace tessera {
namespace {

constexpr std::size_t kMostMarkBytes = 256;  ///< of a mark
constexpr const char *kKeys = "keys ", *kMark = " mark ";

std::string markPath(const std::string& folder) {
    return folder + "/links";
}

tl::unexpected<Error> markError(std::string_view what, const std::string& path) {
    return fail(ErrorCode::kFailed, fmt::format("{}: {} ({})", path, what, std::strerror(errno)));
}

}  // namespace

std::string WallProtection::text() const {
    return fmt::format("{}{}{}{}{}", authority.empty() ? "this-machine" : kKeys, authority, insecure ? " insecure" : "",
                       mark.empty() ? "" : kMark, mark);
}

bool WallProtection::continues(const std::string& before) const {
    const bool mayLoseMark = authority.empty() && mark.empty();
    return before == text() || (mayLoseMark && before.starts_with(text() + kMark));
}

bool WallProtection::hasKeys(const std::string& text) {
    return text.starts_with(kKeys);
}

bool WallProtection::isOf(const std::string& text, const std::string& authority) {
    return hasKeys(text) && (text + " ").starts_with(kKeys + authority + " ");
}

Expected<std::optional<std::string>> readLinksMark(const std::string& folder) {
    constexpr unsigned kOthersMayWrite = 0022;
    const std::string path = markPath(folder);
    const FileHandle file(::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK));
    if (file.get() < 0 && errno == ENOENT) return std::nullopt;
    if (file.get() < 0) return markError("cannot be read", path);
    struct stat info {};
    if (::fstat(file.get(), &info) != 0) return markError("cannot be looked at", path);
    if (!S_ISREG(info.st_mode))
        return fail(ErrorCode::kRefused, fmt::format("{}: it is no file: remove it, and revoke once more", path));
    const bool own = info.st_uid == geteuid() || info.st_uid == 0;
    if (!own || (info.st_mode & kOthersMayWrite) != 0)
        return fail(ErrorCode::kRefused,
                    fmt::format("{}: others may write it: `tessera-keys revoke --links` makes another one", path));
    std::array<char, kMostMarkBytes> text{};
    const ssize_t got = ::pread(file.get(), text.data(), text.size(), 0);
    if (got < 0) return markError("cannot be read", path);
    const std::string_view all(text.data(), static_cast<std::size_t>(got));
    const std::string_view mark = all.substr(0, all.find('\n'));
    if (mark.size() == all.size() || !isToken(mark))
        return fail(ErrorCode::kBadInput,
                    fmt::format("{}: holds no mark: `tessera-keys revoke --links` makes another one", path));
    return std::string(mark);
}

Expected<void> renewLinksMark(const std::string& folder) {
    const std::string path = markPath(folder), unfinished = fmt::format("{}/.links-{}.new", folder, ::getpid());
    const std::string text = freshToken() + "\n";
    ::unlink(unfinished.c_str());
    const FileHandle file(::open(unfinished.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600));
    if (file.get() < 0) return markError("cannot be written", path);
    if (::write(file.get(), text.data(), text.size()) != static_cast<ssize_t>(text.size()) ||
        ::fsync(file.get()) != 0 || ::rename(unfinished.c_str(), path.c_str()) != 0) {
        auto error = markError("cannot be written", path);
        ::unlink(unfinished.c_str());
        return error;
    }
    const FileHandle names(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (names.get() >= 0) (void)::fsync(names.get());
    return {};
}

}  // namespace tessera
