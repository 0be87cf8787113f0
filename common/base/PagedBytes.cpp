#include "common/base/PagedBytes.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <mutex>

#include "common/base/Error.h"

namespace tessera {
namespace {

constexpr std::size_t kPage = PagedBytes::kPageBytes;

constexpr std::size_t kMostPages = 0xffffffff;  // are counted in 32 bits

/// Of all views: a process may have 65,530 mappings (vm.max_map_count).
constexpr std::size_t kMostMappings = 16'384;
std::atomic<std::size_t> mappings{0};

constexpr std::size_t pagesFor(std::size_t bytes) {
    return (bytes + kPage - 1) / kPage;
}

/// The file in which all pages of this process lie. Its places are given once and never again; memory is taken where
/// something is written, and given back as a hole.
class PageFile {
public:
    static PageFile& ofThisProcess() {
        static PageFile* file = new PageFile;  // outlives whatever still holds pages when the program ends
        return *file;
    }
    [[nodiscard]] int get() const { return file_; }

    /// The first byte of so many pages; -1 where there are none to be had.
    [[nodiscard]] off_t take(std::size_t pages) {
        const std::uint64_t bytes = std::uint64_t{pages} * kPage;
        if (file_ < 0 || bytes > kBytes) return -1;
        const std::uint64_t at = next_.fetch_add(bytes, std::memory_order_relaxed);
        return at <= kBytes - bytes ? static_cast<off_t>(at) : -1;
    }
    void giveBack(off_t at, std::size_t pages) const {
        (void)::fallocate(file_, FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, at, static_cast<off_t>(pages * kPage));
    }
    /// Written, not mapped: where there is no memory left this is an error, and a mapping would be a SIGBUS.
    [[nodiscard]] bool write(off_t at, ByteSpan bytes) const {
        while (!bytes.empty()) {
            const ssize_t n = ::pwrite(file_, bytes.data(), bytes.size(), at);
            if (n < 0 && errno == EINTR) continue;
            if (n <= 0) return false;
            bytes = bytes.subspan(static_cast<std::size_t>(n));
            at += n;
        }
        return true;
    }
    void read(off_t at, std::span<std::byte> to) const {
        while (!to.empty()) {
            const ssize_t n = ::pread(file_, to.data(), to.size(), at);
            if (n < 0 && errno == EINTR) continue;
            TESSERA_CHECK(n > 0, "what was written to memory can be read");
            to = to.subspan(static_cast<std::size_t>(n));
            at += n;
        }
    }

private:
    /// Of places, whatever was given back: 10,000 edits of two pages a second for two centuries.
    static constexpr std::uint64_t kBytes = std::uint64_t{1} << 59;

    PageFile() {
        rlimit file{}, addresses{};
        // Beyond the one a write would be a signal; views of versions soon take more of the other than arrays do.
        if (::getrlimit(RLIMIT_FSIZE, &file) != 0 || file.rlim_cur != RLIM_INFINITY ||
            ::getrlimit(RLIMIT_AS, &addresses) != 0 || addresses.rlim_cur != RLIM_INFINITY ||
            ::sysconf(_SC_PAGESIZE) != static_cast<long>(kPage))
            return;
        file_ = ::memfd_create("tessera-pages", MFD_CLOEXEC);
        if (file_ >= 0 && ::ftruncate(file_, static_cast<off_t>(kBytes)) != 0) file_ = (::close(file_), -1);
    }

    int file_ = -1;
    std::atomic<std::uint64_t> next_{0};
};

}  // namespace

/// Pages of their own in the file, until nobody needs them.
class PagedBytes::Slot {
public:
    [[nodiscard]] static std::shared_ptr<const Slot> of(std::size_t pages) {
        const off_t at = pages > 0 && pages <= kMostPages ? PageFile::ofThisProcess().take(pages) : -1;
        return at < 0 ? nullptr : std::make_shared<const Slot>(at, pages);
    }
    Slot(off_t at, std::size_t pages) : at_(at), pages_(pages) {}
    ~Slot() { PageFile::ofThisProcess().giveBack(at_, pages_); }
    Slot(const Slot&) = delete;
    Slot& operator=(const Slot&) = delete;
    [[nodiscard]] off_t byteOf(std::size_t page) const { return at_ + static_cast<off_t>(page * kPage); }

private:
    const off_t at_;
    const std::size_t pages_;
};

/// Where an array's pages lie in their order, and which of them some version still needs.
class PagedBytes::Home {
public:
    Home(std::shared_ptr<const Slot> slot, std::size_t pages) : slot_(std::move(slot)), away_(pages) {}
    Home(std::shared_ptr<const void> owner, ByteSpan mapped) : owner_(std::move(owner)), mapped_(mapped) {}

    /// Whether pages can come home.
    [[nodiscard]] bool ours() const { return slot_ != nullptr; }
    [[nodiscard]] const Slot& slot() const { return *slot_; }
    /// Somebody else's, in one piece.
    [[nodiscard]] ByteSpan mapped() const { return mapped_; }

    void read(std::size_t offset, std::span<std::byte> to) const {
        if (ours())
            PageFile::ofThisProcess().read(slot_->byteOf(0) + static_cast<off_t>(offset), to);
        else
            std::memcpy(to.data(), mapped_.data() + offset, to.size());
    }
    /// A mapping of all of it, in which pieces can be laid; MAP_FAILED.
    [[nodiscard]] void* map(std::size_t bytes) const {
        if (ours())
            return ::mmap(nullptr, bytes, PROT_READ, MAP_SHARED, PageFile::ofThisProcess().get(), slot_->byteOf(0));
        // Of no bytes before: another mapping of the same pages, for which nobody needs to know the file.
        return ::mremap(const_cast<std::byte*>(mapped_.data()), 0, bytes, MREMAP_MAYMOVE);
    }

    /// A version comes. Of its pages that are away and that nobody needs at home, `most` come home: `home` tells which,
    /// and nobody else looks at them before it does.
    void enter(Pieces& away, std::size_t most, std::vector<Piece>& home) {
        const std::scoped_lock lock(mutex_);
        if (ours()) bring(away, most, home);
        ++versions_;
        for (const Piece& piece : away) count(piece, 1);
    }
    void leave(const Pieces& away) {
        const std::scoped_lock lock(mutex_);
        --versions_;
        for (const Piece& piece : away) count(piece, -1);
    }

private:
    void count(const Piece& piece, int by) {
        if (away_.empty()) return;
        for (std::uint32_t page = piece.first; page < piece.end; ++page) away_[page] += static_cast<std::uint32_t>(by);
    }
    void bring(Pieces& away, std::size_t most, std::vector<Piece>& home) {
        Pieces stay;
        for (Piece& piece : away) {
            std::uint32_t end = piece.first;
            while (end < piece.end && most > 0 && away_[end] == versions_) ++end, --most;
            if (end > piece.first) home.push_back({piece.first, end, piece.slot, piece.at});
            if (end < piece.end)
                stay.push_back({end, piece.end, std::move(piece.slot), piece.at + (end - piece.first)});
        }
        away = std::move(stay);
    }

    const std::shared_ptr<const Slot> slot_;   ///< ours
    const std::shared_ptr<const void> owner_;  ///< or somebody else's
    const ByteSpan mapped_;
    std::mutex mutex_;
    std::uint32_t versions_ = 0;       ///< that live
    std::vector<std::uint32_t> away_;  ///< of each page: versions that have it away; empty where it is somebody else's
};

PagedBytes::Maker::Maker(std::size_t size) : slot_(Slot::of(pagesFor(size))), size_(size) {}

bool PagedBytes::Maker::write(std::size_t offset, ByteSpan bytes) {
    TESSERA_CHECK(offset <= size_ && bytes.size() <= size_ - offset, "what comes lies inside");
    return slot_ && PageFile::ofThisProcess().write(slot_->byteOf(0) + static_cast<off_t>(offset), bytes);
}

std::shared_ptr<const PagedBytes> PagedBytes::Maker::finish() {
    TESSERA_CHECK(slot_, "an array is whole");
    return livingIn(std::make_shared<Home>(std::move(slot_), pagesFor(size_)), size_);
}

void PagedBytes::Maker::read(std::size_t offset, std::span<std::byte> to) const {
    if (!to.empty()) PageFile::ofThisProcess().read(slot_->byteOf(0) + static_cast<off_t>(offset), to);
}

std::shared_ptr<const PagedBytes> PagedBytes::livingIn(std::shared_ptr<Home> home, std::size_t size) {
    Pieces none;
    std::vector<Piece> nothing;
    home->enter(none, 0, nothing);
    return std::shared_ptr<const PagedBytes>(new PagedBytes(std::move(home), {}, size));
}

std::shared_ptr<const PagedBytes> PagedBytes::copyOf(ByteSpan bytes) {
    Maker maker(bytes.size());
    return maker.write(0, bytes) ? maker.finish() : nullptr;
}

std::shared_ptr<const PagedBytes> PagedBytes::over(std::shared_ptr<const void> owner, ByteSpan mapped) {
    if (mapped.empty() || pagesFor(mapped.size()) > kMostPages || PageFile::ofThisProcess().get() < 0) return nullptr;
    return livingIn(std::make_shared<Home>(std::move(owner), mapped), mapped.size());
}

PagedBytes::~PagedBytes() {
    if (std::byte* view = view_.load(std::memory_order_acquire)) unmap(view);
    home_->leave(away_);
}

PagedBytes::Pieces PagedBytes::without(const Pieces& away, std::uint32_t first, std::uint32_t end) {
    Pieces left;
    left.reserve(away.size() + 2);
    for (const Piece& piece : away) {
        if (piece.first < first) left.push_back({piece.first, std::min(piece.end, first), piece.slot, piece.at});
        if (piece.end > end) {
            const std::uint32_t from = std::max(piece.first, end);
            left.push_back({from, piece.end, piece.slot, piece.at + (from - piece.first)});
        }
    }
    return left;
}

std::shared_ptr<const PagedBytes> PagedBytes::withRange(std::size_t offset, ByteSpan bytes) const {
    TESSERA_CHECK(!bytes.empty() && offset <= size_ && bytes.size() <= size_ - offset, "a range lies in its array");
    const PageFile& file = PageFile::ofThisProcess();
    const auto first = static_cast<std::uint32_t>(offset / kPage),
               end = static_cast<std::uint32_t>(pagesFor(offset + bytes.size()));
    const std::size_t pages = end - first;
    std::shared_ptr<const Slot> slot = Slot::of(pages);
    if (!slot) return nullptr;
    // Its first and last page keep what the range does not cover.
    std::byte edge[kPage];
    const auto writePage = [&](std::size_t page) {
        const std::size_t from = page * kPage, size = std::min(kPage, size_ - from);
        read(from, std::span(edge).first(size));
        const std::size_t begin = std::max(from, offset), stop = std::min(from + size, offset + bytes.size());
        std::memcpy(edge + (begin - from), bytes.data() + (begin - offset), stop - begin);
        return file.write(slot->byteOf(page - first), std::span(edge).first(size));
    };
    if (!writePage(first) || (pages > 1 && !writePage(end - 1))) return nullptr;
    if (pages > 2 && !file.write(slot->byteOf(1), bytes.subspan((first + 1) * kPage - offset, (pages - 2) * kPage)))
        return nullptr;

    Pieces away = without(away_, first, end);
    const auto place = std::find_if(away.begin(), away.end(), [&](const Piece& piece) { return piece.first >= end; });
    away.insert(place, Piece{first, end, std::move(slot), 0});
    // More pages come home than go away, so that there are ever fewer.
    std::vector<Piece> home;
    home_->enter(away, 2 * pages + 4, home);
    std::shared_ptr<const PagedBytes> made(new PagedBytes(home_, std::move(away), size_));
    std::byte page[kPage];
    for (const Piece& piece : home)
        for (std::uint32_t p = piece.first; p < piece.end; ++p) {
            file.read(piece.slot->byteOf(piece.at + (p - piece.first)), page);
            if (!file.write(home_->slot().byteOf(p), page)) return nullptr;
        }
    return made->away_.size() <= kMostPieces ? made : copyOf(made->view());
}

void PagedBytes::read(std::size_t offset, std::span<std::byte> to) const {
    if (const std::byte* view = view_.load(std::memory_order_acquire)) {
        std::memcpy(to.data(), view + offset, to.size());
        return;
    }
    auto piece = std::lower_bound(away_.begin(), away_.end(), offset / kPage,
                                  [](const Piece& p, std::size_t page) { return p.end <= page; });
    while (!to.empty()) {
        const bool away = piece != away_.end() && piece->first * kPage <= offset;
        std::size_t until = size_;
        if (piece != away_.end()) until = std::min(size_, std::size_t{away ? piece->end : piece->first} * kPage);
        const std::span<std::byte> part = to.first(std::min(to.size(), until - offset));
        if (away)
            PageFile::ofThisProcess().read(
                piece->slot->byteOf(piece->at) + static_cast<off_t>(offset - piece->first * kPage), part);
        else
            home_->read(offset, part);
        offset += part.size();
        to = to.subspan(part.size());
        if (away) ++piece;
    }
}

std::byte* PagedBytes::map() const {
    const auto* failed = static_cast<std::byte*>(MAP_FAILED);
    mappings += mappingsOfView();
    if (mappings <= kMostMappings) {
        auto* bytes = static_cast<std::byte*>(home_->map(size_));
        const auto lay = [&](const Piece& piece) {
            return ::mmap(bytes + piece.first * kPage, (piece.end - piece.first) * kPage, PROT_READ,
                          MAP_SHARED | MAP_FIXED, PageFile::ofThisProcess().get(),
                          piece.slot->byteOf(piece.at)) != MAP_FAILED;
        };
        if (bytes != failed && std::ranges::all_of(away_, lay)) return bytes;
        if (bytes != failed) ::munmap(bytes, size_);
    }
    // Too many mappings. A copy is one.
    auto* copy =
        static_cast<std::byte*>(::mmap(nullptr, size_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0));
    TESSERA_CHECK(copy != failed, "there are addresses for an array");
    read(0, {copy, size_});
    return copy;
}

void PagedBytes::unmap(std::byte* view) const {
    ::munmap(view, size_);
    mappings -= mappingsOfView();
}

ByteSpan PagedBytes::view() const {
    if (away_.empty() && !home_->ours()) return home_->mapped();
    std::byte* bytes = view_.load(std::memory_order_acquire);
    if (!bytes) {
        bytes = map();
        std::byte* first = nullptr;
        if (!view_.compare_exchange_strong(first, bytes, std::memory_order_acq_rel)) {
            unmap(bytes);
            bytes = first;
        }
    }
    return {bytes, size_};
}

}  // namespace tessera
