/// The whole scene for those who join: hosts, applications, and replicas to be repaired.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <thread>
#include <variant>
#include <vector>

#include "common/base/Channel.h"
#include "common/scene/Aspect.h"
#include "common/session/ServerSession.h"
#include "server/sim/commit/Committer.h"

namespace tessera {

/// What the thread of `Snapshots` has made.
struct SnapshotMade {
    message::Snapshot snapshot;
    Blob content;  ///< empty: the scene is small, and the snapshot holds it
};

/// Makes snapshots on a thread of its own, whatever the size of the scene: it holds an aspect that follows the committed
/// lists, some behind while nobody asks. Whatever else is to be found in the scene as it was at some list, and takes longer than
/// a frame should, is found there too (`look`). What has been made serves all who join while the lists since then are few.
///
/// Memory: the scene a second time, and the last snapshot as long as somebody may be served with it.
class Snapshots {
public:
    /// Scenes of up to so many bytes travel in the message itself.
    static constexpr std::size_t kSmallBytes = 64 * 1024;

    /// `deliver` is called on the thread of its own; what it hands over comes back by `made`.
    Snapshots(ServerSession& session, BlobStore& blobs, std::function<void(SnapshotMade)> deliver);
    ~Snapshots();

    // All below: frame thread only.

    /// Each frame that was committed, and the scene before the first one.
    void follow(const CommittedFrame& committed);
    /// The scene before the first frame is there: until then whoever asks waits.
    void sceneReady();
    [[nodiscard]] ServerActions wanted(ConnectionId connection, TimePoint now);
    [[nodiscard]] ServerActions made(SnapshotMade snapshot, TimePoint now);

    /// The scene as a list has left it; null: the thread has gone on from there.
    using Look = std::function<void(const Aspect* scene)>;
    /// Has `look` called on the thread of its own, with the scene as it was at `sequence`, which has been followed; none: as the
    /// thread has it. Lists of the last second or so can be asked about, unless they are large or somebody has joined since
    /// (kTrailing). Nothing else is made meanwhile.
    void look(std::optional<Sequence> sequence, Look look);

private:
    struct Apply {
        std::vector<CommittedFrame> frames;
    };
    struct Make {};
    struct LookAt {
        std::optional<Sequence> sequence;
        Look look;
    };

    void work();
    void handOver();
    void order();
    [[nodiscard]] ServerActions give(ConnectionId connection, TimePoint now);

    ServerSession& session_;
    BlobStore& blobs_;
    std::function<void(SnapshotMade)> deliver_;
    std::vector<CommittedFrame> fresh_;  ///< not handed over yet
    std::size_t freshBytes_ = 0;
    std::vector<ConnectionId> waiting_;
    std::shared_ptr<const SnapshotMade> last_;
    bool ready_ = false;
    bool ordered_ = false;  ///< one is being made
    Channel<std::variant<Apply, Make, LookAt>> orders_;
    std::thread thread_;
};

}  // namespace tessera
