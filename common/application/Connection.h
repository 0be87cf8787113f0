/// One connection of an application: sockets, session and decoding on threads of their own, values out.
#pragma once

#include <atomic>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <thread>
#include <variant>

#include "common/base/Channel.h"
#include "common/change/ChangeList.h"
#include "common/codec/ApplicationCodec.h"
#include "common/net/Transport.h"
#include "common/session/ClientSession.h"

namespace tessera {

namespace incoming {
/// The server has accepted us.
struct Configured {
    ByteSlice wall;
    Epoch epoch;
};
/// A committed list, or with `whole` the list that makes the scene from nothing: as it came, and decoded.
struct List {
    bool whole = false;
    CommittedListPtr committed;
    ChangeListPtr list;
    Sequence current;  ///< of the whole scene: where the server's stands already; lists up to there follow at once
};
struct Reply {
    message::Reply reply;
};
struct Notice {
    ApplicationNotice notice;
    std::size_t encodedBytes = 0;
};
/// The last value.
struct Ended {
    Error error;
    bool over = false;   ///< the server said that it is over
    bool retry = false;  ///< a later attempt may succeed
};
}  // namespace incoming
using Incoming = std::variant<incoming::Configured, incoming::List, incoming::Reply, incoming::Notice, incoming::Ended>;

struct ConnectionOptions {
    Address address;
    std::string name;
    /// The word that lets it in, or an empty one: asked for, on a thread inside, once the server is there. May be
    /// empty.
    std::function<std::string(const std::string& peer)> access = {};
    bool lists = true;  ///< false: the server sends neither its scene nor its lists
    bool blobs = false;
    std::chrono::milliseconds connectTimeout{10'000};
    /// Called by a thread inside whenever something has come that `next` gives; may be empty.
    std::function<void()> arrived;
    Epoch seenEpoch;  ///< servers before this one are not listened to
    /// Lists that may wait for the caller. One who does not poll for longer loses the connection; before that, once
    /// half of the bytes wait, it misses notices.
    std::size_t maxWaiting = 32'768;
    std::size_t maxWaitingBytes = std::size_t{512} << 20;
    /// Bulk bytes kept here for lists that are still to come.
    std::size_t maxBlobBytes = std::size_t{1} << 30;
};

/// Owns two threads: the transport's and the session's. Members are called by one thread, the owner's.
class Connection {
public:
    explicit Connection(ConnectionOptions options);
    ~Connection();

    /// Nothing when none came within `timeout`.
    [[nodiscard]] std::optional<Incoming> next(Duration timeout);
    /// The answer comes as a Reply with this id, or Ended.
    void request(std::uint64_t id, ByteSlice body);
    /// Arrays of the next proposal, in pieces. The bytes are not copied, but for those of small arrays.
    void upload(std::span<const Blob> blobs);
    /// The server has sent this array, and it is in memory.
    [[nodiscard]] bool has(const BlobId& array) const { return store_.find(array).resident(); }

private:
    using Event = std::variant<LinkEvent, message::Request, message::Upload>;

    void run();
    void on(const LinkEvent& event);
    void carryOut(ClientActions actions);
    void carryOut(const client_action::Send& action);
    void carryOut(const client_action::OpenBulk& action);
    void carryOut(const client_action::Configured& action);
    void carryOut(const client_action::ApplySnapshot& action);
    void carryOut(const client_action::ApplyChanges& action);
    void carryOut(const client_action::StoreBlob& action);
    void carryOut(const client_action::ReplyReceived& action);
    void carryOut(const client_action::NoticeReceived& action);
    void carryOut(const client_action::Disconnect& action);
    void carryOut(const client_action::Finish& action);
    // Hosts are asked to draw, and to tell what they have.
    void carryOut(const client_action::Draw&) {}
    void carryOut(const client_action::Show&) {}
    void carryOut(const client_action::DescribeState&) {}
    void carryOut(const client_action::SendImages&) {}
    void carryOut(const client_action::MeetNeighbours&) {}
    /// What follows from it is pending.
    void apply(bool whole, const CommittedListPtr& committed, Sequence current);
    void open(ChannelKind channel);
    void store(const Blob& blob);
    Expected<ChangeListPtr> decode(ByteSpan bytes);
    void give(Incoming incoming);
    void handOut(incoming::List list);
    void end(incoming::Ended end);

    ConnectionOptions options_;
    Channel<Event> events_;
    Channel<Incoming> out_;
    std::atomic<std::size_t> waiting_{0}, waitingBytes_{0};

    BlobStore store_;

    // The session thread's own.
    ClientSession session_;
    std::deque<ClientAction> pending_;
    std::vector<Blob> arrived_;  ///< handles that keep blobs findable until lists name them, oldest first
    std::size_t arrivedBytes_ = 0;
    std::map<ChannelKind, LinkId> links_;
    bool welcomed_ = false;
    bool ended_ = false;

    std::unique_ptr<Transport> transport_;
    std::thread thread_;
};

}  // namespace tessera
