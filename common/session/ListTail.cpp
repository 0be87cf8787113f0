#include "common/session/ListTail.h"

#include <algorithm>

namespace tessera {

void ListTail::startAt(Sequence sequence, StateHash stateHash) {
    started_ = true;
    last_ = sequence;
    base_ = sequence;
    hashes_.emplace_back(sequence, stateHash);
}

void ListTail::append(CommittedListPtr list) {
    TESSERA_CHECK(!started_ || list->sequence == last_.next(), "lists are numbered one by one");
    if (!started_) base_ = Sequence(list->sequence.value - 1);
    started_ = true;
    last_ = list->sequence;
    hashes_.emplace_back(list->sequence, list->stateHash);
    if (hashes_.size() > kHashes) hashes_.pop_front();
    if (!keeping_) {
        base_ = last_;
        return;
    }
    bytes_ += list->encoded.size();
    lists_.push_back(std::move(list));
    bound();
}

void ListTail::bound() {
    while (lists_.size() > maxLists_ || (bytes_ > std::min(maxBytes_, keptBytes_) && !lists_.empty())) {
        bytes_ -= lists_.front()->encoded.size();
        base_ = lists_.front()->sequence;
        lists_.pop_front();
    }
}

void ListTail::keep(bool wanted, std::size_t bytes) {
    keptBytes_ = bytes;
    if (wanted) bound();
    if (keeping_ == wanted) return;
    keeping_ = wanted;
    if (wanted) return;
    lists_.clear();
    bytes_ = 0;
    base_ = last_;
}

std::size_t ListTail::bytesAfter(Sequence sequence) const {
    std::size_t sum = 0;
    for (auto list = lists_.rbegin(); list != lists_.rend() && (*list)->sequence > sequence; ++list)
        sum += (*list)->encoded.size();
    return sum;
}

std::optional<StateHash> ListTail::hashAt(Sequence sequence) const {
    const auto it = std::lower_bound(hashes_.begin(), hashes_.end(), sequence,
                                     [](const auto& entry, Sequence wanted) { return entry.first < wanted; });
    if (it == hashes_.end() || it->first != sequence) return std::nullopt;
    return it->second;
}

}  // namespace tessera
