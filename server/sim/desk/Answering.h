/// From an answer to what the session is to send.
#pragma once

#include "common/codec/ApplicationCodec.h"
#include "common/session/ServerSession.h"
#include "server/sim/audit/AuditBook.h"

namespace tessera {

/// Who waits for an answer, and to which of its requests.
struct Asker {
    ConnectionId connection;
    std::uint64_t request = 0;
    std::uint64_t deed = 0;  ///< of the audit log: who says a number twice hides nothing behind it. 0: it is none
};

/// What is sent. On any thread.
[[nodiscard]] message::Reply replyTo(const Asker& asker, const Expected<ApplicationAnswer>& answer);
/// The one way by which what may have changed something is answered.
struct Answers {
    ServerSession& session;
    AuditBook* audit = nullptr;  ///< who did what; null: nobody keeps it

    [[nodiscard]] ServerActions to(const Asker& asker, const Expected<ApplicationAnswer>& answer) const;
};

}  // namespace tessera
