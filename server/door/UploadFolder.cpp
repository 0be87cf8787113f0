#include "server/door/UploadFolder.h"

#include <dirent.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <set>

#include "common/base/Controls.h"

namespace tessera {
namespace {

constexpr std::string_view kTemporary = ".incoming-", kOwn = "tessera-uploads-";
constexpr std::size_t kMostLooks = 100'000;  ///< for what others have left

std::string words(int error) {
    return std::strerror(error);
}

FileHandle openFolder(int above, const std::string& name) {
    return FileHandle(::openat(above, name.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
}

/// The folders on the way to what has these names, the first one first: as far as there are such.
std::vector<FileHandle> foldersTo(int folder, const std::vector<std::string>& names) {
    std::vector<FileHandle> way;
    for (std::size_t i = 0; i + 1 < names.size(); ++i) {
        FileHandle next = openFolder(way.empty() ? folder : way.back().get(), names[i]);
        if (next.get() < 0) break;
        way.push_back(std::move(next));
    }
    return way;
}

/// Calls `each(name, what it is)` for all in the folder but "." and "..", until it says false.
template <typename Each>
void forAll(int folder, Each each) {
    const int again = ::openat(folder, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    const std::unique_ptr<DIR, int (*)(DIR*)> listing(again >= 0 ? ::fdopendir(again) : nullptr, &::closedir);
    if (!listing) return;
    while (const dirent* entry = ::readdir(listing.get())) {
        const std::string name = entry->d_name;
        struct stat info {};
        if (name == "." || name == ".." || ::fstatat(folder, name.c_str(), &info, AT_SYMLINK_NOFOLLOW) != 0) continue;
        if (!each(name, info)) return;
    }
}

/// `looks`: that are left.
void count(int folder, std::size_t levels, UploadFolder::Used& used, std::size_t& looks) {
    forAll(folder, [&](const std::string& name, const struct stat& info) {
        if (looks == 0) return false;
        --looks;
        if (S_ISDIR(info.st_mode)) {
            const FileHandle inner = levels > 1 ? openFolder(folder, name) : FileHandle();
            if (inner.get() >= 0) count(inner.get(), levels - 1, used, looks);
        } else if (!name.starts_with(kTemporary)) {
            used.bytes += static_cast<std::uint64_t>(info.st_size);
            ++used.files;
        }
        return true;
    });
}

/// False: something is left.
bool removeAll(int above, const std::string& name) {
    if (::unlinkat(above, name.c_str(), 0) == 0) return true;
    if (errno != EISDIR && errno != EPERM) return false;
    if (const FileHandle folder = openFolder(above, name); folder.get() >= 0)
        forAll(folder.get(), [&](const std::string& inner, const struct stat&) {
            (void)removeAll(folder.get(), inner);
            return true;
        });
    return ::unlinkat(above, name.c_str(), AT_REMOVEDIR) == 0;
}

bool standsFor(const std::string& path, int folder) {
    struct stat named {
    }, open{};
    return ::fstat(folder, &open) == 0 && ::lstat(path.c_str(), &named) == 0 && named.st_dev == open.st_dev &&
           named.st_ino == open.st_ino;
}

std::string folderForTemporaryFiles() {
    const char* const said = std::getenv("TMPDIR");
    for (const char* const one : {said != nullptr ? said : "", "/var/tmp", "/tmp"})
        if (*one != '\0' && ::access(one, W_OK | X_OK) == 0) return one;
    return "/tmp";
}

/// What servers of this user have left that run no more.
void sweep(const std::string& in) {
    const FileHandle above(::open(in.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (above.get() < 0) return;
    std::size_t looks = 0;
    forAll(above.get(), [&](const std::string& name, const struct stat& info) {
        if (!name.starts_with(kOwn) || !S_ISDIR(info.st_mode) || info.st_uid != ::geteuid())
            return ++looks < kMostLooks;
        const FileHandle folder = openFolder(above.get(), name);
        if (folder.get() >= 0 && ::flock(folder.get(), LOCK_EX | LOCK_NB) == 0) (void)removeAll(above.get(), name);
        return ++looks < kMostLooks;
    });
}

Expected<void> checkName(std::string_view name) {
    const auto bad = [](std::string_view why) {
        return fail(ErrorCode::kBadInput, fmt::format("a file's name is to be a plain one: {}", why));
    };
    if (name.empty()) return bad("one is empty");
    if (name.front() == '.') return bad("one begins with a point");
    if (name.size() > UploadLimits::kMaxNameBytes)
        return bad(fmt::format("one has more than {} bytes", UploadLimits::kMaxNameBytes));
    if (!isUtf8(name)) return bad("one is no UTF-8");
    for (std::string_view rest = name; !rest.empty(); rest.remove_prefix(utf8CharacterLength(rest))) {
        const char32_t number = numberOfCharacter(rest.substr(0, utf8CharacterLength(rest)));
        if (isControl(number)) return bad("a control character is in one");
        if (number == U'\\') return bad("a backslash is in one");
    }
    return {};
}

}  // namespace

Expected<std::vector<std::string>> uploadNames(std::string_view path) {
    std::vector<std::string> names;
    while (true) {
        const std::string_view name = path.substr(0, path.find('/'));
        if (const Expected<void> good = checkName(name); !good) return tl::unexpected(good.error());
        names.emplace_back(name);
        if (names.size() > UploadLimits::kMaxDepth)
            return fail(ErrorCode::kBadInput,
                        fmt::format("a file lies in {} folders at most", UploadLimits::kMaxDepth - 1));
        if (name.size() == path.size()) return names;
        path.remove_prefix(name.size() + 1);
    }
}

Expected<std::shared_ptr<UploadFolder>> UploadFolder::open(const std::string& path, UploadLimits limits) {
    const bool made = ::mkdir(path.c_str(), 0700) == 0;
    if (!made && errno != EEXIST)
        return fail(ErrorCode::kFailed, fmt::format("{}: this folder cannot be made: {}", path, words(errno)));
    std::error_code error;
    const std::string whole = std::filesystem::canonical(path, error).string();
    FileHandle folder(error ? -1 : ::open(whole.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (folder.get() < 0) return fail(ErrorCode::kFailed, fmt::format("{}: this is no folder", path));
    if (::faccessat(folder.get(), ".", W_OK | X_OK, 0) != 0)
        return fail(ErrorCode::kFailed, fmt::format("{}: nothing can be written there: {}", path, words(errno)));
    if (::flock(folder.get(), LOCK_EX | LOCK_NB) != 0)
        return fail(ErrorCode::kRefused, fmt::format("{}: another server takes uploads there", path));
    std::vector<std::string> left;
    forAll(folder.get(), [&](const std::string& name, const struct stat& info) {
        if (name.starts_with(kTemporary) && S_ISREG(info.st_mode)) left.push_back(name);
        return left.size() < kMostLooks;
    });
    for (const std::string& name : left) (void)::unlinkat(folder.get(), name.c_str(), 0);
    return std::shared_ptr<UploadFolder>(new UploadFolder(whole, std::move(folder), limits));
}

Expected<std::shared_ptr<UploadFolder>> UploadFolder::openOwn(UploadLimits limits) {
    const std::string in = folderForTemporaryFiles();
    sweep(in);
    constexpr int kAttempts = 8;
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
        std::string path = fmt::format("{}/{}XXXXXX", in, kOwn);
        if (::mkdtemp(path.data()) == nullptr)
            return fail(ErrorCode::kFailed, fmt::format("{}: no folder can be made there: {}", in, words(errno)));
        Expected<std::shared_ptr<UploadFolder>> folder = open(path, limits);
        // Another server that starts may have taken it for one that is left over.
        if (!folder || !standsFor((*folder)->path(), (*folder)->folder_.get())) continue;
        (*folder)->isOwn_ = true;
        return folder;
    }
    return fail(ErrorCode::kFailed, fmt::format("{}: no folder for uploads stays there", in));
}

UploadFolder::~UploadFolder() {
    if (isOwn_) (void)removeAll(AT_FDCWD, path_);
}

UploadFolder::Used UploadFolder::used() const {
    const Turn::Hold turn = turn_.take();
    return count();
}

UploadFolder::Used UploadFolder::count() const {
    Used used;
    std::size_t looks = limits_.maxLooks;
    tessera::count(folder_.get(), UploadLimits::kMaxDepth, used, looks);
    if (looks == 0) used.files = std::max(used.files, limits_.maxLooks);  // what was not seen takes room, too
    std::set<std::vector<std::string>> replaced;
    for (const Coming& coming : coming_) {
        used.bytes += coming.bytes;
        ++used.files;
        // Which of the two stays is not known yet. Two of one name: either may stay beside nothing else.
        const std::optional<std::uint64_t> old = bytesOf(coming.names);
        if (!old || !replaced.insert(coming.names).second) continue;
        used.bytes -= std::min(*old, coming.bytes);
        --used.files;
    }
    return used;
}

std::optional<std::uint64_t> UploadFolder::bytesOf(const std::vector<std::string>& names) const {
    const std::vector<FileHandle> folders = foldersTo(folder_.get(), names);
    struct stat info {};
    if (folders.size() + 1 != names.size()) return std::nullopt;
    const int at = folders.empty() ? folder_.get() : folders.back().get();
    if (::fstatat(at, names.back().c_str(), &info, AT_SYMLINK_NOFOLLOW) != 0 || S_ISDIR(info.st_mode))
        return std::nullopt;
    return static_cast<std::uint64_t>(info.st_size);
}

Expected<void> UploadFolder::checkRoom(const std::vector<std::string>& names, std::uint64_t bytes) const {
    if (bytes > limits_.maxBytes)
        return fail(ErrorCode::kLimit, fmt::format("the file has {} bytes; uploads may have {} MiB together "
                                                   "(--uploads-mib)",
                                                   bytes, limits_.maxBytes >> 20));
    const Used used = count();
    const bool comes = std::ranges::find(coming_, names, &Coming::names) != coming_.end();
    const std::optional<std::uint64_t> old = comes ? std::nullopt : bytesOf(names);
    if (!old && used.files >= limits_.maxFiles)
        return fail(ErrorCode::kLimit,
                    fmt::format("{} files lie in the folder for uploads already: remove some", used.files));
    const std::uint64_t more = bytes - std::min(bytes, old.value_or(0));
    if (used.bytes > limits_.maxBytes - more)
        return fail(ErrorCode::kLimit,
                    fmt::format("uploads have {} of {} MiB (--uploads-mib), and the file {} more: remove some",
                                used.bytes >> 20, limits_.maxBytes >> 20, (more + 0xFFFFF) >> 20));
    struct statvfs disk {};
    if (::fstatvfs(folder_.get(), &disk) != 0) return {};
    std::uint64_t taken = UploadLimits::kLeftFree;
    for (const Coming& coming : coming_) taken += coming.bytes - coming.written;
    const std::uint64_t free = std::uint64_t{disk.f_bavail} * disk.f_frsize;
    if (free < bytes + taken)
        return fail(ErrorCode::kLimit,
                    fmt::format("the server's disk has room for {} MiB more", free > taken ? (free - taken) >> 20 : 0));
    return {};
}

Expected<std::shared_ptr<UploadFolder::Incoming>> UploadFolder::begin(const std::shared_ptr<UploadFolder>& folder,
                                                                      std::string_view path, std::uint64_t bytes) {
    Expected<std::vector<std::string>> names = uploadNames(path);
    if (!names) return tl::unexpected(names.error());
    std::shared_ptr<Incoming> incoming;
    {
        const Turn::Hold turn = folder->turn_.take();
        if (const Expected<void> room = folder->checkRoom(*names, bytes); !room) return tl::unexpected(room.error());
        folder->coming_.push_back({std::move(*names), bytes});
        incoming.reset(new Incoming(folder, std::prev(folder->coming_.end()),
                                    fmt::format("{}{}", kTemporary, ++folder->numbers_)));
    }
    incoming->file_ = FileHandle(::openat(folder->folder_.get(), incoming->temporary_.c_str(),
                                          O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600));
    if (incoming->file_.get() < 0)
        return fail(ErrorCode::kFailed, fmt::format("the server cannot write the file: {}", words(errno)));
    return incoming;
}

UploadFolder::Incoming::~Incoming() {
    file_.close();
    if (!temporary_.empty()) (void)::unlinkat(folder_->folder_.get(), temporary_.c_str(), 0);
    const Turn::Hold turn = folder_->turn_.take();
    folder_->coming_.erase(coming_);
}

Expected<void> UploadFolder::Incoming::write(ByteSpan bytes) {
    {
        const Turn::Hold turn = folder_->turn_.take();
        if (bytes.size() > coming_->bytes - coming_->written)
            return fail(ErrorCode::kBadInput, "more has come than was said");
        coming_->written += bytes.size();
    }
    while (!bytes.empty()) {
        const ssize_t count = ::write(file_.get(), bytes.data(), bytes.size());
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0)
            return fail(errno == ENOSPC || errno == EDQUOT || errno == EFBIG ? ErrorCode::kLimit : ErrorCode::kFailed,
                        fmt::format("the server cannot write the file: {}", words(errno)));
        bytes = bytes.subspan(static_cast<std::size_t>(count));
    }
    return {};
}

Expected<std::string> UploadFolder::Incoming::finish() {
    const std::vector<std::string>& names = coming_->names;
    const auto failed = [&](const std::string& name) {
        return fail(errno == ENOTDIR || errno == ELOOP || errno == EISDIR ? ErrorCode::kRefused : ErrorCode::kFailed,
                    fmt::format("{}: the server cannot put the file there: {}", name, words(errno)));
    };
    if (coming_->written != coming_->bytes) return fail(ErrorCode::kBadInput, "less has come than was said");
    if (::fdatasync(file_.get()) != 0) return failed(names.back());
    const Turn::Hold turn = folder_->turn_.take();
    FileHandle inner;
    std::string path = folder_->path_;
    int at = folder_->folder_.get();
    for (std::size_t i = 0; i + 1 < names.size(); ++i) {
        if (::mkdirat(at, names[i].c_str(), 0700) != 0 && errno != EEXIST) return failed(names[i]);
        FileHandle next = openFolder(at, names[i]);
        if (next.get() < 0) return failed(names[i]);
        inner = std::move(next);
        at = inner.get();
        path += "/" + names[i];
    }
    if (::renameat(folder_->folder_.get(), temporary_.c_str(), at, names.back().c_str()) != 0)
        return failed(names.back());
    temporary_.clear();
    (void)::fsync(at);
    return path + "/" + names.back();
}

Expected<void> UploadFolder::remove(std::string_view path) {
    const Expected<std::vector<std::string>> names = uploadNames(path);
    if (!names) return tl::unexpected(names.error());
    const Turn::Hold turn = turn_.take();
    const std::vector<FileHandle> inner = foldersTo(folder_.get(), *names);
    const int at = inner.empty() ? folder_.get() : inner.back().get();
    struct stat info {};
    if (inner.size() + 1 != names->size() || ::fstatat(at, names->back().c_str(), &info, AT_SYMLINK_NOFOLLOW) != 0)
        return fail(ErrorCode::kNotFound, "there is no such file");
    if (!removeAll(at, names->back()))
        return fail(ErrorCode::kFailed, fmt::format("the server cannot remove it: {}", words(errno)));
    // Folders count as no files: nobody is to fill the disk with empty ones.
    for (std::size_t i = inner.size(); i-- > 0;)
        if (::unlinkat(i > 0 ? inner[i - 1].get() : folder_.get(), (*names)[i].c_str(), AT_REMOVEDIR) != 0) break;
    return {};
}

Expected<FileHandle> namelessFile(const std::string& folder) {
    const std::string in = folder.empty() ? folderForTemporaryFiles() : folder;
    FileHandle file(::open(in.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600));
    if (file.get() >= 0) return file;
    // Not every file system has such.
    std::string path = in + "/.incoming-XXXXXX";
    file = FileHandle(::mkostemp(path.data(), O_CLOEXEC));
    if (file.get() < 0)
        return fail(ErrorCode::kFailed, fmt::format("{}: nothing can be written: {}", in, words(errno)));
    (void)::unlink(path.c_str());
    return file;
}

Expected<void> writeNameless(const FileHandle& file, ByteSpan bytes, std::uint64_t leftFree) {
    const auto full = [] { return fail(ErrorCode::kLimit, "the server's disk has no room for it"); };
    struct statvfs disk {};
    if (::fstatvfs(file.get(), &disk) == 0 && std::uint64_t{disk.f_bavail} * disk.f_frsize < bytes.size() + leftFree)
        return full();
    while (!bytes.empty()) {
        const ssize_t count = ::write(file.get(), bytes.data(), bytes.size());
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) return full();
        bytes = bytes.subspan(static_cast<std::size_t>(count));
    }
    return {};
}

}  // namespace tessera
