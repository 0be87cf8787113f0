#include "server/sim/journal/JournalFolder.h"

#include <dirent.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

namespace tessera {
namespace {

constexpr std::string_view kLog = "log-", kSnapshot = "snapshot-", kUnfinished = ".unfinished", kTorn = ".torn-";
constexpr std::uint64_t kTornPieceBytes = std::uint64_t{1} << 20;  ///< bytes in memory at once

/// The number behind `prefix`; nothing for any other name.
std::optional<std::uint64_t> numberIn(std::string_view name, std::string_view prefix) {
    if (!name.starts_with(prefix)) return std::nullopt;
    name.remove_prefix(prefix.size());
    std::uint64_t number = 0;
    const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), number);
    if (error != std::errc() || end != name.data() + name.size() || name.size() != 10) return std::nullopt;
    return number;
}

std::string nameOfLog(std::uint64_t number) {
    return fmt::format("{}{:010}", kLog, number);
}
std::string nameOfSnapshot(std::uint64_t number) {
    return fmt::format("{}{:010}", kSnapshot, number);
}

/// In words: those that count, at most 40 of them.
std::string namesOf(const JournalFiles& files) {
    constexpr std::size_t kMost = 40;
    std::string names = files.snapshot ? nameOfSnapshot(*files.snapshot) : "no snapshot";
    for (std::size_t i = 0; i < std::min(files.logs.size(), kMost); ++i) names += ", " + nameOfLog(files.logs[i]);
    return files.logs.size() > kMost ? names + " …" : names;
}

std::string words(int error) {
    return std::strerror(error);
}

tl::unexpected<Error> notSynced(const std::string& what, int error) {
    return fail(ErrorCode::kFailed, fmt::format("{}: the disk could not be made to keep it: {}", what, words(error)));
}

/// What the holder of a lock has written into it.
std::string holderOf(int lock) {
    char text[64] = {};
    const ssize_t got = ::pread(lock, text, sizeof(text) - 1, 0);
    return got > 0 ? std::string(text, static_cast<std::size_t>(got)) : std::string("another server");
}

}  // namespace

Expected<JournalFolder> JournalFolder::hold(const std::string& path, std::shared_ptr<FileSystem> calls) {
    const bool made = ::mkdir(path.c_str(), 0755) == 0;
    if (!made && errno != EEXIST)
        return fail(ErrorCode::kFailed, fmt::format("{}: the journal's folder cannot be made: {}", path, words(errno)));
    const std::string name = path + "/lock";
    const int lock = ::open(name.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0600);
    struct stat info {};
    const bool regular = lock >= 0 && ::fstat(lock, &info) == 0 && S_ISREG(info.st_mode);
    if (regular ? info.st_nlink > 1 : lock >= 0 || errno == ELOOP || errno == EISDIR) {
        if (lock >= 0) ::close(lock);
        return fail(ErrorCode::kBadInput,
                    fmt::format("{}: it is no file of a journal's own (a link, or no file at all)", name));
    }
    if (lock < 0)
        return fail(ErrorCode::kFailed, fmt::format("{}: a journal cannot be kept there: {}", name, words(errno)));
    JournalFolder folder(path, std::make_shared<JournalDisk>(std::move(calls)), lock);
    if (::flock(lock, LOCK_EX | LOCK_NB) != 0)
        return fail(ErrorCode::kRefused,
                    fmt::format("{}: this journal is in use by {}; a wall has one server, and each "
                                "server a journal of its own",
                                path, holderOf(lock)));
    const std::string holder = fmt::format("tessera-server, pid {}", ::getpid());
    // For people only: a full disk is no reason.
    if (::ftruncate(lock, 0) == 0) (void)!::pwrite(lock, holder.data(), holder.size(), 0);
    const std::string above = std::filesystem::path(path).parent_path().string();
    if (made)
        if (const int error = folder.disk_->syncFolder(above.empty() ? "." : above)) return notSynced(path, error);
    return folder;
}

JournalFolder::JournalFolder(JournalFolder&& other) noexcept
    : path_(std::move(other.path_)),
      disk_(std::move(other.disk_)),
      last_(std::move(other.last_)),
      lock_(std::exchange(other.lock_, -1)) {}

JournalFolder::~JournalFolder() {
    if (lock_ >= 0) ::close(lock_);
}

std::string JournalFolder::logPath(std::uint64_t number) const {
    return path_ + "/" + nameOfLog(number);
}
std::string JournalFolder::snapshotPath(std::uint64_t number) const {
    return path_ + "/" + nameOfSnapshot(number);
}

Expected<JournalFiles> JournalFolder::files() const {
    DIR* listing = ::opendir(path_.c_str());
    if (!listing) return fail(ErrorCode::kFailed, fmt::format("{}: {}", path_, words(errno)));
    JournalFiles files;
    std::vector<std::uint64_t> logs, snapshots;
    while (const dirent* entry = ::readdir(listing)) {
        const std::string_view name = entry->d_name;
        if (const auto log = numberIn(name, kLog)) logs.push_back(*log);
        if (const auto snapshot = numberIn(name, kSnapshot)) snapshots.push_back(*snapshot);
        if (name.ends_with(kUnfinished)) files.unfinished.push_back(fmt::format("{}/{}", path_, name));
    }
    ::closedir(listing);
    std::ranges::sort(logs);
    std::ranges::sort(snapshots);
    if (!snapshots.empty()) {
        files.snapshot = snapshots.back();
        snapshots.pop_back();
    }
    for (const std::uint64_t old : snapshots) files.leftOver.push_back(snapshotPath(old));
    for (const std::uint64_t log : logs)
        if (files.snapshot && log < *files.snapshot)
            files.leftOver.push_back(logPath(log));
        else
            files.logs.push_back(log);
    Expected<std::optional<JournalEnd>> end = last_->read();
    if (!end) return tl::unexpected(end.error());
    files.end = std::move(*end);
    // (Somebody may have renamed one: a person sees it by those that are there.)
    const auto missing = [&](const std::string& path) {
        return fail(ErrorCode::kBadInput,
                    fmt::format("{} is missing. Put it back; in the folder are {}", path, namesOf(files)));
    };
    if (files.snapshot && files.logs.empty()) return missing(logPath(*files.snapshot));
    std::uint64_t expected = files.snapshot.value_or(1);
    if (!files.snapshot && !files.logs.empty() && files.logs.front() > 1)
        return missing(snapshotPath(files.logs.front()) + " or " + logPath(files.logs.front() - 1));
    for (const std::uint64_t log : files.logs)
        if (log != expected++) return missing(logPath(expected - 1));
    if (files.end && files.lastLog() < files.end->log)
        return fail(ErrorCode::kBadInput,
                    fmt::format("{} is missing: the journal's newest edits are in it. Put it back; or, to go on "
                                "without it, {}",
                                logPath(files.end->log), last_->cure(files.lastLog())));
    // A log has its name a moment before `last` names it, and then nobody builds on it.
    if (files.end && files.end->extent && files.lastLog() > files.end->log + 1)
        return fail(ErrorCode::kBadInput,
                    fmt::format("{}: it names log {} as the newest, and {} is there. Put back a copy that is as new; "
                                "or, to go on with the logs that are there, {}",
                                last_->path(), files.end->log, logPath(files.lastLog()), last_->cure(files.lastLog())));
    return files;
}

std::optional<std::string> JournalFolder::findLoss(const JournalFile& log, std::uint64_t number) const {
    if (!standsFor(lockPath(), lock_, 0)) return lockPath() + " was taken away or replaced";
    if (!last_->isThere()) return last_->path() + " was taken away or replaced";
    if (!log.isWhole(logPath(number))) return logPath(number) + " was taken away, replaced or shortened";
    return std::nullopt;
}

int JournalFolder::name(const std::string& unfinished, const std::string& path) const {
    if (const int error = disk_->calls().rename(unfinished, path)) {
        remove(unfinished);
        return error;
    }
    return disk_->syncFolder(path_);
}

Expected<JournalFile> JournalFolder::beginLog(const journal::Opening& opening,
                                              std::span<const RecordContent> then) const {
    const std::string path = logPath(opening.number), unfinished = path + std::string(kUnfinished);
    Expected<JournalFile> file = JournalFile::create(disk_, unfinished, opening);
    if (!file) return file;
    int error = 0;
    for (const RecordContent& record : then)
        if (error == 0) error = file->append(record);
    if (error == 0) error = file->sync();
    if (error == 0)
        if (Expected<void> prepared = last_->prepare({opening.number, file->openingHash()}, file->bytes()); !prepared) {
            remove(unfinished);
            return tl::unexpected(prepared.error());
        }
    if (error != 0)
        remove(unfinished);
    else
        error = name(unfinished, path);
    if (error != 0) {
        last_->drop();
        return fail(ErrorCode::kFailed, fmt::format("{}: the journal cannot be written: {}", path, words(error)));
    }
    if (error = name(last_->unfinished(), last_->path()); error == 0) {
        last_->taken();
        return file;
    }
    // The old log would go on beside a new one, which says where the old one ends.
    disk_->lose(error);
    return notSynced(last_->path(), error);
}

Expected<void> JournalFolder::nameLast(const LogName& log, std::uint64_t bytes) const {
    if (Expected<void> prepared = last_->prepare(log, bytes); !prepared) return prepared;
    if (const int error = name(last_->unfinished(), last_->path())) {
        last_->drop();
        return notSynced(last_->path(), error);
    }
    last_->taken();
    return {};
}

std::optional<std::string> JournalFolder::freeTornPath(std::uint64_t number) const {
    std::error_code unknown;
    std::size_t kept = 0;
    for (std::filesystem::directory_iterator entry(path_, unknown), end; entry != end; entry.increment(unknown))
        if (entry->path().filename().string().find(kTorn) != std::string::npos) ++kept;
    for (std::size_t i = 1; kept < kMostTornEnds && i <= kMostTornEnds; ++i)
        if (std::string path = fmt::format("{}{}{}", logPath(number), kTorn, i);
            !std::filesystem::exists(path, unknown))
            return path;
    return std::nullopt;
}

Expected<std::string> JournalFolder::keepTornEnd(std::uint64_t number, std::uint64_t wholeBytes) const {
    const std::optional<std::string> path = freeTornPath(number);
    if (!path)
        return fail(ErrorCode::kFailed,
                    fmt::format("{}: the torn end of {} cannot be kept beside it: {} files {}*{}* are there. Look at "
                                "them and move them away; the log is as it was",
                                path_, logPath(number), kMostTornEnds, kLog, kTorn));
    const std::string unfinished = *path + std::string(kUnfinished);
    const Expected<RecordSource> log = RecordSource::open(logPath(number));
    if (!log) return failWith(logPath(number), log.error());
    int file = -1;
    int error = disk_->calls().create(unfinished, file);
    for (std::uint64_t at = wholeBytes; at < log->size() && error == 0; at += kTornPieceBytes) {
        const Expected<Bytes> piece = log->read(at, std::min(kTornPieceBytes, log->size() - at));
        if (!piece) {
            disk_->calls().close(file);
            remove(unfinished);
            return failWith(logPath(number), piece.error());
        }
        error = disk_->calls().append(file, *piece, {});
    }
    if (error == 0) error = disk_->sync(file);
    if (file >= 0) disk_->calls().close(file);
    if (error == 0) error = name(unfinished, *path);
    if (error == 0) return *path;
    remove(unfinished);
    return fail(ErrorCode::kFailed,
                fmt::format("{}: the torn end of the log cannot be kept there: {}. Make room; the log is as it was",
                            *path, words(error)));
}

Expected<void> JournalFolder::sealLog(std::uint64_t number, std::uint64_t wholeBytes) const {
    const std::string path = logPath(number);
    int file = -1;
    int error = disk_->calls().open(path, file);
    if (error == 0) error = disk_->calls().truncate(file, wholeBytes);
    if (error == 0) error = disk_->sync(file);
    if (file >= 0) disk_->calls().close(file);
    if (error == 0) return {};
    return disk_->failedSync() != 0
               ? notSynced(path, error)
               : fail(ErrorCode::kFailed, fmt::format("{}: it cannot be shortened: {}", path, words(error)));
}

Expected<JournalFile> JournalFolder::beginSnapshot(const journal::Opening& opening) const {
    return JournalFile::create(disk_, snapshotPath(opening.number) + std::string(kUnfinished), opening);
}

Expected<void> JournalFolder::finishSnapshot(const JournalFile& file, std::uint64_t number) const {
    const std::string path = snapshotPath(number), unfinished = path + std::string(kUnfinished);
    if (const int error = file.sync()) {
        remove(unfinished);
        return notSynced(unfinished, error);
    }
    const int error = name(unfinished, path);
    if (error == 0) return {};
    remove(path);  // what it was made of is there: a start shall not trust a name that may not last
    return notSynced(path, error);
}

void JournalFolder::dropSnapshot(std::uint64_t number) const {
    remove(snapshotPath(number) + std::string(kUnfinished));
}

}  // namespace tessera
