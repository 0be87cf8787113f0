/// One client of the door at the server: an application like others, whose answers come on the door's thread.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>

#include "common/application/ApplicationSession.h"
#include "common/request/Requests.h"
#include "server/door/DoorWire.h"

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
    using AnsweredAsItCame = std::function<void(const Expected<ByteSlice>&)>;  ///< encoded (codec ApplicationCodec)

    [[nodiscard]] static std::shared_ptr<DoorLink> dial(ApplicationSessionOptions options, DoorWire& wire);
    ~DoorLink();

    void on(Callbacks callbacks) { callbacks_ = std::move(callbacks); }
    /// Exactly one call of `answered`, unless `close` comes before its answer. `arrays` go before it.
    void ask(const ApplicationRequest& request, std::span<const Blob> arrays, Answered answered);
    /// `from`: whose request it is, of a link for several; empty: the link's own.
    void askAsItComes(const ApplicationRequest& request, std::span<const Blob> arrays, AnsweredAsItCame answered,
                      const std::string& from = {});
    /// The wall as its configuration says (codec WallCodec); empty until the server has let this one in.
    [[nodiscard]] const ByteSlice& wall() const { return wall_; }
    /// Requests without an answer.
    [[nodiscard]] std::size_t open() const { return open_.size(); }
    [[nodiscard]] bool ended() const { return over_.has_value(); }
    /// No callback comes from now on of what was asked; what is asked later is refused.
    void close();

    // ---- its wire's

    [[nodiscard]] bool owns(LinkId link) const { return session_ && session_->owns(link); }
    void on(const LinkEvent& event);
    void advance(TimePoint now);
    [[nodiscard]] TimePoint nextDeadline() const;
    /// The wire is gone: nothing but `close` may follow.
    void abandon() { session_.reset(); }

private:
    DoorLink() = default;
    void take(const Incoming& incoming);
    void end(const Error& error);

    std::unique_ptr<ApplicationSession> session_;
    Callbacks callbacks_;
    std::map<std::uint64_t, AnsweredAsItCame> open_;
    std::uint64_t lastRequest_ = 0;
    ByteSlice wall_;
    std::optional<Error> over_;
    bool closed_ = false;
};

}  // namespace tessera
