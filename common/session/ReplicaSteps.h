/// What a replica goes through in the server's order, as far as it has not begun with it.
#pragma once

#include <deque>
#include <variant>

#include "common/session/Messages.h"

namespace tessera {

/// Steps wait for blobs, and for what comes before them.
class ReplicaSteps {
public:
    using Message =
        std::variant<message::Snapshot, message::Changes, message::Begin, message::Swap, message::HashQuery>;

    struct Step {
        Message message;
        std::size_t held = 0;   ///< so many of its blobs, from the front, are known to be here
        BlobInfo content = {};  ///< of a snapshot that is still to be fetched; no bytes: none
        /// That comes with the message, or an empty one. It stays where it is.
        [[nodiscard]] const CommittedList& list() const;
    };

    /// The reference is good until they change.
    const Step& append(Message message);
    [[nodiscard]] bool empty() const { return steps_.empty(); }
    [[nodiscard]] Step& front() { return steps_.front(); }
    [[nodiscard]] Message pop();
    void clear();

    /// Whether this blob is the content of a snapshot among them.
    [[nodiscard]] bool awaitContent(const BlobId& content) const;
    /// Whether a step cannot be gone through without this blob.
    [[nodiscard]] bool need(const BlobId& blob) const;
    /// Its content has come: the list of the snapshots that wait for it. False where it is not the one announced.
    [[nodiscard]] bool opened(const BlobId& content, const CommittedListPtr& list);

    [[nodiscard]] std::size_t behind() const { return steps_.size(); }
    /// But for the one in front, which is no backlog, however large it is: it may be a whole scene that waits for its
    /// blobs.
    [[nodiscard]] std::size_t bytesBehind() const;

private:
    std::deque<Step> steps_;
    std::size_t bytes_ = 0;
};

}  // namespace tessera
