/// The newest lists and their state hashes, for peers whose snapshot is older than the scene.
#pragma once

#include <deque>
#include <limits>
#include <optional>
#include <utility>

#include "common/session/CommittedList.h"

namespace tessera {

/// Lists are kept only while somebody waits for a snapshot, within bounds; hashes of the newest kHashes lists always.
class ListTail {
public:
    static constexpr std::size_t kHashes = 4096;

    ListTail(std::size_t maxLists, std::size_t maxBytes) : maxLists_(maxLists), maxBytes_(maxBytes) {}

    /// The scene stood here before the first list.
    void startAt(Sequence sequence, StateHash stateHash);
    void append(CommittedListPtr list);
    /// From now on lists are kept, of at most so many bytes (and never more than the bound), or none is any more.
    void keep(bool wanted, std::size_t bytes = std::numeric_limits<std::size_t>::max());

    /// Whether `after(sequence)` is everything that came since.
    [[nodiscard]] bool covers(Sequence sequence) const { return !started_ || sequence >= base_; }
    /// Of the lists since, where they are covered.
    [[nodiscard]] std::size_t bytesAfter(Sequence sequence) const;
    [[nodiscard]] const std::deque<CommittedListPtr>& lists() const { return lists_; }
    [[nodiscard]] bool started() const { return started_; }
    [[nodiscard]] Sequence last() const { return last_; }
    [[nodiscard]] std::optional<StateHash> hashAt(Sequence sequence) const;

private:
    std::size_t maxLists_, maxBytes_;
    std::deque<CommittedListPtr> lists_;
    std::size_t bytes_ = 0;
    std::deque<std::pair<Sequence, StateHash>> hashes_;  ///< ascending
    Sequence base_;                                      ///< every list after this one is in lists_
    Sequence last_;
    bool started_ = false;
    bool keeping_ = false;
    std::size_t keptBytes_ = std::numeric_limits<std::size_t>::max();
    void bound();
};

}  // namespace tessera
