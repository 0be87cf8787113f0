/// Who is connected and how many bytes wait for each: the one thing that the threads of a transport share.
#pragma once

#include <atomic>
#include <optional>
#include <vector>

#include "common/net/Transport.h"

namespace tessera {

/// A fixed number of slots; a link's id names its slot, so that any thread finds its count without a lock. Every byte
/// charged is discharged once. A link that ends between the look-up and the charge may for a moment be counted on its
/// successor; the sums come out right.
class LinkTable {
public:
    explicit LinkTable(std::size_t slots) : slots_(slots) {}

    /// A fresh id with a slot of its own; nothing when all are taken.
    [[nodiscard]] std::optional<LinkId> claim() {
        const std::uint64_t round = next_.fetch_add(1) + 1;
        for (std::size_t i = 0; i < slots_.size(); ++i) {
            const std::size_t slot = (round + i) % slots_.size();
            const LinkId id{round * (slots_.size() + 1) + slot};
            std::uint64_t free = 0;
            if (!slots_[slot].link.compare_exchange_strong(free, id.value)) continue;
            ++taken_;
            slots_[slot].untaken = 0;
            slots_[slot].resting = false;
            return id;
        }
        return std::nullopt;
    }
    /// An id without a slot, for a link that ends before it begins.
    [[nodiscard]] LinkId stillborn() { return LinkId{(next_.fetch_add(1) + 1) * (slots_.size() + 1) + slots_.size()}; }

    void release(LinkId id) {
        Slot* const slot = find(id);
        if (slot == nullptr) return;
        slot->link = 0;
        --taken_;
    }
    /// Whether `claim` would find a slot now.
    [[nodiscard]] bool hasRoom() const { return taken_ < slots_.size(); }
    [[nodiscard]] bool holds(LinkId id) const {
        const std::size_t at = id.value % (slots_.size() + 1);
        return at < slots_.size() && slots_[at].link == id.value;
    }
    /// The link's bytes after the charge; nothing (and no charge) when there is no such link.
    [[nodiscard]] std::optional<std::size_t> charge(LinkId id, std::size_t bytes) {
        Slot* slot = find(id);
        if (slot == nullptr) return std::nullopt;
        return slot->queued.fetch_add(bytes) + bytes;
    }
    /// Nothing for the stillborn, who have no slot.
    void discharge(LinkId id, std::size_t bytes) {
        if (const std::size_t at = id.value % (slots_.size() + 1); at < slots_.size())
            slots_[at].queued.fetch_sub(bytes);
    }
    /// Bytes handed out and not taken yet, after the change; zero where there is no such link.
    std::size_t handOut(LinkId id, std::size_t bytes) {
        Slot* slot = find(id);
        return slot ? slot->untaken.fetch_add(bytes) + bytes : 0;
    }
    std::size_t take(LinkId id, std::size_t bytes) {
        Slot* slot = find(id);
        return slot ? slot->untaken.fetch_sub(bytes) - bytes : 0;
    }
    [[nodiscard]] std::size_t untaken(LinkId id) const {
        return holds(id) ? slots_[id.value % (slots_.size() + 1)].untaken.load() : 0;
    }
    /// Whether the link is not read: said by the network thread, looked at by who takes.
    void rest(LinkId id, bool resting) {
        if (Slot* slot = find(id)) slot->resting = resting;
    }
    [[nodiscard]] bool resting(LinkId id) const { return holds(id) && slots_[id.value % (slots_.size() + 1)].resting; }
    [[nodiscard]] std::size_t queued(LinkId id) const {
        return holds(id) ? slots_[id.value % (slots_.size() + 1)].queued.load() : 0;
    }

private:
    struct Slot {
        std::atomic<std::uint64_t> link{0};
        std::atomic<std::size_t> queued{0};
        std::atomic<std::size_t> untaken{0};
        std::atomic<bool> resting{false};
    };
    Slot* find(LinkId id) { return holds(id) ? &slots_[id.value % (slots_.size() + 1)] : nullptr; }

    std::vector<Slot> slots_;
    std::atomic<std::uint64_t> next_{0};
    std::atomic<std::size_t> taken_{0};
};

}  // namespace tessera
