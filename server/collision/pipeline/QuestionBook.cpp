#include "server/collision/pipeline/QuestionBook.h"

#include <algorithm>

namespace tessera {

std::vector<TentativeTransform> QuestionBook::take(std::span<const Reply> replies) {
    std::vector<TentativeTransform> wishes;
    for (auto& [matter, entry] : entries_) {
        if (entry.standing != Standing::kAsked) continue;
        const auto reply = std::ranges::find(replies, entry.question.id, &Reply::question);
        if (reply == replies.end()) continue;
        entry.pressed = true;
        if (reply->decision == Reply::Decision::kStop) {
            entry.standing = Standing::kStopped;
            continue;
        }
        entry.standing = Standing::kPassing;
        const Pose& pose = reply->decision == Reply::Decision::kPass ? entry.question.wanted : reply->pose;
        if (!wishes.empty() && wishes.back().transform == matter.transform)
            continue;  // the first reply decides where to
        // Below every motion's and every hand's own wish: what the application says of this motion is the newest word
        // on it.
        wishes.push_back({.transform = matter.transform,
                          .translation = pose.translation,
                          .rotation = pose.rotation,
                          .scale = pose.scale,
                          .source = -1});
    }
    return wishes;
}

bool QuestionBook::passes(const Matter& matter) const {
    const auto it = entries_.find(matter);
    return it != entries_.end() && it->second.standing == Standing::kPassing;
}

void QuestionBook::stopped(const Matter& matter, const Question& question, std::int64_t patience, std::size_t maxOpen,
                           std::vector<Question>& asked) {
    if (const auto known = entries_.find(matter); known != entries_.end()) {
        known->second.pressed = true;
        return;
    }
    const auto open =
        std::ranges::count_if(entries_, [](const auto& e) { return e.second.standing == Standing::kAsked; });
    if (static_cast<std::size_t>(open) >= maxOpen) return;
    Entry entry{.standing = Standing::kAsked, .question = question, .framesLeft = patience, .pressed = true};
    entry.question.id = nextId_++;
    asked.push_back(entry.question);
    entries_.emplace(matter, std::move(entry));
}

std::vector<std::uint64_t> QuestionBook::open() const {
    std::vector<std::uint64_t> ids;
    for (const auto& [matter, entry] : entries_)
        if (entry.standing == Standing::kAsked) ids.push_back(entry.question.id);
    std::ranges::sort(ids);
    return ids;
}

}  // namespace tessera
