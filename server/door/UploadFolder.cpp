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

#include "common/base/Controls.h"

namespace tessera {
namespace {

constexpr std::string_view kTemporary = ".incoming-", kOwn = "tessera-uploads-";
constexpr std::size_t kMostLooks = 100'000;                   ///< for what others have left
constexpr std::uint64_t kLeftFree = std::uint64_t{64} << 20;  ///< of the disk, for whoever else writes there

std::string words(int error) {
    return std::strerror(error);
}

FileHandle openFolder(int above, const std::string& name) {
    return FileHandle(::openat(above, name.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
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
    Used used;
    std::size_t looks = limits_.maxLooks;
    count(folder_.get(), UploadLimits::kMaxDepth, used, looks);
    if (looks == 0) used.files = std::max(used.files, limits_.maxLooks);  // what was not seen takes room, too
    used.bytes += comingBytes_;
    used.files += comingFiles_;
    return used;
}

void UploadFolder::takeBack(std::uint64_t bytes) {
    comingBytes_ -= bytes;
    --comingFiles_;
}

Expected<std::shared_ptr<UploadFolder::Incoming>> UploadFolder::begin(const std::shared_ptr<UploadFolder>& folder,
                                                                      std::string_view path, std::uint64_t bytes) {
    Expected<std::vector<std::string>> names = uploadNames(path);
    if (!names) return tl::unexpected(names.error());
    const UploadLimits& limits = folder->limits_;
    if (bytes > limits.maxBytes)
        return fail(ErrorCode::kLimit, fmt::format("the file has {} bytes; uploads may have {} MiB together "
                                                   "(--uploads-mib)",
                                                   bytes, limits.maxBytes >> 20));
    const Used used = folder->used();
    if (used.files >= limits.maxFiles)
        return fail(ErrorCode::kLimit,
                    fmt::format("{} files lie in the folder for uploads already: remove some", used.files));
    if (used.bytes > limits.maxBytes - bytes)
        return fail(ErrorCode::kLimit,
                    fmt::format("uploads have {} of {} MiB (--uploads-mib), and the file {} more: remove some",
                                used.bytes >> 20, limits.maxBytes >> 20, (bytes + 0xFFFFF) >> 20));
    struct statvfs disk {};
    if (::fstatvfs(folder->folder_.get(), &disk) == 0) {
        const std::uint64_t free = std::uint64_t{disk.f_bavail} * disk.f_frsize;
        if (free < bytes + kLeftFree)
            return fail(ErrorCode::kLimit, fmt::format("the server's disk has room for {} MiB more",
                                                       free > kLeftFree ? (free - kLeftFree) >> 20 : 0));
    }
    const std::string temporary = fmt::format("{}{}", kTemporary, ++folder->numbers_);
    folder->comingBytes_ += bytes;
    ++folder->comingFiles_;
    std::shared_ptr<Incoming> incoming(new Incoming(folder, std::move(*names), bytes));
    incoming->temporary_ = temporary;
    incoming->file_ = FileHandle(
        ::openat(folder->folder_.get(), temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600));
    if (incoming->file_.get() < 0)
        return fail(ErrorCode::kFailed, fmt::format("the server cannot write the file: {}", words(errno)));
    return incoming;
}

UploadFolder::Incoming::~Incoming() {
    file_.close();
    if (!temporary_.empty()) (void)::unlinkat(folder_->folder_.get(), temporary_.c_str(), 0);
    folder_->takeBack(bytes_);
}

Expected<void> UploadFolder::Incoming::write(ByteSpan bytes) {
    written_ += bytes.size();
    if (written_ > bytes_) return fail(ErrorCode::kBadInput, "more has come than was said");
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
    const auto failed = [&](const std::string& name) {
        return fail(errno == ENOTDIR || errno == ELOOP || errno == EISDIR ? ErrorCode::kRefused : ErrorCode::kFailed,
                    fmt::format("{}: the server cannot put the file there: {}", name, words(errno)));
    };
    if (written_ != bytes_) return fail(ErrorCode::kBadInput, "less has come than was said");
    if (::fdatasync(file_.get()) != 0) return failed(names_.back());
    FileHandle inner;
    std::string path = folder_->path_;
    int at = folder_->folder_.get();
    for (std::size_t i = 0; i + 1 < names_.size(); ++i) {
        if (::mkdirat(at, names_[i].c_str(), 0700) != 0 && errno != EEXIST) return failed(names_[i]);
        FileHandle next = openFolder(at, names_[i]);
        if (next.get() < 0) return failed(names_[i]);
        inner = std::move(next);
        at = inner.get();
        path += "/" + names_[i];
    }
    if (::renameat(folder_->folder_.get(), temporary_.c_str(), at, names_.back().c_str()) != 0)
        return failed(names_.back());
    temporary_.clear();
    (void)::fsync(at);
    return path + "/" + names_.back();
}

Expected<void> UploadFolder::remove(std::string_view path) {
    const Expected<std::vector<std::string>> names = uploadNames(path);
    if (!names) return tl::unexpected(names.error());
    std::vector<FileHandle> inner;
    int at = folder_.get();
    for (std::size_t i = 0; i + 1 < names->size(); ++i) {
        at = inner.emplace_back(openFolder(at, (*names)[i])).get();
        if (at < 0) return fail(ErrorCode::kNotFound, "there is no such file");
    }
    struct stat info {};
    if (::fstatat(at, names->back().c_str(), &info, AT_SYMLINK_NOFOLLOW) != 0)
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

}  // namespace tessera
