/// How far one host's replica is, as long as it catches up.
#pragma once

#include <optional>

#include "common/base/HistoryIds.h"
#include "common/session/Patience.h"

namespace tessera {

/// A host is synced once it has said that it stands at `mustReach` or later. What it must reach rises with lists that
/// name blobs: it fetches them before it enters the barrier, not in it. Its patience begins anew with each task, and
/// whenever it has got on with one.
class ReplicaStanding {
public:
    /// A snapshot is asked for: whatever it had does not count.
    void begin(TimePoint now) {
        synced_ = false;
        patience.restart(now);
    }
    void given(Sequence snapshot, StateHash hash, TimePoint now) {
        begin(now);
        mustReach_ = snapshot_ = snapshot;
        snapshotHash_ = hash;
    }
    void mustReach(Sequence sequence) {
        synced_ = false;
        mustReach_ = sequence;
    }
    /// It says that it stands there.
    void stands(Sequence sequence) {
        if (sequence >= mustReach_) synced_ = true;
    }
    /// It is out, or its replica is wrong.
    void over() { synced_ = false; }

    [[nodiscard]] bool synced() const { return synced_; }
    /// Of the snapshot that it was given, if that stands there.
    [[nodiscard]] std::optional<StateHash> hashOfSnapshot(Sequence at) const {
        return at == snapshot_ ? std::optional(snapshotHash_) : std::nullopt;
    }

    Patience patience;

private:
    bool synced_ = false;
    Sequence mustReach_;
    Sequence snapshot_;
    StateHash snapshotHash_;
};

}  // namespace tessera
