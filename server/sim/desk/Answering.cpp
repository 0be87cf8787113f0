#include "server/sim/desk/Answering.h"

namespace tessera {

message::Reply replyTo(const Asker& asker, const Expected<ApplicationAnswer>& answer) {
    message::Reply reply{.id = asker.request, .code = {}, .error = {}, .body = {}};
    if (answer) {
        reply.body = encodeAnswer(*answer);
    } else {
        reply.code = answer.error().code;
        reply.error = answer.error().message;
        // An empty one would grant.
        if (reply.error.empty()) reply.error = "it is refused, and nobody has said why";
    }
    return reply;
}

ServerActions Answers::to(const Asker& asker, const Expected<ApplicationAnswer>& answer) const {
    if (audit) audit->answered(asker.connection, asker.deed, answer.has_value());
    return session.reply(asker.connection, replyTo(asker, answer));
}

}  // namespace tessera
