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
    CommittedListPtr whole = last_.lock();
    if (!whole || whole->sequence != simulation_.sequence()) {
        const ChangeList list = snapshot(simulation_.scene());
        CommittedList made{.sequence = simulation_.sequence(),
                           .stateHash = simulation_.scene().stateHash(),
                           .encoded = encodeChangeList(list),
                           .blobs = {}};
        for (const Blob& blob : blobsOf(list)) made.blobs.push_back({blob.id(), blob.sizeBytes()});
        whole = share(std::move(made));
        last_ = whole;
    }
    return session_.snapshotReady(connection, {std::move(whole)}, now);
}

}  // namespace tessera
