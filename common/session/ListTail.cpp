#include "common/session/ListTail.h"

#include <algorithm>

namespace tessera {

namespace {
std::size_t bytesOf(const message::Changes& changes) {
    return changes.list ? changes.list->size() : 0;
}
}  // namespace

void ListTail::startAt(Sequence sequence, StateHash stateHash) {
    started_ = true;
    last_ = sequence;
    base_ = sequence;
    hashes_.emplace_back(sequence, stateHash);
}

void ListTail::append(const message::Changes& changes) {
    TESSERA_CHECK(!started_ || changes.sequence == last_.next(), "lists are numbered one by one");
    if (!started_) base_ = Sequence(changes.sequence.value - 1);
    started_ = true;
    last_ = changes.sequence;
    hashes_.emplace_back(changes.sequence, changes.stateHash);
    if (hashes_.size() > kHashes) hashes_.pop_front();
    if (!keeping_) {
        base_ = last_;
        return;
    }
    lists_.push_back(changes);
    bytes_ += bytesOf(changes);
    while (lists_.size() > maxLists_ || (bytes_ > maxBytes_ && !lists_.empty())) {
        bytes_ -= bytesOf(lists_.front());
        base_ = lists_.front().sequence;
        lists_.pop_front();
    }
}

void ListTail::keep(bool wanted) {
    if (keeping_ == wanted) return;
    keeping_ = wanted;
    if (wanted) return;
    lists_.clear();
    bytes_ = 0;
    base_ = last_;
}

std::optional<StateHash> ListTail::hashAt(Sequence sequence) const {
    const auto it = std::lower_bound(hashes_.begin(), hashes_.end(), sequence,
                                     [](const auto& entry, Sequence wanted) { return entry.first < wanted; });
    if (it == hashes_.end() || it->first != sequence) return std::nullopt;
    return it->second;
}

}  // namespace tessera
