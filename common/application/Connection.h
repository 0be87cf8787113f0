/// One connection of an application: sockets, session and decoding on threads of their own, values out.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <thread>
#include <variant>

#include "common/application/Application.h"
#include "common/application/ApplicationSession.h"
#include "common/base/Channel.h"

namespace tessera {

/// `access` is called by a thread inside.
struct ConnectionOptions : ApplicationSessionOptions {
    /// Called by a thread inside whenever something has come that `next` gives; may be empty.
    std::function<void()> arrived = {};
    /// Lists that may wait for the caller. One who does not poll for longer loses the connection; before that, once
    /// half of the bytes wait, it misses notices.
    std::size_t maxWaiting = 32'768;
    std::size_t maxWaitingBytes = std::size_t{512} << 20;
};

/// Those of an application. Errors: no server is meant, or its token or its keys cannot be read.
[[nodiscard]] Expected<ConnectionOptions> connectionOptionsOf(const Application::Options& options);

/// Owns two threads: the transport's and the session's. Members are called by one thread, the owner's.
class Connection {
public:
    explicit Connection(ConnectionOptions options);
    ~Connection();

    /// Nothing when none came within `timeout`.
    [[nodiscard]] std::optional<Incoming> next(Duration timeout);
    /// The answer comes as a Reply with this id, or Ended.
    void request(std::uint64_t id, ByteSlice body);
    /// Arrays of the next proposal, in pieces.
    void upload(std::span<const Blob> blobs);
    /// The server has sent this array, and it is in memory.
    [[nodiscard]] bool has(const BlobId& array) const { return session_->store().find(array).resident(); }

private:
    using Event = std::variant<LinkEvent, message::Request, message::Upload>;

    void run();
    void give(Incoming incoming);
    [[nodiscard]] bool hasRoom(const Incoming& incoming);

    ConnectionOptions options_;
    Channel<Event> events_;
    Channel<Incoming> out_;
    std::atomic<std::size_t> waiting_{0}, waitingBytes_{0};
    std::unique_ptr<Transport> transport_;
    std::unique_ptr<ApplicationSession> session_;  ///< the session thread's own
    std::thread thread_;
};

}  // namespace tessera
