#include "common/image/SharedFrame.h"

#include <fcntl.h>
#include <linux/futex.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <climits>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <functional>
#include <thread>
#include <utility>
#include <vector>

#include "common/image/Shrink.h"

namespace tessera {
namespace {

constexpr std::uint64_t kMagic = 0x33454d4152465354;  // "TSFRAME3" in memory
constexpr std::size_t kHeaderBytes = 4096;
constexpr int kMaxFrameSidePx = 16384;
constexpr int kReadAttempts = 200;
/// Windows and tools of the same user read it; what a wall shows is nobody else's.
constexpr mode_t kMode = 0600;

struct Slot {
    std::uint64_t frame;
    std::uint64_t changes;  ///< odd: one is under way
    bool operator==(const Slot&) const = default;
};

/// Start of the file. The pixels of slot i stand at kHeaderBytes + i * widthPx * heightPx * 4, as PixelRows has them.
struct Header {
    std::uint64_t magic;
    std::int32_t widthPx, heightPx;
    std::uint64_t shown;  ///< 0: nothing yet; else (times shown << 1) | slot
    Slot slots[2];
    std::int64_t shownAtNs[2];  ///< CLOCK_MONOTONIC, when the slot became the shown one
};
static_assert(sizeof(Header) <= kHeaderBytes);

std::size_t pixelsIn(int widthPx, int heightPx) {
    return static_cast<std::size_t>(widthPx) * static_cast<std::size_t>(heightPx);
}
std::size_t slotBytes(int widthPx, int heightPx) {
    return 4 * pixelsIn(widthPx, heightPx);
}

Picture pictureFrom(const std::uint8_t* rgbx, int widthPx, int heightPx) {
    Picture picture{.widthPx = widthPx, .heightPx = heightPx, .rgb = {}};
    picture.rgb.resize(3 * pixelsIn(widthPx, heightPx));
    dropAlpha(rgbx, pixelsIn(widthPx, heightPx), picture.rgb.data());
    return picture;
}

bool readAt(int fd, void* to, std::size_t bytes, std::size_t offset) {
    auto* out = static_cast<std::byte*>(to);
    while (bytes > 0) {
        const ssize_t n = ::pread(fd, out, bytes, static_cast<off_t>(offset));
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return false;
        out += n;
        offset += static_cast<std::size_t>(n);
        bytes -= static_cast<std::size_t>(n);
    }
    return true;
}

std::int64_t monotonicNs() {
    timespec now{};
    ::clock_gettime(CLOCK_MONOTONIC, &now);
    return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

/// The word by which readers of other processes are woken: the half of `shown` that changes with each picture.
std::uint32_t* wakingWord(Header* header) {
    return reinterpret_cast<std::uint32_t*>(&header->shown);
}

/// `rgbx` gets the pixels, without gaps between rows.
struct WholeFrame {
    Header header{};
    std::size_t slot = 0;
};
Expected<WholeFrame> readWhole(int file, const std::string& path,
                               const std::function<std::uint8_t*(const Header&)>& roomFor) {
    for (int attempt = 0; attempt < kReadAttempts; ++attempt) {
        if (attempt > 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        Header header{};
        if (!readAt(file, &header, sizeof header, 0) || header.magic != kMagic || header.widthPx <= 0 ||
            header.heightPx <= 0 || header.widthPx > kMaxFrameSidePx || header.heightPx > kMaxFrameSidePx)
            return fail(ErrorCode::kBadInput, path + ": not the shown image of a Tessera host");
        if (header.shown == 0) return fail(ErrorCode::kNotFound, path + ": no image has been shown yet");
        const std::size_t bytes = slotBytes(header.widthPx, header.heightPx);
        struct stat status {};
        if (::fstat(file, &status) != 0 || static_cast<std::size_t>(status.st_size) < kHeaderBytes + 2 * bytes)
            return fail(ErrorCode::kBadInput, path + ": the file is shorter than its pictures");

        const std::size_t slot = header.shown & 1;
        Header after{};
        if (!readAt(file, roomFor(header), bytes, kHeaderBytes + slot * bytes) ||
            !readAt(file, &after, sizeof after, 0))
            return fail(ErrorCode::kBadInput, path + ": the file is shorter than its pictures");
        if (header.slots[slot].changes % 2 == 0 && after.slots[slot] == header.slots[slot])
            return WholeFrame{header, slot};
    }
    return fail(ErrorCode::kFailed,
                path + ": no whole picture in many attempts: its writer is too quick, or the file damaged");
}

}  // namespace

/// The mapped file. Two threads use it at a time: one draws into the slot that is not shown, one flips the word that
/// says which is, and gives the file its name.
class SharedFrameFile {
public:
    SharedFrameFile(const std::string& path, int widthPx, int heightPx)
        : path_(path), next_(path + ".next"), widthPx_(widthPx), heightPx_(heightPx) {}
    ~SharedFrameFile();
    SharedFrameFile(const SharedFrameFile&) = delete;
    SharedFrameFile& operator=(const SharedFrameFile&) = delete;

    [[nodiscard]] Expected<void> make();

    // Whoever draws.
    [[nodiscard]] int hiddenSlot() const;
    [[nodiscard]] std::uint8_t* pixelsOf(int slot) const;
    /// Others see the count odd before anything else of the change, and even after all of it.
    void change(int slot, bool begins) const;
    void number(int slot, std::uint64_t frame) const { header().slots[slot].frame = frame; }
    [[nodiscard]] int widthPx() const { return widthPx_; }
    [[nodiscard]] int heightPx() const { return heightPx_; }

    // Whoever shows.
    void flipTo(int slot) const;
    void wakeReaders() const;
    [[nodiscard]] Expected<void> putInPlace();

private:
    [[nodiscard]] bool linkAs(const std::string& name) const;
    [[nodiscard]] Header& header() const { return *reinterpret_cast<Header*>(memory_); }

    std::string path_;
    std::string next_;  ///< its name just before it takes the place of another; empty once it has its own
    int unnamed_ = -1;  ///< until then; none where the file system has no files without a name
    std::byte* memory_ = nullptr;
    std::size_t mappedBytes_ = 0;
    int widthPx_, heightPx_;
};

Expected<void> SharedFrameFile::make() {
    // Without a name until the first image is shown: a writer that is killed before leaves nothing behind. Where the
    // file system has no such files, under a name that the next writer takes over.
    ::unlink(next_.c_str());
    std::string folder = std::filesystem::path(path_).parent_path();
    if (folder.empty()) folder = ".";
    unnamed_ = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, kMode);
    const FileHandle named(unnamed_ >= 0 ? -1 : ::open(next_.c_str(), O_CREAT | O_EXCL | O_RDWR | O_CLOEXEC, kMode));
    const int file = unnamed_ >= 0 ? unnamed_ : named.get();
    if (file < 0)
        return fail(ErrorCode::kFailed, path_ + ": cannot make the file of the shown image: " + std::strerror(errno));
    const std::size_t bytes = kHeaderBytes + 2 * slotBytes(widthPx_, heightPx_);
    // Taking the blocks now turns a full disk into an error here; without them it would be a SIGBUS in a frame.
    if (const int error = ::posix_fallocate(file, 0, static_cast<off_t>(bytes)); error != 0)
        return fail(ErrorCode::kFailed, path_ + ": no room for the shown image: " + std::strerror(error));
    ::fchmod(file, kMode);
    void* memory = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    if (memory == MAP_FAILED)
        return fail(ErrorCode::kFailed, path_ + ": cannot map the file of the shown image: " + std::strerror(errno));
    memory_ = static_cast<std::byte*>(memory);
    mappedBytes_ = bytes;
    header() =
        Header{.magic = kMagic, .widthPx = widthPx_, .heightPx = heightPx_, .shown = 0, .slots = {}, .shownAtNs = {}};
    return {};
}

SharedFrameFile::~SharedFrameFile() {
    if (memory_) ::munmap(memory_, mappedBytes_);
    if (unnamed_ >= 0) ::close(unnamed_);
    if (!next_.empty()) ::unlink(next_.c_str());
}

int SharedFrameFile::hiddenSlot() const {
    const std::uint64_t shown = std::atomic_ref(header().shown).load(std::memory_order_relaxed);
    return shown == 0 ? 0 : static_cast<int>(1 - (shown & 1));
}

std::uint8_t* SharedFrameFile::pixelsOf(int slot) const {
    return reinterpret_cast<std::uint8_t*>(memory_) + kHeaderBytes +
           static_cast<std::size_t>(slot) * slotBytes(widthPx_, heightPx_);
}

void SharedFrameFile::change(int slot, bool begins) const {
    std::atomic_ref changes(header().slots[slot].changes);
    if (!begins) return changes.store(changes.load(std::memory_order_relaxed) + 1, std::memory_order_release);
    changes.store(changes.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    std::atomic_thread_fence(std::memory_order_seq_cst);
}

void SharedFrameFile::flipTo(int slot) const {
    std::atomic_ref shown(header().shown);
    const std::uint64_t times = (shown.load(std::memory_order_relaxed) >> 1) + 1;
    std::atomic_ref(header().shownAtNs[slot]).store(monotonicNs(), std::memory_order_relaxed);
    shown.store((times << 1) | static_cast<std::uint64_t>(slot), std::memory_order_release);
}

void SharedFrameFile::wakeReaders() const {
    ::syscall(SYS_futex, wakingWord(&header()), FUTEX_WAKE, INT_MAX, nullptr, nullptr, 0);
}

bool SharedFrameFile::linkAs(const std::string& name) const {
    const std::string itself = "/proc/self/fd/" + std::to_string(unnamed_);
    return ::linkat(AT_FDCWD, itself.c_str(), AT_FDCWD, name.c_str(), AT_SYMLINK_FOLLOW) == 0;
}

Expected<void> SharedFrameFile::putInPlace() {
    if (next_.empty()) return {};
    // Where there is none yet the name takes a tenth of a millisecond; taking another's place, on a busy file system,
    // up to ten.
    const bool inPlace = unnamed_ >= 0 && linkAs(path_);
    if (!inPlace && ((unnamed_ >= 0 && !linkAs(next_)) || ::rename(next_.c_str(), path_.c_str()) != 0))
        return fail(ErrorCode::kFailed, path_ + ": cannot put the shown image in place: " + std::strerror(errno));
    if (unnamed_ >= 0) ::close(std::exchange(unnamed_, -1));
    next_.clear();
    return {};
}

Expected<void> ReadyFrame::show(std::span<const ReadyFrame> frames) {
    for (const ReadyFrame& frame : frames) frame.file_->flipTo(frame.slot_);
    for (const ReadyFrame& frame : frames) frame.file_->wakeReaders();
    for (const ReadyFrame& frame : frames)
        if (auto placed = frame.file_->putInPlace(); !placed) return placed;
    return {};
}

Picture ReadyFrame::picture() const {
    return pictureFrom(file_->pixelsOf(slot_), file_->widthPx(), file_->heightPx());
}

Picture ReadyFrame::shrunk(int by) const {
    return tessera::shrunk({.first = file_->pixelsOf(slot_),
                            .pitchBytes = std::size_t{4} * static_cast<std::size_t>(file_->widthPx()),
                            .bytesPerPixel = 4,
                            .widthPx = file_->widthPx(),
                            .heightPx = file_->heightPx()},
                           by);
}

Expected<SharedFrameWriter> SharedFrameWriter::create(const std::string& path, int widthPx, int heightPx) {
    if (widthPx <= 0 || heightPx <= 0 || widthPx > kMaxFrameSidePx || heightPx > kMaxFrameSidePx)
        return fail(ErrorCode::kLimit, path + ": a picture's sides must be 1 to 16384 pixels");
    std::error_code ignored;
    std::filesystem::create_directories(std::filesystem::path(path).parent_path(), ignored);
    auto file = std::make_shared<SharedFrameFile>(path, widthPx, heightPx);
    if (auto made = file->make(); !made) return tl::unexpected(made.error());
    return SharedFrameWriter(std::move(file));
}

PixelRows SharedFrameWriter::begin() {
    const int slot = file_->hiddenSlot();
    if (drawn_ != slot) file_->change(slot, true);
    drawn_ = slot;
    prepared_ = -1;
    holdsIt_[slot] = false;
    return {.rgbx = file_->pixelsOf(slot), .pitchBytes = 4 * static_cast<std::size_t>(file_->widthPx())};
}

void SharedFrameWriter::prepared(std::uint64_t frame) {
    TESSERA_CHECK(drawn_ >= 0, "a picture is begun before it is prepared");
    const int slot = std::exchange(drawn_, -1);
    holdsIt_[slot] = true;
    holdsIt_[1 - slot] = false;
    file_->number(slot, frame);
    file_->change(slot, false);
    prepared_ = slot;
}

void SharedFrameWriter::prepare(std::uint64_t frame, const Picture& picture) {
    TESSERA_CHECK(picture.widthPx == file_->widthPx() && picture.heightPx == file_->heightPx(),
                  "the picture has the size of its tile");
    std::uint8_t* out = begin().rgbx;
    for (std::size_t i = 0; i < picture.rgb.size(); i += 3, out += 4) std::memcpy(out, picture.rgb.data() + i, 3);
    prepared(frame);
}

void SharedFrameWriter::prepareAgain(std::uint64_t frame) {
    TESSERA_CHECK(holdsIt_[0] || holdsIt_[1], "a picture is prepared before it is prepared again");
    const int slot = file_->hiddenSlot();
    if (holdsIt_[slot]) {
        file_->change(slot, true);
        file_->number(slot, frame);
        file_->change(slot, false);
        prepared_ = slot;
        return;
    }
    const std::uint8_t* const from = file_->pixelsOf(1 - slot);
    std::memcpy(begin().rgbx, from, slotBytes(file_->widthPx(), file_->heightPx()));
    const int other = 1 - slot;
    prepared(frame);
    holdsIt_[other] = true;
}

ReadyFrame SharedFrameWriter::ready() const {
    TESSERA_CHECK(prepared_ >= 0, "an image is prepared before it is shown");
    return {file_, prepared_};
}

Expected<void> SharedFrameWriter::show() {
    const ReadyFrame frame = ready();
    prepared_ = -1;
    return ReadyFrame::show(std::span(&frame, 1));
}

Expected<ShownImage> readSharedFrame(const std::string& path) {
    // Read, not mapped: a file that is cut short under our hands is a short read, where a mapping would be a SIGBUS.
    const FileHandle file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    if (file.get() < 0) {
        const bool missing = errno == ENOENT || errno == ENOTDIR;
        return fail(missing ? ErrorCode::kNotFound : ErrorCode::kFailed, path + ": " + std::strerror(errno));
    }
    std::vector<std::uint8_t> rgbx;
    const auto whole = readWhole(file.get(), path, [&](const Header& header) {
        rgbx.resize(slotBytes(header.widthPx, header.heightPx));
        return rgbx.data();
    });
    if (!whole) return tl::unexpected(whole.error());
    return ShownImage{.frame = whole->header.slots[whole->slot].frame,
                      .picture = pictureFrom(rgbx.data(), whole->header.widthPx, whole->header.heightPx)};
}

SharedFrameReader::SharedFrameReader(SharedFrameReader&& other) noexcept
    : path_(std::move(other.path_)),
      file_(std::move(other.file_)),
      header_(std::exchange(other.header_, nullptr)),
      rgbx_(std::move(other.rgbx_)) {}

SharedFrameReader& SharedFrameReader::operator=(SharedFrameReader&& other) noexcept {
    std::swap(path_, other.path_);
    std::swap(file_, other.file_);
    std::swap(header_, other.header_);
    std::swap(rgbx_, other.rgbx_);
    return *this;
}

SharedFrameReader::~SharedFrameReader() {
    if (header_) ::munmap(header_, kHeaderBytes);
}

Expected<SharedFrameReader> SharedFrameReader::open(const std::string& path) {
    SharedFrameReader reader;
    reader.path_ = path;
    reader.file_ = FileHandle(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    if (reader.file_.get() < 0) {
        const bool missing = errno == ENOENT || errno == ENOTDIR;
        return fail(missing ? ErrorCode::kNotFound : ErrorCode::kFailed, path + ": " + std::strerror(errno));
    }
    if (auto first = reader.read(); !first) return tl::unexpected(first.error());
    void* const memory = ::mmap(nullptr, kHeaderBytes, PROT_READ, MAP_SHARED, reader.file_.get(), 0);
    if (memory == MAP_FAILED) return fail(ErrorCode::kFailed, path + ": cannot be mapped: " + std::strerror(errno));
    reader.header_ = memory;
    return reader;
}

Expected<SharedFrameReader::Frame> SharedFrameReader::read() {
    const auto whole = readWhole(file_.get(), path_, [&](const Header& header) {
        rgbx_.resize(slotBytes(header.widthPx, header.heightPx));
        return rgbx_.data();
    });
    if (!whole) return tl::unexpected(whole.error());
    return Frame{.number = whole->header.slots[whole->slot].frame,
                 .times = whole->header.shown >> 1,
                 .shownAtNs = whole->header.shownAtNs[whole->slot],
                 .widthPx = whole->header.widthPx,
                 .heightPx = whole->header.heightPx,
                 .rgbx = rgbx_.data()};
}

SharedFrameReader::Glance SharedFrameReader::glance() const {
    auto* const header = static_cast<Header*>(header_);
    const std::uint64_t shown = std::atomic_ref(header->shown).load(std::memory_order_acquire);
    return {.number = std::atomic_ref(header->slots[shown & 1].frame).load(std::memory_order_relaxed),
            .times = shown >> 1};
}

bool SharedFrameReader::waitForOther(std::uint64_t times, std::chrono::milliseconds atMost) const {
    auto* const header = static_cast<Header*>(header_);
    const timespec patience{static_cast<time_t>(atMost.count() / 1000),
                            static_cast<long>(atMost.count() % 1000 * 1'000'000)};
    const std::uint64_t shown = std::atomic_ref(header->shown).load(std::memory_order_acquire);
    if (shown >> 1 != times) return true;
    ::syscall(SYS_futex, wakingWord(header), FUTEX_WAIT, static_cast<std::uint32_t>(shown), &patience, nullptr, 0);
    return std::atomic_ref(header->shown).load(std::memory_order_acquire) >> 1 != times;
}

bool SharedFrameReader::replaced() const {
    struct stat mine {
    }, named{};
    return ::fstat(file_.get(), &mine) == 0 && ::stat(path_.c_str(), &named) == 0 &&
           (mine.st_ino != named.st_ino || mine.st_dev != named.st_dev);
}

}  // namespace tessera
