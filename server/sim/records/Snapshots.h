/// The whole scene for those who join: hosts, applications, and replicas to be repaired.
#pragma once

#include <atomic>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include "common/base/LaneThreads.h"
#include "common/scene/Aspect.h"
#include "common/session/ServerSession.h"
#include "server/sim/records/WaitingLists.h"

namespace tessera {

/// A snapshot, as the lane of `Snapshots` has made it.
struct SnapshotMade {
    message::Snapshot snapshot;
    Blob content;              ///< empty: the scene is small, and the snapshot holds it
    std::vector<Blob> arrays;  ///< that it names: whoever is given it fetches them, whatever became of the scene
};

/// Makes snapshots on a lane of its own, whatever the size of the scene: it holds an aspect that follows the
/// committed lists, some behind while nobody asks. Whatever else is to be found in the scene as it was at some list,
/// and takes longer than a frame should, is found there too (`look`). What has been made serves all who join while the
/// lists since then are few.
///
/// Memory: the scene a second time; the lists that the lane has not taken yet (16 MiB as they came, or 16 lists where
/// those are larger; what comes beyond is merged); those that it has not applied (kTrailing); and the last snapshot as
/// long as somebody may be served with it, with all arrays that it and the lists since then name: of these lists
/// kMostArrayBytes, beyond which the next to join gets a newer one.
class Snapshots {
public:
    /// Scenes of up to so many bytes travel in the message itself.
    static constexpr std::size_t kSmallBytes = 64 * 1024;
    static constexpr std::uint64_t kMostArrayBytes = std::uint64_t{256} << 20;

    /// `deliver` is called on the lane; what it hands over comes back by `made`.
    Snapshots(ServerSession& session, BlobStore& blobs, std::function<void(SnapshotMade)> deliver,
              const MakeLane& lane = LaneThreads::make);
    ~Snapshots();

    // All below: frame thread only.

    /// Each frame that was committed, and the scene before the first one.
    void follow(const CommittedFrame& committed);
    /// The scene before the first frame is there: until then whoever asks waits.
    void sceneReady();
    [[nodiscard]] ServerActions wanted(ConnectionId connection, TimePoint now);
    [[nodiscard]] ServerActions made(SnapshotMade snapshot, TimePoint now);

    /// The scene as the list `at` has left it.
    using LookAtNewest = std::function<void(const Aspect& scene, Sequence at)>;
    /// Has `look` called on the lane, with the scene as the newest list that was followed has left it.
    /// Nothing else is made meanwhile.
    void lookAtNewest(LookAtNewest look);
    /// The scene as a list has left it; null: the lane has gone on from there, or has never been there.
    using Look = std::function<void(const Aspect* scene)>;
    /// Has `look` called likewise, with the scene as it was at `sequence`, which anybody may have said; none: as the
    /// lane has it. Lists of the last second or so can be asked about, unless they are large or merged, or somebody
    /// has joined or looked at a newer one since (kTrailing).
    void look(std::optional<Sequence> sequence, Look look);

    /// Bytes of memory that lists hold because the lane has not taken them.
    [[nodiscard]] std::size_t waitingBytes() const { return waitingBytes_; }
    /// The last snapshot is kept for who comes next.
    [[nodiscard]] bool keepsLast() const { return last_ != nullptr; }

private:
    struct Apply {
        std::shared_ptr<WaitingLists> lists;
    };
    struct Make {};
    struct LookAt {
        std::optional<Sequence> sequence;
        Look look;
    };
    using Order = std::variant<Apply, Make, LookAt, LookAtNewest>;

    class Follower;
    void work(Order& order);
    /// Hands over what waits, while there is room, or all of it.
    enum class Room : bool { kAsThereIs, kForAll };
    void pump(Room room);
    void handOver();
    /// Hands over all that was followed, and then this.
    void ask(Order order);
    void order();
    [[nodiscard]] ServerActions give(ConnectionId connection, TimePoint now);
    void forgetLast();
    void holdArrays(const CommittedFrame& committed);
    void freeLast();

    ServerSession& session_;
    BlobStore& blobs_;
    std::function<void(SnapshotMade)> deliver_;
    std::vector<CommittedFrame> fresh_;  ///< not handed over yet
    std::size_t freshBytes_ = 0;
    std::atomic<std::size_t> waitingBytes_{0};
    std::atomic<std::size_t> ordersUnderWay_{0};
    std::deque<Order> late_;  ///< for which there was no room: they go with a later frame, lists merged meanwhile
    std::uint64_t looks_ = 0;
    std::vector<ConnectionId> waiting_;
    std::shared_ptr<const SnapshotMade> last_;
    /// What lists since the last snapshot name, or since the one that is being made was asked for.
    struct Named {
        Sequence sequence;
        std::vector<Blob> arrays;
        std::uint64_t bytes = 0;
    };
    std::deque<Named> named_;
    std::uint64_t namedBytes_ = 0;
    bool ready_ = false;
    bool ordered_ = false;                      ///< one is being made
    const std::unique_ptr<Follower> follower_;  ///< the lane's
    std::unique_ptr<Lane> lane_;                ///< last
};

}  // namespace tessera
