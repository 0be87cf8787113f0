/// One connection of an application: sockets, session and decoding beside the caller, values out.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <variant>

#include "common/application/Application.h"
#include "common/application/ApplicationSession.h"
#include "common/base/Channel.h"
#include "common/net/Platform.h"

namespace tessera {

/// `access` is called by a thread inside.
struct ConnectionOptions : ApplicationSessionOptions {
    Platform platform = {};
    /// Called by a thread inside whenever something has come that `next` gives; may be empty.
    std::function<void()> arrived = {};
    /// Lists that may wait for the caller. One who does not poll for longer loses the connection; before that, once
    /// half of the bytes wait, it misses notices.
    std::size_t maxWaiting = 32'768;
    std::size_t maxWaitingBytes = std::size_t{512} << 20;
};

/// Those of an application. Errors: no server is meant, or its token or its keys cannot be read.
[[nodiscard]] Expected<ConnectionOptions> connectionOptionsOf(const Application::Options& options);

/// Owns a transport, and a lane for its session. Members are called by one thread, the owner's.
class Connection {
public:
    explicit Connection(ConnectionOptions options);
    ~Connection();

    /// Nothing when none came until then.
    [[nodiscard]] std::optional<Incoming> next(TimePoint until);
    /// The answer comes as a Reply with this id, or Ended.
    void request(std::uint64_t id, ByteSlice body);
    /// Arrays of the next proposal, in pieces.
    void upload(std::span<const Blob> blobs);
    /// The server has sent this array, and it is in memory.
    [[nodiscard]] bool has(const BlobId& array) const { return session_->store().find(array).resident(); }

private:
    using Event = std::variant<LinkEvent, message::Request, message::Upload>;

    void put(Event event);
    /// On the lane: all that has come, and what its time has come for.
    void turn();
    void give(Incoming incoming);
    [[nodiscard]] bool hasRoom(const Incoming& incoming);

    ConnectionOptions options_;
    Channel<Event> events_;
    Channel<Incoming> out_;
    std::atomic<std::size_t> waiting_{0}, waitingBytes_{0};
    std::atomic<bool> turnWaits_{true};  ///< one is posted and has not begun, or the session is not there yet
    std::unique_ptr<Lane> lane_;
    std::unique_ptr<Transport> transport_;
    std::unique_ptr<ApplicationSession> session_;  ///< the lane's own
    TimePoint wake_ = TimePoint::max();            ///< a turn is posted for then
};

}  // namespace tessera
