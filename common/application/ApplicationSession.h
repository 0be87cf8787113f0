/// A connection's session over a transport that somebody else runs: values in, values out, no thread.
#pragma once

#include <chrono>
#include <deque>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "common/change/ChangeList.h"
#include "common/codec/ApplicationCodec.h"
#include "common/net/Transport.h"
#include "common/session/ClientSession.h"
#include "common/tls/KeyRing.h"

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

struct ApplicationSessionOptions {
    Address address;
    std::string addressNamedBy = {};  ///< ServerMeant::namedBy, for messages
    std::string name;
    /// The word that lets it in, or an empty one: asked for once the server is there. May be empty.
    std::function<std::string(const std::string& peer)> access = {};
    CurrentKeys keys = {};  ///< empty: links are plain; for `limits` of the transport, too
    bool lists = true;      ///< false: the server sends neither its scene nor its lists
    bool blobs = false;
    std::chrono::milliseconds connectTimeout{10'000};
    Epoch seenEpoch;  ///< servers before this one are not listened to
    /// Bulk bytes kept here for lists that are still to come.
    std::size_t maxBlobBytes = std::size_t{1} << 30;
};

/// Of messages: "ADDR:PORT", and who has named it if nobody has said it here.
[[nodiscard]] std::string addressText(const ApplicationSessionOptions& options);

/// One thread calls all members, and `give` is called by it, within them. Whoever owns it brings the events of its
/// links
/// (`owns`) and calls `advance` when `nextDeadline` has come.
class ApplicationSession {
public:
    using Give = std::function<void(Incoming)>;

    /// Dials at once. `transport` has `limits()`, and outlives this.
    ApplicationSession(ApplicationSessionOptions options, Transport& transport, Give give);
    /// Closes what is open; what is queued is sent.
    ~ApplicationSession();
    ApplicationSession(const ApplicationSession&) = delete;
    ApplicationSession& operator=(const ApplicationSession&) = delete;

    /// What a transport of sessions needs.
    [[nodiscard]] static TransportLimits limits(CurrentKeys keys = {});

    [[nodiscard]] bool owns(LinkId link) const;
    void on(const LinkEvent& event);
    [[nodiscard]] TimePoint nextDeadline() const { return session_.nextDeadline(); }
    void advance(TimePoint now);

    /// The answer comes as a Reply with this id, or Ended.
    /// `from`: message::Request::from.
    void request(std::uint64_t id, ByteSlice body, std::string from = {});
    void upload(message::Upload piece);
    /// Ended is the last value; nothing follows.
    void end(incoming::Ended end);
    [[nodiscard]] bool ended() const { return ended_; }
    /// May be asked by any thread.
    [[nodiscard]] const BlobStore& store() const { return store_; }

private:
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

    ApplicationSessionOptions options_;
    Transport& transport_;
    Give give_;
    BlobStore store_;
    ClientSession session_;
    std::deque<ClientAction> pending_;
    std::vector<Blob> arrived_;  ///< handles that keep blobs findable until lists name them, oldest first
    std::size_t arrivedBytes_ = 0;
    std::map<ChannelKind, LinkId> links_;
    bool welcomed_ = false;
    bool ended_ = false;
};

/// An application's arrays as messages: small ones together, large ones in pieces. The bytes are not copied, but for
/// those of small arrays.
void forEachUpload(std::span<const Blob> blobs, const std::function<void(message::Upload)>& send);

}  // namespace tessera
