#include "server/sim/desk/OpenQuestions.h"

#include <fmt/format.h>

#include <set>
#include <utility>

namespace tessera {

std::vector<std::uint64_t> OpenQuestions::frameDone(std::span<const Question> asked,
                                                    std::span<const std::uint64_t> open) {
    const std::set<std::uint64_t> stays(open.begin(), open.end());
    std::vector<std::uint64_t> closed;
    for (auto it = standing_.begin(); it != standing_.end();) {
        const bool over = !stays.contains(it->first);
        if (over) closed.push_back(it->first);
        it = over ? standing_.erase(it) : std::next(it);
    }
    for (const Question& question : asked) {
        newest_ = std::max(newest_, question.id);
        if (stays.contains(question.id)) standing_[question.id] = {.question = question, .answered = false};
    }
    return closed;
}

Expected<void> OpenQuestions::answer(const Reply& reply) {
    const auto found = standing_.find(reply.question);
    if (found == standing_.end())
        return fail(
            ErrorCode::kRefused,
            reply.question > newest_
                ? fmt::format("question {} was never asked", reply.question)
                : fmt::format("question {} is over: it was answered, or nobody answered in time", reply.question));
    if (std::exchange(found->second.answered, true))
        return fail(ErrorCode::kRefused,
                    fmt::format("question {} has been answered already; the first answer counts", reply.question));
    replies_.push_back(reply);
    return {};
}

std::vector<Reply> OpenQuestions::takeReplies() {
    return std::exchange(replies_, {});
}

std::vector<Question> OpenQuestions::unanswered() const {
    std::vector<Question> questions;
    for (const auto& [id, standing] : standing_)
        if (!standing.answered) questions.push_back(standing.question);
    return questions;
}

}  // namespace tessera
