/// A host's board: parts of its picture that neighbours may draw, and what it has drawn for them.
///
/// Each process writes pixels into its own board alone, so one that was stopped in the middle and goes on years later
/// spoils nobody's picture. All that others may write to (the head) is believed in nothing: an owner keeps its posting
/// to itself and reads from the board only who says to have done a part; whoever copies pixels looks afterwards whether
/// they were still the ones it meant. So whatever a neighbour does, the worst is a part drawn twice, or other pixels in
/// a part that it has drawn for us. It runs as the same user, who could do that anyway.
#pragma once

#include <array>
#include <atomic>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/share/SharedMemory.h"
#include "common/base/Clock.h"
#include "common/base/Hash.h"
#include "common/image/Picture.h"
#include "common/wall/LightHistogram.h"
#include "common/wall/Wall.h"

namespace tessera {

/// What a host is at.
enum class Activity : std::uint8_t { kIdle, kDrawing, kHelping };

/// Which host of the wall, by its place in the wall's list: both sides know that.
using HostIndex = std::uint16_t;

/// A picture cut into parts, as a neighbour has read it.
struct Posting {
    std::uint32_t number = 0;      ///< of this board; 0: none
    Hash128 digest;                ///< of all that the picture depends on but the rectangle
    std::uint32_t tile = 0;        ///< of Wall's layoutTiles
    std::vector<PixelRect> parts;  ///< of its screen
};

/// A part that somebody else has drawn, or says so.
struct DoneElsewhere {
    HostIndex by = 0;
    std::uint8_t slot = 0;  ///< of that host's board
};

namespace board {

inline constexpr std::size_t kMostParts = 32, kSlots = 16;
/// Pixels of one part, 8 bit RGB. Larger parts are not posted.
inline constexpr std::size_t kSlotBytes = std::size_t{4} << 20;
/// Behind them how bright what they show is.
inline constexpr std::size_t kLightBytes = sizeof(LightHistogram), kSlotStride = kSlotBytes + 4096;
static_assert(kLightBytes <= 4096);

using Word = std::atomic<std::uint64_t>;
static_assert(Word::is_always_lock_free && std::atomic<std::uint32_t>::is_always_lock_free);

/// In the first pages of a board.
struct Head {
    Word magic;
    std::atomic<std::uint32_t> bell;      ///< counts: somebody may want help
    std::atomic<std::uint32_t> doneBell;  ///< counts: somebody has done a part of ours
    Word activity;
    Word readyFrame;  ///< + 1; 0: none yet
    Word readyAtNs;   ///< on the machine's monotonic clock
    // The posting. `version` is odd while it is written.
    alignas(64) Word version;
    Word number, digestLow, digestHigh, tile, count;
    std::array<Word, kMostParts> rects;
    alignas(64) std::array<Word, kMostParts> states;
    alignas(64) std::array<Word, kSlots> stamps;  ///< what lies in the slots; 0: nothing whole
};
inline constexpr std::size_t kHeadBytes = 4096;
static_assert(sizeof(Head) <= kHeadBytes);

}  // namespace board

/// This host's. The draw thread owns it; `waitForCall` is for one more thread.
class Board {
public:
    [[nodiscard]] static Expected<Board> create();
    [[nodiscard]] std::string place() const { return memory_.place(); }

    // What neighbours see of this host.
    void is(Activity activity) { head().activity.store(static_cast<std::uint64_t>(activity)); }
    void ready(std::uint64_t frame, TimePoint at);

    // As the owner of a picture.
    /// At most kMostParts parts of at most kSlotBytes each. Replaces what was posted.
    void post(const Hash128& digest, std::uint32_t tile, std::span<const PixelRect> parts);
    void withdraw();
    /// This part is ours now, if nobody has taken it. Each once.
    [[nodiscard]] bool take(std::size_t part);
    /// Who says to have drawn this part.
    [[nodiscard]] std::optional<DoneElsewhere> doneElsewhere(std::size_t part) const;
    /// What the pixels of a part are stamped with, wherever they lie.
    [[nodiscard]] std::uint64_t stampOf(HostIndex owner, std::size_t part) const { return stamp(number_, owner, part); }
    /// Sleeps until somebody has done something since `seen` was read; or for no reason.
    [[nodiscard]] std::uint32_t doneCount() const { return head().doneBell.load(); }
    void waitForDone(std::uint32_t seen, Duration timeout) const;

    // As one who helps.
    /// Keeps a part's pixels and light for its owner; which slot. The oldest gives way.
    [[nodiscard]] std::uint8_t keep(const Picture& picture, const LightHistogram& light, std::uint64_t stamp);
    [[nodiscard]] std::uint32_t calls() const { return head().bell.load(); }
    void waitForCall(std::uint32_t seen, Duration timeout) const;
    /// Ends a wait for a call, from any thread.
    void callMyself() const;

    [[nodiscard]] static std::uint64_t stamp(std::uint32_t number, HostIndex owner, std::size_t part) {
        return std::uint64_t{number} << 32 | std::uint64_t{owner} << 16 | std::uint64_t{part} << 8 | 1;
    }

private:
    explicit Board(OwnMemory memory) : memory_(std::move(memory)) {}
    [[nodiscard]] board::Head& head() const { return *reinterpret_cast<board::Head*>(memory_.data()); }

    OwnMemory memory_;
    std::uint32_t number_ = 0;
    std::size_t parts_ = 0;
    std::array<bool, board::kMostParts> taken_{};  ///< by us
    std::uint8_t nextSlot_ = 0;
};

/// A neighbour's, as this process sees it.
class NeighbourBoard {
public:
    [[nodiscard]] static Expected<NeighbourBoard> open(std::string_view place);

    [[nodiscard]] Activity activity() const;
    /// When it was ready with that frame, as it says; nothing: it is not, or not yet.
    [[nodiscard]] std::optional<TimePoint> readyWith(std::uint64_t frame) const;

    /// What is posted now, whole; nothing where it changes just now, or cannot be.
    [[nodiscard]] std::optional<Posting> look() const;
    /// The last part that nobody has taken is ours, for `by`, now. Nothing left: none.
    [[nodiscard]] std::optional<std::size_t> takeLast(const Posting& posting, HostIndex by);
    /// It lies in that slot of our board. False: nobody waits for it any more.
    bool done(const Posting& posting, std::size_t part, HostIndex by, std::uint8_t slot);
    /// It could not be drawn here.
    void giveUp(const Posting& posting, std::size_t part, HostIndex by);
    /// Somebody may want help.
    void call();

    /// Copies what this neighbour has drawn for us into `whole`, whose upper left corner is at that of `tile`; its
    /// light. None: it is not (or no longer) there, and nothing in `whole` but this part may have changed.
    [[nodiscard]] std::optional<LightHistogram> copy(std::uint8_t slot, std::uint64_t stamp, const PixelRect& part,
                                                     const PixelRect& tile, Picture& whole) const;

private:
    explicit NeighbourBoard(OthersMemory memory) : memory_(std::move(memory)) {}
    [[nodiscard]] board::Head& head() const { return *reinterpret_cast<board::Head*>(memory_.head.data()); }

    OthersMemory memory_;
};

}  // namespace tessera
