#include "client/share/SharedArrays.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/magic.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <charconv>
#include <filesystem>
#include <limits>
#include <optional>
#include <system_error>
#include <thread>
#include <tuple>

#include "client/share/SharedMemory.h"
#include "common/base/Channel.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;

constexpr const char* kDirectoryName = "tessera-arrays-1";  // the number is that of the layout below
constexpr const char* kArrayName = "tessera-array";
constexpr int kSealed = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE;

constexpr std::uint64_t kFree = 0, kFirstFile = 1;
constexpr std::size_t kEntryBytes = 32;
/// A process that has just begun has nothing yet, and takes longer than this to have something.
constexpr auto kMeetEvery = 100ms;
/// For a neighbour to see that we have what it has just put there, too.
constexpr auto kSettle = 20ms;
/// When to look whether a neighbour had an array before: after it has come, and after that. One that is about to have
/// it mostly lists it within the first.
constexpr std::array<Duration, 2> kLooks{20ms, 1s};
/// How much of two arrays is compared with each step, and the time between steps.
constexpr std::size_t kCompared = std::size_t{512} << 10;
constexpr Duration kBetweenSteps = 1ms;
constexpr std::size_t kDirectoryBytes = SharedArrays::kMostArrays * kEntryBytes;

std::uint64_t load(const std::uint64_t& word) {
    return __atomic_load_n(&word, __ATOMIC_ACQUIRE);
}
void store(std::uint64_t& word, std::uint64_t value) {
    __atomic_store_n(&word, value, __ATOMIC_RELEASE);
}

std::string linkOf(pid_t process, const std::string& file) {
    return fmt::format("/proc/{}/fd/{}", process, file);
}

/// Whether a link leads to memory of that name: only that is opened, as anything else may be a pipe or a terminal.
bool leadsTo(const std::string& link, const std::string& name) {
    std::error_code error;
    const std::string target = std::filesystem::read_symlink(link, error).string();
    return !error && target.starts_with("/memfd:") && target.compare(7, name.size(), name) == 0;
}

/// A file in memory of exactly this size, of ordinary pages (huge ones may be missing when they are touched), with
/// these seals.
bool isSealed(int file, std::uint64_t bytes, int wanted) {
    struct stat status {};
    struct statfs system {};
    const int seals = ::fcntl(file, F_GET_SEALS);
    return seals >= 0 && (seals & wanted) == wanted && ::fstatfs(file, &system) == 0 && system.f_type == TMPFS_MAGIC &&
           ::fstat(file, &status) == 0 && S_ISREG(status.st_mode) &&
           static_cast<std::uint64_t>(status.st_size) == bytes;
}

bool writeAll(int file, std::size_t offset, ByteSpan bytes) {
    // Written, not mapped: where there is no memory left this is an error, and a mapping would be a SIGBUS.
    while (!bytes.empty()) {
        const ssize_t n = ::pwrite(file, bytes.data(), bytes.size(), static_cast<off_t>(offset));
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return false;
        bytes = bytes.subspan(static_cast<std::size_t>(n));
        offset += static_cast<std::size_t>(n);
    }
    return true;
}

void readAll(int file, std::size_t offset, std::span<std::byte> to) {
    while (!to.empty()) {
        const ssize_t n = ::pread(file, to.data(), to.size(), static_cast<off_t>(offset));
        if (n < 0 && errno == EINTR) continue;
        TESSERA_CHECK(n > 0, "what was written to memory can be read");
        to = to.subspan(static_cast<std::size_t>(n));
        offset += static_cast<std::size_t>(n);
    }
}

/// Whether two files, both long enough, have the same bytes there.
bool areSame(int a, int b, std::size_t offset, std::size_t bytes) {
    // Read, not looked at where they are mapped: that would be a fault for every few pages.
    static thread_local std::array<Bytes, 2> room;
    for (Bytes& each : room) each.resize(bytes);
    readAll(a, offset, room[0]);
    readAll(b, offset, room[1]);
    return room[0] == room[1];
}

bool seal(int file) {
    return ::fcntl(file, F_ADD_SEALS, kSealed | F_SEAL_SEAL) == 0;
}

/// Below 0: there is none to be had.
int newArray() {
    const int file = ::memfd_create(kArrayName, MFD_CLOEXEC | MFD_ALLOW_SEALING);
    if (file < 0 || ::fchmod(file, kSharedMode) == 0) return file;
    ::close(file);
    return -1;
}

/// How many files this process may keep open for arrays: half of what it may have at all.
std::size_t filesAllowed() {
    rlimit limit{};
    if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return 0;
    const rlim_t wanted = 4 * SharedArrays::kMostArrays;
    if (limit.rlim_cur < wanted && limit.rlim_cur < limit.rlim_max) {
        limit.rlim_cur = std::min(wanted, limit.rlim_max);
        (void)::setrlimit(RLIMIT_NOFILE, &limit);
        (void)::getrlimit(RLIMIT_NOFILE, &limit);
    }
    return std::min<std::size_t>(SharedArrays::kMostArrays, static_cast<std::size_t>(limit.rlim_cur) / 2);
}

}  // namespace

class SharedArrays::File {
public:
    explicit File(int handle) : handle_(handle) {}
    File(File&& other) noexcept : handle_(other.release()) {}
    ~File() {
        if (handle_ >= 0) ::close(handle_);
    }
    File(const File&) = delete;
    File& operator=(const File&) = delete;
    [[nodiscard]] int get() const { return handle_; }
    [[nodiscard]] int release() { return std::exchange(handle_, -1); }

private:
    int handle_;
};

/// What a process says of one of its arrays, read by others while it is written: believed by nobody.
struct SharedArrays::Entry {
    std::uint64_t low = 0, high = 0, sizeBytes = 0;
    std::uint64_t file = 0;  ///< 0: free; else its number + kFirstFile
};

/// Ours, that others read. Entries are given out on one thread and given back on any.
class SharedArrays::Directory {
public:
    [[nodiscard]] static std::shared_ptr<Directory> make() {
        static_assert(sizeof(Entry) == kEntryBytes);
        File file(::memfd_create(kDirectoryName, MFD_CLOEXEC | MFD_ALLOW_SEALING));
        if (file.get() < 0 || ::fchmod(file.get(), kSharedMode) != 0 || ::ftruncate(file.get(), kDirectoryBytes) != 0 ||
            ::fcntl(file.get(), F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW) != 0)
            return nullptr;
        void* memory = ::mmap(nullptr, kDirectoryBytes, PROT_READ | PROT_WRITE, MAP_SHARED, file.get(), 0);
        if (memory == MAP_FAILED) return nullptr;
        auto directory = std::make_shared<Directory>();
        directory->file_ = file.release();
        directory->entries_ = static_cast<Entry*>(memory);
        directory->allowed_ = filesAllowed();
        return directory;
    }
    Directory() = default;
    Directory(const Directory&) = delete;
    Directory& operator=(const Directory&) = delete;
    ~Directory() {
        unneeded_.close();
        if (thread_.joinable()) thread_.join();
        if (entries_) ::munmap(entries_, kDirectoryBytes);
        if (file_ >= 0) ::close(file_);
    }

    /// A place for one more; none where all are taken.
    [[nodiscard]] std::optional<std::size_t> place() {
        for (std::size_t i = 0; i < allowed_; ++i, ++next_) {
            const std::size_t at = next_ % allowed_;
            if (load(entries_[at].file) == kFree) return at;
        }
        return std::nullopt;
    }
    void fill(std::size_t place, const BlobInfo& info, int file) {
        Entry& entry = entries_[place];
        store(entry.low, info.id.low);
        store(entry.high, info.id.high);
        store(entry.sizeBytes, info.sizeBytes);
        store(entry.file, static_cast<std::uint64_t>(file) + kFirstFile);
    }
    void free(std::size_t place) { store(entries_[place].file, kFree); }

    /// What nobody needs any more.
    struct Memory {
        void* memory = nullptr;
        std::size_t bytes = 0;
        int file = -1;
        void giveBack() const {
            // In parts: nobody of this process can map anything while one is taken away.
            constexpr std::size_t kPart = std::size_t{1} << 20;
            for (std::size_t at = 0; at < bytes; at += kPart)
                (void)::madvise(static_cast<std::byte*>(memory) + at, std::min(kPart, bytes - at), MADV_DONTNEED);
            if (bytes > 0) ::munmap(memory, bytes);
            if (file >= 0) ::close(file);
        }
    };
    /// Hundreds of megabytes take tens of milliseconds, which a host may not be silent for: a thread does that.
    void giveBack(const Memory& memory, std::size_t bytes) {
        if (bytes < Blob::kPagedBytes || !thread_.joinable() || !unneeded_.tryPush(Memory(memory))) memory.giveBack();
    }

    /// Arrays that come or have come, each with a file.
    void counts(int more) { arrays_ += more; }
    [[nodiscard]] bool full() const { return arrays_ >= static_cast<int>(allowed_); }

private:
    [[nodiscard]] std::thread helper() {
        try {
            return std::thread([this] {
                while (const std::optional<Memory> memory = unneeded_.pop()) memory->giveBack();
            });
        } catch (const std::system_error&) {
            return {};  // no more threads are to be had
        }
    }

    int file_ = -1;
    Entry* entries_ = nullptr;
    std::size_t allowed_ = 0, next_ = 0;
    static constexpr std::size_t kMostUnneeded = 64;  // each an open file
    Channel<Memory> unneeded_{kMostUnneeded};
    std::atomic<int> arrays_{0};
    std::thread thread_ = helper();
};

/// A neighbour's.
class SharedArrays::OtherDirectory {
public:
    [[nodiscard]] static std::unique_ptr<OtherDirectory> open(pid_t process) {
        std::error_code error;
        std::filesystem::directory_iterator it(fmt::format("/proc/{}/fd", process), error), end;
        for (; !error && it != end; it.increment(error)) {
            if (!leadsTo(it->path().string(), kDirectoryName)) continue;
            const File file(::open(it->path().c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
            if (file.get() < 0 || !isSealed(file.get(), kDirectoryBytes, F_SEAL_SHRINK)) continue;
            void* memory = ::mmap(nullptr, kDirectoryBytes, PROT_READ, MAP_SHARED, file.get(), 0);
            if (memory == MAP_FAILED) continue;
            auto other = std::make_unique<OtherDirectory>();
            other->process_ = process;
            other->entries_ = static_cast<const Entry*>(memory);
            return other;
        }
        return nullptr;
    }
    OtherDirectory() = default;
    OtherDirectory(const OtherDirectory&) = delete;
    OtherDirectory& operator=(const OtherDirectory&) = delete;
    ~OtherDirectory() {
        if (entries_) ::munmap(const_cast<Entry*>(entries_), kDirectoryBytes);
    }

    /// Its file with that blob, opened; -1: it has none. The bytes are still to be proved.
    [[nodiscard]] int find(const BlobInfo& wanted) const {
        for (std::size_t i = 0; i < kMostArrays; ++i) {
            const Entry& entry = entries_[i];
            const std::uint64_t named = load(entry.file);
            if (named == kFree || load(entry.low) != wanted.id.low || load(entry.high) != wanted.id.high ||
                load(entry.sizeBytes) != wanted.sizeBytes)
                continue;
            const std::string link = linkOf(process_, std::to_string(named - kFirstFile));
            if (!leadsTo(link, kArrayName)) continue;
            File file(::open(link.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
            if (file.get() >= 0 && isSealed(file.get(), wanted.sizeBytes, kSealed)) return file.release();
        }
        return -1;
    }

private:
    pid_t process_ = -1;
    const Entry* entries_ = nullptr;
};

SharedArrays::SharedArrays(Log& log, Neighbours neighbours)
    : log_(log), neighbours_(neighbours ? std::move(neighbours) : processesOfThisProgram), own_(Directory::make()) {
    if (!own_) log_.info("arrays are not shared with other hosts on this machine: no memory of that kind can be had");
}

void SharedArrays::meetNeighbours() {
    const auto now = std::chrono::steady_clock::now();
    if (now - metAt_ < kMeetEvery) return;
    metAt_ = now;
    std::map<pid_t, std::unique_ptr<OtherDirectory>> met;
    for (const pid_t process : neighbours_()) {
        auto known = others_.extract(process);
        // A process whose number another one has taken over is found to be nobody's when a file of it is opened.
        std::unique_ptr<OtherDirectory> directory =
            known && known.mapped() ? std::move(known.mapped()) : OtherDirectory::open(process);
        if (directory) met.emplace(process, std::move(directory));
    }
    others_ = std::move(met);
}

Blob SharedArrays::find(const BlobInfo& wanted) {
    if (!own_ || wanted.sizeBytes < kLeastBytes) return {};
    meetNeighbours();
    for (const auto& [process, directory] : others_) {
        const int file = directory->find(wanted);
        if (file < 0) continue;
        if (Blob blob = adopted(file, wanted); !blob.empty()) return counted(std::move(blob));
    }
    return {};
}

/// A sealed file, mapped, and listed for others for as long as anybody holds its blob.
struct SharedArrays::Kept {
    /// Opened anew and only to be read: Linux before 6.7 maps no sealed file that could be written.
    Kept(int sealed, std::shared_ptr<Directory> ours, std::uint64_t size)
        : file(::open(fmt::format("/proc/self/fd/{}", sealed).c_str(), O_RDONLY | O_CLOEXEC)),
          directory(std::move(ours)),
          bytes(static_cast<std::size_t>(size)) {
        directory->counts(1);
        if (file.get() >= 0) memory = ::mmap(nullptr, bytes, PROT_READ, MAP_SHARED, file.get(), 0);
    }
    ~Kept() {
        if (place) directory->free(*place);
        directory->giveBack({.memory = memory, .bytes = memory != MAP_FAILED ? bytes : 0, .file = file.release()},
                            bytes);
        directory->counts(-1);
    }
    Kept(const Kept&) = delete;
    Kept& operator=(const Kept&) = delete;

    [[nodiscard]] static std::shared_ptr<Kept> of(int sealed, std::shared_ptr<Directory> ours, std::uint64_t size) {
        auto kept = std::make_shared<Kept>(sealed, std::move(ours), size);
        return kept->memory != MAP_FAILED ? kept : nullptr;
    }
    [[nodiscard]] ByteSpan span() const { return {static_cast<const std::byte*>(memory), bytes}; }
    /// Pages that another sealed file has too lie there from here on: who reads them sees the same. False: they lie
    /// where they did.
    [[nodiscard]] bool layOver(const File& same, std::size_t offset, std::size_t count) {
        return ::mmap(static_cast<std::byte*>(memory) + offset, count, PROT_READ, MAP_SHARED | MAP_FIXED, same.get(),
                      static_cast<off_t>(offset)) != MAP_FAILED;
    }
    /// All of them do: the other file takes the place of ours, under the number that it is listed with.
    void moved(const File& same) {
        const int before = ::fcntl(file.get(), F_DUPFD_CLOEXEC, 0);
        (void)::dup3(same.get(), file.get(), O_CLOEXEC);
        directory->giveBack({.file = before}, bytes);
    }
    /// False: there is no place for one more. Then the mapping is all that is kept of it.
    [[nodiscard]] bool list(const BlobInfo& info) {
        place = directory->place();
        if (place)
            directory->fill(*place, info, file.get());
        else
            ::close(file.release());
        return place.has_value();
    }

    File file;
    std::shared_ptr<Directory> directory;
    std::size_t bytes;
    std::optional<std::size_t> place;
    void* memory = MAP_FAILED;
};

/// A file in memory: one that is being written, or one that somebody has sealed.
class SharedArrays::Place : public BlobPlace {
public:
    Place(SharedArrays& arrays, const BlobInfo& info, File file)
        : arrays_(arrays), info_(info), file_(std::move(file)), directory_(arrays.own_) {
        directory_->counts(1);
    }
    ~Place() override {
        directory_->giveBack({.file = file_.release()}, info_.sizeBytes);
        directory_->counts(-1);
    }
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;
    bool write(std::size_t offset, ByteSpan bytes) override { return writeAll(file_.get(), offset, bytes); }
    void read(std::size_t offset, std::span<std::byte> to) const override { readAll(file_.get(), offset, to); }
    std::shared_ptr<const PagedBytes> finish() override {
        const std::shared_ptr<Kept> kept = isSealed(file_.get(), info_.sizeBytes, kSealed) || seal(file_.get())
                                               ? Kept::of(file_.get(), arrays_.own_, info_.sizeBytes)
                                               : nullptr;
        std::shared_ptr<const PagedBytes> pages = kept ? PagedBytes::over(kept, kept->span()) : nullptr;
        if (pages) arrays_.placed_[info_.id] = kept;
        return pages;
    }

private:
    SharedArrays& arrays_;
    BlobInfo info_;
    File file_;
    std::shared_ptr<Directory> directory_;
};

std::unique_ptr<BlobPlace> SharedArrays::place(const BlobInfo& info) {
    if (!own_ || own_->full() || info.sizeBytes < Blob::kPagedBytes) return nullptr;
    File file(newArray());
    return file.get() < 0 ? nullptr : std::make_unique<Place>(*this, info, std::move(file));
}

/// An array that lies in memory of ours, and may lie in a neighbour's too.
struct SharedArrays::Doubled {
    std::weak_ptr<Kept> kept;
    BlobInfo info;
    std::size_t looks = 0;  ///< for a neighbour's
    std::optional<File> theirs = std::nullopt;
    std::size_t same = 0;  ///< bytes, so far
    bool moved = false;    ///< into a neighbour's, once
};

Blob SharedArrays::share(Blob blob) {
    if (!own_ || !blob.resident() || blob.sizeBytes() < kLeastBytes) return blob;
    const BlobInfo info{blob.id(), blob.sizeBytes()};
    if (const std::shared_ptr<Kept> placed = takePlaced(info.id)) {
        if (!placed->list(info)) return blob;
        later_.emplace(clockNow() + kLooks[0], std::make_unique<Doubled>(Doubled{.kept = placed, .info = info}));
        count(info);
        return blob;
    }
    if (Blob found = find(info); !found.empty()) return found;
    const std::shared_ptr<Kept> kept = copyOf(blob);
    struct stat status {};
    if (!kept || ::fstat(kept->file.get(), &status) != 0 || !kept->list(info)) return blob;
    if (Blob theirs = rival(info, status.st_ino); !theirs.empty()) return theirs;
    count(info);
    return blob.movedTo(kept, kept->span(), Blob::Place::kSharedMapping);
}

void SharedArrays::count(const BlobInfo& own) {
    ++counts_.own;
    counts_.ownBytes += own.sizeBytes;
}

SharedArrays::~SharedArrays() = default;

TimePoint SharedArrays::nextStep() const {
    if (compared_) return stepAt_;
    return later_.empty() ? TimePoint::max() : std::max(stepAt_, later_.begin()->first);
}

void SharedArrays::step(TimePoint now) {
    if (now < nextStep()) return;
    stepAt_ = now + kBetweenSteps;
    if (compared_) {
        if (!compareOn(*compared_)) lookLater(now, std::exchange(compared_, nullptr));
        return;
    }
    std::unique_ptr<Doubled> due = std::move(later_.extract(later_.begin()).mapped());
    if (due->kept.expired()) return;
    if (findEarlier(*due))
        compared_ = std::move(due);
    else
        lookLater(now, std::move(due));
}

/// False: there is nothing more to do with it.
bool SharedArrays::compareOn(Doubled& doubled) {
    const std::shared_ptr<Kept> kept = doubled.kept.lock();
    if (!kept) return false;
    const std::size_t piece = std::min(kCompared, kept->bytes - doubled.same);
    if (!areSame(kept->file.get(), doubled.theirs->get(), doubled.same, piece) ||
        !kept->layOver(*doubled.theirs, doubled.same, piece))
        return false;
    doubled.same += piece;
    if (doubled.same < kept->bytes) return true;
    kept->moved(*doubled.theirs);
    if (std::exchange(doubled.moved, true)) return false;
    --counts_.own;
    counts_.ownBytes -= doubled.info.sizeBytes;
    ++counts_.found;
    counts_.foundBytes += doubled.info.sizeBytes;
    return false;
}

void SharedArrays::lookLater(TimePoint now, std::unique_ptr<Doubled> doubled) {
    doubled->theirs.reset();
    doubled->same = 0;
    if (++doubled->looks < kLooks.size()) later_.emplace(now + kLooks[doubled->looks], std::move(doubled));
}

/// Whether a neighbour has the same in a file that was whole before ours: all agree on which one that is, whenever they
/// look.
bool SharedArrays::findEarlier(Doubled& doubled) {
    const auto wholeAt = [](const File& file) {
        struct stat status {};
        if (::fstat(file.get(), &status) != 0)
            return std::tuple(std::numeric_limits<std::int64_t>::max(), std::int64_t{0}, ino_t{0});
        return std::tuple(std::int64_t{status.st_mtim.tv_sec}, std::int64_t{status.st_mtim.tv_nsec}, status.st_ino);
    };
    const std::shared_ptr<Kept> kept = doubled.kept.lock();
    meetNeighbours();
    auto earliest = wholeAt(kept->file);
    for (const auto& [process, directory] : others_) {
        File theirs(directory->find(doubled.info));
        if (theirs.get() < 0 || wholeAt(theirs) >= earliest) continue;
        earliest = wholeAt(theirs);
        doubled.theirs.emplace(std::move(theirs));
    }
    return doubled.theirs.has_value();
}

/// Null: its bytes lie nowhere in common yet.
std::shared_ptr<SharedArrays::Kept> SharedArrays::takePlaced(const BlobId& id) {
    const auto placed = placed_.extract(id);
    std::erase_if(placed_, [](const auto& each) { return each.second.expired(); });
    return placed ? placed.mapped().lock() : nullptr;
}

/// Null: there is no room.
std::shared_ptr<SharedArrays::Kept> SharedArrays::copyOf(const Blob& blob) {
    const File file(newArray());
    return file.get() >= 0 && writeAll(file.get(), 0, blob.bytes()) && seal(file.get())
               ? Kept::of(file.get(), own_, blob.sizeBytes())
               : nullptr;
}

/// Two that put the same blob there at once see each other when both are done: the one with the lower number keeps its
/// own. Where the other one had looked before, it does not know; so after a moment the lower one gives way.
Blob SharedArrays::rival(const BlobInfo& info, std::uint64_t place) {
    for (const bool waited : {false, true}) {
        bool any = false;
        for (const auto& [process, directory] : others_) {
            File theirs(directory->find(info));
            struct stat status {};
            if (theirs.get() < 0 || ::fstat(theirs.get(), &status) != 0 || status.st_ino == place) continue;
            any = true;
            if (!waited && process > ::getpid()) continue;
            if (Blob blob = adopted(theirs.release(), info); !blob.empty()) return counted(std::move(blob));
        }
        if (!any) break;
        if (!waited) std::this_thread::sleep_for(kSettle);
    }
    return {};
}

Blob SharedArrays::counted(Blob found) {
    ++counts_.found;
    counts_.foundBytes += found.sizeBytes();
    return found;
}

/// What a neighbour has sealed, listed as ours too. Empty where its bytes are others, or nothing more can be kept.
Blob SharedArrays::adopted(int sealed, const BlobInfo& info) {
    File file(sealed);
    Blob blob;
    std::shared_ptr<Kept> kept;
    if (info.sizeBytes >= Blob::kPagedBytes) {
        // Read, not looked at where it is mapped: a fault for every few pages of hundreds of megabytes takes longer
        // than their hash.
        blob = BlobMaker::whole(info.sizeBytes, std::make_unique<Place>(*this, info, std::move(file)));
        kept = takePlaced(info.id);
    } else if ((kept = Kept::of(file.get(), own_, info.sizeBytes))) {
        blob = Blob(kept, kept->span(), Blob::Place::kSharedMapping);
    }
    return kept && blob.id() == info.id && kept->list(info) ? blob : Blob();
}

std::vector<pid_t> processesOfThisProgram() {
    std::vector<pid_t> processes;
    std::error_code error;
    const std::filesystem::path own = std::filesystem::read_symlink("/proc/self/exe", error);
    struct stat me {};
    if (error || ::stat("/proc/self/exe", &me) != 0) return processes;
    std::filesystem::directory_iterator it("/proc", error), end;
    for (; !error && it != end; it.increment(error)) {
        const std::string name = it->path().filename().string();
        pid_t process = 0;
        const auto read = std::from_chars(name.data(), name.data() + name.size(), process);
        if (read.ec != std::errc() || read.ptr != name.data() + name.size() || process == ::getpid()) continue;
        struct stat other {};
        const std::string program = it->path().string() + "/exe";
        // The same file, not the same name. Of others' processes the link cannot be followed at all.
        if (::stat(program.c_str(), &other) == 0 && other.st_dev == me.st_dev && other.st_ino == me.st_ino)
            processes.push_back(process);
    }
    return processes;
}

}  // namespace tessera
