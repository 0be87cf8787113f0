/// What many sources bring to one thread, served so that none keeps another one waiting.
#pragma once

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

namespace tessera {

/// Each source has a queue of its own. Sources of the first rank are served before all others; those of one rank take
/// turns, one value each. Nothing here bounds what a source brings: whoever pushes does. Any number of producers, one
/// consumer.
template <typename T>
class FairQueue {
public:
    using Source = std::uint64_t;
    enum class Rank : std::uint8_t { kFirst, kOther };

    /// False when closed: the value is dropped.
    bool push(Source source, T value) {
        const std::scoped_lock lock(mutex_);
        if (closed_) return false;
        Queue& queue = queues_[source];
        queue.values.push_back(std::move(value));
        if (queue.values.size() == 1) turns_[index(queue.rank)].push_back(source);
        news_ = true;
        filled_.notify_one();
        return true;
    }
    /// From now on; new sources are of the other rank. Until `forget`.
    void setRank(Source source, Rank rank) {
        const std::scoped_lock lock(mutex_);
        Queue& queue = queues_[source];
        if (queue.rank == rank) return;
        if (!queue.values.empty()) {
            std::erase(turns_[index(queue.rank)], source);
            turns_[index(rank)].push_back(source);
        }
        queue.rank = rank;
    }
    /// The source is gone; what it has brought stays until it is taken.
    void forget(Source source) {
        const std::scoped_lock lock(mutex_);
        const auto found = queues_.find(source);
        if (found == queues_.end()) return;
        if (found->second.values.empty())
            queues_.erase(found);
        else
            found->second.gone = true;
    }

    /// The next value of this rank, of a source that `may` be served now. Nothing where there is none.
    std::optional<std::pair<Source, T>> tryPop(Rank rank, const std::function<bool(Source)>& may = {}) {
        const std::scoped_lock lock(mutex_);
        std::deque<Source>& turns = turns_[index(rank)];
        for (std::size_t looked = 0, all = turns.size(); looked < all; ++looked) {
            const Source source = turns.front();
            turns.pop_front();
            if (may && !may(source)) {
                turns.push_back(source);
                continue;
            }
            const auto found = queues_.find(source);
            std::pair<Source, T> taken{source, std::move(found->second.values.front())};
            found->second.values.pop_front();
            if (!found->second.values.empty())
                turns.push_back(source);
            else if (found->second.gone)
                queues_.erase(found);
            return taken;
        }
        return std::nullopt;
    }
    /// Whether `tryPop` would find a value.
    [[nodiscard]] bool any(Rank rank, const std::function<bool(Source)>& may = {}) const {
        const std::scoped_lock lock(mutex_);
        const std::deque<Source>& turns = turns_[index(rank)];
        return std::any_of(turns.begin(), turns.end(), [&](Source source) { return !may || may(source); });
    }
    /// Returns once something has been pushed since it last returned, the queue is closed, or `timeout` is over.
    void waitForNews(std::chrono::nanoseconds timeout) {
        std::unique_lock lock(mutex_);
        filled_.wait_for(lock, timeout, [&] { return closed_ || news_; });
        news_ = false;
    }
    /// Sources with values, in the order of their turns.
    [[nodiscard]] std::vector<Source> waiting(Rank rank) const {
        const std::scoped_lock lock(mutex_);
        return {turns_[index(rank)].begin(), turns_[index(rank)].end()};
    }
    void close() {
        const std::scoped_lock lock(mutex_);
        closed_ = true;
        filled_.notify_all();
    }

private:
    struct Queue {
        std::deque<T> values;
        Rank rank = Rank::kOther;
        bool gone = false;
    };
    static std::size_t index(Rank rank) { return static_cast<std::size_t>(rank); }

    mutable std::mutex mutex_;
    std::condition_variable filled_;
    std::unordered_map<Source, Queue> queues_;
    std::deque<Source> turns_[2];  ///< sources with values, each once
    bool news_ = false;
    bool closed_ = false;
};

}  // namespace tessera
