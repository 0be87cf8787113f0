#include "server/sim/Snapshots.h"

#include "common/codec/ChangeCodec.h"

namespace tessera {

ServerActions Snapshots::wanted(ConnectionId connection, TimePoint now) {
    if (ready_) return give(connection, now);
    waiting_.push_back(connection);
    return {};
}

ServerActions Snapshots::sceneReady(TimePoint now) {
    ready_ = true;
    ServerActions actions;
    for (const ConnectionId connection : std::exchange(waiting_, {})) {
        ServerActions given = give(connection, now);
        actions.insert(actions.end(), std::make_move_iterator(given.begin()), std::make_move_iterator(given.end()));
    }
    return actions;
}

ServerActions Snapshots::give(ConnectionId connection, TimePoint now) {
    const ChangeList list = snapshot(simulation_.scene());
    message::Snapshot message{.sequence = simulation_.sequence(),
                              .stateHash = simulation_.scene().stateHash(),
                              .list = share(encodeChangeList(list)),
                              .blobs = {}};
    for (const Blob& blob : blobsOf(list)) message.blobs.push_back({blob.id(), blob.sizeBytes()});
    return session_.snapshotReady(connection, std::move(message), now);
}

}  // namespace tessera
