/// From an answer to what the session is to send.
#pragma once

#include "common/codec/ApplicationCodec.h"
#include "common/session/ServerSession.h"

namespace tessera {

/// Who waits for an answer, and to which of its requests.
struct Asker {
    ConnectionId connection;
    std::uint64_t request = 0;
};

/// What is sent. On any thread.
[[nodiscard]] message::Reply replyTo(const Asker& asker, const Expected<ApplicationAnswer>& answer);
[[nodiscard]] ServerActions answerTo(ServerSession& session, const Asker& asker,
                                     const Expected<ApplicationAnswer>& answer);

}  // namespace tessera
