#include "server/sim/peers/AnswerGate.h"

#include <fmt/format.h>

namespace tessera {
namespace {

/// The reply that grants, where the action sends one.
const message::Reply* granted(const ServerAction& action) {
    const auto* send = std::get_if<server_action::Send>(&action);
    const auto* reply = send ? std::get_if<message::Reply>(send->message.get()) : nullptr;
    return reply && reply->error.empty() ? reply : nullptr;
}

}  // namespace

ServerActions AnswerGate::pass(ServerActions actions, std::uint64_t written) {
    ServerActions passed;
    for (ServerAction& action : actions)
        if (granted(action))
            held_.push_back({written, std::get<server_action::Send>(std::move(action))});
        else
            passed.push_back(std::move(action));
    return passed;
}

ServerActions AnswerGate::open(std::uint64_t written, const std::optional<Error>& trouble) {
    ServerActions out;
    for (; !held_.empty() && (held_.front().written <= written || trouble); held_.pop_front()) {
        server_action::Send& send = held_.front().send;
        if (held_.front().written > written) {
            message::Reply reply = std::get<message::Reply>(*send.message);
            reply.code = trouble->code;
            reply.error =
                fmt::format("it is done, but {}; a server that is started again may not know of it", trouble->message);
            reply.body = {};
            send.message = std::make_shared<const Message>(std::move(reply));
        }
        out.emplace_back(std::move(send));
    }
    return out;
}

}  // namespace tessera
