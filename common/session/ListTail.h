/// The newest lists and their state hashes, for peers whose snapshot is older than the scene.
#pragma once

#include <deque>
#include <optional>
#include <utility>

#include "common/session/Messages.h"

namespace tessera {

/// Lists are kept only while somebody waits for a snapshot, within bounds; hashes of the newest kHashes lists always.
class ListTail {
public:
    static constexpr std::size_t kHashes = 4096;

    ListTail(std::size_t maxLists, std::size_t maxBytes) : maxLists_(maxLists), maxBytes_(maxBytes) {}

    /// The scene stood here before the first list.
    void startAt(std::uint64_t sequence, std::uint64_t stateHash);
    void append(const message::Changes& changes);
    /// From now on lists are kept, or none is any more.
    void keep(bool wanted);

    /// Whether `after(sequence)` is everything that came since.
    [[nodiscard]] bool covers(std::uint64_t sequence) const { return !started_ || sequence >= base_; }
    [[nodiscard]] const std::deque<message::Changes>& lists() const { return lists_; }
    [[nodiscard]] bool started() const { return started_; }
    [[nodiscard]] std::uint64_t last() const { return last_; }
    [[nodiscard]] std::optional<std::uint64_t> hashAt(std::uint64_t sequence) const;

private:
    std::size_t maxLists_, maxBytes_;
    std::deque<message::Changes> lists_;
    std::size_t bytes_ = 0;
    std::deque<std::pair<std::uint64_t, std::uint64_t>> hashes_;  ///< sequence, state hash; ascending
    std::uint64_t base_ = 0;                                      ///< every list after this one is in lists_
    std::uint64_t last_ = 0;
    bool started_ = false;
    bool keeping_ = false;
};

}  // namespace tessera
