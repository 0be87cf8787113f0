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

#include "server/sim/journal/JournalReader.h"

namespace tessera {
namespace {

constexpr std::string_view kLog = "log-", kSnapshot = "snapshot-", kUnfinished = ".unfinished";

/// The number behind `prefix`; nothing for any other name.
std::optional<std::uint64_t> numberIn(std::string_view name, std::string_view prefix) {
    if (!name.starts_with(prefix)) return std::nullopt;
    name.remove_prefix(prefix.size());
    std::uint64_t number = 0;
    const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), number);
    if (error != std::errc() || end != name.data() + name.size() || name.size() != 10) return std::nullopt;
    return number;
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

/// Whether the name stands for the open file. A name that cannot be looked at is not known to be gone.
bool standsFor(const std::string& path, int file, std::uint64_t leastBytes) {
    struct stat named = {}, open = {};
    if (::fstat(file, &open) != 0) return true;
    if (::stat(path.c_str(), &named) != 0) return errno != ENOENT && errno != ENOTDIR;
    return named.st_dev == open.st_dev && named.st_ino == open.st_ino &&
           static_cast<std::uint64_t>(open.st_size) >= leastBytes;
}

}  // namespace

int JournalDisk::remembered(int error) {
    if (error != 0) failed_ = error;
    return error;
}

int JournalDisk::sync(int file) {
    const int failed = failed_;
    return failed != 0 ? failed : remembered(calls_->sync(file));
}

int JournalDisk::syncFolder(const std::string& path) {
    const int failed = failed_;
    return failed != 0 ? failed : remembered(calls_->syncFolder(path));
}

Expected<JournalFolder> JournalFolder::hold(const std::string& path, std::shared_ptr<FileSystem> calls) {
    const bool made = ::mkdir(path.c_str(), 0755) == 0;
    if (!made && errno != EEXIST)
        return fail(ErrorCode::kFailed, fmt::format("{}: the journal's folder cannot be made: {}", path, words(errno)));
    const std::string name = path + "/lock";
    const int lock = ::open(name.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
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
    : path_(std::move(other.path_)), disk_(std::move(other.disk_)), lock_(std::exchange(other.lock_, -1)) {}

JournalFolder::~JournalFolder() {
    if (lock_ >= 0) ::close(lock_);
}

std::string JournalFolder::logPath(std::uint64_t number) const {
    return fmt::format("{}/{}{:010}", path_, kLog, number);
}
std::string JournalFolder::snapshotPath(std::uint64_t number) const {
    return fmt::format("{}/{}{:010}", path_, kSnapshot, number);
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
    const Expected<std::uint64_t> last = lastOfAll();
    if (!last) return tl::unexpected(last.error());
    files.newest = *last;
    if (files.lastLog() < *last)
        return fail(
            ErrorCode::kBadInput,
            fmt::format(
                "{} is missing: the journal's newest edits are in it; put it back, or remove {} to go on without it",
                logPath(*last), lastPath()));
    std::uint64_t expected = files.snapshot.value_or(1);
    if (files.snapshot && files.logs.empty())
        return fail(ErrorCode::kBadInput,
                    fmt::format("{} is missing: the journal's newest edits are in it", logPath(expected)));
    for (const std::uint64_t log : files.logs)
        if (log != expected++) return fail(ErrorCode::kBadInput, fmt::format("{} is missing", logPath(expected - 1)));
    return files;
}

std::optional<std::string> JournalFolder::findLoss(const JournalFile& log, std::uint64_t number) const {
    if (!standsFor(lockPath(), lock_, 0)) return lockPath() + " was taken away or replaced";
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

/// 0 where there is no such file: older versions write none.
Expected<std::uint64_t> JournalFolder::lastOfAll() const {
    const Expected<RecordSource> source = RecordSource::open(lastPath());
    std::error_code unknown;
    if (!source && !std::filesystem::exists(lastPath(), unknown)) return 0;
    if (!source) return failWith(lastPath(), source.error());
    constexpr std::uint64_t kDigits = 20;
    const Expected<Bytes> bytes = source->read(0, std::min(source->size(), kDigits + 1));
    if (!bytes) return failWith(lastPath(), bytes.error());
    const std::string_view text = asText(*bytes);
    std::uint64_t number = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error == std::errc() && std::string_view(end, text.data() + text.size()) == "\n") return number;
    return fail(ErrorCode::kBadInput, lastPath() + ": it names no log; remove it to go on with those that are there");
}

Expected<void> JournalFolder::writeLast(std::uint64_t number) const {
    const std::string unfinished = lastPath() + std::string(kUnfinished), text = fmt::format("{}\n", number);
    int file = -1;
    int error = disk_->calls().create(unfinished, file);
    if (error == 0) error = disk_->calls().append(file, asBytes(text), {});
    if (error == 0) error = disk_->sync(file);
    if (file >= 0) disk_->calls().close(file);
    if (error == 0) return {};
    remove(unfinished);
    return fail(ErrorCode::kFailed, fmt::format("{}: it cannot be written: {}", unfinished, words(error)));
}

Expected<JournalFile> JournalFolder::beginLog(const journal::Opening& opening,
                                              std::span<const RecordContent> then) const {
    const std::string path = logPath(opening.number), unfinished = path + std::string(kUnfinished),
                      last = lastPath() + std::string(kUnfinished);
    if (Expected<void> written = writeLast(opening.number); !written) return tl::unexpected(written.error());
    Expected<JournalFile> file = JournalFile::create(disk_, unfinished, opening);
    int error = 0;
    for (const RecordContent& record : then)
        if (file && error == 0) error = file->append(record);
    if (file && error == 0) error = file->sync();
    if (file && error == 0) error = name(unfinished, path);
    if (!file || error != 0) remove(last);
    if (!file) return file;
    if (error != 0)
        return fail(ErrorCode::kFailed, fmt::format("{}: the journal cannot be written: {}", path, words(error)));
    if (error = name(last, lastPath()); error == 0) return file;
    // The old log would go on beside a new one, which says where the old one ends.
    disk_->lose(error);
    return notSynced(lastPath(), error);
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

namespace {

/// Reads a file to its end. The reader is left there. `places`: the reader's, or null.
Expected<void> takeAll(JournalReader& reader, JournalState& state, JournalPlaces* places,
                       const std::atomic<bool>* stop) {
    while (true) {
        if (stop && *stop) return fail(ErrorCode::kFailed, "it was stopped");
        Expected<std::optional<JournalRecord>> record = reader.next();
        if (!record) return tl::unexpected(record.error());
        if (!*record) return {};
        const auto* frame = places ? std::get_if<journal::Frame>(&**record) : nullptr;
        if (frame && frame->list)
            if (const Expected<void> known = places->comes(*frame->list, state.scene, reader.ranges()); !known)
                return failWith(reader.where(), known.error());
        if (const Expected<void> taken = state.take(std::move(**record)); !taken)
            return failWith(reader.where(), taken.error());
        if (places) places->sweep(state.history);
    }
}

Expected<void> wholeOrRefused(const JournalReader& reader) {
    if (reader.bytesLeft() == 0) return {};
    return fail(ErrorCode::kBadInput, reader.where() + ": the file is cut off there, and others follow it");
}

/// `kept`: the arrays, or their places.
template <typename Kept>
Expected<JournalStory> read(const JournalFolder& folder, const JournalFiles& files, Kept& kept,
                            const JournalLimits& limits, std::optional<std::uint64_t> upTo,
                            const std::atomic<bool>* stop) {
    JournalPlaces* places = nullptr;
    if constexpr (std::is_same_v<Kept, JournalPlaces>) places = &kept;
    JournalStory story;
    if (files.snapshot) {
        Expected<JournalReader> reader = JournalReader::open(folder.snapshotPath(*files.snapshot), kept, limits);
        if (!reader) return tl::unexpected(reader.error());
        if (Expected<void> taken = takeAll(*reader, story.state, places, stop); !taken)
            return tl::unexpected(taken.error());
        if (Expected<void> whole = wholeOrRefused(*reader); !whole) return tl::unexpected(whole.error());
        story.snapshotBytes = reader->wholeBytes();
        if (story.state.number != *files.snapshot)
            return fail(ErrorCode::kBadInput, reader->name() + ": it is the snapshot of another log");
    }
    for (const std::uint64_t number : files.logs) {
        if (upTo && number >= *upTo) break;
        Expected<JournalReader> reader = JournalReader::open(folder.logPath(number), kept, limits);
        if (!reader) return tl::unexpected(reader.error());
        if (Expected<void> taken = takeAll(*reader, story.state, places, stop); !taken)
            return tl::unexpected(taken.error());
        story.logBytes += reader->wholeBytes();
        story.wholeBytes = reader->wholeBytes();
        story.tornBytes = reader->bytesLeft();
        story.hollow = story.wholeBytes <= kJournalMark.size();
        if (!story.hollow && story.state.number != number)
            return fail(ErrorCode::kBadInput, fmt::format("{}: it is log {}", reader->name(), story.state.number));
        if (number == files.lastLog()) {
            // It is named once its opening is on the disk, and before anything else is in it.
            if (story.hollow && number == files.newest)
                return fail(ErrorCode::kBadInput, fmt::format("{}: it is cut off within its opening, and the journal's "
                                                              "newest edits were behind that; put it back, or "
                                                              "remove it and {} to go on without it",
                                                              reader->name(), folder.lastPath()));
            break;
        }
        if (Expected<void> whole = wholeOrRefused(*reader); !whole || story.hollow)
            return whole ? fail(ErrorCode::kBadInput, reader->name() + ": nothing is in it, and other logs follow it")
                         : tl::unexpected(whole.error());
    }
    return story;
}

}  // namespace

Expected<JournalStory> readJournal(const JournalFolder& folder, const JournalFiles& files, BlobStore& arrays,
                                   const JournalLimits& limits, std::optional<std::uint64_t> upTo,
                                   const std::atomic<bool>* stop) {
    return read(folder, files, arrays, limits, upTo, stop);
}

Expected<JournalStory> readJournal(const JournalFolder& folder, const JournalFiles& files, JournalPlaces& places,
                                   const JournalLimits& limits, std::uint64_t upTo, const std::atomic<bool>& stop) {
    return read(folder, files, places, limits, upTo, &stop);
}

JournalFile::JournalFile(JournalFile&& other) noexcept
    : disk_(std::move(other.disk_)),
      file_(std::exchange(other.file_, -1)),
      bytes_(other.bytes_),
      number_(other.number_),
      torn_(other.torn_) {}
JournalFile& JournalFile::operator=(JournalFile&& other) noexcept {
    std::swap(disk_, other.disk_);
    std::swap(file_, other.file_);
    std::swap(bytes_, other.bytes_);
    std::swap(number_, other.number_);
    std::swap(torn_, other.torn_);
    return *this;
}
JournalFile::~JournalFile() {
    if (file_ >= 0) disk_->calls().close(file_);
}

Expected<JournalFile> JournalFile::create(std::shared_ptr<JournalDisk> disk, const std::string& path,
                                          const journal::Opening& opening) {
    JournalFile made;
    made.disk_ = std::move(disk);
    FileSystem& calls = made.disk_->calls();
    int error = calls.create(path, made.file_);
    if (error == 0) error = calls.append(made.file_, asBytes(kJournalMark), {});
    made.bytes_ = kJournalMark.size();
    if (error == 0) error = made.append(encodeJournal(opening));
    if (error == 0) return made;
    if (made.file_ >= 0) (void)calls.remove(path);
    return fail(ErrorCode::kFailed, fmt::format("{}: the journal cannot be written: {}", path, words(error)));
}

int JournalFile::append(const RecordContent& content) {
    if (torn_)
        if (const int error = disk_->calls().truncate(file_, bytes_)) return error;
    const ByteSpan bytes = content.bytes();
    const RecordHeader header = headerFor(content.kind, bytes, number_);
    if (const int error = disk_->calls().append(file_, std::as_bytes(std::span(&header, 1)), bytes)) {
        cutOff();
        return error;
    }
    ++number_;
    bytes_ += sizeof(header) + bytes.size();
    return 0;
}

Expected<void> JournalFile::append(const RecordHeader& about,
                                   const std::function<Expected<ByteSpan>(std::uint64_t)>& piece) {
    const auto failed = [](int error) { return fail(ErrorCode::kFailed, words(error)); };
    if (torn_)
        if (const int error = disk_->calls().truncate(file_, bytes_)) return failed(error);
    const RecordHeader header = headerFor(about.kind, about.bytes, about.contentHash, number_);
    ByteSpan before = std::as_bytes(std::span(&header, 1));
    std::uint64_t at = 0;
    do {
        const Expected<ByteSpan> next = at < about.bytes ? piece(at) : ByteSpan();
        const int error = next ? disk_->calls().append(file_, before, *next) : 0;
        if (!next || error != 0) {
            cutOff();
            return next ? failed(error) : tl::unexpected(next.error());
        }
        before = {};
        at += next->size();
    } while (at < about.bytes);
    ++number_;
    bytes_ += sizeof(header) + about.bytes;
    return {};
}

bool JournalFile::isWhole(const std::string& path) const {
    return standsFor(path, file_, bytes_);
}

/// What was begun leaves no trace.
void JournalFile::cutOff() {
    torn_ = disk_->calls().truncate(file_, bytes_) != 0;
}

int JournalArrays::append(JournalFile& file, const ChangeList& list) {
    for (const Blob& blob : blobsOf(list)) {
        if (written_.contains(blob.id())) continue;
        if (!blob.resident()) return -1;
        if (const int error = file.append(encodeJournal(journal::Array{blob}))) return error;
        written_.insert(blob.id());
    }
    return 0;
}

}  // namespace tessera
