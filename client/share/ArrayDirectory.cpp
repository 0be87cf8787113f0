#include "client/share/ArrayDirectory.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/magic.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <string>

#include "client/share/SharedMemory.h"
#include "common/base/Blob.h"
#include "common/base/StartThread.h"

namespace tessera {

struct ArrayEntry {
    std::uint64_t low = 0, high = 0, sizeBytes = 0;
    std::uint64_t file = 0;  ///< 0: free; else its number + kFirstFile
};

namespace {

constexpr const char* kDirectoryName = "tessera-arrays-1";  // the number is that of the layout below
constexpr const char* kArrayName = "tessera-array";
constexpr int kSealed = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE;

constexpr std::uint64_t kFreeEntry = 0, kFirstFile = 1;
constexpr std::size_t kEntryBytes = 32;
constexpr std::size_t kDirectoryBytes = ArrayDirectory::kMost * kEntryBytes;

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

/// How many files this process may keep open for arrays: half of what it may have at all.
std::size_t filesAllowed() {
    rlimit limit{};
    if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return 0;
    const rlim_t wanted = 4 * ArrayDirectory::kMost;
    if (limit.rlim_cur < wanted && limit.rlim_cur < limit.rlim_max) {
        limit.rlim_cur = std::min(wanted, limit.rlim_max);
        (void)::setrlimit(RLIMIT_NOFILE, &limit);
        (void)::getrlimit(RLIMIT_NOFILE, &limit);
    }
    return std::min<std::size_t>(ArrayDirectory::kMost, static_cast<std::size_t>(limit.rlim_cur) / 2);
}

}  // namespace

ArrayFile::~ArrayFile() {
    if (handle_ >= 0) ::close(handle_);
}

ArrayFile ArrayFile::make() {
    ArrayFile file(::memfd_create(kArrayName, MFD_CLOEXEC | MFD_ALLOW_SEALING));
    return file.open() && ::fchmod(file.get(), kSharedMode) == 0 ? std::move(file) : ArrayFile(-1);
}

bool ArrayFile::write(std::size_t offset, ByteSpan bytes) const {
    // Written, not mapped: where there is no memory left this is an error, and a mapping would be a SIGBUS.
    while (!bytes.empty()) {
        const ssize_t n = ::pwrite(handle_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return false;
        bytes = bytes.subspan(static_cast<std::size_t>(n));
        offset += static_cast<std::size_t>(n);
    }
    return true;
}

void ArrayFile::read(std::size_t offset, std::span<std::byte> to) const {
    while (!to.empty()) {
        const ssize_t n = ::pread(handle_, to.data(), to.size(), static_cast<off_t>(offset));
        if (n < 0 && errno == EINTR) continue;
        TESSERA_CHECK(n > 0, "what was written to memory can be read");
        to = to.subspan(static_cast<std::size_t>(n));
        offset += static_cast<std::size_t>(n);
    }
}

bool ArrayFile::seal() const {
    return ::fcntl(handle_, F_ADD_SEALS, kSealed | F_SEAL_SEAL) == 0;
}

bool ArrayFile::isSealed(std::uint64_t bytes) const {
    return tessera::isSealed(handle_, bytes, kSealed);
}

bool ArrayFile::areSame(const ArrayFile& a, const ArrayFile& b, std::size_t offset, std::size_t bytes) {
    // Read, not looked at where they are mapped: that would be a fault for every few pages.
    static thread_local std::array<Bytes, 2> room;
    for (Bytes& each : room) each.resize(bytes);
    a.read(offset, room[0]);
    b.read(offset, room[1]);
    return room[0] == room[1];
}

std::shared_ptr<ArrayDirectory> ArrayDirectory::make() {
    static_assert(sizeof(ArrayEntry) == kEntryBytes);
    ArrayFile file(::memfd_create(kDirectoryName, MFD_CLOEXEC | MFD_ALLOW_SEALING));
    if (!file.open() || ::fchmod(file.get(), kSharedMode) != 0 || ::ftruncate(file.get(), kDirectoryBytes) != 0 ||
        ::fcntl(file.get(), F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW) != 0)
        return nullptr;
    void* memory = ::mmap(nullptr, kDirectoryBytes, PROT_READ | PROT_WRITE, MAP_SHARED, file.get(), 0);
    if (memory == MAP_FAILED) return nullptr;
    auto directory = std::make_shared<ArrayDirectory>();
    directory->file_ = file.release();
    directory->entries_ = static_cast<ArrayEntry*>(memory);
    directory->allowed_ = filesAllowed();
    return directory;
}

ArrayDirectory::ArrayDirectory() = default;

ArrayDirectory::~ArrayDirectory() {
    unneeded_.close();
    if (thread_.joinable()) thread_.join();
    if (entries_) ::munmap(entries_, kDirectoryBytes);
    if (file_ >= 0) ::close(file_);
}

std::optional<std::size_t> ArrayDirectory::place() {
    for (std::size_t i = 0; i < allowed_; ++i, ++next_) {
        const std::size_t at = next_ % allowed_;
        if (load(entries_[at].file) == kFreeEntry) return at;
    }
    return std::nullopt;
}

void ArrayDirectory::fill(std::size_t place, const BlobInfo& info, int file) {
    ArrayEntry& entry = entries_[place];
    store(entry.low, info.id.low);
    store(entry.high, info.id.high);
    store(entry.sizeBytes, info.sizeBytes);
    store(entry.file, static_cast<std::uint64_t>(file) + kFirstFile);
}

void ArrayDirectory::free(std::size_t place) {
    store(entries_[place].file, kFreeEntry);
}

void ArrayDirectory::Memory::giveBack() const {
    // In parts: nobody of this process can map anything while one is taken away.
    constexpr std::size_t kPart = std::size_t{1} << 20;
    for (std::size_t at = 0; at < bytes; at += kPart)
        (void)::madvise(static_cast<std::byte*>(memory) + at, std::min(kPart, bytes - at), MADV_DONTNEED);
    if (bytes > 0) ::munmap(memory, bytes);
    if (file >= 0) ::close(file);
}

void ArrayDirectory::giveBack(const Memory& memory, std::size_t bytes) {
    if (bytes < Blob::kPagedBytes || !thread_.joinable() || !unneeded_.tryPush(Memory(memory))) memory.giveBack();
}

std::thread ArrayDirectory::helper() {
    return startThread([this] {
        while (const std::optional<Memory> memory = unneeded_.pop()) memory->giveBack();
    });
}

std::unique_ptr<OthersArrayDirectory> OthersArrayDirectory::open(pid_t process) {
    std::error_code error;
    std::filesystem::directory_iterator it(fmt::format("/proc/{}/fd", process), error), end;
    for (; !error && it != end; it.increment(error)) {
        if (!leadsTo(it->path().string(), kDirectoryName)) continue;
        const ArrayFile file(::open(it->path().c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
        if (!file.open() || !isSealed(file.get(), kDirectoryBytes, F_SEAL_SHRINK)) continue;
        void* memory = ::mmap(nullptr, kDirectoryBytes, PROT_READ, MAP_SHARED, file.get(), 0);
        if (memory == MAP_FAILED) continue;
        auto other = std::make_unique<OthersArrayDirectory>();
        other->process_ = process;
        other->entries_ = static_cast<const ArrayEntry*>(memory);
        return other;
    }
    return nullptr;
}

OthersArrayDirectory::~OthersArrayDirectory() {
    if (entries_) ::munmap(const_cast<ArrayEntry*>(entries_), kDirectoryBytes);
}

ArrayFile OthersArrayDirectory::find(const BlobInfo& wanted) const {
    std::size_t tries = trusted_ ? kMostTries : 0;
    for (std::size_t i = 0; i < ArrayDirectory::kMost && tries > 0; ++i) {
        const ArrayEntry& entry = entries_[i];
        const std::uint64_t named = load(entry.file);
        if (named == kFreeEntry || load(entry.low) != wanted.id.low || load(entry.high) != wanted.id.high ||
            load(entry.sizeBytes) != wanted.sizeBytes)
            continue;
        --tries;
        const std::string link = linkOf(process_, std::to_string(named - kFirstFile));
        if (!leadsTo(link, kArrayName)) continue;
        ArrayFile file(::open(link.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
        if (file.open() && file.isSealed(wanted.sizeBytes)) return file;
    }
    return ArrayFile(-1);
}

}  // namespace tessera
