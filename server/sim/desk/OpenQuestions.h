/// Which questions of the collision pipeline stand, and what has been answered for the next frame.
#pragma once

#include <map>
#include <span>
#include <vector>

#include "common/base/Error.h"
#include "server/collision/pipeline/StepResult.h"

namespace tessera {

/// The pipeline decides when a question is over; this remembers what was asked and sees to it that one answer counts,
/// the first. Nothing here waits for anybody. Bounded by the pipeline's bound on open questions. Frame thread only.
class OpenQuestions {
public:
    /// After each frame. `open`: the ids that stand now, in any order. Returns those that no longer do, ascending.
    [[nodiscard]] std::vector<std::uint64_t> frameDone(std::span<const Question> asked,
                                                       std::span<const std::uint64_t> open);

    /// kRefused: the question has an answer already, or does not stand.
    [[nodiscard]] Expected<void> answer(const Reply& reply);
    /// The answers for the frame that is about to be made, in the order in which they came.
    [[nodiscard]] std::vector<Reply> takeReplies();

    /// Without those that have been answered. Ascending by id.
    [[nodiscard]] std::vector<Question> unanswered() const;

private:
    struct Standing {
        Question question;
        bool answered = false;
    };
    std::map<std::uint64_t, Standing> standing_;
    std::vector<Reply> replies_;
    std::uint64_t newest_ = 0;  ///< the highest id ever asked
};

}  // namespace tessera
