/// What is made of content, by the content's name: made once, however many threads ask, and kept while somebody uses
/// it.
#pragma once

#include <algorithm>
#include <memory>
#include <unordered_map>
#include <utility>
#include <vector>

#include "common/base/Hash.h"
#include "common/base/Turn.h"

namespace tessera {

/// `Value` has `bytes()`, and `inUse()`: whether somebody keeps a part of it. Nothing that is used is dropped; of what
/// is not, as much is kept as was asked for last. A value never changes. Any thread.
template <typename Value>
class ContentCache {
public:
    explicit ContentCache(std::size_t mostUnusedBytes) : mostUnusedBytes_(mostUnusedBytes) {}

    /// `make` gives a Value of what `key` names. Who asks for it at the same time waits, and nobody else does: `make`
    /// may ask for other keys.
    template <typename Make>
    [[nodiscard]] std::shared_ptr<const Value> get(const Hash128& key, Make&& make) {
        std::shared_ptr<Entry> entry;
        {
            const Turn::Hold hold = turn_.take();
            std::shared_ptr<Entry>& known = entries_[key];
            if (!known) known = std::make_shared<Entry>();
            known->lastUse = ++uses_;
            if (known->value) return known->value;
            entry = known;
        }
        std::shared_ptr<const Value> value;
        {
            const Turn::Hold making = entry->turn.take();
            if (!entry->made) entry->made = std::make_shared<const Value>(make());
            value = entry->made;
        }
        const Turn::Hold hold = turn_.take();
        if (!entry->value) {
            entry->value = value;
            unswept_ += value->bytes();
            if (unswept_ > mostUnusedBytes_ / 4) sweep(key);
        }
        return value;
    }
    /// Null where nobody has made it, or not yet. Never waits for a `make`.
    [[nodiscard]] std::shared_ptr<const Value> find(const Hash128& key) {
        const Turn::Hold hold = turn_.take();
        const auto known = entries_.find(key);
        return known == entries_.end() ? nullptr : known->second->value;
    }
    [[nodiscard]] std::size_t size() {
        const Turn::Hold hold = turn_.take();
        return entries_.size();
    }

private:
    struct Entry {
        Turn turn;                           ///< of who makes it
        std::shared_ptr<const Value> made;   ///< under the entry's turn
        std::shared_ptr<const Value> value;  ///< under the cache's: the same
        std::uint64_t lastUse = 0;
    };

    void sweep(const Hash128& newest) {
        unswept_ = 0;
        std::vector<std::pair<std::uint64_t, Hash128>> unused;
        std::size_t bytes = 0;
        for (const auto& [key, entry] : entries_) {
            // The entry's two; `newest` is used by who asked.
            if (key == newest || !entry->value || entry->value.use_count() > 2 || entry->value->inUse()) continue;
            unused.emplace_back(entry->lastUse, key);
            bytes += entry->value->bytes();
        }
        std::sort(unused.begin(), unused.end());
        for (const auto& [lastUse, key] : unused) {
            if (bytes <= mostUnusedBytes_) return;
            bytes -= entries_[key]->value->bytes();
            entries_.erase(key);
        }
    }

    const std::size_t mostUnusedBytes_;
    Turn turn_;
    std::unordered_map<Hash128, std::shared_ptr<Entry>> entries_;
    std::uint64_t uses_ = 0;
    std::size_t unswept_ = 0;
};

}  // namespace tessera
