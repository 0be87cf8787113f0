#include "common/session/ReplicaSteps.h"

#include <algorithm>
#include <utility>

namespace tessera {

namespace {

/// That a waiting step keeps.
std::size_t bytesOf(const ReplicaSteps::Step& step) {
    const CommittedList& list = step.list();
    const auto* begin = std::get_if<message::Begin>(&step.message);
    return list.encoded.size() + list.blobs.size() * sizeof(BlobInfo) + (begin ? begin->payload.size() : 0);
}

}  // namespace

const CommittedList& ReplicaSteps::Step::list() const {
    return std::visit(
        []<typename M>(const M& m) -> const CommittedList& {
            if constexpr (requires { m.list; })
                return *m.list;
            else
                return *nothingCommitted();
        },
        message);
}

const ReplicaSteps::Step& ReplicaSteps::append(Message message) {
    Step& step = steps_.emplace_back(Step{std::move(message)});
    if (const auto* snapshot = std::get_if<message::Snapshot>(&step.message)) step.content = snapshot->content;
    bytes_ += bytesOf(step);
    return step;
}

ReplicaSteps::Message ReplicaSteps::pop() {
    bytes_ -= bytesOf(steps_.front());
    Message message = std::move(steps_.front().message);
    steps_.pop_front();
    return message;
}

void ReplicaSteps::clear() {
    steps_.clear();
    bytes_ = 0;
}

bool ReplicaSteps::awaitContent(const BlobId& content) const {
    return std::ranges::any_of(steps_,
                               [&](const Step& s) { return s.content.sizeBytes > 0 && s.content.id == content; });
}

bool ReplicaSteps::need(const BlobId& blob) const {
    const auto names = [&](const Step& s) {
        return std::ranges::find(s.list().blobs, blob, &BlobInfo::id) != s.list().blobs.end();
    };
    return awaitContent(blob) || std::ranges::any_of(steps_, names);
}

bool ReplicaSteps::opened(const BlobId& content, const CommittedListPtr& list) {
    for (Step& step : steps_) {
        if (step.content.sizeBytes == 0 || step.content.id != content) continue;
        if (step.list().sequence != list->sequence || step.list().stateHash != list->stateHash) return false;
        bytes_ -= bytesOf(step);
        step.content = {};
        step.message = message::Snapshot{.list = list, .current = std::get<message::Snapshot>(step.message).current};
        bytes_ += bytesOf(step);
    }
    return true;
}

std::size_t ReplicaSteps::bytesBehind() const {
    return steps_.empty() ? 0 : bytes_ - bytesOf(steps_.front());
}

}  // namespace tessera
