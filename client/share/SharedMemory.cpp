#include "client/share/SharedMemory.h"

#include <fcntl.h>
#include <linux/futex.h>
#include <linux/magic.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <ctime>
#include <utility>

namespace tessera {
namespace {

std::string readShortFile(const char* path) {
    const int file = ::open(path, O_RDONLY | O_CLOEXEC);
    if (file < 0) return {};
    char text[128];
    const ssize_t size = ::read(file, text, sizeof text);
    ::close(file);
    return size > 0 ? std::string(text, static_cast<std::size_t>(size)) : std::string();
}

struct FileHandle {
    int file;
    ~FileHandle() {
        if (file >= 0) ::close(file);
    }
};

Expected<Mapping> map(int file, std::size_t from, std::size_t bytes, int protection) {
    if (bytes == 0) return Mapping();
    void* const memory = ::mmap(nullptr, bytes, protection, MAP_SHARED, file, static_cast<off_t>(from));
    if (memory == MAP_FAILED)
        return fail(ErrorCode::kFailed, std::string("cannot map shared memory: ") + std::strerror(errno));
    return Mapping(static_cast<std::byte*>(memory), bytes);
}

/// "PID/FILE" of two numbers, as a path below /proc; nothing else gets there.
std::string pathOf(std::string_view place) {
    const std::size_t slash = place.find('/');
    if (slash == std::string_view::npos) return {};
    std::uint32_t process = 0, file = 0;
    const auto number = [](std::string_view text, std::uint32_t& value) {
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        return error == std::errc() && end == text.data() + text.size();
    };
    if (!number(place.substr(0, slash), process) || !number(place.substr(slash + 1), file)) return {};
    return "/proc/" + std::to_string(process) + "/fd/" + std::to_string(file);
}

}  // namespace

std::string machineIdentity() {
    const std::string boot = readShortFile("/proc/sys/kernel/random/boot_id");
    char space[128];
    const ssize_t length = ::readlink("/proc/self/ns/pid", space, sizeof space);
    if (boot.size() < 36 || length <= 0) return {};
    return boot.substr(0, 36) + " " + std::string(space, static_cast<std::size_t>(length)) + " " +
           std::to_string(::geteuid());
}

Mapping::~Mapping() {
    if (data_) ::munmap(data_, bytes_);
}

Mapping& Mapping::operator=(Mapping&& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(bytes_, other.bytes_);
    return *this;
}

Expected<OwnMemory> OwnMemory::create(std::size_t bytes) {
    OwnMemory memory;
    const auto wrong = [](const char* what) {
        return fail(ErrorCode::kFailed,
                    std::string("no memory to share with neighbours: ") + what + ": " + std::strerror(errno));
    };
    memory.file_ = ::memfd_create("tessera-board", MFD_CLOEXEC | MFD_ALLOW_SEALING);
    if (memory.file_ < 0) return wrong("memfd_create");
    if (::fchmod(memory.file_, kSharedMode) != 0) return wrong("fchmod");
    if (::ftruncate(memory.file_, static_cast<off_t>(bytes)) != 0) return wrong("ftruncate");
    if (::fcntl(memory.file_, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0) return wrong("sealing it");
    auto mapping = map(memory.file_, 0, bytes, PROT_READ | PROT_WRITE);
    if (!mapping) return tl::unexpected(mapping.error());
    memory.mapping_ = std::move(*mapping);
    return memory;
}

OwnMemory::~OwnMemory() {
    if (file_ >= 0) ::close(file_);
}

OwnMemory::OwnMemory(OwnMemory&& other) noexcept
    : file_(std::exchange(other.file_, -1)), mapping_(std::move(other.mapping_)) {}

std::string OwnMemory::place() const {
    return std::to_string(::getpid()) + "/" + std::to_string(file_);
}

Expected<OthersMemory> OthersMemory::open(std::string_view place, std::size_t headBytes, std::size_t restBytes) {
    const std::string path = pathOf(place);
    if (path.empty()) return fail(ErrorCode::kBadInput, "'" + std::string(place) + "' is no place of shared memory");
    // What stands there may be anything; to open a device or a pipe is to do something.
    struct stat before {};
    if (::stat(path.c_str(), &before) != 0) return fail(ErrorCode::kNotFound, path + ": " + std::strerror(errno));
    if (!S_ISREG(before.st_mode) || static_cast<std::size_t>(before.st_size) != headBytes + restBytes)
        return fail(ErrorCode::kBadInput, path + ": not the board of a Tessera host");
    const FileHandle handle{::open(path.c_str(), O_RDWR | O_CLOEXEC | O_NONBLOCK | O_NOCTTY)};
    if (handle.file < 0) return fail(ErrorCode::kNotFound, path + ": " + std::strerror(errno));
    // Memory of ordinary pages (not of huge ones, which may be missing when they are touched) whose size nobody can
    // change.
    struct statfs system {};
    struct stat status {};
    const int seals = ::fcntl(handle.file, F_GET_SEALS);
    constexpr int kWanted = F_SEAL_SHRINK | F_SEAL_GROW;
    if (::fstatfs(handle.file, &system) != 0 || system.f_type != TMPFS_MAGIC || seals < 0 ||
        (seals & kWanted) != kWanted || ::fstat(handle.file, &status) != 0 ||
        static_cast<std::size_t>(status.st_size) != headBytes + restBytes)
        return fail(ErrorCode::kBadInput, path + ": not the board of a Tessera host");
    auto head = map(handle.file, 0, headBytes, PROT_READ | PROT_WRITE);
    if (!head) return tl::unexpected(head.error());
    auto rest = map(handle.file, headBytes, restBytes, PROT_READ);
    if (!rest) return tl::unexpected(rest.error());
    return OthersMemory{std::move(*head), std::move(*rest)};
}

void waitForBell(const void* word, std::uint32_t seen, std::int64_t timeoutNs) {
    if (timeoutNs <= 0) return;
    const timespec wait{.tv_sec = timeoutNs / 1'000'000'000, .tv_nsec = timeoutNs % 1'000'000'000};
    ::syscall(SYS_futex, word, FUTEX_WAIT, seen, &wait, nullptr, 0);
}

void ringBell(const void* word) {
    ::syscall(SYS_futex, word, FUTEX_WAKE, std::int32_t{0x7fffffff}, nullptr, nullptr, 0);
}

}  // namespace tessera
