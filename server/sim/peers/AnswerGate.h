/// What says that something is done waits until the journal has it.
#pragma once

#include <deque>
#include <optional>

#include "common/session/ServerSession.h"

namespace tessera {

/// Of the actions that tell what came of edits it keeps the replies that grant, until what they speak of is written.
/// Refusals and all that is no reply pass. Frame thread only.
class AnswerGate {
public:
    /// `written`: as much of the journal must be written before the replies go out.
    [[nodiscard]] ServerActions pass(ServerActions actions, std::uint64_t written);
    /// What may go now. In trouble all goes, as errors that say what has happened: nobody waits for a disk.
    [[nodiscard]] ServerActions open(std::uint64_t written, const std::optional<Error>& trouble);
    /// How much must be written for the next reply to go: perhaps nothing, where the journal was handed nothing yet.
    /// None: nobody waits.
    [[nodiscard]] std::optional<std::uint64_t> awaited() const {
        return held_.empty() ? std::nullopt : std::optional(held_.front().written);
    }

private:
    struct Held {
        std::uint64_t written = 0;
        server_action::Send send;
    };
    std::deque<Held> held_;  ///< ascending
};

}  // namespace tessera
