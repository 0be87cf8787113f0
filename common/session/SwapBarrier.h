/// Nobody shows frame n until everybody has drawn it.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/Clock.h"
#include "common/base/Error.h"
#include "common/base/HistoryIds.h"
#include "common/base/SyncPolicy.h"

namespace tessera {

/// Pure state machine over host names: feed it events, carry out what it returns. Not thread-safe; one owner. Frames
/// begin and are released in order, each exactly once. Times are the caller's clock.
///
/// A late host (hold, drop) is *behind*: it still draws an older frame, so it is neither told to draw newer ones nor
/// waited for. Under hold it stays a member and takes part in the first frame that begins after its Ready; under drop
/// that Ready ends its membership, and the owner enters it again once it has caught up. A host that draws one frame for
/// longer than the frame deadline has stalled and is out, whatever the policy. The frame deadline is
/// `SyncPolicy::frameDeadline`, but never under three times the median of the recent frames; `firstFrameDeadline` until
/// one has been drawn.
///
/// The next frame begins when all who were told to show the last one have said that they do: so no two shown images
/// differ by a frame for longer than the word to show takes. Who lives and does not say so within
/// `SyncPolicy::lostAfter` is out, whatever the policy: it has held the others up once, for that long (hold, drop: for
/// `lateAfter` at most). Who misses the frame deadline and owes that word is out for the word: no host draws a frame
/// before it shows the one before.
///
/// A host that is out for one of these two has held the others up, and does so no more before it has *proved* itself:
/// once it is in again, the others wait for its picture no longer than `lateAfter` after the first Ready, whatever the
/// policy, and for its word not at all. It has proved itself after one frame that it has drawn and shown, after the
/// second time after two, then four, and so on; a picture that comes after the others have gone on counts too. Who was
/// waited for 65,536 frames since begins anew.
class SwapBarrier {
public:
    /// `first`: the number of the first frame.
    explicit SwapBarrier(SyncPolicy policy, FrameNumber first = {});

    /// The host takes part from the next begun frame on. Entering twice is harmless.
    void enter(const std::string& host);
    /// Removes a host now (lost, resyncing). May release the open frame: see `poll`.
    void leave(const std::string& host);

    /// Whether `begin` makes sense: no frame is open, not all hosts that are left are behind, and the last frame is
    /// shown.
    [[nodiscard]] bool mayBegin() const;
    /// Begins `frame`, one past the last; only when no frame is open. Returns who has to draw it.
    std::vector<std::string> begin(FrameNumber frame, TimePoint now);
    /// A repeat for the same frame is harmless, an older frame too (a straggler); a frame that this host was not told
    /// to draw, or one from a host that is not in the barrier, is a protocol error.
    [[nodiscard]] Expected<void> ready(const std::string& host, FrameNumber frame, TimePoint now);
    /// All that hosts were to be told has been said by `now`, a look at the clock: from then on they have time to show.
    /// An event may be handled long after its instant, and Swap goes out no sooner.
    void told(TimePoint now);
    /// That is to be said.
    [[nodiscard]] bool untold() const;
    /// It shows this frame, which it was told to: the caller sees to that. Hosts that are not in the barrier are passed
    /// over.
    void shown(const std::string& host, FrameNumber frame, TimePoint now);

    /// What the others waited for: of the frame's last host, and of the one before it. Times are the caller's.
    struct Wait {
        bool drew = false;              ///< the last one said Ready; else it left, or was left behind
        std::string before;             ///< who was ready before it, the others all by then; empty: nobody waited
        Duration alone{};               ///< from then on
        Duration took{}, beforeTook{};  ///< Begin to Ready of either; their difference is `alone`
    };
    struct Outcome {
        bool released = false;  ///< the open frame is complete: tell `show` to swap
        FrameNumber frame;
        std::vector<std::string> show;  ///< hosts that have drawn it
        std::vector<std::string>
            held;  ///< hosts that keep their last image: those behind; under drop, those just dropped
        std::vector<std::string>
            stalled;  ///< hosts that missed the frame deadline and owe nothing else; they have left the barrier
        std::vector<std::string>
            unshown;             ///< hosts that do not say that they show what they were told to; they have left too
        Duration barrierTime{};  ///< first ready to release
        Duration frameTime{};    ///< begin to release
        std::string lastHost;    ///< the last one waited for; empty when nobody drew
        Wait wait;               ///< for it
    };
    /// Call after every event and whenever the clock passes `nextDeadline()`.
    [[nodiscard]] Outcome poll(TimePoint now) { return poll(now, now); }
    /// Deadlines are judged as of `known`: the caller may not have seen everything yet that happened until `now`.
    [[nodiscard]] Outcome poll(TimePoint now, TimePoint known);
    /// When something would change without an event; TimePoint::max() for never.
    [[nodiscard]] TimePoint nextDeadline() const;

    [[nodiscard]] bool open() const { return open_; }
    /// While one is open.
    [[nodiscard]] FrameNumber openFrame() const { return FrameNumber(next_.value - 1); }
    [[nodiscard]] FrameNumber nextFrame() const { return next_; }
    /// Who has not drawn the open frame yet: always known, and reported.
    [[nodiscard]] std::vector<std::string> waitingFor() const;
    /// Dropped hosts are not in the barrier.
    [[nodiscard]] bool contains(const std::string& host) const;
    /// How many frames this host has still to draw and show before the others wait for it. Zero also where it is not in
    /// the barrier.
    [[nodiscard]] std::uint32_t framesToProve(const std::string& host) const;
    [[nodiscard]] Duration frameDeadline() const;

private:
    enum class Progress : std::uint8_t {
        kIdle,     ///< takes part in the next frame
        kDrawing,  ///< the open frame
        kDone,     ///< with the open frame
        kBehind,   ///< draws a frame that the others have left
    };
    struct Member {
        Progress progress = Progress::kIdle;
        bool dropped = false;
        bool everBegun = false;
        FrameNumber frame;  ///< the last it was told to draw
        TimePoint begunAt{};
        TimePoint readyAt{};
        std::optional<FrameNumber> toShow;     ///< it was told to, and has not said that it does
        std::optional<TimePoint> toShowSince;  ///< as far as is known
        bool holdsUp = false;                  ///< the next frame waits for that word
        std::uint32_t proving = 0;             ///< frames that it has still to draw and show before it is waited for
        std::uint32_t waitedFor = 0;           ///< frames that it has shown since
    };
    [[nodiscard]] std::size_t count(Progress progress) const;
    [[nodiscard]] TimePoint firstReady() const;
    [[nodiscard]] Wait waitForLast(TimePoint now) const;
    /// For the word that a host shows the last frame, before the next one begins without it (hold, drop).
    [[nodiscard]] Duration shownPatience() const { return std::min<Duration>(policy_.lateAfter, policy_.lostAfter); }
    [[nodiscard]] static bool owesFor(const Member& member, Duration time, TimePoint now) {
        return member.toShow && member.toShowSince && now >= *member.toShowSince + time;
    }
    /// Members that the open frame may be released without, `lateAfter` after the first Ready: only they still draw.
    [[nodiscard]] bool mayLeaveBehind() const;
    void heldUpBy(const std::string& host, const Member& member);
    void waitNoLongerForShown(TimePoint now);
    void removeUnshown(TimePoint now, Outcome& outcome);
    void removeStalled(TimePoint now, Outcome& outcome);
    void leaveLateBehind(TimePoint now, Outcome& outcome);
    void release(TimePoint now, Outcome& outcome);

    SyncPolicy policy_;
    std::map<std::string, Member> members_;
    std::map<std::string, std::uint32_t> heldUp_;  ///< how often a host has held up the others, until that is forgotten
    std::vector<Duration> recentFrames_;
    FrameNumber next_;
    bool open_ = false;
    TimePoint begun_{};
    std::string lastHost_;
};

}  // namespace tessera
