#include "client/share/Board.h"

#include <algorithm>
#include <cstring>
#include <new>

namespace tessera {
namespace {

using board::Head;
using board::kHeadBytes;
using board::kLightBytes;
using board::kMostParts;
using board::kSlotBytes;
using board::kSlots;
using board::kSlotStride;

constexpr std::uint64_t kBoardMagic = 0x32445241'4f425354;  // "TSBOARD2" in memory
constexpr std::size_t kBoardBytes = kHeadBytes + kSlots * kSlotStride;

/// A part's state: the posting's number, who has it, where it lies, and:
enum class PartState : std::uint8_t { kFree, kTaken, kDone };
constexpr HostIndex kOwner = 0xffff;

std::uint64_t stateWord(std::uint32_t number, PartState state, HostIndex by = 0, std::uint8_t slot = 0) {
    return std::uint64_t{number} << 32 | std::uint64_t{by} << 16 | std::uint64_t{slot} << 8 |
           static_cast<std::uint64_t>(state);
}

std::uint64_t packed(const PixelRect& rect) {
    const auto half = [](int n) { return static_cast<std::uint64_t>(static_cast<std::uint16_t>(n)); };
    return half(rect.x) << 48 | half(rect.y) << 32 | half(rect.width) << 16 | half(rect.height);
}
PixelRect unpacked(std::uint64_t word) {
    const auto half = [&](int shift) { return static_cast<int>(word >> shift & 0xffff); };
    return {.x = half(48), .y = half(32), .width = half(16), .height = half(0)};
}
std::size_t bytesOf(const PixelRect& rect) {
    return 3 * static_cast<std::size_t>(rect.width) * static_cast<std::size_t>(rect.height);
}

}  // namespace

Expected<Board> Board::create() {
    auto memory = OwnMemory::create(kBoardBytes);
    if (!memory) return tl::unexpected(memory.error());
    Head* const head = new (memory->data()) Head{};
    head->magic.store(kBoardMagic);
    return Board(std::move(*memory));
}

void Board::ready(std::uint64_t frame, TimePoint at) {
    head().readyAtNs.store(static_cast<std::uint64_t>(at.time_since_epoch().count()));
    head().readyFrame.store(frame + 1);
}

void Board::post(const Hash128& digest, std::uint32_t tile, std::span<const PixelRect> parts) {
    TESSERA_CHECK(parts.size() <= kMostParts, "a board has room for so many parts");
    Head& to = head();
    parts_ = parts.size();
    taken_.fill(false);
    number_ = number_ == 0xffffffffu ? 1 : number_ + 1;
    const std::uint64_t version = to.version.load() | 1;
    to.version.store(version);
    to.number.store(number_);
    to.digestLow.store(digest.low);
    to.digestHigh.store(digest.high);
    to.tile.store(tile);
    to.count.store(parts.size());
    for (std::size_t i = 0; i < parts.size(); ++i) {
        TESSERA_CHECK(bytesOf(parts[i]) <= kSlotBytes, "a part has room in a slot");
        to.rects[i].store(packed(parts[i]));
        to.states[i].store(stateWord(number_, PartState::kFree));
    }
    to.version.store(version + 1);
}

void Board::withdraw() {
    Head& to = head();
    const std::uint64_t version = to.version.load() | 1;
    to.version.store(version);
    to.number.store(0);
    to.count.store(0);
    to.version.store(version + 1);
    for (auto& state : to.states) state.store(0);
    parts_ = 0;
}

bool Board::take(std::size_t part) {
    if (part >= parts_ || taken_[part]) return false;  // once is enough, whatever others write there
    std::uint64_t free = stateWord(number_, PartState::kFree);
    taken_[part] = head().states[part].compare_exchange_strong(free, stateWord(number_, PartState::kTaken, kOwner));
    return taken_[part];
}

std::optional<DoneElsewhere> Board::doneElsewhere(std::size_t part) const {
    const std::uint64_t word = head().states[part].load();
    const auto by = static_cast<HostIndex>(word >> 16);
    const auto slot = static_cast<std::uint8_t>(word >> 8);
    if (word != stateWord(number_, PartState::kDone, by, slot) || slot >= kSlots) return std::nullopt;
    return DoneElsewhere{by, slot};
}

void Board::waitForDone(std::uint32_t seen, Duration timeout) const {
    waitForBell(&head().doneBell, seen, timeout.count());
}

std::uint8_t Board::keep(const Picture& picture, const LightHistogram& light, std::uint64_t stamp) {
    TESSERA_CHECK(picture.rgb.size() <= kSlotBytes, "a part has room in a slot");
    const std::uint8_t slot = nextSlot_;
    nextSlot_ = static_cast<std::uint8_t>((nextSlot_ + 1) % kSlots);
    head().stamps[slot].store(0);
    std::atomic_thread_fence(std::memory_order_seq_cst);
    std::byte* const to = memory_.data() + kHeadBytes + slot * kSlotStride;
    std::memcpy(to, picture.rgb.data(), picture.rgb.size());
    std::memcpy(to + kSlotBytes, &light, kLightBytes);
    head().stamps[slot].store(stamp);
    return slot;
}

void Board::waitForCall(std::uint32_t seen, Duration timeout) const {
    waitForBell(&head().bell, seen, timeout.count());
}

void Board::callMyself() const {
    head().bell.fetch_add(1);
    ringBell(&head().bell);
}

Expected<NeighbourBoard> NeighbourBoard::open(std::string_view place) {
    auto memory = OthersMemory::open(place, kHeadBytes, kSlots * kSlotStride);
    if (!memory) return tl::unexpected(memory.error());
    NeighbourBoard opened(std::move(*memory));
    if (opened.head().magic.load() != kBoardMagic)
        return fail(ErrorCode::kBadInput, std::string(place) + ": not the board of a Tessera host of this version");
    return opened;
}

Activity NeighbourBoard::activity() const {
    const std::uint64_t said = head().activity.load();
    return said <= static_cast<std::uint64_t>(Activity::kHelping) ? static_cast<Activity>(said) : Activity::kIdle;
}

std::optional<TimePoint> NeighbourBoard::readyWith(std::uint64_t frame) const {
    if (head().readyFrame.load() != frame + 1) return std::nullopt;
    return TimePoint(Duration(static_cast<std::int64_t>(head().readyAtNs.load() & 0x7fffffffffffffffu)));
}

std::optional<Posting> NeighbourBoard::look() const {
    const Head& from = head();
    const std::uint64_t version = from.version.load();
    Posting posting{.number = static_cast<std::uint32_t>(from.number.load()),
                    .digest = {from.digestLow.load(), from.digestHigh.load()},
                    .tile = static_cast<std::uint32_t>(from.tile.load()),
                    .parts = {}};
    const std::uint64_t count = from.count.load();
    if (version % 2 == 1 || posting.number == 0 || count == 0 || count > kMostParts) return std::nullopt;
    for (std::size_t i = 0; i < count; ++i) {
        posting.parts.push_back(unpacked(from.rects[i].load()));
        const PixelRect& part = posting.parts.back();
        if (part.width == 0 || part.height == 0 || bytesOf(part) > kSlotBytes) return std::nullopt;
    }
    if (from.version.load() != version) return std::nullopt;
    return posting;
}

std::optional<std::size_t> NeighbourBoard::takeLast(const Posting& posting, HostIndex by) {
    for (std::size_t i = posting.parts.size(); i-- > 0;) {
        std::uint64_t free = stateWord(posting.number, PartState::kFree);
        if (head().states[i].compare_exchange_strong(free, stateWord(posting.number, PartState::kTaken, by))) return i;
    }
    return std::nullopt;
}

bool NeighbourBoard::done(const Posting& posting, std::size_t part, HostIndex by, std::uint8_t slot) {
    std::uint64_t taken = stateWord(posting.number, PartState::kTaken, by);
    const bool wanted =
        head().states[part].compare_exchange_strong(taken, stateWord(posting.number, PartState::kDone, by, slot));
    head().doneBell.fetch_add(1);
    ringBell(&head().doneBell);
    return wanted;
}

void NeighbourBoard::giveUp(const Posting& posting, std::size_t part, HostIndex by) {
    std::uint64_t taken = stateWord(posting.number, PartState::kTaken, by);
    head().states[part].compare_exchange_strong(taken, stateWord(posting.number, PartState::kFree));
    head().doneBell.fetch_add(1);
    ringBell(&head().doneBell);
}

void NeighbourBoard::call() {
    head().bell.fetch_add(1);
    ringBell(&head().bell);
}

std::optional<LightHistogram> NeighbourBoard::copy(std::uint8_t slot, std::uint64_t stamp, const PixelRect& part,
                                                   const PixelRect& tile, Picture& whole) const {
    if (slot >= kSlots || head().stamps[slot].load() != stamp) return std::nullopt;
    const std::byte* from = memory_.rest.data() + slot * kSlotStride;
    LightHistogram light;
    std::memcpy(&light, from + kSlotBytes, kLightBytes);
    const std::size_t row = 3 * static_cast<std::size_t>(part.width), stride = 3 * static_cast<std::size_t>(tile.width);
    // Rows count from the top in pictures, from below on screens.
    const auto top = static_cast<std::size_t>(tile.y + tile.height - part.y - part.height);
    std::uint8_t* to = whole.rgb.data() + top * stride + 3 * static_cast<std::size_t>(part.x - tile.x);
    for (int y = 0; y < part.height; ++y, from += row, to += stride) std::memcpy(to, from, row);
    std::atomic_thread_fence(std::memory_order_seq_cst);
    return head().stamps[slot].load() == stamp ? std::optional(light) : std::nullopt;
}

}  // namespace tessera
