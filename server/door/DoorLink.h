/// One client of the door at the server: an application like others, whose answers come on the door's thread.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>

#include "common/application/Connection.h"
#include "common/request/Requests.h"

namespace tessera {

/// All members, and all callbacks, on the door's thread. Nothing is dialled again: who has lost the server begins anew.
class DoorLink : public std::enable_shared_from_this<DoorLink> {
public:
    struct Callbacks {
        std::function<void(const ApplicationNotice&)> notice;
        /// A list, or with `whole` the scene as it stands: `follow` alone.
        std::function<void(const incoming::List&)> list;
        std::function<void(const Error&)> ended;  ///< once; nothing follows
    };
    using Answered = std::function<void(const Expected<ApplicationAnswer>&)>;
    /// Has a function run on the door's thread; from any thread.
    using Post = std::function<void(std::function<void()>)>;

    /// `arrived` of the options is this one's own.
    [[nodiscard]] static std::shared_ptr<DoorLink> dial(ConnectionOptions options, Post post);
    ~DoorLink();

    void on(Callbacks callbacks) { callbacks_ = std::move(callbacks); }
    /// Exactly one call of `answered`, unless `close` comes first. `arrays` go before it.
    void ask(const ApplicationRequest& request, std::span<const Blob> arrays, Answered answered);
    /// The wall as its configuration says (codec WallCodec); empty until the server has let this one in.
    [[nodiscard]] const ByteSlice& wall() const { return wall_; }
    /// Requests without an answer.
    [[nodiscard]] std::size_t open() const { return open_.size(); }
    [[nodiscard]] bool ended() const { return over_.has_value(); }
    /// No callback comes from now on.
    void close();

private:
    DoorLink() = default;
    void drain();
    void take(const Incoming& incoming);
    void end(const Error& error);

    std::unique_ptr<Connection> connection_;
    Callbacks callbacks_;
    std::map<std::uint64_t, Answered> open_;
    std::uint64_t lastRequest_ = 0;
    ByteSlice wall_;
    std::optional<Error> over_;
    bool closed_ = false;
};

}  // namespace tessera
