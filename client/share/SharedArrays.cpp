#include "client/share/SharedArrays.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <charconv>
#include <filesystem>
#include <limits>
#include <optional>
#include <thread>
#include <tuple>

namespace tessera {
namespace {

using namespace std::chrono_literals;

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

}  // namespace

SharedArrays::SharedArrays(Log& log, Neighbours neighbours)
    : log_(log),
      neighbours_(neighbours ? std::move(neighbours) : processesOfThisProgram),
      own_(ArrayDirectory::make()) {
    if (!own_) log_.info("arrays are not shared with other hosts on this machine: no memory of that kind can be had");
}

void SharedArrays::meetNeighbours() {
    const auto now = std::chrono::steady_clock::now();
    if (now - metAt_ < kMeetEvery) return;
    metAt_ = now;
    std::map<pid_t, std::unique_ptr<OthersArrayDirectory>> met;
    for (const pid_t process : neighbours_()) {
        auto known = others_.extract(process);
        // A process whose number another one has taken over is found to be nobody's when a file of it is opened.
        std::unique_ptr<OthersArrayDirectory> directory =
            known && known.mapped() ? std::move(known.mapped()) : OthersArrayDirectory::open(process);
        if (directory) met.emplace(process, std::move(directory));
    }
    others_ = std::move(met);
}

Blob SharedArrays::find(const BlobInfo& wanted) {
    if (!own_ || wanted.sizeBytes < kLeastBytes) return {};
    meetNeighbours();
    for (const auto& [process, directory] : others_) {
        ArrayFile file = directory->find(wanted);
        if (!file.open()) continue;
        if (Blob blob = adopted(std::move(file), *directory, wanted); !blob.empty()) return counted(std::move(blob));
        if (!directory->trusted()) return {};  // that was a hash of all its bytes: one in vain is enough
    }
    return {};
}

/// A sealed file, mapped, and listed for others for as long as anybody holds its blob.
struct SharedArrays::Kept {
    /// Opened anew and only to be read: Linux before 6.7 maps no sealed file that could be written.
    Kept(int sealed, std::shared_ptr<ArrayDirectory> ours, std::uint64_t size)
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

    [[nodiscard]] static std::shared_ptr<Kept> of(int sealed, std::shared_ptr<ArrayDirectory> ours,
                                                  std::uint64_t size) {
        auto kept = std::make_shared<Kept>(sealed, std::move(ours), size);
        return kept->memory != MAP_FAILED ? kept : nullptr;
    }
    [[nodiscard]] ByteSpan span() const { return {static_cast<const std::byte*>(memory), bytes}; }
    /// Pages that another sealed file has too lie there from here on: who reads them sees the same. False: they lie
    /// where they did.
    [[nodiscard]] bool layOver(const ArrayFile& same, std::size_t offset, std::size_t count) {
        return ::mmap(static_cast<std::byte*>(memory) + offset, count, PROT_READ, MAP_SHARED | MAP_FIXED, same.get(),
                      static_cast<off_t>(offset)) != MAP_FAILED;
    }
    /// All of them do: the other file takes the place of ours, under the number that it is listed with.
    void moved(const ArrayFile& same) {
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

    ArrayFile file;
    std::shared_ptr<ArrayDirectory> directory;
    std::size_t bytes;
    std::optional<std::size_t> place;
    void* memory = MAP_FAILED;
};

/// A file in memory: one that is being written, or one that somebody has sealed.
class SharedArrays::Place : public BlobPlace {
public:
    Place(SharedArrays& arrays, const BlobInfo& info, ArrayFile file)
        : arrays_(arrays), info_(info), file_(std::move(file)), directory_(arrays.own_) {
        directory_->counts(1);
    }
    ~Place() override {
        directory_->giveBack({.file = file_.release()}, info_.sizeBytes);
        directory_->counts(-1);
    }
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;
    bool write(std::size_t offset, ByteSpan bytes) override { return file_.write(offset, bytes); }
    void read(std::size_t offset, std::span<std::byte> to) const override { file_.read(offset, to); }
    std::shared_ptr<const PagedBytes> finish() override {
        const std::shared_ptr<Kept> kept = file_.isSealed(info_.sizeBytes) || file_.seal()
                                               ? Kept::of(file_.get(), arrays_.own_, info_.sizeBytes)
                                               : nullptr;
        std::shared_ptr<const PagedBytes> pages = kept ? PagedBytes::over(kept, kept->span()) : nullptr;
        if (pages) arrays_.placed_[info_.id] = kept;
        return pages;
    }

private:
    SharedArrays& arrays_;
    BlobInfo info_;
    ArrayFile file_;
    std::shared_ptr<ArrayDirectory> directory_;
};

std::unique_ptr<BlobPlace> SharedArrays::place(const BlobInfo& info) {
    if (!own_ || own_->full() || info.sizeBytes < Blob::kPagedBytes) return nullptr;
    ArrayFile file = ArrayFile::make();
    return file.get() < 0 ? nullptr : std::make_unique<Place>(*this, info, std::move(file));
}

/// An array that lies in memory of ours, and may lie in a neighbour's too.
struct SharedArrays::Doubled {
    std::weak_ptr<Kept> kept;
    BlobInfo info;
    std::size_t looks = 0;  ///< for a neighbour's
    std::optional<ArrayFile> theirs = std::nullopt;
    pid_t from = -1;       ///< whose that is
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
    if (!ArrayFile::areSame(kept->file, *doubled.theirs, doubled.same, piece)) {
        // Back to ours, and on to the next: else one that lies would keep all others from sharing.
        if (doubled.same > 0) (void)kept->layOver(kept->file, 0, doubled.same);
        if (const auto from = others_.find(doubled.from); from != others_.end()) from->second->distrust();
        doubled.theirs.reset();
        doubled.same = 0;
        return findEarlier(doubled);
    }
    if (!kept->layOver(*doubled.theirs, doubled.same, piece)) return false;
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
    const auto wholeAt = [](const ArrayFile& file) {
        struct stat status {};
        if (::fstat(file.get(), &status) != 0)
            return std::tuple(std::numeric_limits<std::int64_t>::max(), std::int64_t{0}, ino_t{0});
        return std::tuple(std::int64_t{status.st_mtim.tv_sec}, std::int64_t{status.st_mtim.tv_nsec}, status.st_ino);
    };
    const std::shared_ptr<Kept> kept = doubled.kept.lock();
    meetNeighbours();
    auto earliest = wholeAt(kept->file);
    for (const auto& [process, directory] : others_) {
        ArrayFile theirs = directory->find(doubled.info);
        if (theirs.get() < 0 || wholeAt(theirs) >= earliest) continue;
        earliest = wholeAt(theirs);
        doubled.from = process;
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
    const ArrayFile file = ArrayFile::make();
    return file.get() >= 0 && file.write(0, blob.bytes()) && file.seal() ? Kept::of(file.get(), own_, blob.sizeBytes())
                                                                         : nullptr;
}

/// Two that put the same blob there at once see each other when both are done: the one with the lower number keeps its
/// own. Where the other one had looked before, it does not know; so after a moment the lower one gives way.
Blob SharedArrays::rival(const BlobInfo& info, std::uint64_t place) {
    for (const bool waited : {false, true}) {
        bool any = false;
        for (const auto& [process, directory] : others_) {
            ArrayFile theirs = directory->find(info);
            struct stat status {};
            if (theirs.get() < 0 || ::fstat(theirs.get(), &status) != 0 || status.st_ino == place) continue;
            any = true;
            if (!waited && process > ::getpid()) continue;
            if (Blob blob = adopted(std::move(theirs), *directory, info); !blob.empty())
                return counted(std::move(blob));
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
Blob SharedArrays::adopted(ArrayFile file, OthersArrayDirectory& from, const BlobInfo& info) {
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
    if (kept && blob.id() != info.id) from.distrust();
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
