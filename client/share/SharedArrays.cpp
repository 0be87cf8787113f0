#include "client/share/SharedArrays.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/magic.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <atomic>
#include <charconv>
#include <filesystem>
#include <optional>
#include <thread>

#include "client/share/SharedMemory.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;

constexpr const char* kDirectoryName = "tessera-arrays-1";  // the number is that of the layout below
constexpr const char* kArrayName = "tessera-array";
constexpr std::uint64_t kWrittenAsItComes = std::uint64_t{16} << 20;
constexpr int kSealed = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE;

constexpr std::uint64_t kFree = 0, kFirstFile = 1;
constexpr std::size_t kEntryBytes = 32;
/// A process that has just begun has nothing yet, and takes longer than this to have something.
constexpr auto kMeetEvery = 100ms;
/// For a neighbour to see that we have what it has just put there, too.
constexpr auto kSettle = 20ms;
constexpr std::size_t kDirectoryBytes = SharedArrays::kMostArrays * kEntryBytes;

std::uint64_t load(const std::uint64_t& word) {
    return __atomic_load_n(&word, __ATOMIC_ACQUIRE);
}
void store(std::uint64_t& word, std::uint64_t value) {
    __atomic_store_n(&word, value, __ATOMIC_RELEASE);
}

class File {
public:
    explicit File(int handle) : handle_(handle) {}
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

std::string linkOf(pid_t process, const std::string& file) {
    return fmt::format("/proc/{}/fd/{}", process, file);
}

/// Whether a link leads to memory of that name: only that is opened, as anything else may be a pipe or a terminal.
bool leadsTo(const std::string& link, const std::string& name) {
    std::error_code error;
    const std::string target = std::filesystem::read_symlink(link, error).string();
    return !error && target.starts_with("/memfd:") && target.compare(7, name.size(), name) == 0;
}

/// A file in memory of exactly this size, of ordinary pages (huge ones may be missing when they are touched), with these seals.
bool isSealed(int file, std::uint64_t bytes, int wanted) {
    struct stat status {};
    struct statfs system {};
    const int seals = ::fcntl(file, F_GET_SEALS);
    return seals >= 0 && (seals & wanted) == wanted && ::fstatfs(file, &system) == 0 && system.f_type == TMPFS_MAGIC &&
           ::fstat(file, &status) == 0 && S_ISREG(status.st_mode) && static_cast<std::uint64_t>(status.st_size) == bytes;
}

bool writeAll(int file, ByteSpan bytes) {
    // Written, not mapped: where there is no memory left this is an error, and a mapping would be a SIGBUS.
    while (!bytes.empty()) {
        const ssize_t n = ::write(file, bytes.data(), bytes.size());
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return false;
        bytes = bytes.subspan(static_cast<std::size_t>(n));
    }
    return true;
}

/// Below 0: there is none to be had.
int newArray() {
    File file(::memfd_create(kArrayName, MFD_CLOEXEC | MFD_ALLOW_SEALING));
    return file.get() >= 0 && ::fchmod(file.get(), kSharedMode) == 0 ? file.release() : -1;
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

private:
    int file_ = -1;
    Entry* entries_ = nullptr;
    std::size_t allowed_ = 0, next_ = 0;
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

SharedArrays::~SharedArrays() = default;

void SharedArrays::meetNeighbours() {
    const auto now = std::chrono::steady_clock::now();
    if (now - metAt_ < kMeetEvery) return;
    metAt_ = now;
    std::map<pid_t, std::unique_ptr<OtherDirectory>> met;
    for (const pid_t process : neighbours_()) {
        auto known = others_.extract(process);
        // A process whose number another one has taken over is found to be nobody's when a file of it is opened.
        std::unique_ptr<OtherDirectory> directory = known && known.mapped() ? std::move(known.mapped()) : OtherDirectory::open(process);
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
        if (Blob blob = keep(file, wanted, nullptr); !blob.empty()) return counted(std::move(blob));
    }
    return {};
}

struct SharedArrays::Arriving {
    BlobInfo info;
    File file;
    std::uint64_t written = 0;
};

void SharedArrays::arrives(const BlobInfo& info, std::uint64_t offset, ByteSpan piece) {
    if (!own_ || info.sizeBytes < kWrittenAsItComes) return;
    if (offset == 0) arriving_ = std::unique_ptr<Arriving>(new Arriving{info, File(newArray())});
    if (!arriving_ || arriving_->info.id != info.id) return;
    if (offset != arriving_->written || piece.size() > info.sizeBytes - offset || arriving_->file.get() < 0 || !writeAll(arriving_->file.get(), piece))
        return forgetArriving();
    arriving_->written += piece.size();
}

void SharedArrays::forgetArriving() {
    arriving_.reset();
}

Blob SharedArrays::share(Blob blob) {
    if (!own_ || !blob.resident() || blob.sizeBytes() < kLeastBytes) return blob;
    const BlobInfo info{blob.id(), blob.sizeBytes()};
    const std::unique_ptr<Arriving> arrived = arriving_ && arriving_->info.id == info.id ? std::move(arriving_) : nullptr;
    if (Blob found = find(info); !found.empty()) return found;
    const bool whole = arrived && arrived->written == info.sizeBytes;
    File file(whole ? arrived->file.release() : newArray());
    if (file.get() < 0 || (!whole && !writeAll(file.get(), blob.bytes())) || ::fcntl(file.get(), F_ADD_SEALS, kSealed | F_SEAL_SEAL) != 0)
        return blob;
    struct stat status {};
    if (::fstat(file.get(), &status) != 0) return blob;
    Blob shared = keep(file.release(), info, &blob);
    if (shared.empty()) return blob;
    if (Blob theirs = rival(info, status.st_ino); !theirs.empty()) return theirs;
    ++counts_.own;
    counts_.ownBytes += info.sizeBytes;
    return shared;
}

/// Two that put the same blob there at once see each other when both are done: the one with the lower number keeps its own. Where the
/// other one had looked before, it does not know; so after a moment the lower one gives way.
Blob SharedArrays::rival(const BlobInfo& info, std::uint64_t place) {
    for (const bool waited : {false, true}) {
        bool any = false;
        for (const auto& [process, directory] : others_) {
            File theirs(directory->find(info));
            struct stat status {};
            if (theirs.get() < 0 || ::fstat(theirs.get(), &status) != 0 || status.st_ino == place) continue;
            any = true;
            if (!waited && process > ::getpid()) continue;
            if (Blob blob = keep(theirs.release(), info, nullptr); !blob.empty()) return counted(std::move(blob));
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

/// Maps a sealed file, which is ours from here on, and lists it for others for as long as anybody holds the blob. `known`: whose bytes it
/// has; null: they are to be proved. Empty when they are others, or nothing more can be kept.
Blob SharedArrays::keep(int file, const BlobInfo& info, const Blob* known) {
    struct Kept {
        Kept(int f, std::shared_ptr<Directory> d) : file(f), directory(std::move(d)) {}
        ~Kept() {
            if (place) directory->free(*place);
            if (memory != MAP_FAILED) ::munmap(memory, bytes);
            if (file >= 0) ::close(file);
        }
        Kept(const Kept&) = delete;
        Kept& operator=(const Kept&) = delete;
        int file;
        std::shared_ptr<Directory> directory;
        std::optional<std::size_t> place;
        void* memory = MAP_FAILED;
        std::size_t bytes = 0;
    };
    auto kept = std::make_shared<Kept>(file, own_);
    kept->bytes = static_cast<std::size_t>(info.sizeBytes);
    kept->memory = ::mmap(nullptr, kept->bytes, PROT_READ, MAP_SHARED, file, 0);
    if (kept->memory == MAP_FAILED) return {};
    const ByteSpan bytes(static_cast<const std::byte*>(kept->memory), kept->bytes);
    constexpr auto kPlace = Blob::Place::kSharedMapping;
    Blob blob = known ? known->movedTo(kept, bytes, kPlace) : Blob(kept, bytes, kPlace);
    if (blob.id() != info.id) return {};
    const std::optional<std::size_t> place = own_->place();
    if (!place) return {};
    own_->fill(*place, info, file);
    kept->place = place;
    return blob;
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
